//! The checks of a start-up, each with its value, its limit and a remedy.

use crate::signals::{RAIL, axis_name};
use std::fmt;

/// Comparison of a value with its limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bound {
    /// At most the limit.
    AtMost,
    /// At least the limit.
    AtLeast,
    /// Within 5 % of the limit.
    Near,
}

/// Tolerance of [`Bound::Near`], as a share of the limit.
const NEAR: f64 = 0.05;

/// The subject of a check.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CheckSubject {
    /// A robot.
    Robot,
    /// The force/torque sensor.
    Sensor,
    /// The parts between the robots.
    Parts,
}

/// Unit of a check's value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CheckUnit {
    /// 1 for yes, 0 for no.
    YesNo,
    /// A count of the named items.
    Count(&'static str),
    /// Seconds; written in milliseconds.
    Seconds,
    /// Metres; written in millimetres.
    Metres,
    /// Radians; written in degrees.
    Radians,
    /// Radians of a joint or metres of the rail.
    Axis,
    /// A share; written in per cent.
    Share,
    /// Newtons.
    Newtons,
    /// Newton metres.
    NewtonMetres,
}

impl CheckUnit {
    /// Factor from the SI value to the written one, its unit and decimals.
    fn scale(self, axis: Option<usize>) -> (f64, &'static str, usize) {
        match self {
            Self::YesNo => (1.0, "", 0),
            Self::Count(word) => (1.0, word, 0),
            Self::Seconds => (1e3, "ms", 3),
            Self::Metres => (1e3, "mm", 2),
            Self::Axis if axis == Some(RAIL) => (1e3, "mm", 2),
            Self::Radians | Self::Axis => (180.0 / std::f64::consts::PI, "deg", 3),
            Self::Share => (100.0, "%", 2),
            Self::Newtons => (1.0, "N", 1),
            Self::NewtonMetres => (1.0, "N m", 2),
        }
    }

    /// The SI unit, for files that programs read.
    pub fn si(self, axis: Option<usize>) -> &'static str {
        match self {
            Self::YesNo | Self::Count(_) | Self::Share => "1",
            Self::Seconds => "s",
            Self::Metres => "m",
            Self::Axis if axis == Some(RAIL) => "m",
            Self::Radians | Self::Axis => "rad",
            Self::Newtons => "N",
            Self::NewtonMetres => "N m",
        }
    }

    /// A value as users read it.
    fn text(self, value: f64, axis: Option<usize>) -> String {
        if self == Self::YesNo {
            return if value > 0.5 { "yes" } else { "no" }.to_owned();
        }
        let (factor, unit, decimals) = self.scale(axis);
        format!("{:.decimals$} {unit}", value * factor)
    }
}

/// A row of the table of checks.
#[derive(Clone, Copy, Debug)]
pub struct CheckRow {
    /// Name in files.
    pub id: &'static str,
    /// Subject.
    pub subject: CheckSubject,
    /// Meaning of the value.
    pub title: &'static str,
    /// Its unit.
    pub unit: CheckUnit,
    /// Comparison with the limit.
    pub bound: Bound,
    /// Remedy of a failure.
    pub remedy: &'static str,
}

/// Declares the checks in their order; the first failed one refuses the session.
macro_rules! checks {
    ($($variant:ident $id:literal $subject:ident, $title:literal, $unit:expr, $bound:ident, $remedy:literal;)*) => {
        /// A check of the start-up.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum CheckKind {
            $(#[doc = $title] $variant,)*
        }

        impl CheckKind {
            /// All checks, in order.
            pub const ALL: &[Self] = &[$(Self::$variant),*];
            const ROWS: &[CheckRow] = &[$(CheckRow {
                id: $id,
                subject: CheckSubject::$subject,
                title: $title,
                unit: $unit,
                bound: Bound::$bound,
                remedy: $remedy,
            }),*];

            /// Returns the check's row.
            pub fn row(self) -> &'static CheckRow {
                &Self::ROWS[self as usize]
            }
        }
    };
}

checks! {
    Reports "reports" Robot, "reports received", CheckUnit::Count("reports"), AtLeast,
        "start its program, and compare the address that it sends to with this one";
    Samples "samples" Sensor, "samples received", CheckUnit::Count("samples"), AtLeast,
        "check its address, and that no other computer receives its stream";
    Link "link" Robot, "link works", CheckUnit::YesNo, AtLeast,
        "see the message of the link";
    SensorLink "sensor_link" Sensor, "link works", CheckUnit::YesNo, AtLeast,
        "see the message of the link";
    Foreign "foreign" Robot, "datagrams from other senders", CheckUnit::Count("datagrams"), AtMost,
        "remove the other sender from this port, and start again";
    Still "still" Robot, "change of its set-point while no motion is commanded", CheckUnit::Axis, AtMost,
        "another master moves it, or its controller has started a new session: start again";
    Period "period" Robot, "period of its reports", CheckUnit::Seconds, Near,
        "set cycle_ms of its address to the period of its controller";
    Loss "loss" Robot, "successive reports without loss", CheckUnit::Count("reports"), AtLeast,
        "check cable, switch and load of this machine";
    Late "late" Robot, "answers that the robot reports as late", CheckUnit::Count("answers"), AtMost,
        "check network and load of this machine, and --priority";
    Clock "clock" Robot, "rate difference between its clock and this machine's", CheckUnit::Share, AtMost,
        "set cycle_ms of its address, or check the time stamps of its controller";
    Ready "ready" Robot, "follows commands", CheckUnit::YesNo, AtLeast,
        "switch the drives on, select the operating mode, acknowledge faults and stops";
    Servo "servo" Robot, "distance from its own set-point", CheckUnit::Axis, AtMost,
        "open the brakes, switch the drives on, and remove obstacles";
    Range "range" Robot, "least distance from the end of a range", CheckUnit::Axis, AtLeast,
        "move it by hand into its range";
    ToolPosition "tool_position" Robot, "distance between reported and modelled position of its tool", CheckUnit::Metres, AtMost,
        "check robot model, [joints] zero, tool_position and tool_rotation of the facility file";
    ToolRotation "tool_rotation" Robot, "angle between reported and modelled attitude of its tool", CheckUnit::Radians, AtMost,
        "check robot model, [joints] zero, tool_position and tool_rotation of the facility file";
    Torques "torques" Robot, "reports the torques that the facility file limits", CheckUnit::YesNo, AtLeast,
        "configure its controller to send the torques of its joints, or remove torque from [safety] of the facility file";
    Reach "reach" Robot, "reaches the start of the run within its limits", CheckUnit::YesNo, AtLeast,
        "move its base, or select another run";
    StartPosition "start_position" Robot, "distance of its part from the start of the run", CheckUnit::Metres, AtMost,
        "move it there with --to-start --arm";
    StartRotation "start_rotation" Robot, "angle of its part from the start of the run", CheckUnit::Radians, AtMost,
        "move it there with --to-start --arm";
    Status "status" Sensor, "samples are valid and not saturated", CheckUnit::YesNo, AtLeast,
        "see the status of the sensor";
    Age "age" Sensor, "age of its newest sample", CheckUnit::Seconds, AtMost,
        "check its network, its rate, and sensor_age of the facility file";
    RestSpread "rest_spread" Sensor, "range of the force at rest", CheckUnit::Newtons, AtMost,
        "remove contacts and vibrations";
    RestForce "rest_force" Sensor, "force at rest without the weight of its tool", CheckUnit::Newtons, AtMost,
        "check tool_mass and the axes of [sensor] in the facility file, contacts of the tool, and the sensor's own bias";
    RestMoment "rest_moment" Sensor, "moment at rest without the weight of its tool", CheckUnit::NewtonMetres, AtMost,
        "check tool_centre and the axes of [sensor] in the facility file, contacts of the tool, and the sensor's own bias";
    TurnedForce "turned_force" Sensor, "change of force in a second attitude, without the weight", CheckUnit::Newtons, AtMost,
        "check tool_mass and rotation of [sensor] in the facility file";
    TurnedMoment "turned_moment" Sensor, "change of moment in a second attitude, without the weight", CheckUnit::NewtonMetres,
        AtMost, "check tool_centre and rotation of [sensor] in the facility file";
    Clearance "clearance" Parts, "least distance of the parts, including the path to the start", CheckUnit::Metres,
        AtLeast, "move the robots apart by hand";
    ArmDistance "arm_distance" Parts, "least distance of the arms, including the path to the start", CheckUnit::Metres,
        AtLeast, "move the robots nearer to the start by hand";
    KeepOut "keep_out" Parts, "depth in a keep-out box, including the path to the start", CheckUnit::Metres,
        AtMost, "move the robots nearer to the start by hand";
}

impl CheckKind {
    /// Whether the value may be unknown: robots need not report it, or it is not measured yet.
    pub fn may_be_unknown(self) -> bool {
        matches!(
            self,
            Self::ArmDistance
                | Self::Clearance
                | Self::Clock
                | Self::KeepOut
                | Self::Period
                | Self::Still
                | Self::ToolPosition
                | Self::ToolRotation
                | Self::TurnedForce
                | Self::TurnedMoment
        )
    }
}

/// A check with its value and limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Check {
    /// Kind of the check.
    pub kind: CheckKind,
    /// Robot, 0 or 1, if the check concerns one.
    pub robot: Option<usize>,
    /// Axis with this value, if there are several.
    pub axis: Option<usize>,
    /// Value, SI units; NaN if unknown.
    pub value: f64,
    /// Limit, SI units.
    pub limit: f64,
    /// Whether the check decides; otherwise its value is information only.
    pub decides: bool,
}

/// The outcome of a check.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CheckOutcome {
    /// Within its limit.
    Passed,
    /// Beyond its limit.
    Failed,
    /// Unknown value, or a check that does not decide.
    Open,
}

impl CheckOutcome {
    /// Returns the word for files and pages.
    pub fn word(self) -> &'static str {
        match self {
            Self::Passed => "passed",
            Self::Failed => "failed",
            Self::Open => "open",
        }
    }
}

impl Check {
    /// Creates a check of the sensor or the parts.
    pub fn new(kind: CheckKind, value: f64, limit: f64) -> Self {
        Self { kind, robot: None, axis: None, value, limit, decides: true }
    }

    /// Creates a check of a robot, 0 or 1.
    pub fn of_robot(kind: CheckKind, robot: usize, value: f64, limit: f64) -> Self {
        Self { robot: Some(robot), ..Self::new(kind, value, limit) }
    }

    /// Returns the outcome. A NaN fails, unless the value may be unknown.
    pub fn answer(&self) -> CheckOutcome {
        if !self.decides || self.value.is_nan() && self.kind.may_be_unknown() {
            return CheckOutcome::Open;
        }
        let passed = match self.kind.row().bound {
            Bound::AtMost => self.value <= self.limit,
            Bound::AtLeast => self.value >= self.limit,
            Bound::Near => (self.value - self.limit).abs() <= NEAR * self.limit,
        };
        if passed { CheckOutcome::Passed } else { CheckOutcome::Failed }
    }

    /// Returns the subject as text: "robot 1", "robot 1, axis 3", "sensor".
    pub fn subject(&self) -> String {
        match (self.robot, self.axis, self.kind.row().subject) {
            (Some(robot), Some(axis), _) => format!("robot {}, {}", robot + 1, axis_name(axis)),
            (Some(robot), None, _) => format!("robot {}", robot + 1),
            (None, _, CheckSubject::Parts) => "parts".to_owned(),
            (None, ..) => "sensor".to_owned(),
        }
    }

    /// Returns the value with its unit, for users.
    pub fn value_text(&self) -> String {
        if self.value.is_nan() { "not known".to_owned() } else { self.kind.row().unit.text(self.value, self.axis) }
    }

    /// Returns the limit with its unit, for users.
    pub fn limit_text(&self) -> String {
        let row = self.kind.row();
        let limit = row.unit.text(self.limit, self.axis);
        match row.bound {
            _ if !self.decides => "not required".to_owned(),
            _ if row.unit == CheckUnit::YesNo => limit,
            Bound::AtMost => format!("at most {limit}"),
            Bound::AtLeast => format!("at least {limit}"),
            Bound::Near => format!("{limit} within {:.0} %", NEAR * 100.0),
        }
    }
}

impl fmt::Display for Check {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (row, subject) = (self.kind.row(), self.subject());
        let (value, limit) = (self.value_text(), self.limit_text());
        write!(f, "{subject}: {}: {value}, required {limit}: {}", row.title, row.remedy)
    }
}

/// Capacity of a list: every check for both robots.
const ROOMS: usize = 2 * CheckKind::ALL.len();

/// The checks of a start-up with their values; allocates nothing.
#[derive(Clone, Copy, Debug)]
pub struct Checklist {
    checks: [Check; ROOMS],
    len: usize,
}

impl Default for Checklist {
    fn default() -> Self {
        Self { checks: [Check::new(CheckKind::Reports, f64::NAN, f64::NAN); ROOMS], len: 0 }
    }
}

impl Checklist {
    /// Adds a check.
    pub fn push(&mut self, check: Check) {
        if let Some(place) = self.checks.get_mut(self.len) {
            *place = check;
            self.len += 1;
        }
    }

    /// Replaces the value of a check of the sensor or the parts.
    pub fn set(&mut self, check: Check) {
        let same = |old: &&mut Check| old.kind == check.kind && old.robot == check.robot;
        if let Some(old) = self.checks[..self.len].iter_mut().find(same) {
            *old = check;
        }
    }

    /// All checks, in order.
    pub fn checks(&self) -> &[Check] {
        &self.checks[..self.len]
    }

    /// The first check that has failed.
    pub fn failed(&self) -> Option<Check> {
        self.checks().iter().copied().find(|check| check.answer() == CheckOutcome::Failed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_check_has_a_row_of_its_own_and_answers_by_its_bound() {
        for (i, kind) in CheckKind::ALL.iter().enumerate() {
            assert_eq!(*kind as usize, i);
            let same = CheckKind::ALL.iter().filter(|other| other.row().id == kind.row().id).count();
            assert_eq!(same, 1, "{}", kind.row().id);
            let answers = [0.5, 1.0, 2.0].map(|value| Check::new(*kind, value, 1.0).answer());
            let expected = match kind.row().bound {
                Bound::AtMost => [CheckOutcome::Passed, CheckOutcome::Passed, CheckOutcome::Failed],
                Bound::AtLeast => [CheckOutcome::Failed, CheckOutcome::Passed, CheckOutcome::Passed],
                Bound::Near => [CheckOutcome::Failed, CheckOutcome::Passed, CheckOutcome::Failed],
            };
            assert_eq!(answers, expected, "{}", kind.row().id);
            let unknown = if kind.may_be_unknown() { CheckOutcome::Open } else { CheckOutcome::Failed };
            assert_eq!(Check::new(*kind, f64::NAN, 1.0).answer(), unknown, "{}", kind.row().id);
        }
    }

    #[test]
    fn a_failed_check_states_subject_value_limit_and_remedy() {
        let servo = Check { axis: Some(2), ..Check::of_robot(CheckKind::Servo, 0, 0.02, 0.01) };
        let text = servo.to_string();
        let expected =
            "robot 1, axis 3: distance from its own set-point: 1.146 deg, required at most 0.573 deg: open the";
        assert!(text.starts_with(expected), "{text}");
        let rail = Check { axis: Some(RAIL), ..servo };
        assert!(rail.to_string().contains("rail: distance from its own set-point: 20.00 mm"), "{rail}");
    }
}
