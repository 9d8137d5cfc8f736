//! What leaves the frame: finished runs with their flags, and the signals of a run under way.

use crate::metrics::{Metrics, flags};
use crate::params::Params;
use crate::plant::Plant;
use crate::session::Rule;
use crate::space::{Parts, Wrench};
use crate::vector::Vec3;

/// What a finished run leaves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finished {
    /// The run's number.
    pub run: u64,
    /// Parameters as they were applied.
    pub params: Params<f64>,
    /// Metrics of the loop in space.
    pub space: Metrics<f64>,
    /// Metrics of the loop on the facility.
    pub hil: Metrics<f64>,
    /// Flag bits ([`flags`]).
    pub flags: u32,
    /// The rule that stopped the session on the facility, at the end of its loop; none if the run ended by itself.
    pub stop: Option<Stop>,
    /// Normal of the first touch in space (inertial axes) and its point from part A's origin; zero without a touch.
    pub touch: [Vec3<f64>; 2],
}

/// A rule that was met, and by what.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    /// The rule.
    pub rule: Rule,
    /// The value that met it, in the rule's unit.
    pub value: f64,
}

impl Stop {
    /// From the end of a loop: 1 if it diverged and its speed then, the rule's number in the session and its measure.
    pub fn of([unstable, speed, rule, measure]: [f64; 4]) -> Option<Self> {
        let met = Rule::of_number(rule).map(|rule| Self { rule, value: rule.in_unit(measure) });
        met.or_else(|| (unstable > 0.0).then_some(Self { rule: Rule::Divergence, value: speed }))
    }
}

/// The signals of a trace, at the end of each tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Signals {
    /// Time \[s\].
    pub time: f64,
    /// Simulated parts in space and on the facility.
    pub parts: [Parts<f64>; 2],
    /// Parts as the robots hold them, laboratory axes.
    pub mounted: Parts<f64>,
    /// Contact wrench on part A about its origin, latch excluded: in space (inertial axes), on the hardware (laboratory
    /// axes).
    pub contact: [Wrench<f64>; 2],
    /// Wrench of the latch, likewise.
    pub latch: [Wrench<f64>; 2],
    /// What the sensor reads: on part A about its origin, part A's axes, with low-pass, errors, noise and quantisation,
    /// the tool's load subtracted.
    pub measured: Wrench<f64>,
    /// What acts on the simulated part A: the measured wrench after delay and compensator, part A's axes.
    pub fed_back: Wrench<f64>,
    /// Energy injected by the facility: through the port on the simulated side less that on the hardware \[J\].
    pub injected_energy: f64,
    /// Latch closed, space and facility.
    pub closed: [f64; 2],
}

/// What the flags of a run are made of.
#[derive(Clone, Copy, Debug)]
pub struct RunEnd {
    /// Metrics in space.
    pub space: Metrics<f64>,
    /// Metrics on the facility.
    pub hil: Metrics<f64>,
    /// Divergence, contact work and largest absorbed energy of the loop in space.
    pub space_watch: (bool, f64, f64),
    /// The HIL loop met its divergence bound.
    pub hil_unstable: bool,
    /// The sensor saturated.
    pub saturated: bool,
    /// A robot met a speed limit.
    pub limited: bool,
    /// A command was lost.
    pub dropped: bool,
}

/// Flag bits of a finished run.
pub fn run_flags(m: &Plant, end: RunEnd) -> u32 {
    let broken = |metrics: &Metrics<f64>| crate::fields::to_vec(metrics).iter().any(|v| !v.is_finite());
    let (space_unstable, work, absorbed) = end.space_watch;
    // A passive contact returns no more than it took; 5 % and a microjoule are for the step.
    let jump = work > 0.05 * absorbed + 1e-6;
    let bits = [
        (broken(&end.space) || space_unstable, flags::SPACE_NON_FINITE),
        (broken(&end.hil) && !end.hil_unstable, flags::HIL_NON_FINITE),
        (jump, flags::SPACE_ENERGY_JUMP),
        (end.space.peak_depth > m.task.max_depth, flags::SPACE_PENETRATION),
        (end.hil_unstable, flags::HIL_UNSTABLE),
        (end.saturated, flags::SENSOR_SATURATED),
        (end.limited, flags::ROBOT_SPEED_LIMIT),
        (end.dropped, flags::PACKET_DROPPED),
    ];
    bits.into_iter().filter(|(set, _)| *set).fold(0, |word, (_, bit)| word | bit)
}
