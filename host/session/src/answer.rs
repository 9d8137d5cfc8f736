//! Answer of a session: the values of `drive.json`, of the operator's page and of the terminal.

use crate::plan::SessionPlan;
use serde::{Serialize, Serializer};
use softdock_analysis::number::with_unit;
use softdock_campaign::criteria::succeeds;
use softdock_campaign::rules;
use softdock_kernels::metrics::Metrics;
use softdock_kernels::outcome::Stop;
use softdock_realtime::drive::checklist::{Check, Checklist};
use softdock_realtime::drive::guard::Alarm;
use softdock_realtime::drive::start::moved;
use softdock_realtime::log::codes::StopCause;
use softdock_realtime::log::record::CycleRecord;
use softdock_realtime::signals::{LinkFault, axis_name};
use softdock_realtime::time::Nanos;

/// Outcome of a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SessionOutcome {
    /// Completed, and every criterion of the task is met.
    Pass,
    /// Completed, and some criterion is not met.
    Fail,
    /// Stopped before its end: no verdict.
    NotCompleted,
    /// Refused.
    Refused,
    /// The requested checks have passed.
    Checked,
}

impl SessionOutcome {
    /// Exit code of a command: 0 passed, 1 failed, 3 not completed or refused.
    pub fn exit_code(self) -> u8 {
        match self {
            Self::Pass | Self::Checked => 0,
            Self::Fail => 1,
            Self::NotCompleted | Self::Refused => 3,
        }
    }

    /// Returns the word in `drive.json`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Fail => "fail",
            Self::NotCompleted => "not_completed",
            Self::Refused => "refused",
            Self::Checked => "checked",
        }
    }
}

impl Serialize for SessionOutcome {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.word())
    }
}

/// The end of a session, as returned by the cycle's thread.
#[derive(Clone, Debug)]
pub struct EndedSession {
    /// The last cycle.
    pub last: CycleRecord,
    /// The check that refused the session.
    pub refusal: Option<Check>,
    /// The checks of the start-up.
    pub checklist: Checklist,
    /// Distance by which robot 1 has retracted its part after the stop \[m\].
    pub retracted: Option<f64>,
    /// Faults of the links of robots 1 and 2 and of the sensor.
    pub faults: [Option<LinkFault>; 3],
    /// Metrics of the run as measured by the facility.
    pub metrics: Metrics<f64>,
    /// The session rule that was met.
    pub stop: Option<Stop>,
    /// Time since the start, and cause of the stop.
    pub stopped: Option<(Nanos, Alarm)>,
    /// Greatest distance \[m\] and angle \[rad\] of each robot's tool from its command.
    pub worst_tracking: [[f64; 2]; 2],
    /// Greatest share of its limit that an unexplained torque has reached, robots 1 and 2.
    pub worst_torques: [f64; 2],
    /// Records written by the log.
    pub log_records: u64,
    /// Records lost by the log.
    pub log_records_lost: u64,
}

/// The session rule that stopped a session.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RuleMet {
    /// Name of the rule.
    pub id: &'static str,
    /// Value, in `unit`.
    pub value: f64,
    /// Limit, in `unit`.
    pub limit: f64,
    /// Unit of value and limit.
    pub unit: &'static str,
}

/// Cause and time of a stop.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StopReason {
    /// Word of the cause.
    pub cause: &'static str,
    /// Time since the start of the session \[s\].
    pub time_s: f64,
    /// Robot, from 1.
    pub robot: Option<usize>,
    /// Name of the axis for users.
    pub axis: Option<String>,
    /// Value, in `unit`.
    pub value: Option<f64>,
    /// Limit, in `unit`.
    pub limit: Option<f64>,
    /// Unit of value and limit.
    pub unit: Option<&'static str>,
}

/// A start-up check.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CheckAnswer {
    /// Name of the check.
    pub id: &'static str,
    /// Robot, axis or sensor.
    pub subject: String,
    /// Title of the check.
    pub title: &'static str,
    /// Word of the outcome.
    pub answer: &'static str,
    /// The value, in `unit`; none if unknown.
    pub value: Option<f64>,
    /// Limit, in `unit`.
    pub limit: f64,
    /// SI unit of value and limit.
    pub unit: &'static str,
}

/// Quality of a robot's link and tracking.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RobotValidity {
    /// Lost or overtaken reports.
    pub lost_reports: u64,
    /// Answers that the robot reports as late.
    pub late_answers: u32,
    /// Answers that the robot has not taken.
    pub untaken_answers: u64,
    /// Answers not sent, because their cycle was over.
    pub unsent_answers: u64,
    /// Datagrams from other hosts.
    pub foreign_datagrams: u64,
    /// Malformed datagrams.
    pub malformed_datagrams: u64,
    /// Greatest share of its limit that an unexplained torque has reached.
    pub worst_torque_share: f64,
    /// Greatest distance of the tool from its command \[m\].
    pub worst_tracking_m: f64,
    /// Greatest angle of the tool from its command \[rad\].
    pub worst_tracking_rad: f64,
}

/// Quality of the data behind a session's metrics.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Validity {
    /// Robot 1.
    pub robot_1: RobotValidity,
    /// Robot 2.
    pub robot_2: RobotValidity,
    /// Lost samples of the sensor.
    pub lost_samples: u64,
    /// Cycles whose work took too long.
    pub overruns: u64,
    /// Records lost by the log.
    pub log_records_lost: u64,
}

/// The answer of a session, before its comparison with the model; `drive.json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SessionAnswer {
    /// Campaign.
    pub campaign: String,
    /// Number of the run.
    pub run: u64,
    /// Whether the commands moved real robots.
    pub armed: bool,
    /// Start of the session \[s since the Unix epoch\].
    pub began_unix_s: f64,
    /// Word of the cause that ended it.
    pub cause: &'static str,
    /// Outcome.
    pub outcome: SessionOutcome,
    /// The session rule that stopped it.
    pub rule: Option<RuleMet>,
    /// Cause and time of the stop.
    pub stop: Option<StopReason>,
    /// The check that refused it.
    pub refusal: Option<String>,
    /// Whether every criterion of the task is met.
    pub success: bool,
    /// Distance by which robot 1 has retracted its part after the stop \[m\].
    pub retracted_m: Option<f64>,
    /// The start-up checks.
    pub checks: Vec<CheckAnswer>,
    /// Links, tracking, timing.
    pub validity: Validity,
}

impl EndedSession {
    /// Returns the outcome.
    pub fn outcome(&self, plan: &SessionPlan) -> SessionOutcome {
        if self.refusal.is_some() {
            return SessionOutcome::Refused;
        }
        match self.last.cause {
            StopCause::Checked => SessionOutcome::Checked,
            StopCause::Completed if succeeds(&plan.task.plant.task, &self.metrics) => SessionOutcome::Pass,
            StopCause::Completed => SessionOutcome::Fail,
            // Every other cause stops a session before its end.
            _ => SessionOutcome::NotCompleted,
        }
    }

    /// Returns the answer of the session.
    pub fn answer(&self, plan: &SessionPlan) -> SessionAnswer {
        let (last, outcome) = (&self.last, self.outcome(plan));
        let rule = self.stop.map(|stop| {
            let row = stop.rule.row();
            let limit = (row.limit)(&plan.task.plant.facility);
            RuleMet { id: row.id, value: stop.value, limit, unit: row.unit }
        });
        SessionAnswer {
            campaign: plan.campaign.id.clone(),
            run: plan.task.run,
            armed: plan.task.armed,
            began_unix_s: last.wall_offset.seconds(),
            cause: last.cause.word(),
            outcome,
            rule,
            stop: self.stopped.map(|(time, alarm)| StopReason::new(time, alarm)),
            refusal: self.refusal.map(|refusal| refusal.to_string()),
            success: outcome == SessionOutcome::Pass,
            retracted_m: self.retracted,
            checks: self.checklist.checks().iter().map(CheckAnswer::new).collect(),
            validity: Validity {
                robot_1: self.robot_validity(0),
                robot_2: self.robot_validity(1),
                lost_samples: last.ft.link.lost,
                overruns: last.overruns,
                log_records_lost: self.log_records_lost,
            },
        }
    }

    fn robot_validity(&self, robot: usize) -> RobotValidity {
        let record = moved(&self.last)[robot];
        let real = [&self.last.robot_1, &self.last.robot_2][robot];
        let [worst_tracking_m, worst_tracking_rad] = self.worst_tracking[robot];
        RobotValidity {
            lost_reports: real.link.lost + real.link.overtaken,
            late_answers: real.late_answers,
            untaken_answers: record.wire.untaken,
            unsent_answers: real.link.unsent,
            foreign_datagrams: real.link.foreign,
            malformed_datagrams: real.link.malformed,
            worst_torque_share: self.worst_torques[robot],
            worst_tracking_m,
            worst_tracking_rad,
        }
    }

    /// Returns robot, value and limit of the stop, where they are known.
    pub fn stop_text(&self, plan: &SessionPlan) -> Option<String> {
        if let Some(stop) = self.stop {
            let row = stop.rule.row();
            let limit = (row.limit)(&plan.task.plant.facility);
            let (sentence, value) = (rules::sentence(row, Some(limit)), with_unit(stop.value, row.unit));
            return Some(format!("{}: {sentence}; the value was {value}", row.id));
        }
        let (time, alarm) = self.stopped?;
        let found = alarm.violation?;
        let axis = found.axis.map_or_else(String::new, |axis| format!(", {}", axis_name(axis)));
        let robot = found.robot.map_or_else(String::new, |robot| format!("robot {}{axis}: ", robot + 1));
        let [value, limit] = [found.value, found.limit].map(|value| with_unit(value, found.unit));
        Some(format!("{robot}{value}, {limit} is allowed, at {:.3} s of the session", time.seconds()))
    }
}

impl StopReason {
    /// Returns the reason of a stop at a time since the start.
    pub fn new(time: Nanos, alarm: Alarm) -> Self {
        let found = alarm.violation;
        Self {
            cause: alarm.cause.word(),
            time_s: time.seconds(),
            robot: found.and_then(|found| found.robot).map(|robot| robot + 1),
            axis: found.and_then(|found| found.axis).map(axis_name),
            value: found.map(|found| found.value),
            limit: found.map(|found| found.limit),
            unit: found.map(|found| found.unit),
        }
    }
}

impl CheckAnswer {
    /// Returns a check with its outcome.
    pub fn new(check: &Check) -> Self {
        let row = check.kind.row();
        Self {
            id: row.id,
            subject: check.subject(),
            title: row.title,
            answer: check.answer().word(),
            value: Some(check.value).filter(|value| value.is_finite()),
            limit: check.limit,
            unit: row.unit.si(check.axis),
        }
    }
}
