//! From the hidden effects and a seed to one drive with its nuisances.

use super::friction::{BRISTLE_DAMPING_RATIO, Friction, MapWave, STRIBECK_SPEED};
use super::gear::{Flank, Spring, Transmission};
use super::nominal::{self, tolerance};
use super::plant::{GRAVITY, Inputs, Link, Motor, Plant};
use crate::catalogue::{Parameter, Sizes};
use crate::random::Stream;
use std::f64::consts::TAU;

/// Time constant of warming up \[s\].
pub(crate) const WARM_UP_S: f64 = 40.0;
/// Frequency of the link on a gear with backlash when the motor is locked \[Hz\].
const TOOTH_HZ: f64 = 60.0;
/// Damping of teeth that meet \[s/rad\]: a restitution of about 0.6 at 0.03 rad/s.
const TOOTH_IMPACT: f64 = 20.0;
/// Damping ratios of an elastic gear and of an elastic part of the link.
const GEAR_DAMPING_RATIO: f64 = 0.03;
const PART_DAMPING_RATIO: f64 = 0.02;
/// Inertia of the elastic part, taken out of the link's \[kg m^2\].
const PART_INERTIA: f64 = 4.0;
/// By how much softer the loose flank of an asymmetric backlash is.
const LOOSE_FLANK: f64 = 6.0;
/// A clock offset stays below a tick, so that a stamp never passes its neighbour's.
const LARGEST_CLOCK_OFFSET: f64 = 0.0009;

/// Nuisance parameters that a data set draws within the model's tolerances.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nuisances {
    /// Factors on the model's values.
    pub(crate) coulomb: f64,
    pub(crate) viscous: f64,
    pub(crate) torque_constant: f64,
    pub(crate) presliding_travel: f64,
    /// Constant torque \[N m\].
    pub(crate) offset: f64,
    /// The torque stamped t was there at t + this \[s\].
    pub(crate) clock_offset: f64,
}

impl Nuisances {
    pub(crate) fn draw(seed: u64) -> Self {
        let mut stream = Stream::new(seed, "nuisances of the drive", 0);
        let [coulomb, viscous, torque_constant, travel, offset, clock] = stream.normals();
        let clock_offset: f64 = tolerance::CLOCK_OFFSET * clock;
        Self {
            coulomb: 1.0 + tolerance::COULOMB * coulomb,
            viscous: 1.0 + tolerance::VISCOUS * viscous,
            torque_constant: 1.0 + tolerance::TORQUE_CONSTANT * torque_constant,
            // Log-normal: a travel cannot be negative.
            presliding_travel: (tolerance::PRESLIDING_TRAVEL * travel).exp(),
            offset: tolerance::OFFSET * offset,
            clock_offset: clock_offset.clamp(-LARGEST_CLOCK_OFFSET, LARGEST_CLOCK_OFFSET),
        }
    }

    pub(crate) fn parameters(&self) -> Vec<Parameter> {
        vec![
            Parameter::new("coulomb_factor", self.coulomb, ""),
            Parameter::new("viscous_factor", self.viscous, ""),
            Parameter::new("torque_constant_factor", self.torque_constant, ""),
            Parameter::new("presliding_travel_factor", self.presliding_travel, ""),
            Parameter::new("offset", self.offset, "N m"),
            Parameter::new("clock_offset", self.clock_offset, "s"),
        ]
    }
}

/// Inner parameters of periodic effects, drawn whether or not their effect is hidden.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Inner {
    /// Torque ripple: periods \[rad/rad\], phase \[rad\].
    pub(crate) ripple: (f64, f64),
    /// Transmission error, the same.
    pub(crate) transmission: (f64, f64),
    /// Tabulated kinematics, the same.
    pub(crate) table: (f64, f64),
    pub(crate) map: [MapWave; 3],
}

impl Inner {
    pub(crate) fn draw(seed: u64) -> Self {
        let mut stream = Stream::new(seed, "inner parameters of the drive", 0);
        let mut wave = |low, high| (stream.between(low, high), stream.between(0.0, TAU));
        let (ripple, transmission, table) = (wave(20.0, 70.0), wave(20.0, 70.0), wave(10.0, 30.0));
        let map = [1.5, 4.0, 9.0].map(|number| {
            let (number, phase) = wave(0.8 * number, 1.2 * number);
            MapWave { number, phase }
        });
        Self { ripple, transmission, table, map }
    }

    /// True parameters of an effect besides its size.
    pub(crate) fn parameters(&self, id: &str) -> Vec<Parameter> {
        let periodic = |(number, phase): (f64, f64)| {
            vec![Parameter::new("periods", number, "1/rad"), Parameter::new("phase", phase, "rad")]
        };
        match id {
            "J3_stribeck" | "stribeck_squared" => vec![Parameter::new("speed", STRIBECK_SPEED, "rad/s")],
            "J6_warm_up" | "temperature_load" => vec![Parameter::new("time_constant", WARM_UP_S, "s")],
            "J7_backlash" | "asymmetric_backlash" => vec![Parameter::new("stiffness", tooth_stiffness(), "N m/rad")],
            "J9_torque_ripple" => periodic(self.ripple),
            "J10_transmission_error" => periodic(self.transmission),
            "table_kinematics" => periodic(self.table),
            _ => Vec::new(),
        }
    }
}

fn tooth_stiffness() -> f64 {
    nominal::LINK_INERTIA * (TAU * TOOTH_HZ).powi(2)
}

/// The drive as it is.
pub(crate) fn plant(sizes: &Sizes, nuisances: &Nuisances, inner: &Inner) -> Plant {
    let wave = |id, (number, phase)| (sizes.of(id), number, phase);
    Plant {
        motor: Motor {
            constant: nuisances.torque_constant * (1.0 + sizes.of("J11_torque_constant")),
            offset: nuisances.offset,
            lag: sizes.of("J12_current_loop"),
            limit: sizes.limit("J13_saturation"),
            ripple: wave("J9_torque_ripple", inner.ripple),
        },
        motor_inertia: nominal::MOTOR_INERTIA,
        friction: friction(sizes, nuisances, inner),
        transmission: Transmission {
            sine: wave("J10_transmission_error", inner.transmission),
            triangle: wave("table_kinematics", inner.table),
        },
        spring: spring(sizes),
        link: link(sizes),
        inputs: Inputs::default(),
    }
}

fn friction(sizes: &Sizes, nuisances: &Nuisances, inner: &Inner) -> Friction {
    let coulomb = nominal::COULOMB * nuisances.coulomb + sizes.of("J1_coulomb");
    let travel = nominal::PRESLIDING_TRAVEL * nuisances.presliding_travel + sizes.of("J4_presliding");
    let stiffness = coulomb / travel;
    let inertia = nominal::MOTOR_INERTIA + nominal::LINK_INERTIA;
    Friction {
        coulomb,
        half_difference: sizes.of("J18_direction_friction"),
        stribeck: sizes.of("J3_stribeck"),
        stribeck_squared: sizes.of("stribeck_squared"),
        map_deviation: sizes.of("friction_map"),
        map: inner.map,
        load_share: sizes.of("J5_load_friction"),
        warm_load_share: sizes.of("temperature_load"),
        stiffness,
        damping: 2.0 * BRISTLE_DAMPING_RATIO * (stiffness * inertia).sqrt(),
        viscous: nominal::VISCOUS * nuisances.viscous + sizes.of("J2_viscous"),
        warm_loss: sizes.of("J6_warm_up"),
        quadratic: sizes.of("quadratic_drag"),
        cubic: sizes.of("cubic_drag"),
    }
}

/// The gear's spring; none where nothing hidden makes the gear yield.
fn spring(sizes: &Sizes) -> Option<Spring> {
    let (compliance, half_gap) = (sizes.of("J8_elasticity"), sizes.of("J7_backlash"));
    let loose = sizes.of("asymmetric_backlash");
    if compliance == 0.0 && half_gap == 0.0 && loose == 0.0 {
        return None;
    }
    let stiffness = if compliance > 0.0 { 1.0 / compliance } else { tooth_stiffness() };
    let reduced = nominal::MOTOR_INERTIA * nominal::LINK_INERTIA / (nominal::MOTOR_INERTIA + nominal::LINK_INERTIA);
    let softer = if loose > 0.0 { LOOSE_FLANK } else { 1.0 };
    Some(Spring {
        positive: Flank { gap: half_gap, stiffness },
        negative: Flank { gap: half_gap + loose, stiffness: stiffness / softer },
        damping: 2.0 * GEAR_DAMPING_RATIO * (stiffness * reduced).sqrt(),
        impact: TOOTH_IMPACT,
    })
}

fn link(sizes: &Sizes) -> Link {
    let (payload, radius) = (sizes.of("J14_payload"), nominal::PAYLOAD_RADIUS);
    let compliance = sizes.of("second_resonance");
    let part = if compliance > 0.0 {
        let damping = 2.0 * PART_DAMPING_RATIO * (PART_INERTIA / compliance).sqrt();
        (PART_INERTIA, 1.0 / compliance, damping)
    } else {
        (0.0, 0.0, 0.0)
    };
    Link {
        inertia: nominal::LINK_INERTIA + sizes.of("J15_link_inertia") + payload * radius * radius - part.0,
        gravity: nominal::GRAVITY + sizes.of("J16_gravity_compensation") + payload * GRAVITY * radius,
        cable: sizes.of("J17_cable"),
        part,
    }
}
