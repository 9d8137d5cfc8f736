//! Arguments of the commands that move robots, real or emulated.

use super::positive;
use clap::Args;
use softdock_realtime::links::PROTOCOLS;
use softdock_session::emulated::EmulationOptions;
use softdock_session::plan::{RunChoice, SessionMode, SessionOptions};
use softdock_session::rights::CycleRights;
use std::path::PathBuf;

/// What follows the options in the help of `drive`; the addresses are those of the protocols' table.
fn drive_help() -> String {
    let addresses = listed(PROTOCOLS.iter().flat_map(|row| row.usage_lines()));
    format!("Addresses:\n{addresses}\n{DRIVE_HELP}")
}

/// The same of `emulate`.
fn emulate_help() -> String {
    let addresses = listed(PROTOCOLS.iter().flat_map(|row| row.emulated_usage_lines()));
    format!("Addresses:\n{addresses}\n{EMULATE_HELP}")
}

fn listed(lines: impl Iterator<Item = String>) -> String {
    lines.map(|line| format!("  {line}\n")).collect()
}

const DRIVE_HELP: &str = "\
Without --arm nothing real moves: the real links are exercised, and emulated robots move in their place. With it the
robots wait for GO (the key g) once every check has passed. A stop key,
Ctrl-C or SIGTERM ends in a controlled stop, a second one in the protocol's own end at once. This is no emergency stop.

Before that, --check makes every check of the start-up on the real links and prints the list.

Exit codes: 0 the run meets every criterion of the task (or every check has passed), 1 it does not, 2 bad input, 3 it was
stopped or did not begin.

Examples:
  softdock drive campaigns/probe_drogue.toml --run 1244 --virtual
  softdock drive campaigns/probe_drogue.toml --experiment results/diagnose_probe_drogue/experiment.toml --virtual
  softdock drive campaigns/probe_drogue.toml --run 1244 --robot1 rsi://0.0.0.0:59152 --robot2 rsi://0.0.0.0:59153 \
    --ft netft://192.168.1.1 --to-start --check
  softdock drive campaigns/probe_drogue.toml --run 1244 --robot1 rsi://0.0.0.0:59152 --robot2 rsi://0.0.0.0:59153 \
    --ft netft://192.168.1.1 --to-start --arm --retract 50";

/// Arguments of `drive`.
#[derive(Args, Debug)]
#[command(after_help = drive_help())]
pub(crate) struct DriveArgs {
    /// Campaign file.
    pub(crate) campaign: PathBuf,
    /// Number of the run.
    #[arg(long, value_name = "N", required_unless_present = "experiment")]
    pub(crate) run: Option<u64>,
    /// Experiment file that a diagnosis has left: it says which run.
    #[arg(long, value_name = "FILE", conflicts_with = "run")]
    pub(crate) experiment: Option<PathBuf>,
    /// Number of this repeat of the run: emulated links have other noise in each.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    pub(crate) repeat: u64,
    /// Scenario in the place of the campaign's: the model that a diagnosis has extended.
    #[arg(long, value_name = "FILE")]
    pub(crate) model: Option<PathBuf>,
    /// Secret effects of the emulated facility: keys of the scenario that differ.
    #[arg(long, value_name = "FILE")]
    pub(crate) effects: Option<PathBuf>,
    /// Facility file in place of the one that the scenario names: with other robots or addresses, but the same rules.
    #[arg(long, value_name = "FILE")]
    pub(crate) facility: Option<PathBuf>,
    /// Robot 1, which holds part A and gives the beat.
    #[arg(long, value_name = "ADDRESS", default_value = "emulated://")]
    pub(crate) robot1: String,
    /// Robot 2, which holds part B.
    #[arg(long, value_name = "ADDRESS", default_value = "emulated://")]
    pub(crate) robot2: String,
    /// Force/torque sensor.
    #[arg(long, value_name = "ADDRESS", default_value = "emulated://")]
    pub(crate) ft: String,
    /// Ask the real robots for nothing, whatever comes; the default.
    #[arg(long, conflicts_with = "arm")]
    pub(crate) dry_run: bool,
    /// Make every check of the start-up on the links, print the list with values and limits, and move nothing.
    #[arg(long, conflicts_with_all = ["arm", "experiment"])]
    pub(crate) check: bool,
    /// Move the real robots.
    #[arg(long)]
    pub(crate) arm: bool,
    /// After a stop, move robot 1 straight back along the approach by so many millimetres, 1 to 500.
    #[arg(long, value_name = "MM", value_parser = way_back)]
    pub(crate) retract: Option<f64>,
    /// Let armed robots move as soon as every check has passed, without anybody's GO; for tests.
    #[arg(long, requires = "arm")]
    pub(crate) go_after_check: bool,
    /// Show the session in a browser on this machine, with GO and stop: address of loopback, 127.0.0.1:8765 if not given.
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, default_missing_value = softdock_session::page::DEFAULT_ADDRESS)]
    pub(crate) serve: Option<String>,
    /// Move the robots to the start of the run first, at a tenth of their limits.
    #[arg(long)]
    pub(crate) to_start: bool,
    /// In virtual time, as fast as it goes; for emulated robots alone.
    #[arg(long = "virtual")]
    pub(crate) virtual_time: bool,
    /// Real-time priority (SCHED_FIFO) of the cycle, 1 to 99; 0 asks for none.
    #[arg(long, value_name = "N", default_value_t = 80, value_parser = clap::value_parser!(u8).range(0..=99))]
    pub(crate) priority: u8,
    /// Processor core that the cycle keeps to.
    #[arg(long, value_name = "N")]
    pub(crate) core: Option<usize>,
    /// Results folder; `results/drive_ID_RUN` if not given.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Predictions behind the 95 % band.
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u64).range(20..=100_000))]
    pub(crate) band_runs: u64,
    /// Write the `rsi_ethernet.xml` that the KUKA controllers need for these addresses into a folder, and drive nothing.
    #[arg(long, value_name = "DIR")]
    pub(crate) rsi_config: Option<PathBuf>,
    /// Leave the prediction away.
    #[arg(long)]
    pub(crate) no_band: bool,
    /// Answer in JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// A way back in millimetres.
fn way_back(text: &str) -> Result<f64, String> {
    let way: f64 = text.parse().map_err(|_| "write a number of millimetres, 1 to 500".to_owned())?;
    if (1.0..=500.0).contains(&way) { Ok(way) } else { Err("write 1 to 500 millimetres".to_owned()) }
}

const EMULATE_HELP: &str = "\
It survives its clients: once a drive has ended or gone, the robots hold, the parts are released, and after one second
new sessions are offered.

An effects file holds a table [set] whose keys replace keys of the scenario: \"facility.loop_delay\" = \"9 ms\".

Example, in two terminals:
  softdock emulate campaigns/probe_drogue.toml --run 1244 --robot1 rsi://127.0.0.1:59152 --robot2 rsi://127.0.0.1:59153 \
    --ft 'netft://127.0.0.1?http=8080'
  softdock drive campaigns/probe_drogue.toml --run 1244 --robot1 rsi://127.0.0.1:59152 --robot2 rsi://127.0.0.1:59153 \
    --ft 'netft://127.0.0.1?http=8080' --to-start --arm";

/// Arguments of `emulate`.
#[derive(Args, Debug)]
#[command(after_help = emulate_help())]
pub(crate) struct EmulateArgs {
    /// Scenario file; or a campaign file, with the draw of --run.
    pub(crate) scenario: PathBuf,
    /// Draw of the campaign; without it the scenario's own values.
    #[arg(long, value_name = "N")]
    pub(crate) run: Option<u64>,
    /// Experiment file that a diagnosis has left: it says which draw of the campaign.
    #[arg(long, value_name = "FILE", conflicts_with = "run")]
    pub(crate) experiment: Option<PathBuf>,
    /// Facility file in place of the one that the scenario names.
    #[arg(long, value_name = "FILE")]
    pub(crate) facility: Option<PathBuf>,
    /// Robot 1.
    #[arg(long, value_name = "ADDRESS")]
    pub(crate) robot1: Option<String>,
    /// Robot 2.
    #[arg(long, value_name = "ADDRESS")]
    pub(crate) robot2: Option<String>,
    /// Force/torque sensor.
    #[arg(long, value_name = "ADDRESS")]
    pub(crate) ft: Option<String>,
    /// Secret effects: keys of the scenario that differ.
    #[arg(long, value_name = "FILE")]
    pub(crate) effects: Option<PathBuf>,
    /// File that gets the truth at the end: parameters and what really happened.
    #[arg(long, value_name = "FILE")]
    pub(crate) truth: Option<PathBuf>,
    /// Real-time priority (SCHED_FIFO) of the cycle, 1 to 99; 0 asks for none.
    #[arg(long, value_name = "N", default_value_t = 80, value_parser = clap::value_parser!(u8).range(0..=99))]
    pub(crate) priority: u8,
    /// Processor core that the cycle keeps to.
    #[arg(long, value_name = "N")]
    pub(crate) core: Option<usize>,
    /// Offer no new session after the first one.
    #[arg(long)]
    pub(crate) once: bool,
    /// Ends by itself after so many seconds.
    #[arg(long, value_name = "SECONDS", value_parser = positive)]
    pub(crate) seconds: Option<f64>,
}

impl DriveArgs {
    /// What is asked of the session.
    pub(crate) fn options(&self) -> SessionOptions {
        let number = RunChoice::Number(self.run.unwrap_or_default());
        let mode = match (self.check, self.arm) {
            (true, _) => SessionMode::CheckOnly,
            (false, true) => SessionMode::Armed,
            (false, false) => SessionMode::DryRun,
        };
        SessionOptions {
            campaign: self.campaign.clone(),
            model: self.model.clone(),
            facility: self.facility.clone(),
            run: self.experiment.clone().map_or(number, RunChoice::Experiment),
            repeat: self.repeat,
            effects: self.effects.clone(),
            robots: [self.robot1.clone(), self.robot2.clone()],
            sensor: self.ft.clone(),
            mode,
            retract: self.retract.map_or(0.0, |millimetres| millimetres * 1e-3),
            go_after_check: self.go_after_check,
            to_start: self.to_start,
            virtual_time: self.virtual_time,
            rights: CycleRights { priority: self.priority, core: self.core },
            out: self.out.clone(),
        }
    }
}

impl EmulateArgs {
    /// What is asked of the facility.
    pub(crate) fn options(&self) -> EmulationOptions {
        EmulationOptions {
            scenario: self.scenario.clone(),
            run: self.experiment.clone().map(RunChoice::Experiment).or(self.run.map(RunChoice::Number)),
            facility: self.facility.clone(),
            robots: [self.robot1.clone(), self.robot2.clone()],
            sensor: self.ft.clone(),
            effects: self.effects.clone(),
            once: self.once,
        }
    }

    /// Rights of the facility's thread.
    pub(crate) fn rights(&self) -> CycleRights {
        CycleRights { priority: self.priority, core: self.core }
    }
}
