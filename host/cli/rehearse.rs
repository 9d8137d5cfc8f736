//! Runs of a campaign rehearsed on emulated robots, to find the one whose drive would tell rivals of a diagnosis apart.

use crate::band::write;
use crate::found::told;
use crate::words::explain;
use miette::IntoDiagnostic;
use rayon::prelude::*;
use softdock_campaign::{Campaign, Station};
use softdock_diagnosis::block::facility::FacilityModel;
use softdock_diagnosis::diagnosis::{Diagnosis, Judged};
use softdock_diagnosis::experiment::Experiment;
use softdock_diagnosis::next_drive;
use softdock_kernels::philox;
use softdock_kernels::plant::Plant;
use softdock_realtime::drive::core::Task;
use softdock_realtime::drive::prediction::rehearse;
use softdock_realtime::log::codes::StopCause;
use softdock_realtime::time::Nanos;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Runs that are rehearsed, spread over the campaign.
const REHEARSED: u64 = 24;
/// Cycle of the emulated robots.
const CYCLE: Nanos = Nanos::from_millis(1);

/// The run to drive next, if an answer to drives of a campaign is ambiguous: of those that a rehearsal at the station
/// brings to their end.
pub(crate) fn proposed(
    campaign: &Campaign,
    station: &Path,
    diagnosis: &Diagnosis,
    judged: &[Judged],
) -> miette::Result<Option<Experiment>> {
    let station = Arc::new(Station::load(station).map_err(explain)?);
    let folder = tempfile::tempdir().into_diagnostic()?;
    let plant = Arc::new(Plant::new(campaign.scenario.model.clone()));
    let count = REHEARSED.min(campaign.runs);
    let runs: Vec<u64> = (0..count).map(|k| k * campaign.runs / count).collect();
    let rehearsed: miette::Result<Vec<Option<(u64, PathBuf)>>> = runs
        .into_par_iter()
        .map(|run| {
            let params = campaign.draw(run).params;
            let (plant, station) = (Arc::clone(&plant), Arc::clone(&station));
            let task = Task::new(plant, station, run, params);
            let log = folder.path().join(format!("{run}.parquet"));
            Ok(rehearsal(campaign, &task, &log)?.then_some((run, log)))
        })
        .collect();
    let rehearsed: Vec<(u64, PathBuf)> = rehearsed?.into_iter().flatten().collect();
    let logs: Vec<(u64, &Path)> = rehearsed.iter().map(|(run, log)| (*run, log.as_path())).collect();
    let model = FacilityModel::Campaign(Box::new(campaign.clone()));
    next_drive(&model, diagnosis, judged, &logs).map_err(told)
}

/// Drives a task on a facility as its campaign draws it, and leaves the log; whether the run came to its end. One that these
/// robots cannot begin does not.
fn rehearsal(campaign: &Campaign, task: &Task, log: &Path) -> miette::Result<bool> {
    let mut records = Vec::new();
    let key = philox::key(campaign.seed);
    let ended = rehearse(task, key, &task.params, CYCLE, &mut |record| records.push(*record));
    if !ended.is_ok_and(|ended| ended.last.cause == StopCause::Completed) {
        return Ok(false);
    }
    let said = [("campaign_hash", campaign.hash.clone()), ("run", task.run.to_string())];
    write(log, &records, &said.map(|(key, value)| (key.to_owned(), value)))?;
    Ok(true)
}
