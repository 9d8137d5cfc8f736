//! Makes the missing runs of a campaign, then judges it; the same call resumes interrupted work.

use crate::clear::clear;
use crate::error::{FarmError, Result};
use crate::finish::finish;
use crate::folder::ResultsFolder;
use crate::make::{RunOptions, make_missing};
use crate::observer::Context;
use crate::outcome::{Ended, Incomplete, Shown};
use crate::part::Part;
use crate::run_engine::RunEngine;
use crate::variants;
use softdock_analysis::{Content, summarise};
use softdock_campaign::Campaign;
use softdock_results::partial::partial_runs;
use softdock_results::shards::ShardIndex;
use std::path::Path;

/// Runs a campaign into a results folder: makes the missing runs and, once all shards exist, judges it. A campaign with
/// variants has a folder for each variant, and their comparison.
///
/// # Errors
/// If no engine can make the runs, the folder belongs to another campaign, or a file cannot be read or written.
pub fn run(campaign: Campaign, results: &Path, options: &RunOptions, context: Context) -> Result<Ended> {
    if !campaign.variants.is_empty() {
        return variants::run(campaign, results, options, context);
    }
    // The engine first: a campaign that cannot run creates no folder.
    let scene = campaign.clone();
    let mut engine = RunEngine::open(&scene, options.choice, context)?;
    if options.is_fresh {
        clear(results, campaign.files(), context)?;
    }
    let folder = ResultsFolder::claim(results, campaign, context)?;
    if let Some(incomplete) = make_missing(&folder, options, &mut engine, context)? {
        return Ok(Ended { incomplete: Some(incomplete), ..Ended::new(&folder, Shown::Nothing) });
    }
    let index = folder.shards()?;
    if context.cancel.is_cancelled() || !index.is_complete() {
        return incomplete(&folder, index, options.part, context);
    }
    match finish(&folder, index, context) {
        Err(FarmError::Cancelled) => {
            let incomplete = Some(Incomplete::CancelledInChecks);
            Ok(Ended { incomplete, ..Ended::new(&folder, Shown::Nothing) })
        }
        summary => Ok(Ended::new(&folder, Shown::Campaign(Box::new(summary?)))),
    }
}

/// The end of a call after which shards are missing.
fn incomplete(folder: &ResultsFolder, index: ShardIndex, part: Part, context: Context) -> Result<Ended> {
    let (done, planned) = (index.complete.len(), index.plan.shards());
    let shown = match done {
        0 => Shown::Nothing,
        _ => Shown::Campaign(Box::new(summarise(&Content::of_shards(&folder.path, index)?, &folder.facts())?)),
    };
    let partial_runs = partial_runs(&folder.path)?;
    let incomplete = match (context.cancel.is_cancelled(), part.count) {
        (true, _) => Incomplete::Cancelled { done, planned, partial_runs },
        (false, 1) => Incomplete::ShardsMissing { done, planned },
        (false, _) => Incomplete::PartMade(part),
    };
    Ok(Ended { incomplete: Some(incomplete), ..Ended::new(folder, shown) })
}
