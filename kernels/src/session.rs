//! Session stage: the rules that stop a session on the robots, evaluated once a cycle.
//!
//! The farm steps it once a tick behind the sensor, `drive` once a cycle of robot 1, from the same quantities: what the
//! robots report, what they were commanded, what the sensor measures. A rule that is met stops the session: the
//! facility then gives no answer.

mod axes;
mod workspace;

pub use axes::{Asked, SessionRobot, axes_asked, range_used};
pub use workspace::{Clearance, Workspace, clearance, clearance_at, deepest_in_box, far_apart};

use crate::bundle;
use crate::manipulator::cell::AXES;
use crate::model::{Facility, SessionRules};
use crate::plant::Plant;
use crate::real::Real;
use crate::space::{Motion, Parts, Wrench};
use crate::vector::{Quat, Vec3};

bundle! {
    /// What a cycle of a session observes.
    Observed {
        parts: Parts<R>, "1", "motion of the parts as the robots report it, laboratory";
        commanded: Parts<R>, "1", "motion of the parts that was commanded for this instant, laboratory";
        wrench: Wrench<R>, "1", "measured wrench on part A about its origin, part A's axes, without the tool's load";
        saturated: R, "1", "1 if a channel of the sensor has saturated";
        cut: R, "1", "1 if the command was cut to the limits of an axis";
        asked: Asked<R>, "1", "what the command asks of the axes";
        range_used: R, "1", "greatest share of its range that it needs of a joint, 0 far from every end";
        clearance: Clearance<R>, "1", "how far the robots are from where they may not be";
        port_energy: R, "J", "energy through the port on the simulated side";
    }
}

bundle! {
    /// What the supervision of a session remembers.
    Session {
        begun: R, "1", "1 once a cycle has been observed";
        place: Vec3<R>, "m", "part A's origin from part B's at the last cycle, part B's axes";
        turn: Quat<R>, "1", "attitude of part A in part B's axes at the last cycle";
        wrench: Wrench<R>, "1", "measured wrench at the last cycle, part B's axes";
        work: R, "J", "work of the measured wrench on the reported motion";
        rates_a: [R; AXES], "1/s", "rates that the command asked of robot 1's axes at the last cycle";
        rates_b: [R; AXES], "1/s", "rates that the command asked of robot 2's axes at the last cycle";
        clamped: R, "s", "time during which commands have been cut without a pause";
        rule: R, "1", "number of the rule that was met first, 0 before";
        value: R, "1", "value that met it, in the rule's own measure";
    }
}

/// A rule that stops a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u32)]
pub enum Rule {
    /// Measured force.
    Force = 1,
    /// Measured moment.
    Moment,
    /// Change of the measured force.
    ForceRate,
    /// A channel of the sensor at the end of its range.
    Saturation,
    /// Energy injected by the facility.
    InjectedEnergy,
    /// Distance of a tool from its command.
    FollowingError,
    /// Angle between a tool and its command.
    FollowingRotation,
    /// Distance of a commanded tool from the start of the run.
    ToolReach,
    /// Angle of a commanded tool from the start of the run.
    ToolRotation,
    /// Axes of a robot at the end of their ranges, or of the way that they may make.
    JointRange,
    /// Commands cut to the limits of an axis for too long.
    ClampTime,
    /// Speed of a commanded tool.
    ToolSpeed,
    /// A link or a tool in a keep-out box.
    KeepOut,
    /// Distance between the arms.
    ArmDistance,
    /// Angle of a robot from a singular posture.
    Singularity,
    /// Relative speed of the simulated parts: the loop diverges.
    Divergence,
}

/// One row of the rule table.
#[derive(Clone, Copy, Debug)]
pub struct RuleRow {
    /// The rule.
    pub rule: Rule,
    /// Its id in result files, also its key in the facility file.
    pub id: &'static str,
    /// Unit of value and limit.
    pub unit: &'static str,
    /// What stops a session; `{}` stands for the limit.
    pub stops_on: &'static str,
    /// Its limit in a facility; infinite if the rule is not in force.
    pub limit: fn(&Facility) -> f64,
}

/// All rules, in the order of their numbers; of several that are met in one cycle the first one counts.
pub const RULES: [RuleRow; 16] = [
    RuleRow {
        rule: Rule::Force,
        id: "force",
        unit: "N",
        stops_on: "a measured force above {}",
        limit: |f| f.rules.force,
    },
    RuleRow {
        rule: Rule::Moment,
        id: "moment",
        unit: "N m",
        stops_on: "a measured moment about part A's origin above {}",
        limit: |f| f.rules.moment,
    },
    RuleRow {
        rule: Rule::ForceRate,
        id: "force_rate",
        unit: "N/s",
        stops_on: "a change of the measured force above {} from cycle to cycle",
        limit: |f| f.rules.force_rate,
    },
    RuleRow {
        rule: Rule::Saturation,
        id: "sensor_saturation",
        unit: "1",
        stops_on: "a saturated channel of the sensor",
        limit: |f| if f.rules.sensor_saturation { 0.0 } else { f64::INFINITY },
    },
    RuleRow {
        rule: Rule::InjectedEnergy,
        id: "injected_energy",
        unit: "J",
        stops_on: "more than {} of energy injected by the facility",
        limit: |f| f.rules.injected_energy,
    },
    RuleRow {
        rule: Rule::FollowingError,
        id: "following_error",
        unit: "m",
        stops_on: "a tool more than {} from its command",
        limit: |f| f.rules.following_error,
    },
    RuleRow {
        rule: Rule::FollowingRotation,
        id: "following_rotation",
        unit: "rad",
        stops_on: "a tool turned by more than {} from its command",
        limit: |f| f.rules.following_rotation,
    },
    RuleRow {
        rule: Rule::ToolReach,
        id: "tool_reach",
        unit: "m",
        stops_on: "a command more than {} from the tool's place at the start",
        limit: |f| f.rules.tool_reach,
    },
    RuleRow {
        rule: Rule::ToolRotation,
        id: "tool_rotation",
        unit: "rad",
        stops_on: "a command turned by more than {} from the tool's attitude at the start",
        limit: |f| f.rules.tool_rotation,
    },
    RuleRow {
        rule: Rule::JointRange,
        id: "joint_range",
        unit: "1",
        stops_on: "a command beyond the range of a joint, or beyond its correction",
        limit: |f| if f.session_robots.is_some() { 1.0 } else { f64::INFINITY },
    },
    RuleRow {
        rule: Rule::ClampTime,
        id: "clamp_time",
        unit: "s",
        stops_on: "commands beyond the speed or acceleration of an axis for longer than {}",
        limit: |f| f.rules.clamp_time,
    },
    RuleRow {
        rule: Rule::ToolSpeed,
        id: "tool_speed",
        unit: "m/s",
        stops_on: "a command of a tool faster than {}",
        limit: |f| f.rules.tool_speed,
    },
    RuleRow {
        rule: Rule::KeepOut,
        id: "keep_out",
        unit: "m",
        stops_on: "a command of a link or a tool into a keep-out box",
        limit: |f| if f.rules.keep_out.is_empty() { f64::INFINITY } else { 0.0 },
    },
    RuleRow {
        rule: Rule::ArmDistance,
        id: "arm_distance",
        unit: "m",
        stops_on: "a command that brings the arms within {} of each other, except the links that hold the parts",
        limit: |f| f.rules.arm_distance,
    },
    RuleRow {
        rule: Rule::Singularity,
        id: "singularity",
        unit: "rad",
        stops_on: "a command within {} of a singular posture",
        limit: |f| f.rules.singularity,
    },
    RuleRow {
        rule: Rule::Divergence,
        id: "divergence",
        unit: "m/s",
        stops_on: "a relative speed of the simulated parts above {}",
        limit: |f| f.unstable_speed,
    },
];

impl Rule {
    /// Its row of the table.
    pub fn row(self) -> &'static RuleRow {
        &RULES[self as usize - 1]
    }

    /// The rule of a number in a session's state; none for 0.
    pub fn of_number(number: f64) -> Option<Self> {
        RULES.iter().map(|row| row.rule).find(|rule| f64::from(*rule as u32) == number)
    }

    /// A value in the rule's unit, from its measure in a session's state: lengths of vectors are kept as their squares,
    /// angles as the square of the sine of their half; what must not be too small is kept negative, as a distance or as
    /// the sine of an angle.
    pub fn in_unit(self, measure: f64) -> f64 {
        match self {
            Self::Force | Self::Moment | Self::ForceRate | Self::FollowingError | Self::ToolReach | Self::ToolSpeed => {
                measure.sqrt()
            }
            Self::ArmDistance => -measure,
            Self::Singularity => (-measure).clamp(-1.0, 1.0).asin(),
            Self::FollowingRotation | Self::ToolRotation => 2.0 * measure.min(1.0).sqrt().asin(),
            Self::Saturation
            | Self::InjectedEnergy
            | Self::JointRange
            | Self::ClampTime
            | Self::KeepOut
            | Self::Divergence => measure,
        }
    }
}

impl SessionRules {
    /// No rule: nothing stops a session but the end of its run.
    pub const NONE: Self = Self {
        force: f64::INFINITY,
        moment: f64::INFINITY,
        force_rate: f64::INFINITY,
        sensor_saturation: false,
        injected_energy: f64::INFINITY,
        following_error: f64::INFINITY,
        following_rotation: f64::INFINITY,
        tool_reach: f64::INFINITY,
        tool_rotation: f64::INFINITY,
        clamp_time: f64::INFINITY,
        tool_speed: f64::INFINITY,
        keep_out: Vec::new(),
        arm_distance: f64::INFINITY,
        singularity: f64::INFINITY,
    };

    /// Whether any of these rules can stop a session.
    pub fn any(&self) -> bool {
        *self != Self::NONE
    }
}

/// Whether any rule can stop the sessions of a facility, besides the bound of divergence.
pub fn supervised(m: &Plant) -> bool {
    m.facility.rules.any() || m.facility.session_robots.is_some()
}

/// A session before its first cycle.
#[inline(always)]
pub fn new_session<R: Real>() -> Session<R> {
    let zero = R::lit(0.0);
    Session {
        begun: zero,
        place: Vec3::zero(),
        turn: Quat::identity(),
        wrench: Wrench::zero(),
        work: zero,
        rates_a: [zero; AXES],
        rates_b: [zero; AXES],
        clamped: zero,
        rule: zero,
        value: zero,
    }
}

/// One cycle of supervision; `cycle` is its length \[s\].
///
/// The work of the measured wrench is taken over the reported displacement, not over reported velocities, which real
/// robots do not send: the same in the farm and on the robots. A value that is no number meets its rule.
#[inline(always)]
pub fn supervise<R: Real>(m: &Plant, s: &Session<R>, seen: &Observed<R>, cycle: R) -> Session<R> {
    let (zero, half, rules) = (R::lit(0.0), R::lit(0.5), &m.facility.rules);
    let (a, b) = (&seen.parts.a, &seen.parts.b);
    let place = b.attitude.rotate_back(a.position - b.position);
    let turn = b.attitude.conjugate().compose(a.attitude);
    let wrench = Wrench { force: turn.rotate(seen.wrench.force), moment: turn.rotate(seen.wrench.moment) };
    let turned = turn.compose(s.turn.conjugate()).small_rotation_vector();
    let way = (s.wrench.force + wrench.force).dot(place - s.place) + (s.wrench.moment + wrench.moment).dot(turned);
    let begun = zero.lt(s.begun);
    let work = s.work + R::select(begun, way * half, zero);
    let change = R::select(begun, square(wrench.force - s.wrench.force), zero);

    let (reference, start) = (&seen.commanded, &m.start);
    let following = square(reference.a.position - a.position).max(square(reference.b.position - b.position));
    let following_turn = half_turn(reference.a.attitude, a.attitude).max(half_turn(reference.b.attitude, b.attitude));
    let reach = distance(reference.a, start.a).max(distance(reference.b, start.b));
    let reach_turn = half_turn(Quat::lit(start.a.attitude), reference.a.attitude)
        .max(half_turn(Quat::lit(start.b.attitude), reference.b.attitude));
    let speed = square(reference.a.velocity).max(square(reference.b.velocity));
    let mut fast = zero.lt(seen.cut);
    if let Some([robot1, robot2]) = &m.session_robots {
        let (a, b) = (&seen.asked.rates_a, &seen.asked.rates_b);
        let too_fast = robot1.too_fast(&s.rates_a, a, cycle) | robot2.too_fast(&s.rates_b, b, cycle);
        // Before the first cycle there is no rate to differ from.
        fast = fast | begun & too_fast;
    }
    let clamped = R::select(fast, s.clamped + cycle, zero);

    let measures = [
        (square(wrench.force), rules.force * rules.force),
        (square(wrench.moment), rules.moment * rules.moment),
        (change / (cycle * cycle), rules.force_rate * rules.force_rate),
        (seen.saturated, if rules.sensor_saturation { 0.0 } else { f64::INFINITY }),
        (seen.port_energy - work, rules.injected_energy),
        (following, rules.following_error * rules.following_error),
        (following_turn, half_sine(rules.following_rotation)),
        (reach, rules.tool_reach * rules.tool_reach),
        (reach_turn, half_sine(rules.tool_rotation)),
        (seen.range_used, if m.facility.session_robots.is_some() { 1.0 } else { f64::INFINITY }),
        (clamped, rules.clamp_time),
        (speed, rules.tool_speed * rules.tool_speed),
        (seen.clearance.depth, if rules.keep_out.is_empty() { f64::INFINITY } else { 0.0 }),
        (-seen.clearance.arms, -rules.arm_distance),
        (-seen.asked.least_sine, if rules.singularity.is_finite() { -rules.singularity.sin() } else { f64::INFINITY }),
    ];
    let (mut rule, mut value) = (zero, zero);
    // No iterator: what it calls might be compiled for any processor.
    let mut index = measures.len();
    while index > 0 {
        index -= 1;
        let (measure, limit) = measures[index];
        if limit.is_finite() {
            // Not "greater than": the comparison must also catch a NaN.
            let met = !measure.le(R::lit(limit));
            rule = R::select(met, R::lit(index as f64 + 1.0), rule);
            value = R::select(met, measure, value);
        }
    }
    let stopped = zero.lt(s.rule);
    Session {
        begun: R::lit(1.0),
        place,
        turn,
        wrench,
        work,
        rates_a: seen.asked.rates_a,
        rates_b: seen.asked.rates_b,
        clamped,
        rule: R::select(stopped, s.rule, rule),
        value: R::select(stopped, s.value, value),
    }
}

/// Square of a vector's length.
#[inline(always)]
fn square<R: Real>(v: Vec3<R>) -> R {
    v.dot(v)
}

/// Square of the sine of half the angle between two attitudes.
#[inline(always)]
fn half_turn<R: Real>(from: Quat<R>, to: Quat<R>) -> R {
    square(to.compose(from.conjugate()).v)
}

/// Square of the sine of half an angle; infinite for none.
fn half_sine(angle: f64) -> f64 {
    if angle.is_finite() { (0.5 * angle).sin().powi(2) } else { angle }
}

/// Square of the distance of a commanded part from its start.
#[inline(always)]
fn distance<R: Real>(commanded: Motion<R>, start: Motion<f64>) -> R {
    square(commanded.position - Vec3::lit(start.position))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Facility, KeepOut, Model, Timing};
    use crate::vector::{Pose, vec3};

    /// A plant of which only the rules count: two bodies at the origin.
    fn plant(rules: SessionRules) -> Plant {
        let timing = Timing { substep: 1e-3, substeps: 1, max_ticks: 1 };
        let facility = Facility { rules, ..Facility::IDEAL };
        Plant::new(Model { facility, ..Model::two_bodies(timing, 0.0) })
    }

    fn motion(position: Vec3<f64>, attitude: Quat<f64>) -> Motion<f64> {
        Motion { position, attitude, velocity: Vec3::zero(), omega: Vec3::zero() }
    }

    fn turn(axis: Vec3<f64>, angle: f64) -> Quat<f64> {
        let axis = axis * (1.0 / axis.norm());
        Quat { w: (0.5 * angle).cos(), v: axis * (0.5 * angle).sin() }
    }

    fn observed(parts: Parts<f64>, wrench: Wrench<f64>) -> Observed<f64> {
        let rates = [0.0; AXES];
        let asked = Asked { rates_a: rates, rates_b: rates, near_limit: 0.0, least_sine: 1.0, near_body: 0.0 };
        let (commanded, cut, range_used, clearance) = (parts, 0.0, 0.0, far_apart());
        Observed { commanded, parts, wrench, saturated: 0.0, cut, asked, range_used, clearance, port_energy: 0.0 }
    }

    /// The parts after a share of a relative motion: part A slides by 10 mm along x and turns by 0.1 rad about z relative
    /// to part B, while both are carried along and turned by `carrier`.
    fn carried(share: f64, carrier: Pose<f64>) -> Parts<f64> {
        let a = Pose { position: vec3(0.01 * share, 0.0, 0.0), attitude: turn(vec3(0.0, 0.0, 1.0), 0.1 * share) };
        let b = Pose { position: vec3(0.3, 0.1, 0.0), attitude: Quat::identity() };
        let [a, b] = [a, b].map(|pose| carrier.compose(pose));
        Parts { a: motion(a.position, a.attitude), b: motion(b.position, b.attitude) }
    }

    #[test]
    fn the_work_of_a_wrench_is_that_of_the_relative_motion_whoever_carries_both_parts() {
        let m = plant(SessionRules { injected_energy: 1e9, ..SessionRules::NONE });
        let still = |_: f64| Pose::identity();
        let carrying = |share: f64| Pose {
            position: vec3(0.2 * share, -0.1, 0.3 * share),
            attitude: turn(vec3(1.0, 2.0, -1.0), 0.5 * share),
        };
        for carrier in [&still as &dyn Fn(f64) -> Pose<f64>, &carrying] {
            let mut s = new_session::<f64>();
            for step in 0..=1000 {
                let share = f64::from(step) / 1000.0;
                let parts = carried(share, carrier(share));
                // 100 N along part B's x, 5 N m about its z, as the sensor on part A sees them.
                let in_a = turn(vec3(0.0, 0.0, 1.0), 0.1 * share);
                let wrench = Wrench {
                    force: in_a.rotate_back(vec3(100.0, 0.0, 0.0)),
                    moment: in_a.rotate_back(vec3(0.0, 0.0, 5.0)),
                };
                s = supervise(&m, &s, &observed(parts, wrench), 1e-3);
            }
            assert!((s.work - (100.0 * 0.01 + 5.0 * 0.1)).abs() < 1e-6, "{} J", s.work);
            assert_eq!(s.rule, 0.0);
        }
    }

    #[test]
    fn each_rule_is_met_by_its_own_quantity_and_the_first_one_stands() {
        let rules = SessionRules {
            force: 100.0,
            moment: 20.0,
            force_rate: 5e4,
            sensor_saturation: true,
            injected_energy: 0.5,
            following_error: 0.05,
            following_rotation: 0.1,
            tool_reach: 0.3,
            tool_rotation: 0.2,
            clamp_time: 2e-3,
            tool_speed: 0.4,
            keep_out: vec![KeepOut { name: "wall".to_owned(), frame: Pose::identity(), half: vec3(0.1, 0.1, 0.1) }],
            arm_distance: 0.3,
            singularity: 0.1,
        };
        let m = plant(rules);
        let start = m.start;
        let calm = || observed(Parts { a: start.a, b: start.b }, Wrench::zero());
        let pushed = |force: f64, moment: f64| Wrench { force: vec3(force, 0.0, 0.0), moment: vec3(0.0, moment, 0.0) };
        let moved = |way: f64, angle: f64| {
            let attitude = turn(vec3(0.0, 1.0, 0.0), angle).compose(start.b.attitude);
            Parts { b: Motion { position: start.b.position + vec3(0.0, way, 0.0), attitude, ..start.b }, ..start }
        };
        let hurried = |speed: f64| {
            let mut seen = calm();
            seen.commanded.b.velocity = vec3(0.0, speed, 0.0);
            seen
        };
        let near = |clearance| Observed { clearance, ..calm() };
        let bent = |angle: f64| Observed { asked: Asked { least_sine: angle.sin(), ..calm().asked }, ..calm() };
        let cases: [(Rule, Observed<f64>, f64); 17] = [
            (Rule::Force, Observed { wrench: pushed(101.0, 0.0), ..calm() }, 101.0),
            (Rule::Force, Observed { wrench: pushed(f64::NAN, 0.0), ..calm() }, f64::NAN),
            (Rule::Moment, Observed { wrench: pushed(0.0, 21.0), ..calm() }, 21.0),
            (Rule::ForceRate, Observed { wrench: pushed(60.0, 0.0), ..calm() }, 6e4),
            (Rule::Saturation, Observed { saturated: 1.0, ..calm() }, 1.0),
            (Rule::InjectedEnergy, Observed { port_energy: 0.6, ..calm() }, 0.6),
            (Rule::FollowingError, Observed { parts: moved(0.06, 0.0), ..calm() }, 0.06),
            (Rule::FollowingRotation, Observed { parts: moved(0.0, 0.11), ..calm() }, 0.11),
            (Rule::ToolReach, observed(moved(0.31, 0.0), Wrench::zero()), 0.31),
            (Rule::ToolRotation, observed(moved(0.0, 0.21), Wrench::zero()), 0.21),
            (Rule::ToolSpeed, hurried(0.41), 0.41),
            (Rule::KeepOut, near(Clearance { depth: 0.02, ..far_apart() }), 0.02),
            (Rule::KeepOut, near(Clearance { depth: f64::NAN, ..far_apart() }), f64::NAN),
            (Rule::ArmDistance, near(Clearance { arms: 0.29, ..far_apart() }), 0.29),
            (Rule::ArmDistance, near(Clearance { arms: f64::NAN, ..far_apart() }), f64::NAN),
            (Rule::Singularity, bent(0.09), 0.09),
            (Rule::Singularity, bent(f64::NAN), f64::NAN),
        ];
        for (rule, seen, value) in cases {
            let before = supervise(&m, &new_session(), &calm(), 1e-3);
            assert_eq!(before.rule, 0.0, "{rule:?}: a calm cycle meets no rule");
            let met = supervise(&m, &before, &seen, 1e-3);
            assert_eq!(Rule::of_number(met.rule), Some(rule));
            let found = rule.in_unit(met.value);
            assert!((found - value).abs() < 1e-9 || value.is_nan(), "{rule:?}: {found}, not {value}");
            let after = supervise(&m, &met, &Observed { wrench: pushed(500.0, 90.0), ..calm() }, 1e-3);
            assert_eq!((after.rule, after.value.to_bits()), (met.rule, met.value.to_bits()), "the first rule stands");
        }
    }

    #[test]
    fn commands_may_be_cut_for_a_time_without_a_pause() {
        let m = plant(SessionRules { clamp_time: 2.5e-3, ..SessionRules::NONE });
        let start = m.start;
        let step = |s: &Session<f64>, cut: f64| {
            supervise(&m, s, &Observed { cut, ..observed(Parts { a: start.a, b: start.b }, Wrench::zero()) }, 1e-3)
        };
        let mut s = new_session();
        for cut in [1.0, 1.0, 0.0, 1.0, 1.0] {
            s = step(&s, cut);
            assert_eq!(s.rule, 0.0);
        }
        assert_eq!(Rule::of_number(step(&s, 1.0).rule), Some(Rule::ClampTime));
    }

    #[test]
    fn the_table_is_in_the_order_of_the_numbers() {
        for (index, row) in RULES.iter().enumerate() {
            assert_eq!(row.rule as usize, index + 1);
            assert_eq!(row.rule.row().id, row.id);
        }
        assert_eq!(Rule::of_number(0.0), None);
    }
}
