//! `softdock run`: makes the missing runs of a campaign, then judges it.

use crate::args::{Part, RunArgs, default_results};
use crate::cases;
use crate::farm::Farm;
use crate::finish::finish;
use crate::folder::Folder;
use crate::fresh;
use crate::progress::{Progress, listen, stopped};
use crate::variants;
use crate::words::{Exit, explain, json, refuse, say, warn};
use miette::IntoDiagnostic;
use softdock_analysis::{Summary, summarise, verdict_text};
use softdock_campaign::Campaign;
use softdock_engine::EngineError;
use softdock_results::partial::{
    PartialShard, partial_path, partial_runs, read_partial, remove_partial, write_partial,
};
use softdock_results::runs::RunRow;
use softdock_results::shards::{Provenance, write_shard};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Runs a campaign.
pub(crate) fn run(args: &RunArgs) -> miette::Result<Exit> {
    let Some((campaign, out)) = campaign(args)? else { return Ok(Exit::Done) };
    if !campaign.variants.is_empty() {
        return variants::run(args, campaign, &out);
    }
    let choice = args.choice(&campaign);
    // The engine before the folder: what cannot run leaves nothing behind.
    let scene = campaign.clone();
    let mut farm = Farm::open(&scene, choice).map_err(unusable)?;
    if args.fresh {
        fresh::clear(&out, campaign.files())?;
    }
    let folder = Folder::claim(&out, campaign)?;
    listen();
    if let Err(end) = make_missing(&folder, args.shard, &mut farm) {
        return end;
    }
    if stopped() || !folder.shards()?.is_complete() {
        return partial(&folder, args);
    }
    let summary = match finish(&folder) {
        Err(_) if stopped() => {
            warn("stopped while runs were repeated for checks; every run is on disk, the same command resumes");
            return Ok(Exit::Incomplete);
        }
        summary => summary?,
    };
    tell(&summary, args.json);
    if !args.json {
        say(format!("\nreport  {}", out.join("report.html").display()));
    }
    Ok(Exit::of(&summary))
}

/// The campaign with what the command line says otherwise, and its results folder; `None` if there is nothing to run.
fn campaign(args: &RunArgs) -> miette::Result<Option<(Campaign, PathBuf)>> {
    let Some(path) = &args.campaign else { return cases::failed_runs(args) };
    let campaign = named(args, path)?;
    let results = |id: &str| default_results(&format!("{id}{}", if args.cases.is_some() { "_cases" } else { "" }));
    let out = match (&args.out, &args.variant) {
        (Some(out), Some(variant)) => out.join(variant),
        (Some(out), None) => out.clone(),
        (None, _) => results(&campaign.id),
    };
    let Some(table) = &args.cases else { return Ok(Some((campaign, out))) };
    if let Some(variant) = campaign.variants.first() {
        let message = format!("`{}` has variants, and given cases are run on one facility", path.display());
        return Err(refuse(message, format!("choose one: --variant {}", variant.name)));
    }
    let table = cases::read(table)?;
    cases::tell(&table);
    Ok(Some((campaign.with_cases(table).map_err(explain)?, out)))
}

/// The campaign of a file, with the number of runs, the seed and the variant of the command line.
fn named(args: &RunArgs, path: &std::path::Path) -> miette::Result<Campaign> {
    let campaign = Campaign::load_with(path, args.model.as_deref()).map_err(explain)?;
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
        warn(format!("made again: {} ({reason}); the file is kept with the ending .damaged-N", path.display()));
    }
    for path in &index.set_aside {
        warn(format!("ignored: {} (it was damaged or foreign; delete it if you do not need it)", path.display()));
    }
    for shard in index.complete.keys().filter(|shard| partial_path(&folder.path, **shard).is_file()) {
        // Its writer was killed between the whole shard and this.
        remove_partial(&folder.path, *shard).into_diagnostic().map_err(Err)?;
    }
    let own = |shard: &u32| shard % part.count == part.index;
    let missing: Vec<u32> = index.missing().into_iter().filter(own).collect();
    let mut kept = Kept::read(folder, &missing, farm);
    let there = if kept.rows.is_empty() { String::new() } else { format!(" and {} runs of others", kept.count()) };
    warn(format!(
        "{}  {} shards to make, {}{there} there  on {}",
        folder.campaign.id,
        missing.len(),
        index.complete.len(),
        farm.device()
    ));
    if missing.is_empty() {
        return Ok(());
    }
    let to_make = |kept: &Kept, shards: &[u32]| {
        let missing = |shard: &u32| {
            let range = folder.plan().range(*shard);
            range.end - range.start - kept.rows.get(shard).map_or(0, |rows| rows.len() as u64)
        };
        shards.iter().map(missing).sum::<u64>()
    };
    let progress = Progress::new("run", to_make(&kept, &missing));
    let (mut rest, mut done) = (missing.as_slice(), 0);
    while !rest.is_empty() && !stopped() {
        // Neighbours only, so that a batch is one range of runs.
        let most = farm.batch_shards().min(rest.len());
        let together = (1..most).take_while(|next| rest[*next] == rest[next - 1] + 1).count() + 1;
        let (batch, after) = rest.split_at(together);
        let own = to_make(&kept, batch);
        match make_batch(folder, batch, farm, &mut kept, &progress) {
            Ok(()) => {}
            Err(Ended::Stopped) => return Ok(()),
            Err(Ended::Failed(end)) => return Err(end),
        }
        rest = after;
        done += own;
        progress.set(done);
    }
    Ok(())
}

/// Finished runs of unfinished shards, which an earlier command has left.
struct Kept {
    rows: BTreeMap<u32, Vec<RunRow>>,
    /// What made them.
    provenance: Provenance,
}

impl Kept {
    /// What goes together with the rows of this engine; of the rest it is reported why it is made again.
    fn read(folder: &Folder, shards: &[u32], farm: &Farm) -> Self {
        let provenance = farm.provenance();
        let mut rows = BTreeMap::new();
        for shard in shards {
            let runs = folder.run_numbers(*shard);
            let is_own = |run: u64| runs.binary_search(&run).is_ok();
            match read_partial(&folder.path, *shard, is_own, &farm.ledger.schema, &provenance) {
                PartialShard::Absent => {}
                PartialShard::Usable(own) => drop(rows.insert(*shard, own)),
                PartialShard::Unusable(reason) => {
                    let path = partial_path(&folder.path, *shard);
                    warn(format!("made again: the runs of {} ({reason})", path.display()));
                }
            }
        }
        Self { rows, provenance }
    }

    fn count(&self) -> usize {
        self.rows.values().map(Vec::len).sum()
    }

    /// Gives out the rows of a shard, unless another engine has taken over: a shard states one backend.
    fn take(&mut self, shard: u32, own: &Provenance) -> Vec<RunRow> {
        let rows = self.rows.remove(&shard).unwrap_or_default();
        let alike =
            own.backend == self.provenance.backend && (own.backend == "cpu" || own.device == self.provenance.device);
        if alike { rows } else { Vec::new() }
    }
}

/// Why a batch was not written whole.
enum Ended {
    /// The user stopped it; its finished runs are written.
    Stopped,
    /// Something went wrong.
    Failed(miette::Result<Exit>),
}

fn make_batch(
    folder: &Folder,
    shards: &[u32],
    farm: &mut Farm,
    kept: &mut Kept,
    progress: &Progress,
) -> Result<(), Ended> {
    let failed = |error: EngineError| match error {
        error if error.is_of_the_device() => {
            warn(error);
            Ended::Failed(Ok(Exit::Incomplete))
        }
        error => Ended::Failed(Err(unusable(error))),
    };
    let mut rows: Vec<RunRow> = Vec::new();
    for shard in shards {
        rows.append(&mut kept.take(*shard, &farm.provenance()));
    }
    let (device, numbers) = (farm.device(), shards.iter().flat_map(|shard| folder.run_numbers(*shard)));
    let is_kept = |run: &u64| rows.binary_search_by_key(run, |row| row.run).is_ok();
    let (there, missing): (Vec<u64>, Vec<u64>) = numbers.partition(is_kept);
    let (mut made, mut is_whole) = farm.make_numbered(&missing, &|ended| progress.add(ended)).map_err(failed)?;
    if farm.device() != device && !there.is_empty() {
        // The CPU took over in this batch: what the GPU had kept does not go together with its rows.
        rows.clear();
        if is_whole {
            let (mut again, ended) = farm.make_numbered(&there, &|_| progress.add(0)).map_err(failed)?;
            made.append(&mut again);
            is_whole = ended;
        }
    }
    rows.append(&mut made);
    rows.sort_by_key(|row| row.run);
    write_batch(folder, shards, farm, rows).into_diagnostic().map_err(|error| Ended::Failed(Err(error)))?;
    if is_whole { Ok(()) } else { Err(Ended::Stopped) }
}

/// Writes every shard of which all runs are there, and of the others the runs that are there.
fn write_batch(folder: &Folder, shards: &[u32], farm: &Farm, mut rows: Vec<RunRow>) -> softdock_results::Result<()> {
    let (path, schema, provenance) = (&folder.path, &farm.ledger.schema, farm.provenance());
    for shard in shards.iter().rev() {
        let numbers = folder.run_numbers(*shard);
        let mut own = rows.split_off(rows.partition_point(|row| row.run < numbers[0]));
        if own.len() == numbers.len() {
            let mut provenance = provenance.clone();
            if folder.campaign.cases().is_some() {
                let first = folder.plan().range(*shard).start;
                provenance.more.push(("first_case".to_owned(), first.to_string()));
            }
            write_shard(path, *shard, schema, own, &provenance)?;
            remove_partial(path, *shard)?;
        } else if !own.is_empty() {
            // Another worker on the same shard may have kept other runs meanwhile.
            let is_own = |run: u64| numbers.binary_search(&run).is_ok();
            if let PartialShard::Usable(mut others) = read_partial(path, *shard, is_own, schema, &provenance) {
                own.append(&mut others);
            }
            write_partial(path, *shard, schema, own, &provenance)?;
        }
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
    if done > 0 {
        tell(&summarise(&folder.path, &folder.facts()).into_diagnostic()?, args.json);
    }
    let others = match partial_runs(&folder.path).into_diagnostic()? {
        0 => String::new(),
        runs => format!(" and {runs} runs of others"),
    };
    warn(match (stopped(), args.shard.count) {
        (true, _) => format!("stopped with {done} of {planned} shards{others}; the same command resumes"),
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
