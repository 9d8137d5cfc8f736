//! Worker of a results folder, which makes its part of the runs without judging them, and completion of a folder whose
//! shards all exist.

use crate::error::{FarmError, Result};
use crate::finish::finish;
use crate::folder::ResultsFolder;
use crate::make::{RunOptions, make_missing};
use crate::observer::Context;
use crate::outcome::{Ended, Incomplete, Shown};
use crate::run_engine::RunEngine;
use crate::variants;
use std::path::Path;

/// Makes the missing runs of a part of an existing results folder, without judging; returns the reason if some are
/// still missing.
///
/// # Errors
/// If the folder is no results folder, no engine can make the runs, or a file cannot be read or written.
pub fn work(results: &Path, options: &RunOptions, context: Context) -> Result<Option<Incomplete>> {
    for folder in ResultsFolder::open(results)?.with_runs()? {
        let folder = ResultsFolder::claim(&folder.path.clone(), folder.campaign, context)?;
        let scene = folder.campaign.clone();
        let mut engine = RunEngine::open(&scene, options.choice, context)?;
        if let Some(incomplete) = make_missing(&folder, options, &mut engine, context)? {
            return Ok(Some(incomplete));
        }
        if context.cancel.is_cancelled() {
            let index = folder.shards()?;
            let partial_runs = softdock_results::partial::partial_runs(&folder.path)?;
            let (done, planned) = (index.complete.len(), index.plan.shards());
            return Ok(Some(Incomplete::Cancelled { done, planned, partial_runs }));
        }
    }
    Ok(None)
}

/// Completes a results folder whose shards all exist: repeated runs, time histories, summary and page; for variants,
/// their comparison.
///
/// # Errors
/// If the folder is no results folder, or a file cannot be read or written.
pub fn finish_folder(results: &Path, context: Context) -> Result<Ended> {
    let whole = ResultsFolder::open(results)?;
    let whole = ResultsFolder::claim(results, whole.campaign, context)?;
    if !whole.campaign.variants.is_empty() {
        for folder in whole.variants()? {
            let index = folder.shards()?;
            if index.is_complete() {
                finish(&folder, index, context)?;
            }
        }
        return variants::conclude(&whole, Incomplete::VariantMissing);
    }
    let index = whole.shards()?;
    if !index.is_complete() {
        let missing = Incomplete::ShardsMissing { done: index.complete.len(), planned: index.plan.shards() };
        return Ok(Ended { incomplete: Some(missing), ..Ended::new(&whole, Shown::Nothing) });
    }
    match finish(&whole, index, context) {
        Err(FarmError::Cancelled) => {
            let incomplete = Some(Incomplete::CancelledInChecks);
            Ok(Ended { incomplete, ..Ended::new(&whole, Shown::Nothing) })
        }
        summary => Ok(Ended::new(&whole, Shown::Campaign(Box::new(summary?)))),
    }
}
