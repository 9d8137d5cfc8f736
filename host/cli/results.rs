//! `softdock status`, `verify`, `merge`, `compare`, `judge`, `report` and `replay`: results folders and logs.

use crate::progress::Terminal;
use crate::terminal::{Exit, Format, Outcome, print, warn};
use clap::Args;
use serde_json::{Value, json};
use softdock_campaign::Campaign;
use softdock_farm::{Ended, Shown, Verification, compare_folders, replay_run, results_of};
use softdock_session::replay::{ReplayFiles, SessionLog};
use std::path::{Path, PathBuf};

/// Prints the result of a campaign function and why it is incomplete; returns the exit code.
pub(crate) fn show(ended: &Ended, format: &Format) -> Outcome {
    format.print(|| ended.shown.json(), || ended.shown.text());
    if let (Some(page), false) = (ended.page(), format.json) {
        let name = if matches!(ended.shown, Shown::Variants(_)) { "comparison" } else { "\nreport" };
        print(format!("{name}  {}", page.display()));
    }
    ended.incomplete.iter().for_each(warn);
    Ok(Exit::of_code(ended.exit_code()))
}

/// Report the progress of a campaign and its results so far.
#[derive(Args, Debug)]
#[command(after_help = "--json prints the summary.\n\nExample:\n  softdock status results/probe_drogue")]
pub(crate) struct StatusArgs {
    /// Results folder, or campaign file (then `results/ID`).
    path: PathBuf,
}

pub(crate) fn status(args: &StatusArgs, format: &Format) -> Outcome {
    let results = results_of(&args.path, None)?;
    let terminal = Terminal::new("status");
    let status = softdock_farm::status(&results)?;
    terminal.end();
    format.print(|| status.shown.json(), || status.shown.text());
    status.notes(&results).iter().for_each(warn);
    Ok(Exit::of_code(status.shown.exit_code()))
}

/// Compare every file of a results folder with its stated hash, and summary and page with the runs.
#[derive(Args, Debug)]
#[command(after_help = "\
Exit codes: 0 every file verified, 1 a file differs, 2 bad input, 3 a file is missing.

Example:
  softdock verify results/probe_drogue")]
pub(crate) struct VerifyArgs {
    /// Results folder.
    #[arg(value_name = "DIR")]
    results: PathBuf,
}

pub(crate) fn verify(args: &VerifyArgs, format: &Format) -> Outcome {
    let terminal = Terminal::new("verify");
    let verified = softdock_farm::verify(&args.results)?;
    terminal.end();
    let json = || verified.iter().map(Verification::json).collect::<Value>();
    format.print(json, || verified.iter().map(|folder| folder.text() + "\n").collect());
    Ok(Exit::of_code(Verification::worst_exit_code(&verified)))
}

/// Merge the results folders of several workers into one, and judge them.
#[derive(Args, Debug)]
#[command(after_help = "Example:\n  softdock merge results/dock worker1/dock worker2/dock")]
pub(crate) struct MergeArgs {
    /// Folder that receives the whole campaign.
    out: PathBuf,
    /// Results folders of the parts.
    #[arg(required = true, value_name = "DIR")]
    parts: Vec<PathBuf>,
}

pub(crate) fn merge(args: &MergeArgs, format: &Format) -> Outcome {
    let ended = softdock_farm::merge(&args.parts, &args.out, Terminal::new("merge").context())?;
    show(&ended, format)
}

/// Compare two results folders: failures, rates, runs that changed, metrics, and keys that differ.
#[derive(Args, Debug)]
#[command(after_help = "\
Runs with the same number are compared in pairs where both folders have the same seed; else the folders are two
independent samples. Differences are those of the second folder less the first.

Exit codes: 0 compared, 2 bad input, 3 compared, but a folder is incomplete.

Example:
  softdock compare results/probe_drogue results/probe_drogue_soft")]
pub(crate) struct CompareArgs {
    /// First results folder.
    #[arg(value_name = "A")]
    first: PathBuf,
    /// Second results folder.
    #[arg(value_name = "B")]
    second: PathBuf,
}

pub(crate) fn compare(args: &CompareArgs, format: &Format) -> Outcome {
    let terminal = Terminal::new("compare");
    let compared = compare_folders(&args.first, &args.second)?;
    terminal.end();
    format.print(|| compared.json(), || compared.text());
    Ok(if compared.is_complete() { Exit::Done } else { Exit::Incomplete })
}

/// Judge finished runs by other criteria, metrics and requirements, without new runs.
#[derive(Args, Debug)]
#[command(after_help = "\
May change: [[requirement]], [[metric]], [traces], [contact_events], [compare], titles and sources of a campaign, what an
invalid run counts as, and the criteria of the scenario's [task]. Any other change is refused with its keys: it needs new
runs. The change is recorded in campaign.json and on the page. Only the runs with traces or contact events and the repeated
runs are stepped.
--json prints the summary.

Exit codes: as `run`.

Example:
  softdock judge results/probe_drogue campaigns/probe_drogue.toml")]
pub(crate) struct JudgeArgs {
    /// Results folder.
    #[arg(value_name = "DIR")]
    results: PathBuf,
    /// Campaign file with the criteria and requirements; that of the folder if not given.
    campaign: Option<PathBuf>,
    /// Scenario file in place of the campaign's, if the runs were made with one.
    #[arg(long, value_name = "FILE", requires = "campaign")]
    model: Option<PathBuf>,
}

pub(crate) fn judge(args: &JudgeArgs, format: &Format) -> Outcome {
    let load = |file: &PathBuf| Campaign::load_with(file, args.model.as_deref());
    let campaign = args.campaign.as_ref().map(load).transpose()?;
    let ended = softdock_farm::judge(&args.results, campaign, Terminal::new("judge").context())?;
    show(&ended, format)
}

/// Write summary and report page of a results folder again.
#[derive(Args, Debug)]
#[command(after_help = "Example:\n  softdock report results/probe_drogue")]
pub(crate) struct ReportArgs {
    /// Results folder, or campaign file (then `results/ID`).
    path: PathBuf,
    /// Results folder of the campaign file, if it is not `results/ID`.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

pub(crate) fn report(args: &ReportArgs, format: &Format) -> Outcome {
    let terminal = Terminal::new("report");
    let ended = softdock_farm::report(&results_of(&args.path, args.out.as_deref())?)?;
    terminal.end();
    let files = ended.report_files();
    let lines = || files.iter().map(|file| format!("{}\n", file.display())).collect();
    format.print(|| json!({ "files": files, "exit_code": ended.shown.exit_code() }), lines);
    Ok(Exit::of_code(ended.shown.exit_code()))
}

/// Repeat one run of a results folder, or the log of a session, and compare it bit by bit.
#[derive(Args, Debug)]
#[command(after_help = "\
Exit code 0: the row is the same, or was computed in f32 and is compared with f64; 1: the row differs where it must not.

Example:
  softdock replay results/smoke 17 --out run17.parquet")]
pub(crate) struct ReplayArgs {
    /// Results folder.
    #[arg(required_unless_present = "log")]
    results: Option<PathBuf>,
    /// Number of the run.
    #[arg(required_unless_present = "log")]
    run: Option<u64>,
    /// Log of a session; its decisions are computed again from the received data, cycle by cycle.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["results", "run", "out"])]
    log: Option<PathBuf>,
    /// Campaign file of the log; the path that the log states if not given.
    #[arg(long, value_name = "FILE", requires = "log")]
    campaign: Option<PathBuf>,
    /// Scenario file in place of the campaign's; the session's own if not given.
    #[arg(long, value_name = "FILE", requires = "log")]
    model: Option<PathBuf>,
    /// Facility file of the log; the path that the log states if not given.
    #[arg(long, value_name = "FILE", requires = "log")]
    facility: Option<PathBuf>,
    /// File of the time history; `DIR/replays/run=N.parquet` if not given.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

pub(crate) fn replay(args: &ReplayArgs, format: &Format) -> Outcome {
    let (Some(results), Some(run)) = (&args.results, args.run) else {
        return replay_log(args, args.log.as_ref().expect("clap requires it"), format);
    };
    let terminal = Terminal::new("replay");
    let replayed = replay_run(results, run, args.out.as_deref())?;
    terminal.end();
    let json = || {
        let is_equal = replayed.differences.is_empty();
        json!({
            "run": replayed.run, "is_equal": is_equal, "is_f64": replayed.is_f64,
            "differences": replayed.differences, "history": replayed.history,
        })
    };
    format.print(json, || replayed.text());
    Ok(if replayed.is_wrong() { Exit::NotVerified } else { Exit::Done })
}

fn replay_log(args: &ReplayArgs, log: &Path, format: &Format) -> Outcome {
    let terminal = Terminal::new("replay");
    let log = SessionLog::read(log)?;
    let early = log.ends_early().map(ToString::to_string);
    if let Some(reason) = &early {
        warn(format!("the log ends early ({reason}): {} cycles up to there", log.cycles()));
    }
    let (campaign, model, facility) = (args.campaign.clone(), args.model.clone(), args.facility.clone());
    let replay = log.replay(&ReplayFiles { campaign, model, facility })?;
    terminal.end();
    let json =
        || json!({ "is_equal": replay.is_equal(), "cycles": log.cycles(), "ends_early": early, "text": replay.text() });
    format.print(json, || replay.text());
    Ok(if replay.is_equal() { Exit::Done } else { Exit::NotVerified })
}
