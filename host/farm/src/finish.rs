//! Completion of a campaign: repeated runs, time histories, contact events, summary and page.

use crate::contact_events::write_kept_events;
use crate::error::Result;
use crate::folder::ResultsFolder;
use crate::observer::Context;
use crate::page::{page_text, write_page};
use crate::paths::files_below;
use crate::repetitions::{HalfStepRuns, ParityRuns};
use crate::run_engine::RunEngine;
use crate::run_selection::RunSelection;
use crate::traces::write_traces;
use softdock_analysis::{Content, Summary, summarise, write_summary};
use softdock_results::contact_events::CONTACT_EVENTS_FILE;
use softdock_results::parity::{HALF_STEP, PARITY};
use softdock_results::shards::ShardIndex;
use softdock_results::{hash_files, is_temporary};
use std::path::Path;

/// Completes a campaign with the shards of `index`. Everything follows from the shards, so repeating it changes
/// nothing.
///
/// # Errors
/// [`crate::FarmError::Cancelled`] if the context cancels the repetition of runs; if a file cannot be read or written.
pub(crate) fn finish(folder: &ResultsFolder, index: ShardIndex, context: Context) -> Result<Summary> {
    let mut reference = RunEngine::reference(&folder.campaign);
    let (mut parity, mut half_step) = (ParityRuns::of(folder, &index), HalfStepRuns::of(folder, &index));
    let campaign = &folder.campaign;
    let (mut traced, mut recorded) = (
        RunSelection::new(campaign, &campaign.traces.keep),
        RunSelection::new(campaign, &campaign.contact_events.keep),
    );
    let mut runs = 0;
    // Run numbers of given cases may have gaps; the places of their rows have none.
    for (place, row) in (0..).zip(index.read_runs()) {
        let row = row?;
        traced.see(place, &row);
        recorded.see(place, &row);
        runs += 1;
        half_step.see(place, &row);
        parity.see(place, row);
    }
    let provenance = reference.provenance();
    write_traces(folder, &reference.builder, &provenance, &index, traced.kept())?;
    write_kept_events(folder, (&reference.builder, &provenance), (&index, runs), recorded, context)?;
    parity.write(folder, &mut reference, &index, context)?;
    half_step.write(folder, &mut reference, &index, context)?;
    write_summary_and_page(folder, index)
}

/// Writes summary and page of what the folder holds.
pub(crate) fn write_summary_and_page(folder: &ResultsFolder, index: ShardIndex) -> Result<Summary> {
    let stated = Stated::of(folder, index)?;
    write_summary(&folder.path, &stated.summary)?;
    write_page(folder, &stated.content, &stated.summary)?;
    Ok(stated.summary)
}

/// Content of a results folder with its summary.
pub(crate) struct Stated {
    /// Its shards and time histories.
    pub(crate) content: Content,
    /// The summary, with the hash of the files that it follows from.
    pub(crate) summary: Summary,
}

impl Stated {
    /// Judges a folder by its shards.
    pub(crate) fn of(folder: &ResultsFolder, index: ShardIndex) -> Result<Self> {
        let content = Content::of_shards(&folder.path, index)?;
        let summary = summarise(&content, &folder.facts())?;
        let hash = hash_files(&folder.path, &hashed(folder, &content))?;
        Ok(Self { content, summary: Summary { results_hash: Some(hash), ..summary } })
    }

    /// The text of the page.
    pub(crate) fn page(&self, folder: &ResultsFolder) -> Result<String> {
        page_text(folder, &self.content, &self.summary)
    }
}

/// Names of the files that the summary follows from, and of those made from the runs; files that count for nothing
/// are not among them.
fn hashed(folder: &ResultsFolder, content: &Content) -> Vec<String> {
    let foreign = content.foreign().map(|(path, _)| path.as_path());
    let ignored: Vec<&Path> = foreign.chain(content.shards.set_aside.iter().map(|path| path.as_path())).collect();
    let belongs = |name: &str| {
        name == crate::manifest::MANIFEST_FILE
            || [PARITY.file, HALF_STEP.file, CONTACT_EVENTS_FILE].contains(&name)
            || ["campaign/", "runs/", "traces/"].iter().any(|folder| name.starts_with(folder))
            || folder.campaign.cases().is_some_and(|cases| cases.file_name() == name)
    };
    let files = files_below(&folder.path).into_iter();
    let own = files.filter(|(name, path)| belongs(name) && !is_temporary(path) && !ignored.contains(&path.as_path()));
    own.map(|(name, _)| name).collect()
}
