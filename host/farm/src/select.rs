//! Overrides of a campaign: model, number of runs, seed, variant, given cases, or values of single keys.

use crate::cases;
use crate::error::{FarmError, Result};
use crate::observer::Context;
use softdock_campaign::campaign::MOST_SHARDS;
use softdock_campaign::{Campaign, Settings};
use std::path::{Path, PathBuf};

/// Overrides of a campaign file.
#[derive(Clone, Debug, Default)]
pub struct Selection {
    /// Scenario that replaces the campaign's own.
    pub model: Option<PathBuf>,
    /// Number of runs.
    pub runs: Option<u64>,
    /// Seed.
    pub seed: Option<u64>,
    /// Name of one variant.
    pub variant: Option<String>,
    /// Table of given cases that replaces the draws.
    pub cases: Option<PathBuf>,
    /// Values in the place of those that campaign, scenario and facility file write.
    pub settings: Settings,
}

impl Selection {
    /// Results folder of the campaign `id`: `out` or `results/ID`, with a subfolder for a single variant.
    pub fn results(&self, out: Option<&Path>, id: &str) -> PathBuf {
        match (out, &self.variant) {
            (Some(out), Some(variant)) => out.join(variant),
            (Some(out), None) => out.to_owned(),
            (None, _) => crate::default_results(&format!("{id}{}", if self.cases.is_some() { "_cases" } else { "" })),
        }
    }
}

/// Loads a campaign file with a selection.
///
/// # Errors
/// If a file is wrong, or the selection does not fit the campaign.
pub fn load_campaign(file: &Path, selection: &Selection, context: Context) -> Result<Campaign> {
    let campaign = Campaign::load_set(file, selection.model.as_deref(), &selection.settings)?;
    select(campaign, file, selection, context)
}

/// Loads a campaign from a text in the place of the file `file`, with a selection.
///
/// # Errors
/// As [`load_campaign`].
pub fn load_campaign_text(file: &Path, text: String, selection: &Selection, context: Context) -> Result<Campaign> {
    let campaign = Campaign::load_text(file, text, selection.model.as_deref(), &selection.settings)?;
    select(campaign, file, selection, context)
}

fn select(campaign: Campaign, file: &Path, selection: &Selection, context: Context) -> Result<Campaign> {
    let (runs, seed) = (selection.runs.unwrap_or(campaign.runs), selection.seed.unwrap_or(campaign.seed));
    let campaign = match &selection.variant {
        Some(name) => of_variant(campaign, name)?,
        None => campaign,
    };
    let campaign = campaign.with_sample(runs, seed);
    let most = campaign.method.most_runs();
    if campaign.runs > most {
        let message = format!("{} runs, but a Sobol' sequence has {most} points", campaign.runs);
        return Err(FarmError::refused(message, format!("write --runs {most} or less, or another sampling.method")));
    }
    let shards = campaign.runs.div_ceil(campaign.execution.shard_runs.max(1));
    if shards > MOST_SHARDS {
        let message = format!(
            "{} runs in shards of {} are {shards} shards, and a results folder has {MOST_SHARDS} at most",
            campaign.runs, campaign.execution.shard_runs
        );
        return Err(FarmError::refused(message, "write fewer runs, or a larger execution.shard_runs"));
    }
    if let Some(draws) = campaign.outer_draws.filter(|draws| campaign.runs < u64::from(*draws)) {
        let message = format!("{} runs cannot hold {draws} outer draws", campaign.runs);
        return Err(FarmError::refused(message, format!("write --runs {draws} or more")));
    }
    let Some(table) = &selection.cases else { return Ok(campaign) };
    if let Some(variant) = campaign.variants.first() {
        let message = format!("`{}` has variants, and given cases are run on one facility", file.display());
        return Err(FarmError::refused(message, format!("choose one: --variant {}", variant.name)));
    }
    let table = cases::read_cases(table)?;
    context.note(cases::note(&table));
    Ok(campaign.with_cases(table)?)
}

/// The campaign on one of its facilities.
fn of_variant(campaign: Campaign, name: &str) -> Result<Campaign> {
    let names: Vec<&str> = campaign.variants.iter().map(|variant| variant.name.as_str()).collect();
    match campaign.variants.iter().find(|variant| variant.name == name) {
        Some(variant) => Ok(campaign.on_variant(variant)),
        None if names.is_empty() => Err(FarmError::refused("the campaign has no variants", "leave --variant out")),
        None => Err(FarmError::refused(
            format!("there is no variant `{name}`"),
            format!("write one of: {}", names.join(", ")),
        )),
    }
}
