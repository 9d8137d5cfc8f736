//! Verdicts of a campaign with and without an extended model.

use crate::choice_of;
use crate::error::{FarmError, Result};
use crate::observer::{Context, Progress, Work};
use crate::run_engine::{RunEngine, counting};
use serde_json::{Value, json};
use softdock_analysis::exact::pooled;
use softdock_analysis::number::significant;
use softdock_campaign::Campaign;
use softdock_results::runs::{Agreement, Outcome, RunRow};
use std::path::Path;

/// Draws of the identified effects, each for its share of the runs.
const DRAWS: u32 = 20;
/// Confidence of the intervals.
const CONFIDENCE: f64 = 0.95;

/// A share of runs with its interval of 95 %.
#[derive(Clone, Copy, Debug)]
struct Share {
    value: f64,
    lo: f64,
    hi: f64,
}

/// A campaign's verdicts with one model.
#[derive(Clone, Debug)]
struct Verdicts {
    runs: u64,
    invalid: u64,
    space_success: Share,
    hil_success: Share,
    false_pass: Share,
    false_fail: Share,
    aborted: Share,
}

/// Verdicts of a campaign with its own model and with an extended one.
#[derive(Clone, Debug)]
pub struct ModelComparison {
    campaign: String,
    before: Verdicts,
    after: Verdicts,
}

impl ModelComparison {
    /// Runs a campaign with the scenario that it names and with an extended one, over the posterior of the identified
    /// effects; `runs` in the place of the campaign's number of runs.
    ///
    /// # Errors
    /// If a file is wrong, the scenarios have different ids, or no engine can make the runs.
    pub fn of(campaign: &Path, extended: &Path, runs: Option<u64>, context: Context) -> Result<Self> {
        let sampled = |campaign: Campaign| {
            let (runs, seed) = (runs.unwrap_or(campaign.runs), campaign.seed);
            campaign.with_sample(runs, seed)
        };
        let before = sampled(Campaign::load(campaign)?);
        let after = sampled(Campaign::load_with(campaign, Some(extended))?);
        if before.scenario.id != after.scenario.id {
            let message = format!("`{}` is of another scenario, {}", campaign.display(), before.scenario.id);
            return Err(FarmError::refused(message, format!("name a campaign of the scenario {}", after.scenario.id)));
        }
        let draws = DRAWS.min(u32::try_from(after.runs).unwrap_or(DRAWS));
        let uncertain = after.scenario.identified.iter().any(softdock_campaign::IdentifiedEffect::is_uncertain);
        let after = if uncertain { after.over_posterior(draws) } else { after };
        let id = before.id.clone();
        Ok(Self {
            campaign: id,
            before: verdicts(&before, Work::OwnModel, context)?,
            after: verdicts(&after, Work::ExtendedModel, context)?,
        })
    }

    /// As JSON.
    pub fn json(&self) -> Value {
        json!({ "campaign": self.campaign, "before": self.before.json(), "after": self.after.json() })
    }

    /// As a table.
    pub fn text(&self) -> String {
        let row = |name: &str, of: fn(&Verdicts) -> Share| {
            format!("  {name:<22}{:<30}{}\n", shown(of(&self.before)), shown(of(&self.after)))
        };
        let mut out = format!("{}, {} runs each; shares with intervals of 95 %\n", self.campaign, self.after.runs);
        out += &format!("  {:<22}{:<30}{}\n", "", "model as it is", "extended model");
        out += &row("success in space", |v| v.space_success);
        out += &row("success on facility", |v| v.hil_success);
        out += &row("false passes", |v| v.false_pass);
        out += &row("false fails", |v| v.false_fail);
        out + &row("aborted sessions", |v| v.aborted)
    }
}

impl Verdicts {
    fn json(&self) -> Value {
        let share = |share: Share| json!({ "value": share.value, "lo": share.lo, "hi": share.hi });
        json!({
            "runs": self.runs, "invalid": self.invalid,
            "space_success": share(self.space_success), "hil_success": share(self.hil_success),
            "false_pass": share(self.false_pass), "false_fail": share(self.false_fail),
            "aborted": share(self.aborted),
        })
    }
}

fn shown(share: Share) -> String {
    let percent = |value: f64| significant(100.0 * value, 3);
    format!("{} % ({} to {})", percent(share.value), percent(share.lo), percent(share.hi))
}

fn verdicts(campaign: &Campaign, work: Work, context: Context) -> Result<Verdicts> {
    let mut engine = RunEngine::open(campaign, choice_of(campaign), context)?;
    let progress = Progress::new(context, work, campaign.runs);
    let numbers: Vec<u64> = (0..campaign.runs).collect();
    let (rows, is_whole) = engine.make_numbered(&numbers, &counting(&progress))?;
    if !is_whole {
        return Err(FarmError::Cancelled);
    }
    let share = |is: &dyn Fn(&RunRow) -> bool| {
        let draws = campaign.outer_draws.unwrap_or(1);
        let mut counts = vec![(0, 0); draws as usize];
        for row in rows.iter().filter(|row| row.agreement != Agreement::Invalid) {
            let count = &mut counts[row.outer as usize];
            count.0 += u64::from(is(row));
            count.1 += 1;
        }
        let (value, interval) = pooled(&counts, CONFIDENCE);
        Share { value, lo: interval.lo, hi: interval.hi }
    };
    Ok(Verdicts {
        runs: campaign.runs,
        invalid: rows.iter().filter(|row| row.agreement == Agreement::Invalid).count() as u64,
        space_success: share(&|row| row.space.outcome == Outcome::Pass),
        hil_success: share(&|row| row.hil.outcome == Outcome::Pass),
        false_pass: share(&|row| row.agreement == Agreement::FalsePass),
        false_fail: share(&|row| row.agreement == Agreement::FalseFail),
        aborted: share(&|row| row.agreement.is_aborted()),
    })
}
