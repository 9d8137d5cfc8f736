//! Campaigns with variants: each facility run, judged and reported in a folder of its own, then all side by side.

use crate::args::{Part, RunArgs};
use crate::farm::Farm;
use crate::finish::{finish, judge};
use crate::folder::{Folder, build_of_folder, records};
use crate::merge::join_parts;
use crate::progress::{listen, stopped};
use crate::run::{make_missing, unusable};
use crate::words::{Exit, json, refuse, say, warn};
use miette::IntoDiagnostic;
use softdock_analysis::{Compared, Summary, VariantInput, compare, compare_text, summarise, write_compare};
use softdock_campaign::{Campaign, Variant};
use softdock_results::shards::ShardIndex;
use std::path::{Path, PathBuf};

/// Runs every variant, or what is missing of it, then compares them.
pub(crate) fn run(args: &RunArgs, campaign: Campaign, out: &Path) -> miette::Result<Exit> {
    let choice = args.choice(&campaign);
    // The engine before the folder: what cannot run leaves nothing behind.
    drop(Farm::open(&campaign.variants[0].campaign, choice).map_err(unusable)?);
    if args.fresh {
        crate::fresh::clear(out, campaign.files())?;
    }
    let whole = Folder::claim(out, campaign)?;
    listen();
    for folder in folders(&whole)? {
        let folder = Folder::claim(&folder.path, folder.campaign)?;
        let scene = folder.campaign.clone();
        let mut farm = Farm::open(&scene, choice).map_err(unusable)?;
        if let Err(end) = make_missing(&folder, args.shard, &mut farm) {
            return end;
        }
        if stopped() {
            break;
        }
        if folder.shards()?.is_complete() {
            match finish(&folder) {
                Err(_) if stopped() => break,
                summary => drop(summary?),
            }
        }
    }
    let Part { index, count } = args.shard;
    let missing = match count {
        1 => "not every variant is whole; the same command resumes".to_owned(),
        parts => format!("part {} of {parts} is made; `softdock merge` joins the parts", index + 1),
    };
    conclude(&whole, args.json, missing)
}

/// What completes a comparison whose variants are not all whole.
pub(crate) const RUN_THE_REST: &str = "not every variant is whole; `softdock run` makes the rest";

/// Compares what is there of every variant, and says it.
///
/// `missing` says what to do where not every variant is whole.
pub(crate) fn conclude(whole: &Folder, as_json: bool, missing: impl Into<String>) -> miette::Result<Exit> {
    let compared = judged(whole)?;
    let path = write(whole, &compared)?;
    match as_json {
        true => say(json(&as_value(&compared))),
        false => say(format!("{}\ncomparison  {}", compare_text(&compared), path.display())),
    }
    let exit = Exit::of_code(compared.exit_code);
    if exit == Exit::Incomplete {
        warn(missing.into());
    }
    Ok(exit)
}

/// The folders of the variants, below that of the campaign; what is not there is not made.
pub(crate) fn folders(whole: &Folder) -> miette::Result<Vec<Folder>> {
    let folder = |variant: &Variant| {
        let path = whole.path.join(&variant.name);
        let (extensions, judgements) = records(&path)?;
        let (campaign, file, model) = (variant.campaign.clone(), whole.file.clone(), whole.model.clone());
        let build = build_of_folder(&path)?;
        Ok(Folder { path, campaign, file, model, build, extensions, judgements })
    };
    whole.campaign.variants.iter().map(folder).collect()
}

/// Writes all pages again.
pub(crate) fn report(whole: &Folder) -> miette::Result<Exit> {
    for folder in folders(whole)?.into_iter().filter(|folder| folder.path.is_dir()) {
        judge(&folder)?;
    }
    let compared = judged(whole)?;
    let path = write(whole, &compared)?;
    say(format!("{}\n{}", whole.path.join("compare.json").display(), path.display()));
    Ok(Exit::of_code(compared.exit_code))
}

/// Says how far the variants are and what they have shown.
pub(crate) fn status(whole: &Folder, as_json: bool) -> miette::Result<Exit> {
    let compared = judged(whole)?;
    match as_json {
        true => say(json(&as_value(&compared))),
        false => say(compare_text(&compared)),
    }
    Ok(Exit::of_code(compared.exit_code))
}

/// Summaries of all variants, side by side.
fn judged(whole: &Folder) -> miette::Result<Compared> {
    let folders = folders(whole)?;
    let summaries: Vec<Summary> = folders
        .iter()
        .map(|folder| summarise(&folder.path, &folder.facts()).into_diagnostic())
        .collect::<miette::Result<_>>()?;
    let indexes: Vec<ShardIndex> = folders.iter().map(Folder::shards).collect::<miette::Result<_>>()?;
    let variants = whole.campaign.variants.iter().zip(&folders).zip(&indexes).zip(summaries);
    let inputs: Vec<VariantInput> = variants
        .map(|(((variant, folder), shards), summary)| VariantInput {
            shards,
            name: &variant.name,
            title: &variant.title,
            changes: &variant.changes,
            results: &folder.path,
            summary,
        })
        .collect();
    let c = &whole.campaign;
    compare(&c.id, &c.title, &c.comparison, &inputs).into_diagnostic()
}

fn write(whole: &Folder, compared: &Compared) -> miette::Result<PathBuf> {
    let c = &whole.campaign;
    // From inside the folder, so that no path of the machine stands in the page.
    let commands = [
        format!("softdock run campaign/{} --runs {} --seed {} --out again", whole.file, c.runs, c.seed),
        format!("softdock replay {} 0", c.variants[0].name),
        "softdock report .".to_owned(),
    ];
    write_compare(&whole.path, &c.comparison, compared, &c.text, &commands).into_diagnostic()
}

fn as_value(compared: &Compared) -> serde_json::Value {
    serde_json::to_value(compared).expect("a comparison is plain JSON")
}

/// Joins the parts of every variant and compares them.
pub(crate) fn merge(whole: &Folder, parts: &[PathBuf]) -> miette::Result<Exit> {
    for folder in folders(whole)? {
        let Some(name) = folder.path.file_name() else { continue };
        let own: Vec<PathBuf> = parts.iter().map(|part| part.join(name)).filter(|part| part.is_dir()).collect();
        if !join_parts(&folder, &folder.path, &own)? {
            return Ok(Exit::Incomplete);
        }
        finish(&folder)?;
    }
    conclude(whole, false, RUN_THE_REST)
}

/// The campaign on one of its facilities.
pub(crate) fn of_name(campaign: Campaign, name: &str) -> miette::Result<Campaign> {
    let names: Vec<&str> = campaign.variants.iter().map(|variant| variant.name.as_str()).collect();
    match campaign.variants.iter().find(|variant| variant.name == name) {
        Some(variant) => Ok(variant.campaign.clone()),
        None if names.is_empty() => Err(refuse("the campaign has no variants", "leave --variant out")),
        None => Err(refuse(format!("there is no variant `{name}`"), format!("write one of: {}", names.join(", ")))),
    }
}

/// Refuses a folder of variants where the runs of one are meant.
pub(crate) fn refuse_whole(folder: &Folder) -> miette::Result<()> {
    match folder.campaign.variants.first() {
        None => Ok(()),
        Some(first) => {
            let message = format!("`{}` holds the runs of several variants", folder.path.display());
            Err(refuse(message, format!("name one of them: {}", folder.path.join(&first.name).display())))
        }
    }
}
