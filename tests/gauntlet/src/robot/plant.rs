//! Motors, gears and links of the robot as differential equations.

use super::arm::{Axes, Dynamics, accelerations, dynamics};
use super::nominal::{AXES, ROBOT};
use crate::drive::{Friction, Sliding};
use crate::ode::System;

/// Numbers of the state, and of one axis in it: motor angle and rate, bristle, link angle and rate.
const STATES: usize = 5 * AXES;
const OWN: usize = 5;
const MOTOR: usize = 0;
const MOTOR_RATE: usize = 1;
const BRISTLE: usize = 2;
const LINK: usize = 3;
const LINK_RATE: usize = 4;

/// State of the robot, axis after axis \[rad, rad/s, rad, rad, rad/s\].
pub(crate) type State = [f64; STATES];

/// The drive of an axis as it is.
#[derive(Clone, Debug)]
pub(crate) struct Drive {
    /// Torque per commanded torque.
    pub(crate) constant: f64,
    pub(crate) friction: Friction,
    /// Stiffness of the gear \[N m/rad\].
    pub(crate) stiffness: f64,
    /// Behind the gear: inertia \[kg m^2\], torque times the cosine of the angle \[N m\], cable as a spring about 0 \[N m/rad\].
    pub(crate) inertia: f64,
    pub(crate) gravity: f64,
    pub(crate) cable: f64,
}

/// The robot with what is held over a tick.
#[derive(Clone, Debug)]
pub(crate) struct Plant {
    pub(crate) drives: [Drive; AXES],
    /// Commanded torques and disturbances \[N m\].
    pub(crate) torque: Axes,
    pub(crate) disturbance: Axes,
}

/// One of an axis' numbers, of all axes.
fn each(state: &State, own: usize) -> Axes {
    std::array::from_fn(|axis| state[OWN * axis + own])
}

pub(crate) fn motors(state: &State) -> Axes {
    each(state, MOTOR)
}

impl Plant {
    /// At rest with the motors at angles, wound up by the load.
    pub(crate) fn at_rest(&self, angle: Axes) -> State {
        let mut state = [0.0; STATES];
        let load = self.static_load(&angle, &dynamics(&angle, &[0.0; AXES]).weight);
        for (axis, own) in state.chunks_exact_mut(OWN).enumerate() {
            own[MOTOR] = angle[axis];
            own[LINK] = angle[axis] - load[axis] / self.drives[axis].stiffness;
        }
        state
    }

    /// What the gears carry at rest under the links' weight \[N m\].
    fn static_load(&self, link: &Axes, weight: &Axes) -> Axes {
        std::array::from_fn(|axis| weight[axis] + self.drives[axis].extra(link[axis]))
    }
}

impl Drive {
    /// Torque against the link beyond the arm's own.
    fn extra(&self, link: f64) -> f64 {
        self.gravity * link.cos() + self.cable * link
    }
}

impl System<STATES, AXES> for Plant {
    fn rate(&self, state: &State) -> State {
        let [link, link_rate] = [LINK, LINK_RATE].map(|own| each(state, own));
        let Dynamics { mut mass_matrix, bias, weight } = dynamics(&link, &link_rate);
        let static_load = self.static_load(&link, &weight);
        let (mut on_link, mut out) = ([0.0; AXES], [0.0; STATES]);
        for (axis, drive) in self.drives.iter().enumerate() {
            let own = &state[OWN * axis..][..OWN];
            let gear =
                drive.stiffness * (own[MOTOR] - own[LINK]) + ROBOT[axis].damping * (own[MOTOR_RATE] - own[LINK_RATE]);
            let sliding = Sliding {
                angle: own[MOTOR],
                rate: own[MOTOR_RATE],
                bristle: own[BRISTLE],
                load: static_load[axis],
                warmth: 0.0,
            };
            let (bristle_rate, friction) = drive.friction.of(sliding);
            let torque = drive.constant * self.torque[axis] + self.disturbance[axis];
            out[OWN * axis + MOTOR] = own[MOTOR_RATE];
            out[OWN * axis + MOTOR_RATE] = (torque - friction - gear) / ROBOT[axis].rotor;
            out[OWN * axis + BRISTLE] = bristle_rate;
            out[OWN * axis + LINK] = own[LINK_RATE];
            mass_matrix[axis][axis] += drive.inertia;
            on_link[axis] = gear - bias[axis] - drive.extra(own[LINK]);
        }
        for (axis, acceleration) in accelerations(&mass_matrix, &on_link).into_iter().enumerate() {
            out[OWN * axis + LINK_RATE] = acceleration;
        }
        out
    }

    /// The bristles kink where a rate changes sign.
    fn surfaces(&self, state: &State) -> Axes {
        each(state, MOTOR_RATE)
    }
}
