//! What follows the last shard: repeated runs, time histories, summary and page.

use crate::changes::files_below;
use crate::farm::Farm;
use crate::folder::Folder;
use crate::half_step::{HalfStepRuns, write_half_step_of};
use crate::page::write_page;
use crate::parity::{ParityRuns, write_parity_of};
use crate::traces::{Keeper, write_traces};
use miette::IntoDiagnostic;
use softdock_analysis::{Summary, summarise, write_summary};
use softdock_engine::Choice;
use softdock_results::parity::{HALF_STEP, PARITY};
use softdock_results::traces::read_traces;
use softdock_results::{hash_files, is_temporary};
use std::path::Path;

/// Ends a whole campaign; all of it follows from the shards, so that doing it twice changes nothing.
pub(crate) fn finish(folder: &Folder) -> miette::Result<Summary> {
    let mut truth = Farm::open(&folder.campaign, Choice::Cpu).map_err(crate::run::unusable)?;
    let index = folder.shards()?;
    let (mut parity, mut half_step) = (ParityRuns::of(folder, &index), HalfStepRuns::of(folder, &index));
    let mut keeper = Keeper::new(&folder.campaign);
    // Run numbers of given cases may have gaps; the places of their rows have none.
    for (place, row) in (0..).zip(index.read_runs()) {
        let row = row.into_diagnostic()?;
        keeper.see(place, &row);
        half_step.see(place, &row);
        parity.see(place, row);
    }
    write_traces(folder, &truth.ledger, &truth.provenance(), &index, keeper.kept())?;
    write_parity_of(folder, &mut truth, &index, parity)?;
    write_half_step_of(folder, &mut truth, &index, half_step)?;
    judge(folder)
}

/// Writes summary and page of what is there.
pub(crate) fn judge(folder: &Folder) -> miette::Result<Summary> {
    let summary = stated(folder)?;
    write_summary(&folder.path, &summary).into_diagnostic()?;
    write_page(folder, &summary)?;
    Ok(summary)
}

/// What the folder shows, with the hash of what it follows from.
pub(crate) fn stated(folder: &Folder) -> miette::Result<Summary> {
    let summary = summarise(&folder.path, &folder.facts()).into_diagnostic()?;
    let hash = hash_files(&folder.path, &hashed(folder)?).into_diagnostic()?;
    Ok(Summary { results_hash: Some(hash), ..summary })
}

/// Names of the files that the summary follows from, and of those made from the runs; files that count for nothing
/// are not among them.
fn hashed(folder: &Folder) -> miette::Result<Vec<String>> {
    let index = folder.shards()?;
    let foreign = read_traces(&folder.path, &index).into_diagnostic()?.foreign;
    let foreign = index.foreign.iter().chain(&foreign).map(|(path, _)| path.as_path());
    let ignored: Vec<&Path> = foreign.chain(index.set_aside.iter().map(|path| path.as_path())).collect();
    let belongs = |name: &str| {
        name == "campaign.json"
            || [PARITY.file, HALF_STEP.file].contains(&name)
            || ["campaign/", "runs/", "traces/"].iter().any(|folder| name.starts_with(folder))
            || folder.campaign.cases().is_some_and(|cases| cases.file_name() == name)
    };
    let files = files_below(&folder.path).into_iter();
    let own = files.filter(|(name, path)| belongs(name) && !is_temporary(path) && !ignored.contains(&path.as_path()));
    Ok(own.map(|(name, _)| name).collect())
}
