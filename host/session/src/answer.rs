//! How a session ended: the values of `drive.json`, the operator's page and the terminal.

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

/// How a session has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SessionOutcome {
    /// Completed, and every criterion of the task is met.
    Pass,
    /// Completed, and some criterion is not met.
    Fail,
    /// Stopped before its end: no verdict.
    NotCompleted,
    /// Not begun.
    Refused,
    /// The checks were asked for, and have passed.
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

    /// The word in `drive.json`.
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

/// The end of a session as the cycle's thread leaves it.
#[derive(Clone, Debug)]
pub struct EndedSession {
    /// The last cycle.
    pub last: CycleRecord,
    /// The check that has refused the session.
    pub refusal: Option<Check>,
    /// The checks of the start-up.
    pub checklist: Checklist,
    /// How far robot 1 has moved its part back after the stop \[m\].
    pub retracted: Option<f64>,
    /// What the links of robots 1 and 2 and of the sensor have failed with.
    pub faults: [Option<LinkFault>; 3],
    /// Metrics of the run as the facility measures them.
    pub metrics: Metrics<f64>,
    /// The session's rule that was met.
    pub stop: Option<Stop>,
    /// When the session was stopped, since its start, and why.
    pub stopped: Option<(Nanos, Alarm)>,
    /// Greatest distance \[m\] and angle \[rad\] of each robot's tool from its command.
    pub worst_tracking: [[f64; 2]; 2],
    /// Greatest share of its limit that an unexplained torque has had, robots 1 and 2.
    pub worst_torques: [f64; 2],
    /// Records that the log has written.
    pub log_records: u64,
    /// Records that the log has lost.
    pub log_records_lost: u64,
}

/// The rule that stopped a session.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RuleMet {
    /// Name of the rule.
    pub id: &'static str,
    /// The value that met it, in `unit`.
    pub value: f64,
    /// The limit, in `unit`.
    pub limit: f64,
    /// Unit of value and limit.
    pub unit: &'static str,
}

/// What a session was stopped for, and when.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StopReason {
    /// Word of the cause.
    pub cause: &'static str,
    /// Time since the start of the session \[s\].
    pub time_s: f64,
    /// Robot, from 1.
    pub robot: Option<usize>,
    /// Axis as users call it.
    pub axis: Option<String>,
    /// The value that was found, in `unit`.
    pub value: Option<f64>,
    /// Its limit, in `unit`.
    pub limit: Option<f64>,
    /// Unit of value and limit.
    pub unit: Option<&'static str>,
}

/// A check of the start-up.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CheckAnswer {
    /// Name of the check.
    pub id: &'static str,
    /// Robot, axis or sensor.
    pub subject: String,
    /// What is checked.
    pub title: &'static str,
    /// Word of the answer.
    pub answer: &'static str,
    /// The value, in `unit`; none if it is not known.
    pub value: Option<f64>,
    /// The limit, in `unit`.
    pub limit: f64,
    /// SI unit of value and limit.
    pub unit: &'static str,
}

/// What a robot's link and tracking were like.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RobotValidity {
    /// Reports that were lost or overtaken.
    pub lost_reports: u64,
    /// Answers that the robot counts as late.
    pub late_answers: u32,
    /// Answers that the robot has not taken.
    pub untaken_answers: u64,
    /// Answers that were not sent, because their cycle was over.
    pub unsent_answers: u64,
    /// Datagrams of other hosts.
    pub foreign_datagrams: u64,
    /// Datagrams that could not be read.
    pub malformed_datagrams: u64,
    /// Greatest share of its limit that an unexplained torque has had.
    pub worst_torque_share: f64,
    /// Greatest distance of the tool from its command \[m\].
    pub worst_tracking_m: f64,
    /// Greatest angle of the tool from its command \[rad\].
    pub worst_tracking_rad: f64,
}

/// What confidence in a session's metrics rests on.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Validity {
    /// Robot 1.
    pub robot_1: RobotValidity,
    /// Robot 2.
    pub robot_2: RobotValidity,
    /// Samples of the sensor that were lost.
    pub lost_samples: u64,
    /// Cycles whose work took too long.
    pub overruns: u64,
    /// Records that the log has lost.
    pub log_records_lost: u64,
}

/// The answer of a session, before it is compared with the model; `drive.json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SessionAnswer {
    /// Campaign.
    pub campaign: String,
    /// Number of the run.
    pub run: u64,
    /// The commands moved real robots.
    pub armed: bool,
    /// Start of the session \[s since the Unix epoch\].
    pub began_unix_s: f64,
    /// Word of the cause that ended it.
    pub cause: &'static str,
    /// How it ended.
    pub outcome: SessionOutcome,
    /// The rule that stopped it.
    pub rule: Option<RuleMet>,
    /// What it was stopped for.
    pub stop: Option<StopReason>,
    /// The check that refused it.
    pub refusal: Option<String>,
    /// Whether every criterion of the task is met.
    pub success: bool,
    /// How far robot 1 has moved its part back after the stop \[m\].
    pub retracted_m: Option<f64>,
    /// The checks of the start-up.
    pub checks: Vec<CheckAnswer>,
    /// Links, tracking, timing.
    pub validity: Validity,
}

impl EndedSession {
    /// How the session has ended.
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

    /// The answer of the session.
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

    /// What the session was stopped for: robot, value and limit, where they are known.
    pub fn stop_text(&self, plan: &SessionPlan) -> Option<String> {
        if let Some(stop) = self.stop {
            let row = stop.rule.row();
            let limit = (row.limit)(&plan.task.plant.facility);
            let (sentence, value) = (rules::sentence(row, Some(limit)), with_unit(stop.value, row.unit));
            return Some(format!("{}: {sentence}; the value was {value}", row.id));
        }
        let (time, alarm) = self.stopped?;
        let found = alarm.found?;
        let axis = found.axis.map_or_else(String::new, |axis| format!(", {}", axis_name(axis)));
        let robot = found.robot.map_or_else(String::new, |robot| format!("robot {}{axis}: ", robot + 1));
        let [value, limit] = [found.value, found.limit].map(|value| with_unit(value, found.unit));
        Some(format!("{robot}{value}, {limit} is allowed, at {:.3} s of the session", time.seconds()))
    }
}

impl StopReason {
    /// What a session was stopped for at a time since its start.
    pub fn new(time: Nanos, alarm: Alarm) -> Self {
        let found = alarm.found;
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
    /// A check with its answer.
    pub fn new(check: &Check) -> Self {
        let row = check.what.row();
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
