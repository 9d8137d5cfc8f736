//! `softdock drive`: one run on real or emulated robots, and its metrics beside what the model predicts.

use crate::args::DriveArgs;
use crate::checklist_text::checklist_text;
use crate::reports::session_failed;
use crate::words::{Exit, json, refuse, say, warn};
use miette::IntoDiagnostic;
use softdock_analysis::number::{percent, with_unit};
use softdock_realtime::drive::checklist::Answer;
use softdock_realtime::drive::controls::Controls;
use softdock_realtime::drive::feed::Samples;
use softdock_realtime::drive::runner::Alarms;
use softdock_realtime::view::model::{Budgets, View};
use softdock_realtime::view::show;
use softdock_session::answer::{EndedSession, SessionAnswer, SessionOutcome};
use softdock_session::operator::{Operator, SessionNotice};
use softdock_session::page::OperatorPage;
use softdock_session::plan::SessionPlan;
use softdock_session::prediction::PredictedAnswer;
use std::fs;
use std::io::IsTerminal;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// Drives a run.
pub(crate) fn drive(args: &DriveArgs) -> miette::Result<Exit> {
    let plan = SessionPlan::new(args.options()).map_err(session_failed)?;
    if let Some(repeats) = plan.repeats().filter(|repeats| args.repeat > *repeats) {
        warn(format!("the experiment asks for {repeats} repeats, and this is number {}", args.repeat));
    }
    if let Some(folder) = &args.rsi_config {
        return write_configurations(&plan, folder);
    }
    plan.check_folder().map_err(session_failed)?;
    let is_terminal = std::io::stdin().is_terminal() && std::io::stdout().is_terminal();
    if args.arm && !args.go_after_check && args.serve.is_none() && !is_terminal {
        let remedy = "run it in a terminal, where the key g lets the robots move, or add --serve or --go-after-check";
        return Err(refuse("nobody can say GO here: this is no terminal", remedy));
    }
    describe(&plan);
    let ended = run(&plan, args.serve.as_deref())?;
    report(&plan, &ended, args)
}

/// Writes the files that controllers need for these addresses.
fn write_configurations(plan: &SessionPlan, folder: &Path) -> miette::Result<Exit> {
    let files = plan.addresses().configurations(&plan.task().station, &|notice| warn(notice));
    let files = files.map_err(|error| session_failed(error))?;
    if files.is_empty() {
        let remedy = "write --robot1 rsi://ADDRESS:PORT with this machine's address";
        return Err(refuse("none of the robots speaks RSI", remedy));
    }
    fs::create_dir_all(folder).into_diagnostic()?;
    for (name, text) in files {
        let path = folder.join(name);
        fs::write(&path, text).into_diagnostic()?;
        say(format!("{}", path.display()));
    }
    Ok(Exit::Done)
}

/// Prints what will be done, and what stops it, before anything moves.
fn describe(plan: &SessionPlan) {
    let (task, addresses) = (plan.task(), plan.addresses().all());
    say(format!("{}  run {}  {}", plan.campaign().id, task.run, plan.mode_text()));
    for (index, (robot, address)) in task.station.robots.iter().zip(addresses).enumerate() {
        say(format!("  robot {}   {}  {}", index + 1, robot.name, address.shown()));
    }
    say(plan.limits_text());
}

/// Runs the session under the eyes of the terminal and, if asked for, of a page.
fn run(plan: &SessionPlan, page: Option<&str>) -> miette::Result<EndedSession> {
    let controls = Arc::new(Controls::default());
    let page = page.map(|address| OperatorPage::serve(address, &controls, plan)).transpose().map_err(session_failed)?;
    if let Some(page) = &page {
        say(format!("  page      http://{}/", page.address()));
    }
    let alarms = Arc::new(Alarms::default());
    listen(&alarms, &controls);
    plan.run(&Terminal { page }, &controls, &alarms).map_err(session_failed)
}

/// SIGINT, SIGTERM and panics of any thread end in a controlled stop.
fn listen(alarms: &Arc<Alarms>, controls: &Arc<Controls>) {
    let (for_signals, view) = (Arc::clone(alarms), Arc::clone(controls));
    // Without a handler the signal ends the process, and the controllers' own time-outs stop the robots.
    let _ = ctrlc::set_handler(move || {
        for_signals.signals.fetch_add(1, Ordering::Relaxed);
        view.leave();
    });
    let (for_panics, before) = (Arc::clone(alarms), std::panic::take_hook());
    std::panic::set_hook(Box::new(move |info| {
        for_panics.panicked.store(true, Ordering::Relaxed);
        before(info);
    }));
}

/// The terminal of the command, and the page if one is served.
struct Terminal {
    page: Option<OperatorPage>,
}

impl Operator for Terminal {
    fn notice(&self, notice: &SessionNotice) {
        if notice.is_warning() { warn(notice) } else { say(notice) }
    }

    fn watch(&self, samples: Samples, budgets: Budgets, controls: &Controls) {
        let mut watch = |view: &View| self.page.iter().for_each(|page| page.board().show(view));
        if let Err(error) = show(samples, budgets, controls, &mut watch) {
            warn(format!("the view has failed ({error}); the run goes on, Ctrl-C stops it"));
        }
    }

    fn answered(&self, answer: &SessionAnswer) {
        self.page.iter().for_each(|page| page.board().finish(answer));
    }
}

/// Prints how the session ended, and compares it with the model if that is wanted.
fn report(plan: &SessionPlan, ended: &EndedSession, args: &DriveArgs) -> miette::Result<Exit> {
    if plan.task().check_only {
        return Ok(report_checks(plan, ended, args));
    }
    let cause = ended.last.cause;
    say(format!("stopped by {}: {}", cause.word(), cause.meaning()));
    if let Some(text) = ended.stop_text(plan) {
        say(format!("           {text}"));
    }
    if let Some(way) = ended.retracted {
        say(format!("           robot 1 has moved its part back by {:.1} mm", way * 1e3));
    }
    for (link, fault) in ["robot 1", "robot 2", "the sensor"].iter().zip(ended.faults) {
        if let Some(fault) = fault {
            say(format!("           {link}: {fault}"));
        }
    }
    let file = |name: &str| plan.folder().join(name).display().to_string();
    say(format!("log        {}  {} cycles, {} dropped", file("log.mcap"), ended.log_records, ended.log_records_lost));
    say(format!("evidence   {}", file("evidence.csv")));
    if let Some(refusal) = ended.refusal {
        warn(format!("{:?}", refuse("the drive did not begin", refusal)));
        return Ok(Exit::Incomplete);
    }
    if !args.no_band {
        let predicted = plan.predict(ended, args.band_runs).map_err(session_failed)?;
        say(if args.json { json(&serde_json::to_value(&predicted).into_diagnostic()?) } else { text(&predicted) });
    }
    Ok(exit(ended.outcome(plan)))
}

/// Prints the answer of `--check`.
fn report_checks(plan: &SessionPlan, ended: &EndedSession, args: &DriveArgs) -> Exit {
    if args.json {
        say(json(&serde_json::json!(ended.answer(plan))));
    } else {
        say(checklist_text(&ended.checklist));
        let checks = ended.checklist.checks();
        let count = |answer: Answer| checks.iter().filter(|check| check.answer() == answer).count();
        let [passed, failed, open] = [Answer::Passed, Answer::Failed, Answer::Open].map(count);
        say(format!("\n{passed} checks passed, {failed} failed, {open} without an answer; nothing has moved"));
    }
    if ended.outcome(plan) == SessionOutcome::Checked { Exit::Done } else { Exit::Incomplete }
}

/// The exit code of an outcome, whatever the options.
fn exit(outcome: SessionOutcome) -> Exit {
    match outcome {
        SessionOutcome::Pass | SessionOutcome::Checked => Exit::Done,
        SessionOutcome::Fail => Exit::NotVerified,
        SessionOutcome::NotCompleted | SessionOutcome::Refused => Exit::Incomplete,
    }
}

/// Verdict and metrics beside the prediction.
fn text(predicted: &PredictedAnswer) -> String {
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
