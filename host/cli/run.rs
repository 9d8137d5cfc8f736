//! `softdock run`: makes the missing runs of a campaign, then judges it.

use crate::args::{BackendArg, RunArgs};
use crate::farm::{called, end};
use crate::progress::Terminal;
use crate::words::{Exit, refuse};
use softdock_farm::{RunOptions, Selection, choice_of, default_results, failed_results, failed_runs, load_campaign};
use std::path::PathBuf;

/// Runs a campaign, or the failed runs of a results folder.
pub(crate) fn run(args: &RunArgs) -> miette::Result<Exit> {
    let terminal = Terminal::new();
    let context = terminal.context();
    let (campaign, out) = match (&args.campaign, &args.only_failed) {
        (Some(file), _) => {
            let campaign = called(load_campaign(file, &selection(args), context))?;
            let out = results(args, &campaign.id);
            (campaign, out)
        }
        (None, Some(results)) => {
            let out = called(failed_results(results, args.out.as_deref()))?;
            let Some(campaign) = called(failed_runs(results, context))? else { return Ok(Exit::Done) };
            (campaign, out)
        }
        (None, None) => {
            return Err(refuse("no campaign is named", "write softdock run CAMPAIGN, or --only-failed DIR"));
        }
    };
    let choice = args.backend.map_or_else(|| choice_of(&campaign), BackendArg::choice);
    let options = RunOptions { choice, part: args.shard, is_fresh: args.fresh, ..RunOptions::default() };
    end(softdock_farm::run(campaign, &out, &options, context), args.json)
}

fn selection(args: &RunArgs) -> Selection {
    Selection {
        model: args.model.clone(),
        runs: args.runs,
        seed: args.seed,
        variant: args.variant.clone(),
        cases: args.cases.clone(),
    }
}

/// The results folder, if none is named by the campaign's id.
fn results(args: &RunArgs, id: &str) -> PathBuf {
    match (&args.out, &args.variant) {
        (Some(out), Some(variant)) => out.join(variant),
        (Some(out), None) => out.clone(),
        (None, _) => default_results(&format!("{id}{}", if args.cases.is_some() { "_cases" } else { "" })),
    }
}
