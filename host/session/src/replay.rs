//! Replays the log of a session, and identifies the dead times of its robots.

use crate::error::{Result, SessionError};
use softdock_campaign::{Campaign, Station};
use softdock_kernels::plant::Plant;
use softdock_realtime::drive::core::SessionTask;
use softdock_realtime::drive::delay::{DeadTime, DelayClock, ProtocolTiming, ServoResponse, delays};
use softdock_realtime::drive::replay::{Replayed, replay};
use softdock_realtime::log::reader::{Log, read_log};
use softdock_realtime::signals::Capabilities;
use softdock_realtime::time::Nanos;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Files in place of those that the log names.
#[derive(Clone, Debug, Default)]
pub struct ReplayFiles {
    /// Campaign file.
    pub campaign: Option<PathBuf>,
    /// Scenario file in place of the campaign's.
    pub model: Option<PathBuf>,
    /// Facility file.
    pub facility: Option<PathBuf>,
}

/// The log of a session.
#[derive(Debug)]
pub struct SessionLog {
    log: Log,
}

/// A replayed log.
#[derive(Debug)]
pub struct ReplayedLog {
    /// Number of equal cycles, and the first difference.
    pub replayed: Replayed,
    /// Dead time between command and motion of robots 1 and 2, beyond one cycle.
    pub delays: [Option<DeadTime>; 2],
}

impl SessionLog {
    /// Reads a log.
    ///
    /// # Errors
    /// If it is not the log of a session.
    pub fn read(path: &Path) -> Result<Self> {
        Ok(Self { log: read_log(path)? })
    }

    /// Returns the number of cycles.
    pub fn cycles(&self) -> usize {
        self.log.records.len()
    }

    /// Returns why the log ends early, if it does.
    pub fn ends_early(&self) -> Option<&str> {
        self.log.ends_early.as_deref()
    }

    /// Replays the log with the campaign and the facility that it names, or the given ones.
    ///
    /// # Errors
    /// If a file cannot be used, differs from that of the session, or the log does not state its session.
    pub fn replay(&self, files: &ReplayFiles) -> Result<ReplayedLog> {
        let stated = |key: &str| self.stated(key);
        let campaign = files.campaign.clone().map_or_else(|| stated("campaign").map(PathBuf::from), Ok)?;
        let facility = files.facility.clone().map_or_else(|| stated("facility").map(PathBuf::from), Ok)?;
        let optional = |key: &str| self.log.prologue.provenance.get(key);
        let model = files.model.clone().or_else(|| optional("model").map(PathBuf::from));
        let campaign = Campaign::load_with(&campaign, model.as_deref())?;
        campaign.refuse_for("a session")?;
        if campaign.hash != stated("campaign_hash")? {
            return Err(SessionError::refused(
                "the campaign differs from that of the session: its text, or that of its model, has changed",
                "name the original files with --campaign and --model",
            ));
        }
        let station = Arc::new(Station::load(&facility)?);
        let (run, cycle) = (number(&stated("run")?)?, Nanos(number::<u64>(&stated("cycle_ns")?)? as i64));
        let plant = Arc::new(Plant::new(campaign.scenario.model.clone()));
        let task = SessionTask {
            armed: stated("armed")? == "true",
            to_start: stated("to_start")? == "true",
            check_only: optional("check_only").is_some_and(|value| value == "true"),
            retract: optional("retract_m").map_or(Ok(0.0), |value| number(value))?,
            ..SessionTask::new(plant, station, run, campaign.draw(run)?.params)
        };
        let robot = Capabilities { cycle, master: true, rail: true, torque: false, pose: true };
        let replayed = replay(task, [robot; 2], self.log.records.iter().copied())?;
        let stated = [ProtocolTiming::one_cycle(cycle); 2];
        let delays = delays(&self.log.records, stated, DelayClock::Robot, [ServoResponse::Second; 2]);
        Ok(ReplayedLog { replayed, delays })
    }

    /// Returns a value that the log states of its session.
    fn stated(&self, key: &str) -> Result<String> {
        let missing = || {
            let remedy = "it was not written by `softdock drive`";
            SessionError::refused(format!("the log does not state its `{key}`"), remedy)
        };
        self.log.prologue.provenance.get(key).cloned().ok_or_else(missing)
    }
}

fn number<T: std::str::FromStr>(text: &str) -> Result<T> {
    let damaged = |_| SessionError::refused(format!("`{text}` is not a number"), "the log's metadata are damaged");
    text.parse().map_err(damaged)
}
