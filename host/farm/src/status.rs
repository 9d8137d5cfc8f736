//! Progress of a campaign, and rewriting of its summary and page.

use crate::error::Result;
use crate::finish::write_summary_and_page;
use crate::folder::ResultsFolder;
use crate::outcome::{Ended, Shown};
use crate::variants;
use softdock_analysis::summarise_folder;
use softdock_results::partial::partial_runs;
use std::path::Path;

/// Progress of a campaign.
#[derive(Clone, Debug)]
pub struct Status {
    /// Result of its folder so far.
    pub shown: Shown,
    /// Finished runs of unfinished shards, from which `run` resumes.
    pub partial_runs: u64,
}

/// Reads the progress of the campaign of a results folder, without writing.
///
/// # Errors
/// If the folder cannot be read.
pub fn status(results: &Path) -> Result<Status> {
    let folder = ResultsFolder::open(results)?;
    let shown = match folder.campaign.variants.is_empty() {
        true => Shown::Campaign(Box::new(summarise_folder(&folder.path, &folder.facts())?)),
        false => Shown::Variants(Box::new(variants::compared(&folder)?)),
    };
    Ok(Status { shown, partial_runs: partial_runs(&folder.path)? })
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
