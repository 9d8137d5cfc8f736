//! Output of the frame: finished runs with their flags, and the signals of a run in progress.

use crate::bundle;
use crate::metrics::{Metrics, flags};
use crate::model::MAX_JOINTS;
use crate::params::Params;
use crate::plant::{Plant, PointSource};
use crate::session::Rule;
use crate::space::{Parts, Wrench};
use crate::vector::Vec3;

/// A finished run.
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

impl Finished {
    /// Puts a run together from its parameters, the metrics of both loops and the state at its end.
    pub fn new(m: &Plant, run: u64, params: Params<f64>, [space, hil]: [Metrics<f64>; 2], end: &EndState<f64>) -> Self {
        let touch = [end.touch_normal, end.touch_lever];
        Self { run, params, space, hil, flags: run_flags(m, &space, &hil, end), stop: end.stop(), touch }
    }
}

/// A session rule that was met, with the value that met it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    /// The rule.
    pub rule: Rule,
    /// The value that met it, in the rule's unit.
    pub value: f64,
}

impl Stop {
    /// The stop of a supervised session: the number of the rule and its measure; `None` for number 0.
    pub fn of_session(rule: f64, measure: f64) -> Option<Self> {
        Rule::of_number(rule).map(|rule| Self { rule, value: rule.in_unit(measure) })
    }
}

bundle! {
    /// State of both loops at the end of a run, besides the metrics; flags and the stop are computed from it.
    EndState {
        space_unstable: R, "1", "1 if the loop in space diverged";
        space_contact_work: R, "J", "work of the contact on the parts in space";
        space_absorbed: R, "J", "largest energy that the contact in space had absorbed";
        hil_unstable: R, "1", "1 if the loop on the facility diverged";
        hil_end_speed: R, "m/s", "speed of the parts at its end";
        rule: R, "1", "number of the session rule that stopped the facility, 0 = none";
        rule_measure: R, "1", "the measure that met it";
        saturated: R, "1", "1 if the sensor saturated";
        limited: R, "1", "1 if a robot met a speed limit";
        dropped: R, "1", "1 if a command was lost";
        touch_normal: Vec3<R>, "1", "normal of the first touch in space, inertial axes";
        touch_lever: Vec3<R>, "m", "its point from part A's origin, inertial axes";
    }
}

impl EndState<f64> {
    /// The rule that stopped the session; divergence where no rule did but the loop diverged.
    pub fn stop(&self) -> Option<Stop> {
        let diverged = || Stop { rule: Rule::Divergence, value: self.hil_end_speed };
        Stop::of_session(self.rule, self.rule_measure).or_else(|| (self.hil_unstable > 0.0).then(diverged))
    }
}

/// One contact of a point or solid of a part with a solid of the other, from the touch to the separation.
///
/// Axes of the loop: inertial in space, those of the laboratory on the facility. All of it is of the parts that touch: on
/// the facility those that the robots hold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactEvent {
    /// What touches, of part A and of part B.
    pub members: [PointSource; 2],
    /// Index of their material pair among the scenario's; none under the common law.
    pub pair: Option<usize>,
    /// Time of the first substep with a contact force \[s\].
    pub start: f64,
    /// From there to the end of the last such substep \[s\].
    pub duration: f64,
    /// Time of the greatest contact force \[s\].
    pub peak_time: f64,
    /// Place of its most loaded point then, frame of part B \[m\].
    pub place: Vec3<f64>,
    /// Unit normal there, out of part B, axes of part B.
    pub normal: Vec3<f64>,
    /// Greatest magnitude of the contact force, friction included \[N\].
    pub peak_force: f64,
    /// Greatest sum of the normal forces of its points; positive pushes the parts apart \[N\].
    pub peak_normal_force: f64,
    /// Integral of the contact force on part A, axes of the loop \[N s\].
    pub impulse: Vec3<f64>,
    /// Path of sliding beyond the deflection of the bristles; of several points their mean, weighted by the normal
    /// forces \[m\].
    pub slip: f64,
    /// Work of the contact force on both parts; negative where it dissipates or stores energy \[J\].
    pub work: f64,
    /// Greatest overlap; a point beyond the middle of a thin solid counts as in `peak_depth` of the metrics \[m\].
    pub depth: f64,
    /// Speed at which the parts approach along the normal in the first substep \[m/s\].
    pub closing_speed: f64,
    /// The parts still touched when the loop ended.
    pub is_open: bool,
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
    /// Phase of the arm's plan, from 1, space and facility; 0 without a plan.
    pub phase: [f64; 2],
    /// Angles of the arm's joints \[rad\], travels \[m\] of those that slide, space and facility; 0 beyond its joints.
    pub joints: [[f64; MAX_JOINTS]; 2],
}

/// Flag bits of a finished run.
fn run_flags(m: &Plant, space: &Metrics<f64>, hil: &Metrics<f64>, end: &EndState<f64>) -> u32 {
    let non_finite = |metrics: &Metrics<f64>| crate::fields::to_vec(metrics).iter().any(|v| !v.is_finite());
    let is_set = |value: f64| value > 0.0;
    // A passive contact returns no more than it took; 5 % and a microjoule are for the step.
    let jump = end.space_contact_work > 0.05 * end.space_absorbed + 1e-6;
    let bits = [
        (non_finite(space) || is_set(end.space_unstable), flags::SPACE_NON_FINITE),
        (non_finite(hil) && !is_set(end.hil_unstable), flags::HIL_NON_FINITE),
        (jump, flags::SPACE_ENERGY_JUMP),
        (space.peak_depth > m.task.max_depth, flags::SPACE_PENETRATION),
        // A session that a rule stopped, or that diverged, has failed already, whatever its parts did before.
        (hil.peak_depth > m.task.max_depth && end.stop().is_none(), flags::HIL_PENETRATION),
        (is_set(end.hil_unstable), flags::HIL_UNSTABLE),
        (is_set(end.saturated), flags::SENSOR_SATURATED),
        (is_set(end.limited), flags::ROBOT_SPEED_LIMIT),
        (is_set(end.dropped), flags::PACKET_DROPPED),
    ];
    bits.into_iter().filter(|(set, _)| *set).fold(0, |word, (_, bit)| word | bit)
}
