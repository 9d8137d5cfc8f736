//! `softdock drive`: one run on real or emulated robots, and its metrics beside what the model predicts.

mod terminal;
mod text;

use crate::args::DriveArgs;
use crate::reports::session_failed;
use crate::words::{Exit, json, refuse, say, warn};
use miette::IntoDiagnostic;
use softdock_realtime::drive::controls::Controls;
use softdock_realtime::drive::runner::Alarms;
use softdock_session::answer::{EndedSession, SessionOutcome};
use softdock_session::page::OperatorPage;
use softdock_session::plan::SessionPlan;
use std::fs;
use std::io::IsTerminal;
use std::path::Path;
use std::sync::Arc;
use terminal::{Terminal, listen};
use text::{checks_text, end_text, plan_text, prediction_text};

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
    say(plan_text(&plan));
    let ended = run(&plan, args.serve.as_deref())?;
    report(&plan, &ended, args)
}

/// Writes the files that controllers need for these addresses.
fn write_configurations(plan: &SessionPlan, folder: &Path) -> miette::Result<Exit> {
    let files = plan.addresses().configurations(&plan.task().station, &|notice| warn(notice));
    let files = files.map_err(session_failed)?;
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

/// Prints how the session ended, and compares it with the model if that is wanted.
fn report(plan: &SessionPlan, ended: &EndedSession, args: &DriveArgs) -> miette::Result<Exit> {
    if plan.task().check_only {
        return Ok(report_checks(plan, ended, args));
    }
    say(end_text(plan, ended));
    if let Some(refusal) = ended.refusal {
        warn(format!("{:?}", refuse("the drive did not begin", refusal)));
        return Ok(Exit::Incomplete);
    }
    if !args.no_band {
        let predicted = plan.predict(ended, args.band_runs).map_err(session_failed)?;
        say(if args.json {
            json(&serde_json::to_value(&predicted).into_diagnostic()?)
        } else {
            prediction_text(&predicted)
        });
    }
    Ok(exit(ended.outcome(plan)))
}

/// Prints the answer of `--check`.
fn report_checks(plan: &SessionPlan, ended: &EndedSession, args: &DriveArgs) -> Exit {
    say(if args.json { json(&serde_json::json!(ended.answer(plan))) } else { checks_text(&ended.checklist) });
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
