//! Contact events: runs repeated in f64, whose contacts are recorded in every substep.

use crate::error::{FarmError, Result};
use crate::folder::ResultsFolder;
use crate::observer::{Context, Progress, Work};
use crate::rows::{RowBuilder, params_of};
use crate::run_selection::{KeptRun, RunSelection};
use rayon::prelude::*;
use softdock_campaign::campaign::Keep;
use softdock_campaign::contact_names::{ContactNames, pair_key};
use softdock_engine::cpu;
use softdock_kernels::model::Side;
use softdock_kernels::outcome::ContactEvent;
use softdock_results::contact_events::{ContactEventFacts, ContactEventRow, write_contact_events};
use softdock_results::shards::{Provenance, ShardIndex};
use softdock_results::traces::NOMINAL_RUN;
use std::collections::BTreeMap;

/// Runs whose events are in memory at a time.
const CHUNK: usize = 256;

/// Steps the kept runs again and writes their contact events; without any to keep, no file.
///
/// `runs` is the number of runs in the shards.
///
/// # Errors
/// [`FarmError::Cancelled`] if the context cancels it; if a file cannot be read or written.
pub(crate) fn write_kept_events(
    folder: &ResultsFolder,
    (builder, provenance): (&RowBuilder, &Provenance),
    (index, runs): (&ShardIndex, u64),
    selection: RunSelection,
    context: Context,
) -> Result<()> {
    let plan = &folder.campaign.contact_events;
    if plan.keep.is_empty() {
        return Ok(());
    }
    let mut picked = selection.kept();
    // The nominal case is no row; it has the greatest number.
    let nominal = picked.pop_if(|((run, _), _)| *run == NOMINAL_RUN);
    let mut reasons: BTreeMap<u64, String> = picked.into_iter().map(|((run, _), reason)| (run, reason)).collect();
    let keeps_all = plan.keep.contains(&Keep::All);
    let kept_runs = u64::from(nominal.is_some()) + if keeps_all { runs } else { reasons.len() as u64 };
    let rows = index.read_runs().filter_map(|row| match row {
        Ok(row) => {
            let reason = reasons.remove(&row.run).or_else(|| keeps_all.then(|| "all".to_owned()))?;
            Some(Ok(((row.run, params_of(&row)), reason)))
        }
        Err(error) => Some(Err(FarmError::from(error))),
    });
    let mut kept = rows.chain(nominal.map(Ok));
    let progress = Progress::new(context, Work::ContactEvents, kept_runs);
    let names = ContactNames::of(&folder.campaign.scenario);
    let parts = std::iter::from_fn(|| {
        let chunk: Result<Vec<KeptRun>> = kept.by_ref().take(CHUNK).collect();
        let chunk = match chunk {
            Ok(chunk) if chunk.is_empty() => return None,
            Ok(chunk) => chunk,
            Err(error) => return Some(Err(error)),
        };
        let count = chunk.len();
        let events = chunk.into_par_iter().map(|kept| events_of(builder, plan.merge_gap, &names, kept));
        let events: Result<Vec<_>> = events.collect();
        match progress.add(count) {
            true => Some(events.map(|events| events.into_iter().flatten().collect())),
            false => Some(Err(FarmError::Cancelled)),
        }
    });
    let facts = ContactEventFacts { kept_runs, merge_gap: plan.merge_gap };
    write_contact_events(&folder.path, facts, parts, provenance, index)
}

/// Steps one run and returns its events, those in space first.
fn events_of(
    builder: &RowBuilder,
    merge_gap: f64,
    names: &ContactNames,
    ((run, params), kept_as): KeptRun,
) -> Result<Vec<ContactEventRow>> {
    let input = builder.input(run, Some(params))?;
    let (_, loops) = cpu::contact_events(&builder.job, &input, merge_gap);
    let row = |side: usize, number: u32, event: ContactEvent| {
        let [of_a, of_b] = event.members;
        ContactEventRow {
            run,
            kept_as: kept_as.clone(),
            side,
            number,
            members: [names.member(Side::A, of_a), names.member(Side::B, of_b)],
            pair: pair_key(event.pair),
            event,
        }
    };
    let of_loop = |(side, events): (usize, Vec<ContactEvent>)| {
        (1..).zip(events).map(|(number, event)| row(side, number, event)).collect::<Vec<_>>()
    };
    Ok(loops.into_iter().enumerate().flat_map(of_loop).collect())
}
