//! `softdock drive` and `emulate`: sessions on real or emulated robots.

use crate::progress::Terminal;
use crate::session_terminal::{SessionTerminal, handle_alarms};
use crate::terminal::{Exit, Failure, Format, Outcome, print, readable, warn, write_file};
use crate::values::positive;
use clap::Args;
use serde_json::json;
use softdock_realtime::drive::controls::Controls;
use softdock_realtime::drive::runner::Alarms;
use softdock_realtime::links::PROTOCOLS;
use softdock_session::answer::EndedSession;
use softdock_session::emulated::{EmulationNotice, EmulationOptions, FacilityEmulator};
use softdock_session::page::{DEFAULT_ADDRESS, OperatorPage};
use softdock_session::plan::{RunChoice, SessionMode, SessionOptions, SessionPlan, parse_retraction};
use softdock_session::rights::CycleRights;
use softdock_session::terminal_text::checks_text;
use std::io::IsTerminal;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Joins the address lines of the protocol table with the rest of a help text.
fn help(addresses: impl Iterator<Item = String>, rest: &str) -> String {
    let addresses: String = addresses.map(|line| format!("  {line}\n")).collect();
    format!("Addresses:\n{addresses}\n{rest}")
}

const DRIVE_HELP: &str = "\
Without --arm no real robot moves: the real links are exercised, and emulated robots move in their place. With --arm
the robots wait for GO (key g) until every check has passed. A stop key, Ctrl-C or SIGTERM causes a controlled stop; a
second one ends the protocol session at once. This is no emergency stop.

Before that, --check makes every check of the start-up on the real links and prints the list.

Exit codes: 0 the run meets every criterion of the task (or every check has passed), 1 it does not, 2 bad input, 3 the
session was stopped or refused.

Examples:
  softdock drive campaigns/probe_drogue.toml --run 1244 --virtual
  softdock drive campaigns/probe_drogue.toml --experiment results/diagnose_probe_drogue/experiment.toml --virtual
  softdock drive campaigns/probe_drogue.toml --run 1244 --robot1 rsi://0.0.0.0:59152 --robot2 rsi://0.0.0.0:59153 \
    --ft netft://192.168.1.1 --to-start --check
  softdock drive campaigns/probe_drogue.toml --run 1244 --robot1 rsi://0.0.0.0:59152 --robot2 rsi://0.0.0.0:59153 \
    --ft netft://192.168.1.1 --to-start --arm --retract 50";

/// Drive one run of a campaign on real or emulated robots, and compare it with the model's prediction.
#[derive(Args, Debug)]
#[command(after_help = help(PROTOCOLS.iter().flat_map(|row| row.usage_lines()), DRIVE_HELP))]
pub(crate) struct DriveArgs {
    /// Campaign file.
    campaign: PathBuf,
    /// Number of the run.
    #[arg(long, value_name = "N", required_unless_present = "experiment")]
    run: Option<u64>,
    /// Experiment file of a diagnosis; it states the run.
    #[arg(long, value_name = "FILE", conflicts_with = "run")]
    experiment: Option<PathBuf>,
    /// Number of this repeat of the run: emulated links have other noise in each.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    repeat: u64,
    /// Scenario file in place of the campaign's: a model that a diagnosis has extended.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Hidden effects of the emulated facility: keys of the scenario that differ.
    #[arg(long, value_name = "FILE")]
    effects: Option<PathBuf>,
    /// Facility file in place of the scenario's: other robots or addresses, the same rules.
    #[arg(long, value_name = "FILE")]
    facility: Option<PathBuf>,
    /// Robot 1, which holds part A and is the clock master.
    #[arg(long, value_name = "ADDRESS", default_value = "emulated://")]
    robot1: String,
    /// Robot 2, which holds part B.
    #[arg(long, value_name = "ADDRESS", default_value = "emulated://")]
    robot2: String,
    /// Force/torque sensor.
    #[arg(long, value_name = "ADDRESS", default_value = "emulated://")]
    ft: String,
    /// Command no motion of the real robots (the default).
    #[arg(long, conflicts_with = "arm")]
    dry_run: bool,
    /// Make every check of the start-up on the links, print the list with values and limits, and move nothing.
    #[arg(long, conflicts_with_all = ["arm", "experiment"])]
    check: bool,
    /// Move the real robots.
    #[arg(long)]
    arm: bool,
    /// After a stop, retract robot 1 straight along the approach by this distance, 1 to 500 mm.
    #[arg(long, value_name = "MM", value_parser = parse_retraction)]
    retract: Option<f64>,
    /// Start the motion of armed robots as soon as every check has passed, without GO; for tests.
    #[arg(long, requires = "arm")]
    go_after_check: bool,
    /// Show the session in a browser on this machine, with GO and stop: address of loopback, 127.0.0.1:8765 if not given.
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, default_missing_value = DEFAULT_ADDRESS)]
    serve: Option<String>,
    /// Move the robots to the start of the run first, at a tenth of their limits.
    #[arg(long)]
    to_start: bool,
    /// Run in virtual time, as fast as possible; emulated robots only.
    #[arg(long = "virtual")]
    virtual_time: bool,
    #[command(flatten)]
    cycle: CycleArgs,
    /// Results folder; `results/drive_ID_RUN` if not given.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Number of predictions behind the 95 % interval.
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u64).range(20..=100_000))]
    band_runs: u64,
    /// Write the `rsi_ethernet.xml` that the KUKA controllers need for these addresses into a folder, and drive nothing.
    #[arg(long, value_name = "DIR")]
    rsi_config: Option<PathBuf>,
    /// Skip the prediction.
    #[arg(long)]
    no_band: bool,
}

/// Rights of the real-time cycle.
#[derive(Args, Debug)]
struct CycleArgs {
    /// Real-time priority (SCHED_FIFO) of the cycle, 1 to 99; 0 requests none.
    #[arg(long, value_name = "N", default_value_t = 80, value_parser = clap::value_parser!(u8).range(0..=99))]
    priority: u8,
    /// Processor core to which the cycle is pinned.
    #[arg(long, value_name = "N")]
    core: Option<usize>,
}

fn session_options(args: &DriveArgs) -> SessionOptions {
    let number = RunChoice::Number(args.run.unwrap_or_default());
    SessionOptions {
        campaign: args.campaign.clone(),
        model: args.model.clone(),
        facility: args.facility.clone(),
        run: args.experiment.clone().map_or(number, RunChoice::Experiment),
        repeat: args.repeat,
        effects: args.effects.clone(),
        robots: [args.robot1.clone(), args.robot2.clone()],
        sensor: args.ft.clone(),
        mode: SessionMode::new(args.check, args.arm),
        retract: args.retract.unwrap_or(0.0),
        go_after_check: args.go_after_check,
        to_start: args.to_start,
        virtual_time: args.virtual_time,
        rights: CycleRights { priority: args.cycle.priority, core: args.cycle.core },
        out: args.out.clone(),
    }
}

pub(crate) fn drive(args: &DriveArgs, format: &Format) -> Outcome {
    let plan = SessionPlan::new(session_options(args))?;
    plan.repeat_warning().iter().for_each(warn);
    if let Some(folder) = &args.rsi_config {
        let files = plan.write_configurations(folder, &|notice| warn(notice))?;
        let lines = || files.iter().map(|path| format!("{}\n", path.display())).collect();
        format.print(|| json!({ "files": files }), lines);
        return Ok(Exit::Done);
    }
    plan.check_folder()?;
    let is_terminal = std::io::stdin().is_terminal() && std::io::stdout().is_terminal();
    if args.arm && !args.go_after_check && args.serve.is_none() && !is_terminal {
        let remedy = "run it in a terminal, where the key g is GO, or add --serve or --go-after-check";
        return Err(Failure::new("an armed session needs a terminal or a page for GO", remedy));
    }
    if format.json {
        warn(plan.text())
    } else {
        print(plan.text())
    }
    let ended = run(&plan, args.serve.as_deref(), format.json)?;
    report(&plan, &ended, args, format)
}

/// Runs the session with the terminal as its operator, and a web page if requested.
fn run(plan: &SessionPlan, page: Option<&str>, is_json: bool) -> Result<EndedSession, Failure> {
    let controls = Arc::new(Controls::default());
    let page = page.map(|address| OperatorPage::serve(address, &controls, plan)).transpose()?;
    if let Some(page) = &page {
        let line = format!("  page      http://{}/", page.address());
        if is_json { warn(line) } else { print(line) }
    }
    let alarms = Arc::new(Alarms::default());
    handle_alarms(&alarms, &controls);
    Ok(plan.run(&SessionTerminal { page, is_json }, &controls, &alarms)?)
}

/// Prints the end of the session, and compares it with the prediction; returns the exit code.
fn report(plan: &SessionPlan, ended: &EndedSession, args: &DriveArgs, format: &Format) -> Outcome {
    let exit = Exit::of_code(ended.outcome(plan).exit_code());
    if plan.task().check_only {
        format.print(|| json!(ended.answer(plan)), || checks_text(&ended.checklist));
        return Ok(exit);
    }
    if !format.json {
        print(ended.text(plan));
    }
    if let Some(refusal) = ended.refusal {
        warn(Failure::new("the session was refused", refusal).detail());
        format.print(|| json!(ended.answer(plan)), String::new);
        return Ok(exit);
    }
    if args.no_band {
        format.print(|| json!(ended.answer(plan)), String::new);
        return Ok(exit);
    }
    let terminal = Terminal::new("prediction");
    let predicted = plan.predict(ended, args.band_runs)?;
    terminal.end();
    format.print(|| json!(predicted), || predicted.text());
    Ok(exit)
}

const EMULATE_HELP: &str = "\
The emulator outlives its clients: after a session ends or its client disconnects, the robots hold, the parts are
released, and after one second new sessions are offered.

An effects file holds a table [set] whose keys replace keys of the scenario: \"facility.loop_delay\" = \"9 ms\".

Example, in two terminals:
  softdock emulate campaigns/probe_drogue.toml --run 1244 --robot1 rsi://127.0.0.1:59152 --robot2 rsi://127.0.0.1:59153 \
    --ft 'netft://127.0.0.1?http=8080'
  softdock drive campaigns/probe_drogue.toml --run 1244 --robot1 rsi://127.0.0.1:59152 --robot2 rsi://127.0.0.1:59153 \
    --ft 'netft://127.0.0.1?http=8080' --to-start --arm";

/// Emulate the facility: two robots and a sensor behind their real protocols.
#[derive(Args, Debug)]
#[command(after_help = help(PROTOCOLS.iter().flat_map(|row| row.emulated_usage_lines()), EMULATE_HELP))]
pub(crate) struct EmulateArgs {
    /// Scenario file; or a campaign file, with the draw of --run.
    scenario: PathBuf,
    /// Draw of the campaign; the scenario's own values if not given.
    #[arg(long, value_name = "N")]
    run: Option<u64>,
    /// Experiment file of a diagnosis; it states the draw of the campaign.
    #[arg(long, value_name = "FILE", conflicts_with = "run")]
    experiment: Option<PathBuf>,
    /// Facility file in place of the scenario's.
    #[arg(long, value_name = "FILE")]
    facility: Option<PathBuf>,
    /// Robot 1.
    #[arg(long, value_name = "ADDRESS")]
    robot1: Option<String>,
    /// Robot 2.
    #[arg(long, value_name = "ADDRESS")]
    robot2: Option<String>,
    /// Force/torque sensor.
    #[arg(long, value_name = "ADDRESS")]
    ft: Option<String>,
    /// Hidden effects: keys of the scenario that differ.
    #[arg(long, value_name = "FILE")]
    effects: Option<PathBuf>,
    /// File for the true parameters and events, written at the end.
    #[arg(long, value_name = "FILE")]
    truth: Option<PathBuf>,
    #[command(flatten)]
    cycle: CycleArgs,
    /// Offer no new session after the first one.
    #[arg(long)]
    once: bool,
    /// End after this many seconds.
    #[arg(long, value_name = "SECONDS", value_parser = positive)]
    seconds: Option<f64>,
}

/// Printed when the emulator listens.
const RUNS: &str = "the emulated facility runs; Ctrl-C ends it";

pub(crate) fn emulate(args: &EmulateArgs, format: &Format) -> Outcome {
    let options = EmulationOptions {
        scenario: args.scenario.clone(),
        run: args.experiment.clone().map(RunChoice::Experiment).or(args.run.map(RunChoice::Number)),
        facility: args.facility.clone(),
        robots: [args.robot1.clone(), args.robot2.clone()],
        sensor: args.ft.clone(),
        effects: args.effects.clone(),
        once: args.once,
    };
    let is_json = format.json;
    let report = |notice: EmulationNotice| if notice.is_warning() || is_json { warn(notice) } else { print(notice) };
    let facility = FacilityEmulator::open(&options, &report)?;
    let stop = Arc::new(AtomicBool::new(false));
    let on_signal = Arc::clone(&stop);
    ctrlc::set_handler(move || on_signal.store(true, Ordering::Relaxed)).map_err(Failure::of)?;
    if is_json {
        warn(RUNS)
    } else {
        print(RUNS)
    }
    let rights = CycleRights { priority: args.cycle.priority, core: args.cycle.core };
    let summary = facility.serve(rights, args.seconds, &stop, &report)?;
    if let Some(path) = &args.truth {
        write_file(path, readable(&json!(summary.truth)).as_bytes())?;
    }
    format.print(|| json!({ "text": summary.text(), "truth_file": args.truth }), || summary.text());
    Ok(Exit::Done)
}
