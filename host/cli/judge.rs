//! `softdock judge`: finished runs judged by other criteria, metrics and requirements, without new runs.

use crate::args::JudgeArgs;
use crate::finish::{finish, judge as write_summary_and_page};
use crate::folder::{Folder, Rejudged, id_of, normal};
use crate::progress::listen;
use crate::run::tell;
use crate::variants;
use crate::words::{Exit, explain, refuse, say, warn};
use miette::IntoDiagnostic;
use softdock_analysis::summarise;
use softdock_campaign::Campaign;
use std::path::Path;

/// Judges a results folder again.
pub(crate) fn judge(args: &JudgeArgs) -> miette::Result<Exit> {
    listen();
    let campaign = match &args.campaign {
        Some(file) => of_folder(Campaign::load_with(file, args.model.as_deref()).map_err(explain)?, args)?,
        None => Folder::open(&args.results)?.campaign,
    };
    if campaign.variants.is_empty() {
        return conclude(&judged(&args.results, campaign)?, args);
    }
    // The whole first: what it refuses is refused before anything is written.
    let (mut whole, rejudged) = Folder::open_to_judge(&args.results, campaign)?;
    for variant in whole.campaign.variants.clone() {
        let path = args.results.join(&variant.name);
        if path.join("campaign.json").is_file() {
            let folder = judged(&path, variant.campaign)?;
            match folder.shards()?.is_complete() {
                true => finish(&folder)?,
                false => write_summary_and_page(&folder)?,
            };
        }
    }
    if let Some(rejudged) = rejudged {
        whole.rejudge(rejudged)?;
    }
    variants::conclude(&whole, args.json, variants::RUN_THE_REST)
}

/// The campaign, or the variant of it whose runs the folder holds.
fn of_folder(campaign: Campaign, args: &JudgeArgs) -> miette::Result<Campaign> {
    let id = id_of(&args.results)?;
    let Some(variant) = campaign.variants.iter().find(|variant| variant.campaign.id == id) else { return Ok(campaign) };
    let whole = normal(&args.results).parent().map(Path::to_owned).unwrap_or_default();
    if id_of(&whole).is_ok_and(|id| id == campaign.id) {
        let message = format!("`{}` is one variant of a comparison", args.results.display());
        return Err(refuse(message, format!("judge all of them: softdock judge {}", whole.display())));
    }
    Ok(variant.campaign.clone())
}

/// The folder, its runs judged by the campaign.
fn judged(results: &Path, campaign: Campaign) -> miette::Result<Folder> {
    let (mut folder, rejudged) = Folder::open_to_judge(results, campaign)?;
    let same = Rejudged { before: folder.campaign.hash.clone(), changes: None };
    let rejudged = rejudged.unwrap_or(same);
    let what = match &rejudged.changes {
        Some(changes) => format!("by a campaign that differs in {} keys (recorded in campaign.json)", changes.len()),
        None => "by the campaign of the folder".to_owned(),
    };
    folder.rejudge(rejudged)?;
    warn(format!("{}  judged again {what}; no run was made", folder.campaign.id));
    Ok(folder)
}

/// Writes and reports what the runs show.
fn conclude(folder: &Folder, args: &JudgeArgs) -> miette::Result<Exit> {
    let index = folder.shards()?;
    if !index.is_complete() {
        tell(&summarise(&folder.path, &folder.facts()).into_diagnostic()?, args.json);
        warn(format!("{} of {} shards; `softdock run` makes the others", index.complete.len(), index.plan.shards()));
        return Ok(Exit::Incomplete);
    }
    let summary = finish(folder)?;
    tell(&summary, args.json);
    if !args.json {
        say(format!("\nreport  {}", folder.path.join("report.html").display()));
    }
    Ok(Exit::of(&summary))
}
