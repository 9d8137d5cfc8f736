//! Compares reported joint torques with those that weight and measured contact explain.
//!
//! A force on a robot outside the sensor (the other robot, a cable, a person) causes a torque without a measured force.
//! Friction is not modelled: the limits must exceed twice the Coulomb friction of a joint.

use super::guard::{Alarm, LimitViolation};
use crate::arms::Arms;
use crate::log::codes::StopCause;
use crate::signals::{AXES, RAIL, RobotState};
use crate::time::Nanos;
use softdock_campaign::station::TorqueRules;
use softdock_kernels::space::{Parts, Wrench};

/// Differences of one robot's torques from the expected ones; mean over the tare.
#[derive(Clone, Copy, Debug, Default)]
struct Tare {
    sum: [f64; RAIL],
    count: u32,
}

/// Compares the torques of both robots.
#[derive(Clone, Debug)]
pub struct TorqueWatch {
    rules: TorqueRules,
    tares: [Tare; 2],
    /// Time since which a robot has exceeded a limit.
    since: [Option<Nanos>; 2],
    worst: [f64; 2],
}

impl TorqueWatch {
    /// Creates a watch without samples.
    pub fn new(rules: TorqueRules) -> Self {
        Self { rules, tares: [Tare::default(); 2], since: [None; 2], worst: [0.0; 2] }
    }

    /// Returns the greatest share of its limit that an unexplained torque has reached, robots 1 and 2; 0 without
    /// reports.
    pub fn worst(&self) -> [f64; 2] {
        self.worst
    }

    /// Takes the torques at rest, while the sensor is tared.
    pub fn tare(&mut self, arms: &Arms, robots: &[Option<RobotState>; 2]) {
        for (r, report) in robots.iter().enumerate() {
            let Some((position, torque)) = report.and_then(|report| Some((report.position, report.torque?))) else {
                continue;
            };
            let expected = arms.torques(r, &position, Wrench::zero());
            let tare = &mut self.tares[r];
            tare.count += 1;
            tare.sum
                .iter_mut()
                .zip(torque)
                .zip(expected)
                .for_each(|((sum, torque), expected)| *sum += torque - expected);
        }
    }

    /// Returns an alarm if torques exceed what weight and measured wrench (on part A about its origin, part A's axes)
    /// explain.
    pub fn check(
        &mut self,
        arms: &Arms,
        robots: &[Option<RobotState>; 2],
        parts: &Parts<f64>,
        wrench: Wrench<f64>,
        now: Nanos,
    ) -> Option<Alarm> {
        let limits = self.rules.limits?;
        for (r, report) in robots.iter().enumerate() {
            let Some((position, torque)) = report.and_then(|report| Some((report.position, report.torque?))) else {
                continue;
            };
            let tare = self.tares[r];
            if tare.count == 0 {
                continue;
            }
            let expected = arms.torques(r, &position, on_part(r, parts, wrench));
            let found = unexplained(&torque, &expected, &tare);
            let share = |i: usize| found[i].abs() / limits[i];
            let axis = (0..RAIL).max_by(|i, j| share(*i).total_cmp(&share(*j))).unwrap_or(0);
            self.worst[r] = self.worst[r].max(share(axis));
            if share(axis) <= 1.0 {
                self.since[r] = None;
                continue;
            }
            let since = *self.since[r].get_or_insert(now);
            if (now - since).seconds() >= self.rules.time {
                let (value, limit) = (found[axis].abs(), limits[axis]);
                let found = Some(LimitViolation { robot: Some(r), axis: Some(axis), value, limit, unit: "N m" });
                return Some(Alarm { violation: found, ..Alarm::of(StopCause::Torque) });
            }
        }
        None
    }
}

/// Returns the differences from the expected torques and the tare \[N m\].
fn unexplained(torque: &[f64; AXES], expected: &[f64; RAIL], tare: &Tare) -> [f64; RAIL] {
    std::array::from_fn(|i| torque[i] - expected[i] - tare.sum[i] / f64::from(tare.count))
}

/// Returns the measured wrench on a robot's part about the part's origin, laboratory axes.
fn on_part(robot: usize, parts: &Parts<f64>, wrench: Wrench<f64>) -> Wrench<f64> {
    let turned =
        Wrench { force: parts.a.attitude.rotate(wrench.force), moment: parts.a.attitude.rotate(wrench.moment) };
    if robot == 0 {
        return turned;
    }
    let lever = parts.a.position - parts.b.position;
    Wrench { force: turned.force * -1.0, moment: (turned.moment + lever.cross(turned.force)) * -1.0 }
}
