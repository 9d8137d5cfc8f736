//! What follows the last shard: repeated runs, time histories, summary and page.

use crate::farm::Farm;
use crate::folder::Folder;
use crate::half_step::{HalfStepRuns, write_half_step_of};
use crate::page::write_page;
use crate::parity::{ParityRuns, write_parity_of};
use crate::traces::{Keeper, write_traces};
use miette::IntoDiagnostic;
use softdock_analysis::{Summary, summarise, write_summary};
use softdock_engine::Choice;

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
    let summary = summarise(&folder.path, &folder.facts()).into_diagnostic()?;
    write_summary(&folder.path, &summary).into_diagnostic()?;
    write_page(folder, &summary)?;
    Ok(summary)
}
