//! `softdock replay --log`: a drive decided again from what its links brought, and its dead times.

use crate::args::ReplayArgs;
use crate::words::{Exit, explain, refuse, say};
use miette::IntoDiagnostic;
use softdock_campaign::{Campaign, Station};
use softdock_kernels::plant::Plant;
use softdock_realtime::drive::core::Task;
use softdock_realtime::drive::delay::{Delay, Response, Stated, Timing, delays};
use softdock_realtime::drive::replay::replay;
use softdock_realtime::log::reader::{Prologue, read_log};
use softdock_realtime::log::record::CycleRecord;
use softdock_realtime::signals::Capabilities;
use softdock_realtime::time::Nanos;
use std::path::PathBuf;
use std::sync::Arc;

/// Plays a log again.
pub(crate) fn replay_log(args: &ReplayArgs) -> miette::Result<Exit> {
    let path = args.log.as_ref().expect("clap asks for it");
    let log = read_log(path).into_diagnostic()?;
    if let Some(why) = &log.ends_early {
        say(format!("the log ends early ({why}): {} cycles up to there", log.records.len()));
    }
    let said = |key: &str| said(&log.prologue, key);
    let campaign = args.campaign.clone().map_or_else(|| said("campaign").map(PathBuf::from), Ok)?;
    let facility = args.facility.clone().map_or_else(|| said("facility").map(PathBuf::from), Ok)?;
    let model = args.model.clone().or_else(|| log.prologue.provenance.get("model").map(PathBuf::from));
    let campaign = Campaign::load_with(&campaign, model.as_deref()).map_err(explain)?;
    if campaign.hash != said("campaign_hash")? {
        let message = "the campaign is not the one that was driven: its text, or that of its model, has changed since";
        return Err(refuse(message, "give what was driven with --campaign and --model"));
    }
    let station = Arc::new(Station::load(&facility).map_err(explain)?);
    let (run, cycle) = (number(&said("run")?)?, Nanos(number(&said("cycle_ns")?)? as i64));
    let plant = Arc::new(Plant::new(campaign.scenario.model.clone()));
    let asked = |key: &str| log.prologue.provenance.get(key);
    let task = Task {
        armed: said("armed")? == "true",
        to_start: said("to_start")? == "true",
        check_only: asked("check_only").is_some_and(|value| value == "true"),
        retract: asked("retract_m").map_or(Ok(0.0), |value| real(value))?,
        ..Task::new(plant, station, run, campaign.draw(run).params)
    };
    let robot = Capabilities { cycle, master: true, rail: true, torque: false, pose: true };
    let replayed = replay(task, [robot; 2], log.records.iter().copied()).into_diagnostic()?;
    tell_delays(&log.records, cycle);
    match &replayed.first {
        None => {
            say(format!("{} cycles: equal, bit for bit", replayed.cycles));
            Ok(Exit::Done)
        }
        Some(difference) => {
            say(format!("{} of {} cycles equal; the first that is not: {difference}", replayed.equal, replayed.cycles));
            Ok(Exit::NotVerified)
        }
    }
}

/// Dead time between command and motion, whatever the protocol states left aside.
fn tell_delays(records: &[CycleRecord], cycle: Nanos) {
    let stated = [Stated::one_cycle(cycle); 2];
    let found = delays(records, stated, Timing::Robot, [Response::Second; 2]);
    for (robot, delay) in found.iter().enumerate() {
        let Some(Delay { dead_time, error, .. }) = delay else {
            continue;
        };
        let slow = delay.as_ref().map_or(0.0, Delay::of_slow_motion);
        say(format!(
            "robot {}    dead time {:.2} +- {:.2} ms beyond one cycle; slow motion comes {:.2} ms late",
            robot + 1,
            dead_time * 1e3,
            error * 1e3,
            slow * 1e3
        ));
    }
}

fn said(prologue: &Prologue, key: &str) -> miette::Result<String> {
    let message = || refuse(format!("the log does not say its `{key}`"), "it was not written by `softdock drive`");
    prologue.provenance.get(key).cloned().ok_or_else(message)
}

fn real(text: &str) -> miette::Result<f64> {
    text.parse().map_err(|_| refuse(format!("`{text}` is no number"), "the log's metadata are damaged"))
}

fn number(text: &str) -> miette::Result<u64> {
    text.parse().map_err(|_| refuse(format!("`{text}` is no number"), "the log's metadata are damaged"))
}
