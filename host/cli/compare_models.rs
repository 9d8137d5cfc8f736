//! How a campaign's verdicts change with what a diagnosis found: the same campaign with and without it.

use crate::args::choice;
use crate::farm::Farm;
use crate::progress::Progress;
use crate::run::unusable;
use crate::words::{explain, refuse};
use softdock_analysis::compare_models::{ModelComparison, ModelVerdicts};
use softdock_campaign::Campaign;
use std::path::Path;

/// Draws of what was found, each for its share of the runs.
const DRAWS: u32 = 20;

/// Runs a campaign with the scenario that it names and with an extended one, over the posterior of what was found.
pub(crate) fn compare_models(campaign: &Path, extended: &Path, runs: Option<u64>) -> miette::Result<ModelComparison> {
    let sampled = |campaign: Campaign| {
        let (runs, seed) = (runs.unwrap_or(campaign.runs), campaign.seed);
        campaign.with_sample(runs, seed)
    };
    let before = sampled(Campaign::load(campaign).map_err(explain)?);
    let after = sampled(Campaign::load_with(campaign, Some(extended)).map_err(explain)?);
    if before.scenario.id != after.scenario.id {
        let message = format!("`{}` is of another scenario, {}", campaign.display(), before.scenario.id);
        return Err(refuse(message, format!("name a campaign of the scenario {}", after.scenario.id)));
    }
    let draws = DRAWS.min(u32::try_from(after.runs).unwrap_or(DRAWS));
    let uncertain = after.scenario.found.iter().any(softdock_campaign::FoundEffect::is_uncertain);
    let after = if uncertain { after.over_posterior(draws) } else { after };
    Ok(ModelComparison {
        campaign: before.id.clone(),
        before: verdicts(&before, "as it is")?,
        after: verdicts(&after, "with what was found")?,
    })
}

fn verdicts(campaign: &Campaign, what: &'static str) -> miette::Result<ModelVerdicts> {
    let mut farm = Farm::open(campaign, choice(campaign.execution.backend)).map_err(unusable)?;
    let progress = Progress::new(what, campaign.runs);
    let rows = farm.make(0..campaign.runs, &|ended| progress.add(ended)).map_err(unusable)?;
    Ok(ModelVerdicts::of(campaign, &rows))
}
