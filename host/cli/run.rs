//! `softdock run`: makes the missing shards of a campaign, then judges it.

use crate::args::{Part, RunArgs, default_results};
use crate::farm::Farm;
use crate::finish::finish;
use crate::folder::Folder;
use crate::progress::{Progress, listen, stopped};
use crate::variants;
use crate::words::{Exit, explain, json, refuse, say, warn};
use miette::IntoDiagnostic;
use softdock_analysis::{Summary, summarise, verdict_text};
use softdock_campaign::Campaign;
use softdock_engine::EngineError;
use softdock_results::shards::write_shard;

/// Runs a campaign.
pub(crate) fn run(args: &RunArgs) -> miette::Result<Exit> {
    let campaign = campaign(args)?;
    if !campaign.variants.is_empty() {
        return variants::run(args, campaign);
    }
    let choice = args.choice(&campaign);
    let out = match (&args.out, &args.variant) {
        (Some(out), Some(variant)) => out.join(variant),
        (Some(out), None) => out.clone(),
        (None, _) => default_results(&campaign.id),
    };
    // The engine before the folder: what cannot run leaves nothing behind.
    let scene = campaign.clone();
    let mut farm = Farm::open(&scene, choice).map_err(unusable)?;
    let folder = Folder::claim(&out, campaign)?;
    listen();
    if let Err(end) = make_missing(&folder, args.shard, &mut farm) {
        return end;
    }
    if stopped() || !folder.shards()?.is_complete() {
        return partial(&folder, args);
    }
    let summary = finish(&folder)?;
    tell(&summary, args.json);
    if !args.json {
        say(format!("\nreport  {}", out.join("report.html").display()));
    }
    Ok(Exit::of(&summary))
}

/// The campaign with what the command line says otherwise.
fn campaign(args: &RunArgs) -> miette::Result<Campaign> {
    let campaign = Campaign::load_with(&args.campaign, args.model.as_deref()).map_err(explain)?;
    let (runs, seed) = (args.runs.unwrap_or(campaign.runs), args.seed.unwrap_or(campaign.seed));
    let campaign = match &args.variant {
        Some(name) => variants::of_name(campaign, name)?,
        None => campaign,
    };
    let campaign = campaign.with_sample(runs, seed);
    let most = campaign.method.most_runs();
    if campaign.runs > most {
        let message = format!("{} runs, but a Sobol' sequence has {most} points", campaign.runs);
        return Err(refuse(message, format!("write --runs {most} or less, or another sampling.method")));
    }
    match campaign.outer_draws {
        Some(draws) if campaign.runs < u64::from(draws) => {
            let message = format!("{} runs cannot hold {draws} outer draws", campaign.runs);
            Err(refuse(message, format!("write --runs {draws} or more")))
        }
        _ => Ok(campaign),
    }
}

/// Makes what is missing of one part of the campaign; `Err` holds how the command ends early.
pub(crate) fn make_missing(folder: &Folder, part: Part, farm: &mut Farm) -> Result<(), miette::Result<Exit>> {
    let index = folder.shards().map_err(Err)?;
    for (path, reason) in &index.foreign {
        warn(format!("made again: {} ({reason})", path.display()));
    }
    let own = |shard: &u32| shard % part.count == part.index;
    let missing: Vec<u32> = index.missing().into_iter().filter(own).collect();
    let count = |shards: &[u32]| shards.iter().map(|s| folder.plan().range(*s)).map(|r| r.end - r.start).sum::<u64>();
    warn(format!(
        "{}  {} shards to make, {} there  on {}",
        folder.campaign.id,
        missing.len(),
        index.complete.len(),
        farm.device()
    ));
    if missing.is_empty() {
        return Ok(());
    }
    let progress = Progress::new("run", count(&missing));
    let (mut rest, mut done) = (missing.as_slice(), 0);
    while !rest.is_empty() && !stopped() {
        // Neighbours only, so that a batch is one range of runs.
        let most = farm.batch_shards().min(rest.len());
        let together = (1..most).take_while(|next| rest[*next] == rest[next - 1] + 1).count() + 1;
        let (batch, after) = rest.split_at(together);
        match make_batch(folder, batch, farm, &progress) {
            Ok(()) => {}
            Err(Ended::Stopped) => return Ok(()),
            Err(Ended::Failed(end)) => return Err(end),
        }
        rest = after;
        done += count(batch);
        progress.set(done);
    }
    Ok(())
}

/// Why a batch was not written.
enum Ended {
    /// The user stopped it.
    Stopped,
    /// Something went wrong.
    Failed(miette::Result<Exit>),
}

fn make_batch(folder: &Folder, shards: &[u32], farm: &mut Farm, progress: &Progress) -> Result<(), Ended> {
    let plan = folder.plan();
    let runs = plan.range(shards[0]).start..plan.range(shards[shards.len() - 1]).end;
    let mut rows = farm.make(runs, &|ended| progress.add(ended)).map_err(|error| match error {
        EngineError::Stopped => Ended::Stopped,
        error if error.is_of_the_device() => {
            warn(error);
            Ended::Failed(Ok(Exit::Incomplete))
        }
        error => Ended::Failed(Err(unusable(error))),
    })?;
    let provenance = farm.provenance();
    for shard in shards.iter().rev() {
        let first = plan.range(*shard).start;
        let own = rows.split_off(rows.partition_point(|row| row.run < first));
        let written = write_shard(&folder.path, *shard, &farm.ledger.schema, own, &provenance);
        written.into_diagnostic().map_err(|error| Ended::Failed(Err(error)))?;
    }
    Ok(())
}

/// An engine error as the user's matter.
pub(crate) fn unusable(error: EngineError) -> miette::Report {
    refuse(error, "`softdock devices` lists what runs can be made on")
}

/// The campaign is not whole: says how far it is.
fn partial(folder: &Folder, args: &RunArgs) -> miette::Result<Exit> {
    let index = folder.shards()?;
    let (done, planned) = (index.complete.len(), index.plan.shards());
    if index.foreign.is_empty() && done > 0 {
        tell(&summarise(&folder.path, &folder.facts()).into_diagnostic()?, args.json);
    }
    warn(match (stopped(), args.shard.count) {
        (true, _) => format!("stopped with {done} of {planned} shards; the same command resumes"),
        (false, 1) => format!("{done} of {planned} shards; the same command resumes"),
        (false, parts) => format!("part {} of {parts} is made; `softdock merge` joins the parts", args.shard.index + 1),
    });
    Ok(Exit::Incomplete)
}

/// The verdict, for a person or for a program.
pub(crate) fn tell(summary: &Summary, as_json: bool) {
    match as_json {
        true => say(json(&serde_json::to_value(summary).expect("a summary is plain JSON"))),
        false => say(verdict_text(summary)),
    }
}
