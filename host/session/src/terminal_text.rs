//! Texts of a session for a terminal: plan, checks, end, prediction, replay, emulated facility.

use crate::answer::{EndedSession, SessionOutcome};
use crate::emulated::EmulationSummary;
use crate::plan::SessionPlan;
use crate::prediction::PredictedAnswer;
use crate::replay::ReplayedLog;
use softdock_analysis::number::{percent, with_unit};
use softdock_realtime::drive::checklist::{Check, CheckOutcome, Checklist};

impl SessionPlan {
    /// Returns run, mode, addresses, limits and stop rules, before the links open.
    pub fn text(&self) -> String {
        let (task, addresses) = (&self.task, self.addresses.all());
        let mut out = format!("{}  run {}  {}\n", self.campaign.id, task.run, self.mode_text());
        for (index, (robot, address)) in task.station.robots.iter().zip(addresses).enumerate() {
            out += &format!("  robot {}   {}  {}\n", index + 1, robot.name, address.shown());
        }
        out + &self.limits_text()
    }
}

/// Returns the start-up checks as a table with their count; failed checks have a line with their remedy.
pub fn checks_text(list: &Checklist) -> String {
    let count = |answer: CheckOutcome| list.checks().iter().filter(|check| check.answer() == answer).count();
    let [passed, failed, open] = [CheckOutcome::Passed, CheckOutcome::Failed, CheckOutcome::Open].map(count);
    let lines: Vec<String> = list.checks().iter().map(check_line).collect();
    let table = lines.join("\n");
    format!("{table}\n\n{passed} checks passed, {failed} failed, {open} without an answer; nothing has moved")
}

fn check_line(check: &Check) -> String {
    let (row, answer) = (check.kind.row(), check.answer());
    let mark = match answer {
        CheckOutcome::Passed => "ok    ",
        CheckOutcome::Failed => "FAILED",
        CheckOutcome::Open => "-     ",
    };
    let remedy = if answer == CheckOutcome::Failed { format!("\n       {}", row.remedy) } else { String::new() };
    let [value, limit] = [check.value_text(), check.limit_text()];
    format!("{mark} {:<16} {:<66} {value:>14}   {limit}{remedy}", check.subject(), row.title)
}

impl EndedSession {
    /// Returns the stop cause with robot, value and limit, the link faults, and the paths of log and evidence.
    pub fn text(&self, plan: &SessionPlan) -> String {
        let cause = self.last.cause;
        let mut out = format!("stopped by {}: {}\n", cause.word(), cause.meaning());
        let mut detail = |text: String| out += &format!("           {text}\n");
        self.stop_text(plan).into_iter().for_each(&mut detail);
        if let Some(distance) = self.retracted {
            detail(format!("robot 1 has retracted its part by {:.1} mm", distance * 1e3));
        }
        for (link, fault) in ["robot 1", "robot 2", "the sensor"].iter().zip(self.faults) {
            fault.into_iter().for_each(|fault| detail(format!("{link}: {fault}")));
        }
        let file = |name: &str| plan.folder().join(name).display().to_string();
        let (written, lost) = (self.log_records, self.log_records_lost);
        out += &format!("log        {}  {written} cycles, {lost} dropped\n", file("log.mcap"));
        out + &format!("evidence   {}", file("evidence.csv"))
    }
}

impl PredictedAnswer {
    /// Returns the verdict, and every metric with its 95 % prediction interval.
    pub fn text(&self) -> String {
        let Self { answer, prediction } = self;
        let verdict = match answer.outcome {
            SessionOutcome::Pass => "PASS",
            SessionOutcome::Fail => "FAIL",
            SessionOutcome::NotCompleted | SessionOutcome::Refused | SessionOutcome::Checked => {
                "NOT COMPLETED, no verdict"
            }
        };
        let (share, runs) = (percent(prediction.predicted_success), prediction.predictions);
        let mut out = format!("\nthe run    {verdict}; the model passes {share} of {runs} drives of this draw\n");
        out += &format!("{:<24} {:>14} {:>14} {:>14}\n", "metric", "this run", "95 % from", "to");
        for line in &prediction.metrics {
            let mark = if line.inside { "" } else { "  OUTSIDE" };
            let [value, lo, hi] = [line.value, line.lo, line.hi].map(|value| with_unit(value, line.unit));
            out += &format!("{:<24} {value:>14} {lo:>14} {hi:>14}{mark}\n", line.name);
        }
        let inside = prediction.metrics.iter().filter(|line| line.inside).count();
        out + &format!("{inside} of {} metrics inside the prediction intervals", prediction.metrics.len())
    }
}

impl ReplayedLog {
    /// Whether every cycle is equal, bit for bit.
    pub fn is_equal(&self) -> bool {
        self.replayed.first.is_none()
    }

    /// Returns the identified dead times of the robots, and the first cycle that differs.
    pub fn text(&self) -> String {
        let mut out = String::new();
        for (index, delay) in self.delays.iter().enumerate() {
            let Some(delay) = delay else { continue };
            out += &format!(
                "robot {}    dead time {:.2} +- {:.2} ms beyond one cycle; slow motion is {:.2} ms late\n",
                index + 1,
                delay.dead_time * 1e3,
                delay.error * 1e3,
                delay.of_slow_motion() * 1e3
            );
        }
        let (cycles, equal) = (self.replayed.cycles, self.replayed.equal);
        out + &match &self.replayed.first {
            None => format!("{cycles} cycles: equal, bit for bit"),
            Some(difference) => format!("{equal} of {cycles} cycles equal; the first difference: {difference}"),
        }
    }
}

impl EmulationSummary {
    /// Returns the facility's lateness, the robots that have stopped, and the peak force.
    pub fn text(&self) -> String {
        let mut out = format!("the facility's own lateness: {}\n", self.lateness);
        for (index, end) in self.ends.iter().enumerate() {
            out += &end.map_or_else(String::new, |end| format!("robot {} stopped: {end}\n", index + 1));
        }
        out + &format!("peak force {:.1} N  captured {}", self.truth.peak_contact_force, self.captured)
    }
}
