//! Judgement of finished runs by other criteria, metrics and requirements, without new runs.

use crate::error::{FarmError, Result};
use crate::finish::{finish, write_summary_and_page};
use crate::folder::{Rejudgement, ResultsFolder};
use crate::manifest::Manifest;
use crate::observer::{Context, Note};
use crate::outcome::{Ended, Incomplete, Shown};
use crate::paths::normal;
use crate::variants;
use softdock_analysis::{Content, summarise};
use softdock_campaign::Campaign;
use std::path::Path;

/// Judges the runs of a results folder by `campaign`, or by the folder's own campaign if `None`. Every file of runs is
/// rewritten; only the time histories and the repeated runs are simulated.
///
/// # Errors
/// If the runs would not be those of the campaign: with the keys that differ.
pub fn judge(results: &Path, campaign: Option<Campaign>, context: Context) -> Result<Ended> {
    let campaign = match campaign {
        Some(campaign) => of_folder(campaign, results)?,
        None => ResultsFolder::open(results)?.campaign,
    };
    if campaign.variants.is_empty() {
        return conclude(&rejudged(results, campaign, context)?, context);
    }
    // The whole folder first: rejections precede any write.
    let (mut whole, rejudgement) = ResultsFolder::open_to_judge(results, campaign)?;
    for variant in whole.campaign.variants.clone() {
        let path = results.join(&variant.name);
        if Manifest::read(&path)?.is_some() {
            let folder = rejudged(&path, whole.campaign.on_variant(&variant), context)?;
            let index = folder.shards()?;
            match index.is_complete() {
                true => finish(&folder, index, context)?,
                false => write_summary_and_page(&folder, index)?,
            };
        }
    }
    if let Some(rejudgement) = rejudgement {
        whole.rejudge(rejudgement)?;
    }
    variants::conclude(&whole, Incomplete::VariantMissing)
}

/// The campaign, or the variant of it whose runs the folder holds.
fn of_folder(campaign: Campaign, results: &Path) -> Result<Campaign> {
    let id = Manifest::require(results)?.id;
    let Some(variant) = campaign.variant_of_id(&id) else { return Ok(campaign) };
    let whole = normal(results).parent().map(Path::to_owned).unwrap_or_default();
    if Manifest::require(&whole).is_ok_and(|manifest| manifest.id == campaign.id) {
        let message = format!("`{}` is one variant of a comparison", results.display());
        return Err(FarmError::refused(message, format!("judge all of them: softdock judge {}", whole.display())));
    }
    Ok(campaign.on_variant(variant))
}

/// The folder, its runs judged by the campaign.
fn rejudged(results: &Path, campaign: Campaign, context: Context) -> Result<ResultsFolder> {
    let (mut folder, rejudgement) = ResultsFolder::open_to_judge(results, campaign)?;
    let same = Rejudgement { before: folder.campaign.hash.clone(), changes: None };
    let rejudgement = rejudgement.unwrap_or(same);
    let changes = rejudgement.changes.as_ref().map(Vec::len);
    folder.rejudge(rejudgement)?;
    context.note(Note::Rejudged { campaign: folder.campaign.id.clone(), changes });
    Ok(folder)
}

/// Writes summary and page, if all runs exist.
fn conclude(folder: &ResultsFolder, context: Context) -> Result<Ended> {
    let index = folder.shards()?;
    if index.is_complete() {
        return Ok(Ended::new(folder, Shown::Campaign(Box::new(finish(folder, index, context)?))));
    }
    let incomplete = Incomplete::ShardsMissing { done: index.complete.len(), planned: index.plan.shards() };
    let summary = summarise(&Content::of_shards(&folder.path, index)?, &folder.facts())?;
    Ok(Ended { incomplete: Some(incomplete), ..Ended::new(folder, Shown::Campaign(Box::new(summary))) })
}
