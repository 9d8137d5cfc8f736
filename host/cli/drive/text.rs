//! Texts of a session for the terminal: the plan, the checks, the end, the metrics beside the prediction.

use softdock_analysis::number::{percent, with_unit};
use softdock_realtime::drive::checklist::{Answer, Check, Checklist};
use softdock_session::answer::{EndedSession, SessionOutcome};
use softdock_session::plan::SessionPlan;
use softdock_session::prediction::PredictedAnswer;
use std::io::IsTerminal;

/// What will be done, and what stops it.
pub(super) fn plan_text(plan: &SessionPlan) -> String {
    let (task, addresses) = (plan.task(), plan.addresses().all());
    let mut out = format!("{}  run {}  {}\n", plan.campaign().id, task.run, plan.mode_text());
    for (index, (robot, address)) in task.station.robots.iter().zip(addresses).enumerate() {
        out += &format!("  robot {}   {}  {}\n", index + 1, robot.name, address.shown());
    }
    out + &plan.limits_text()
}

/// The checks of the start-up, and how many have passed.
pub(super) fn checks_text(list: &Checklist) -> String {
    let count = |answer: Answer| list.checks().iter().filter(|check| check.answer() == answer).count();
    let [passed, failed, open] = [Answer::Passed, Answer::Failed, Answer::Open].map(count);
    let table = table(list);
    format!("{table}\n\n{passed} checks passed, {failed} failed, {open} without an answer; nothing has moved")
}

/// One line a check, failed ones with their remedy; in colours on a terminal.
fn table(list: &Checklist) -> String {
    let colours = std::io::stdout().is_terminal();
    let mark = |answer: Answer| match (answer, colours) {
        (Answer::Passed, true) => "\x1b[32mok    \x1b[0m",
        (Answer::Failed, true) => "\x1b[31mFAILED\x1b[0m",
        (Answer::Passed, false) => "ok    ",
        (Answer::Failed, false) => "FAILED",
        (Answer::Open, _) => "-     ",
    };
    let line = |check: &Check| {
        let (row, answer) = (check.what.row(), check.answer());
        let remedy = if answer == Answer::Failed { format!("\n       {}", row.remedy) } else { String::new() };
        let [value, limit] = [check.value_text(), check.limit_text()];
        format!("{} {:<16} {:<66} {value:>14}   {limit}{remedy}", mark(answer), check.subject(), row.title)
    };
    list.checks().iter().map(line).collect::<Vec<_>>().join("\n")
}

/// How a session ended, and where its files are.
pub(super) fn end_text(plan: &SessionPlan, ended: &EndedSession) -> String {
    let cause = ended.last.cause;
    let mut out = format!("stopped by {}: {}\n", cause.word(), cause.meaning());
    let mut detail = |text: String| out += &format!("           {text}\n");
    ended.stop_text(plan).into_iter().for_each(&mut detail);
    if let Some(way) = ended.retracted {
        detail(format!("robot 1 has moved its part back by {:.1} mm", way * 1e3));
    }
    for (link, fault) in ["robot 1", "robot 2", "the sensor"].iter().zip(ended.faults) {
        fault.into_iter().for_each(|fault| detail(format!("{link}: {fault}")));
    }
    let file = |name: &str| plan.folder().join(name).display().to_string();
    let (written, lost) = (ended.log_records, ended.log_records_lost);
    out += &format!("log        {}  {written} cycles, {lost} dropped\n", file("log.mcap"));
    out + &format!("evidence   {}", file("evidence.csv"))
}

/// Verdict and metrics beside the prediction.
pub(super) fn prediction_text(predicted: &PredictedAnswer) -> String {
    let PredictedAnswer { answer, prediction } = predicted;
    let verdict = match answer.outcome {
        SessionOutcome::Pass => "PASS",
        SessionOutcome::Fail => "FAIL",
        SessionOutcome::NotCompleted | SessionOutcome::Refused | SessionOutcome::Checked => "NOT COMPLETED, no verdict",
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
    out + &format!("{inside} of {} metrics inside what the model expects", prediction.metrics.len())
}
