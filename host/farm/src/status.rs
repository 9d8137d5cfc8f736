//! Progress of a campaign, and rewriting of its summary and page.

use crate::error::{FarmError, Result};
use crate::finish::write_summary_and_page;
use crate::folder::ResultsFolder;
use crate::outcome::{Ended, Shown};
use crate::slurm::slurm_state;
use crate::variants;
use softdock_analysis::summarise_folder;
use softdock_results::partial::partial_runs;
use std::path::{Path, PathBuf};

/// Progress of a campaign.
#[derive(Clone, Debug)]
pub struct FolderStatus {
    /// Result of its folder so far.
    pub shown: Shown,
    /// Finished runs of unfinished shards, from which `run` resumes.
    pub partial_runs: u64,
}

/// Reads the progress of the campaign of a results folder, without writing.
///
/// # Errors
/// If the folder cannot be read.
pub fn status(results: &Path) -> Result<FolderStatus> {
    let folder = ResultsFolder::open(results)?;
    let shown = match folder.campaign.variants.is_empty() {
        true => Shown::Campaign(Box::new(summarise_folder(&folder.path, &folder.facts())?)),
        false => Shown::Variants(Box::new(variants::compared(&folder)?)),
    };
    Ok(FolderStatus { shown, partial_runs: partial_runs(&folder.path)? })
}

impl FolderStatus {
    /// Returns notes beside the summary: runs of unfinished shards, and the state of the Slurm jobs of `results`.
    pub fn notes(&self, results: &Path) -> Vec<String> {
        let mut notes = Vec::new();
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
