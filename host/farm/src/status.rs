//! Progress of a campaign, and rewriting of its summary and page.

use crate::error::{FarmError, Result};
use crate::finish::write_summary_and_page;
use crate::folder::ResultsFolder;
use crate::outcome::{Ended, Shown};
use crate::slurm::slurm_state;
use crate::variants;
use softdock_analysis::summary::SUMMARY_SCHEMA;
use softdock_analysis::{RunningSummary, Summary, summarise_folder};
use softdock_input::{MAX_TEXT, read_text};
use softdock_results::partial::partial_runs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Progress of a campaign.
#[derive(Clone, Debug)]
pub struct FolderStatus {
    /// Result of its folder so far.
    pub shown: Shown,
    /// Finished runs of unfinished shards, from which `run` resumes.
    pub partial_runs: u64,
    /// Whether the result is that of the written summary, without a look at the runs.
    pub is_as_written: bool,
}

/// Reads the progress of the campaign of a results folder, without writing.
///
/// # Errors
/// If the folder cannot be read.
pub fn status(results: &Path) -> Result<FolderStatus> {
    whole_status(&ResultsFolder::open(results)?)
}

/// Reads every run.
fn whole_status(folder: &ResultsFolder) -> Result<FolderStatus> {
    let shown = match folder.campaign.variants.is_empty() {
        true => Shown::Campaign(Box::new(summarise_folder(&folder.path, &folder.facts())?)),
        false => Shown::Variants(Box::new(variants::compared(folder)?)),
    };
    Ok(FolderStatus { shown, partial_runs: partial_runs(&folder.path)?, is_as_written: false })
}

/// Progress of a results folder that is asked for again and again.
///
/// The written summary of a complete campaign is taken as it is, unless runs are newer; otherwise only new shards are
/// read, so that the answer is fast for any number of runs.
#[derive(Default)]
pub struct FolderWatch {
    running: RunningSummary,
}

impl FolderWatch {
    /// Reads the progress, without writing.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub fn status(&mut self, results: &Path) -> Result<FolderStatus> {
        let folder = ResultsFolder::open(results)?;
        if !folder.campaign.variants.is_empty() {
            return whole_status(&folder);
        }
        let partial_runs = partial_runs(&folder.path)?;
        if let Some(summary) = written_summary(&folder) {
            return Ok(FolderStatus { shown: Shown::Campaign(Box::new(summary)), partial_runs, is_as_written: true });
        }
        let summary = self.running.renew(&folder.path, &folder.facts())?;
        Ok(FolderStatus { shown: Shown::Campaign(Box::new(summary)), partial_runs, is_as_written: false })
    }
}

/// The summary of a complete campaign as the folder states it, if it is of this campaign and no runs are newer.
fn written_summary(folder: &ResultsFolder) -> Option<Summary> {
    let path = folder.path.join("summary.json");
    let written = changed(&path)?;
    let runs = folder.path.join("runs");
    // Equal times may stand in either order. A file that was deleted changes the folder's own time.
    let is_older = |path: &Path| changed(path).is_some_and(|runs| runs < written);
    let are_older = is_older(&runs) && std::fs::read_dir(&runs).ok()?.flatten().all(|entry| is_older(&entry.path()));
    let text = read_text(&path, MAX_TEXT).ok().filter(|_| are_older)?;
    let summary: Summary = serde_json::from_str(&text).ok()?;
    let facts = folder.facts();
    let is_of_campaign = (summary.schema.as_str(), summary.campaign_hash.as_str(), summary.seed)
        == (SUMMARY_SCHEMA, facts.hash, facts.seed)
        && (summary.version.as_str(), summary.commit.as_str()) == (facts.version, facts.commit);
    (is_of_campaign && summary.completeness.is_complete()).then_some(summary)
}

fn changed(path: &Path) -> Option<SystemTime> {
    std::fs::metadata(path).and_then(|found| found.modified()).ok()
}

impl FolderStatus {
    /// Returns notes beside the summary: runs of unfinished shards, and the state of the Slurm jobs of `results`.
    pub fn notes(&self, results: &Path) -> Vec<String> {
        let mut notes = Vec::new();
        if self.is_as_written {
            notes.push("as summary.json states it; `softdock verify` checks it against the runs".to_owned());
        }
        if self.partial_runs > 0 {
            let runs = self.partial_runs;
            notes.push(format!("{runs} finished runs of unfinished shards are kept; `softdock run` resumes from them"));
        }
        match slurm_state(results) {
            Ok(None) => {}
            Ok(Some((jobs, states))) => {
                let states: Vec<String> = states.iter().map(|(state, tasks)| format!("{tasks} {state}")).collect();
                let states = if states.is_empty() { "no task in the queue".to_owned() } else { states.join(", ") };
                let (array, tasks, finish) = (jobs.array, jobs.tasks, jobs.finish);
                notes.push(format!("slurm jobs {array} ({tasks} tasks) and {finish}: {states}"));
            }
            Err(error) => notes.push(format!("the state of the slurm jobs is unknown: {error}")),
        }
        notes
    }
}

/// Returns `path` if it is a folder; for a campaign file, its results folder: `out`, or `results/ID`.
///
/// # Errors
/// If the campaign file is wrong, or its results folder does not exist.
pub fn results_of(path: &Path, out: Option<&Path>) -> Result<PathBuf> {
    if path.is_dir() {
        return Ok(path.to_owned());
    }
    let campaign = softdock_campaign::load(path)?;
    let results = out.map_or_else(|| crate::default_results(&campaign.id), Path::to_owned);
    if results.is_dir() {
        return Ok(results);
    }
    let message = format!("there is no results folder `{}`", results.display());
    Err(FarmError::refused(message, format!("run the campaign first: softdock run {}", path.display())))
}

/// Writes summary and page of a results folder again.
///
/// # Errors
/// If the folder cannot be read, or a file not be written.
pub fn report(results: &Path) -> Result<Ended> {
    let folder = ResultsFolder::open(results)?;
    if !folder.campaign.variants.is_empty() {
        return variants::report(&folder);
    }
    Ok(Ended::new(&folder, Shown::Campaign(Box::new(write_summary_and_page(&folder, folder.shards()?)?))))
}
