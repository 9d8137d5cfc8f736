//! Campaigns with variants: each facility is run, judged and reported in its own folder, then all are compared.

use crate::clear::clear;
use crate::error::{FarmError, Result};
use crate::finish::{finish, write_summary_and_page};
use crate::folder::ResultsFolder;
use crate::join::join_parts;
use crate::make::{RunOptions, make_missing};
use crate::observer::Context;
use crate::outcome::{Ended, Incomplete, Shown};
use crate::run_engine::RunEngine;
use softdock_analysis::{Compared, Content, VariantInput, compare, summarise, write_compare};
use softdock_campaign::Campaign;
use std::path::{Path, PathBuf};

/// Runs every variant, or what is missing of it, then compares them.
pub(crate) fn run(campaign: Campaign, results: &Path, options: &RunOptions, context: Context) -> Result<Ended> {
    // The engine first: a campaign that cannot run creates no folder.
    drop(RunEngine::open(&campaign.on_variant(&campaign.variants[0]), options.choice, context)?);
    if options.is_fresh {
        clear(results, campaign.files(), context)?;
    }
    let whole = ResultsFolder::claim(results, campaign, context)?;
    for folder in whole.variants()? {
        let folder = ResultsFolder::claim(&folder.path, folder.campaign, context)?;
        let scene = folder.campaign.clone();
        let mut engine = RunEngine::open(&scene, options.choice, context)?;
        if let Some(incomplete) = make_missing(&folder, options, &mut engine, context)? {
            return Ok(Ended { incomplete: Some(incomplete), ..Ended::new(&whole, Shown::Nothing) });
        }
        if context.cancel.is_cancelled() {
            break;
        }
        let index = folder.shards()?;
        if index.is_complete() {
            match finish(&folder, index, context) {
                Err(FarmError::Cancelled) => break,
                summary => drop(summary?),
            }
        }
    }
    let missing = match options.part.count {
        1 => Incomplete::VariantMissing,
        _ => Incomplete::PartMade(options.part),
    };
    conclude(&whole, missing)
}

/// Compares what exists of every variant and writes the comparison; `missing` is the reason where one is not complete.
pub(crate) fn conclude(whole: &ResultsFolder, missing: Incomplete) -> Result<Ended> {
    let compared = compared(whole)?;
    write(whole, &compared)?;
    let incomplete = (compared.exit_code == 3).then_some(missing);
    Ok(Ended { incomplete, ..Ended::new(whole, Shown::Variants(Box::new(compared))) })
}

/// Writes all pages again.
pub(crate) fn report(whole: &ResultsFolder) -> Result<Ended> {
    for folder in whole.variants()?.into_iter().filter(|folder| folder.path.is_dir()) {
        write_summary_and_page(&folder, folder.shards()?)?;
    }
    conclude(whole, Incomplete::VariantMissing)
}

/// Summaries of all variants, side by side.
pub(crate) fn compared(whole: &ResultsFolder) -> Result<Compared> {
    let folders = whole.variants()?;
    let contents: Vec<Content> =
        folders.iter().map(|folder| Ok(Content::read(&folder.path, &folder.facts())?)).collect::<Result<_>>()?;
    let variants = whole.campaign.variants.iter().zip(&folders).zip(&contents);
    let inputs: Vec<VariantInput> = variants
        .map(|((variant, folder), content)| {
            Ok(VariantInput {
                shards: &content.shards,
                name: &variant.name,
                title: &variant.title,
                changes: &variant.changes,
                results: &folder.path,
                summary: summarise(content, &folder.facts())?,
            })
        })
        .collect::<Result<_>>()?;
    let c = &whole.campaign;
    Ok(compare(&c.id, &c.title, &c.comparison, &inputs)?)
}

fn write(whole: &ResultsFolder, compared: &Compared) -> Result<PathBuf> {
    let c = &whole.campaign;
    // Relative to the folder, so that the page contains no path of the machine.
    let commands = [
        format!("softdock run campaign/{} --runs {} --seed {} --out again", whole.file, c.runs, c.seed),
        format!("softdock replay {} 0", c.variants[0].name),
        "softdock report .".to_owned(),
    ];
    Ok(write_compare(&whole.path, &c.comparison, compared, &c.text, &commands)?)
}

/// Joins the parts of every variant and compares them.
pub(crate) fn merge(whole: &ResultsFolder, parts: &[PathBuf], context: Context) -> Result<Ended> {
    for folder in whole.variants()? {
        let Some(name) = folder.path.file_name() else { continue };
        let own: Vec<PathBuf> = parts.iter().map(|part| part.join(name)).filter(|part| part.is_dir()).collect();
        match join_parts(&folder, &folder.path, &own, context)? {
            Ok((folder, index)) => drop(finish(&folder, index, context)?),
            Err(missing) => return Ok(Ended { incomplete: Some(missing), ..Ended::new(whole, Shown::Nothing) }),
        }
    }
    conclude(whole, Incomplete::VariantMissing)
}
