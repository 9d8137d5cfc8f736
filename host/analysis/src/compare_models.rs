//! Verdicts of one campaign with two models: as it is, and extended by what a diagnosis found.

use crate::exact::pooled;
use crate::number::significant;
use serde::Serialize;
use softdock_campaign::Campaign;
use softdock_results::runs::{Agreement, Outcome, RunRow};

/// Confidence of the intervals.
const CONFIDENCE: f64 = 0.95;

/// A share of runs with its interval of 95 %.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ShareOfRuns {
    /// The share, 0 to 1.
    pub value: f64,
    /// Lower end of the interval.
    pub lo: f64,
    /// Upper end of the interval.
    pub hi: f64,
}

/// A campaign's verdicts with one model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModelVerdicts {
    /// Runs.
    pub runs: u64,
    /// Invalid runs; no share counts them.
    pub invalid: u64,
    /// Runs that succeed in space.
    pub space_success: ShareOfRuns,
    /// Runs that succeed on the facility.
    pub hil_success: ShareOfRuns,
    /// Runs that succeed on the facility alone.
    pub false_pass: ShareOfRuns,
    /// Runs that succeed in space alone.
    pub false_fail: ShareOfRuns,
    /// Runs whose session was aborted.
    pub aborted: ShareOfRuns,
}

/// The verdicts with the model as it is, and with what was found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModelComparison {
    /// Campaign.
    pub campaign: String,
    /// With the model as it is.
    pub before: ModelVerdicts,
    /// With the extended model.
    pub after: ModelVerdicts,
}

impl ModelComparison {
    /// As a table.
    pub fn text(&self) -> String {
        let row = |name: &str, of: fn(&ModelVerdicts) -> ShareOfRuns| {
            format!("  {name:<22}{:<30}{}\n", shown(of(&self.before)), shown(of(&self.after)))
        };
        let mut out = format!("{}, {} runs each; shares with intervals of 95 %\n", self.campaign, self.after.runs);
        out += &format!("  {:<22}{:<30}{}\n", "", "model as it is", "with what was found");
        out += &row("success in space", |v| v.space_success);
        out += &row("success on facility", |v| v.hil_success);
        out += &row("false passes", |v| v.false_pass);
        out += &row("false fails", |v| v.false_fail);
        out + &row("aborted sessions", |v| v.aborted)
    }
}

impl ModelVerdicts {
    /// The verdicts of all runs of a campaign.
    pub fn of(campaign: &Campaign, rows: &[RunRow]) -> Self {
        let share = |is: &dyn Fn(&RunRow) -> bool| {
            let draws = campaign.outer_draws.unwrap_or(1);
            let mut counts = vec![(0, 0); draws as usize];
            for row in rows.iter().filter(|row| row.agreement != Agreement::Invalid) {
                let count = &mut counts[row.outer as usize];
                count.0 += u64::from(is(row));
                count.1 += 1;
            }
            let (value, interval) = pooled(&counts, CONFIDENCE);
            ShareOfRuns { value, lo: interval.lo, hi: interval.hi }
        };
        Self {
            runs: campaign.runs,
            invalid: rows.iter().filter(|row| row.agreement == Agreement::Invalid).count() as u64,
            space_success: share(&|row| row.space.outcome == Outcome::Pass),
            hil_success: share(&|row| row.hil.outcome == Outcome::Pass),
            false_pass: share(&|row| row.agreement == Agreement::FalsePass),
            false_fail: share(&|row| row.agreement == Agreement::FalseFail),
            aborted: share(&|row| row.agreement.is_aborted()),
        }
    }
}

fn shown(share: ShareOfRuns) -> String {
    let percent = |value: f64| significant(100.0 * value, 3);
    format!("{} % ({} to {})", percent(share.value), percent(share.lo), percent(share.hi))
}
