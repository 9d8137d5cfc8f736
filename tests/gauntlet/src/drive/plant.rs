//! Motor, gear and link of the drive as differential equations.

use super::friction::{Friction, Sliding};
use super::gear::{Spring, Transmission};
use crate::ode::System;

/// Index of a state: motor angle and rate, bristle, link angle and rate, motor torque behind the current loop, angle and
/// rate of the elastic part.
pub(crate) const MOTOR: usize = 0;
pub(crate) const MOTOR_RATE: usize = 1;
const BRISTLE: usize = 2;
pub(crate) const LINK: usize = 3;
pub(crate) const LINK_RATE: usize = 4;
pub(crate) const CURRENT: usize = 5;
const PART: usize = 6;
const PART_RATE: usize = 7;

/// State of the plant \[rad, rad/s, rad, rad, rad/s, N m, rad, rad/s\].
pub(crate) type State = [f64; 8];

/// Standard gravity \[m/s^2\].
pub(crate) const GRAVITY: f64 = 9.80665;

/// What the motor makes of a torque command.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Motor {
    /// Torque per commanded torque.
    pub(crate) constant: f64,
    /// Constant torque on top \[N m\].
    pub(crate) offset: f64,
    /// Time constant of the current loop \[s\]; 0 for none.
    pub(crate) lag: f64,
    /// Greatest torque \[N m\].
    pub(crate) limit: f64,
    /// Ripple: amplitude \[N m\], periods \[rad/rad\], phase \[rad\].
    pub(crate) ripple: (f64, f64, f64),
}

/// What hangs on the gear.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Link {
    /// Inertia, payload included, elastic part left out \[kg m^2\].
    pub(crate) inertia: f64,
    /// Gravity torque, times cos q \[N m\].
    pub(crate) gravity: f64,
    /// Cable as a spring about q = 0 \[N m/rad\].
    pub(crate) cable: f64,
    /// Elastic part: inertia \[kg m^2\] (0 for none), stiffness \[N m/rad\], damping \[N m s/rad\].
    pub(crate) part: (f64, f64, f64),
}

/// Held over a tick.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Inputs {
    /// Torque command \[N m\].
    pub(crate) torque: f64,
    /// Disturbance torque on the motor \[N m\].
    pub(crate) disturbance: f64,
    /// 0 cold, 1 warm.
    pub(crate) warmth: f64,
}

/// The plant, with its inputs of the tick.
#[derive(Clone, Debug)]
pub(crate) struct Plant {
    pub(crate) motor: Motor,
    /// Rotor and gear \[kg m^2\].
    pub(crate) motor_inertia: f64,
    pub(crate) friction: Friction,
    pub(crate) transmission: Transmission,
    /// None for a rigid gear.
    pub(crate) spring: Option<Spring>,
    pub(crate) link: Link,
    pub(crate) inputs: Inputs,
}

impl Plant {
    /// At rest behind the brake at a motor angle \[rad\]; a link on a spring hangs as its weight wants.
    pub(crate) fn at_rest(&self, angle: f64) -> State {
        let mut state = [0.0; 8];
        state[MOTOR] = angle;
        state[LINK] = self.transmission.at(angle).angle;
        if let Some(spring) = self.spring {
            // The weight changes by 60 N m a radian, the spring by far more: a few rounds settle it.
            for _ in 0..20 {
                state[LINK] = self.transmission.at(angle).angle - spring.twist(self.static_load(state[LINK]));
            }
        }
        state[PART] = state[LINK];
        state
    }

    /// Link angle \[rad\].
    pub(crate) fn link_angle(&self, state: &State) -> f64 {
        if self.spring.is_some() { state[LINK] } else { self.transmission.at(state[MOTOR]).angle }
    }

    /// Torque that holds the link at an angle \[rad\] \[N m\].
    fn static_load(&self, angle: f64) -> f64 {
        self.link.gravity * angle.cos() + self.link.cable * angle
    }

    /// Torque on the rotor, friction left out \[N m\].
    fn motor_torque(&self, state: &State) -> f64 {
        let Motor { constant, offset, lag, limit, ripple } = self.motor;
        let made = if lag > 0.0 { state[CURRENT] } else { self.inputs.torque };
        let (amplitude, number, phase) = ripple;
        let ripple = if amplitude > 0.0 { amplitude * (number * state[MOTOR] + phase).sin() } else { 0.0 };
        constant * made.clamp(-limit, limit) + offset + ripple + self.inputs.disturbance
    }
}

impl System<8, 3> for Plant {
    fn rate(&self, state: &State) -> State {
        let [angle, rate, bristle, ..] = *state;
        let ratio = self.transmission.at(angle);
        let rigid = [ratio.angle, ratio.slope * rate];
        let [link, link_rate] = if self.spring.is_some() { [state[LINK], state[LINK_RATE]] } else { rigid };
        let load = self.static_load(link);
        let sliding = Sliding { angle, rate, bristle, load, warmth: self.inputs.warmth };
        let (bristle_rate, friction) = self.friction.of(sliding);
        let drive = self.motor_torque(state) - friction;
        let (part_inertia, part_stiffness, part_damping) = self.link.part;
        let on_part = part_stiffness * (link - state[PART]) + part_damping * (link_rate - state[PART_RATE]);
        let carried = load + on_part;

        let mut out = [0.0; 8];
        out[MOTOR] = rate;
        out[BRISTLE] = bristle_rate;
        if let Some(spring) = self.spring {
            let gear = spring.torque(ratio.angle - link, ratio.slope * rate - link_rate);
            out[MOTOR_RATE] = (drive - ratio.slope * gear) / self.motor_inertia;
            out[LINK] = link_rate;
            out[LINK_RATE] = (gear - carried) / self.link.inertia;
        } else {
            // q_l = g(q): (J_m + g'^2 J_l) a = drive - g' (carried + J_l g'' v^2).
            let inertia = self.motor_inertia + ratio.slope * ratio.slope * self.link.inertia;
            let carried = carried + self.link.inertia * ratio.bend * rate * rate;
            out[MOTOR_RATE] = (drive - ratio.slope * carried) / inertia;
        }
        if self.motor.lag > 0.0 {
            out[CURRENT] = (self.inputs.torque - state[CURRENT]) / self.motor.lag;
        }
        if part_inertia > 0.0 {
            out[PART] = state[PART_RATE];
            out[PART_RATE] = on_part / part_inertia;
        }
        out
    }

    /// The bristles kink where the rate changes sign, the gear where teeth meet or part.
    fn surfaces(&self, state: &State) -> [f64; 3] {
        let [positive, negative] = self
            .spring
            .map_or([1.0; 2], |spring| spring.surfaces(self.transmission.at(state[MOTOR]).angle - state[LINK]));
        [state[MOTOR_RATE], positive, negative]
    }
}
