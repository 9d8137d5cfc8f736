//! Rehearses draws of a campaign on emulated robots, in process and in virtual time, with their logs.

use crate::error::Result;
use crate::files::write_records;
use rayon::prelude::*;
use softdock_campaign::{Campaign, Station};
use softdock_kernels::philox;
use softdock_kernels::plant::Plant;
use softdock_realtime::drive::core::SessionTask;
use softdock_realtime::drive::prediction::rehearse;
use softdock_realtime::log::codes::StopCause;
use softdock_realtime::time::Nanos;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Number of rehearsed runs, spread over the campaign.
const REHEARSED: u64 = 24;
/// Cycle of the emulated robots.
const CYCLE: Nanos = Nanos::from_millis(1);

/// A completed rehearsal of a run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RehearsedRun {
    /// Number of the run.
    pub run: u64,
    /// Its log, as Parquet.
    pub log: PathBuf,
}

/// Rehearses runs of a campaign at a facility and writes the logs of the completed ones into a folder.
///
/// # Errors
/// If the facility file cannot be used or a log cannot be written.
pub fn rehearse_runs(campaign: &Campaign, facility: &Path, folder: &Path) -> Result<Vec<RehearsedRun>> {
    campaign.refuse_for("a rehearsal")?;
    let station = Arc::new(Station::load(facility)?);
    let plant = Arc::new(Plant::new(campaign.scenario.model.clone()));
    let count = REHEARSED.min(campaign.runs);
    let runs: Vec<u64> = (0..count).map(|k| k * campaign.runs / count).collect();
    let rehearsed: Result<Vec<Option<RehearsedRun>>> = runs
        .into_par_iter()
        .map(|run| {
            let params = campaign.draw(run)?.params;
            let task = SessionTask::new(Arc::clone(&plant), Arc::clone(&station), run, params);
            let log = folder.join(format!("{run}.parquet"));
            Ok(is_completed(campaign, &task, &log)?.then_some(RehearsedRun { run, log }))
        })
        .collect();
    Ok(rehearsed?.into_iter().flatten().collect())
}

/// Rehearses a run and writes its log; returns false if it does not complete or cannot begin on these robots.
fn is_completed(campaign: &Campaign, task: &SessionTask, log: &Path) -> Result<bool> {
    let mut records = Vec::new();
    let key = philox::key(campaign.seed);
    let ended = rehearse(task, key, &task.params, CYCLE, &mut |record| records.push(*record));
    if !ended.is_ok_and(|ended| ended.last.cause == StopCause::Completed) {
        return Ok(false);
    }
    let metadata = [("campaign_hash", campaign.hash.clone()), ("run", task.run.to_string())];
    write_records(log, &records, &metadata.map(|(key, value)| (key.to_owned(), value)))?;
    Ok(true)
}
