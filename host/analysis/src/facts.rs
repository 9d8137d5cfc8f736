//! Campaign data for summary and report.

use softdock_campaign::requirement::{AgreementRequirement, Requirement};
use softdock_results::shards::{Origin, ShardIndex, ShardPlan};
use std::path::Path;

use crate::summary::{Extension, Judgement};

/// Policy for invalid runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InvalidRuns {
    /// A failure of every requirement: the policy for sign-off.
    CountAsFailures,
    /// Excluded from the verdict, and reported.
    ReportOnly,
}

/// Checked campaign, for the analysis.
#[derive(Clone, Debug)]
pub struct CampaignFacts<'a> {
    /// Id; also the name of the results folder.
    pub id: &'a str,
    /// Title.
    pub title: &'a str,
    /// The campaign file as it was read.
    pub text: &'a str,
    /// Hash of the checked campaign.
    pub hash: &'a str,
    /// Seed.
    pub seed: u64,
    /// Version of softdock that made the runs.
    pub version: &'a str,
    /// Commit of that build.
    pub commit: &'a str,
    /// Runs and their division into shards.
    pub plan: ShardPlan,
    /// Policy for invalid runs.
    pub invalid: InvalidRuns,
    /// False for exploratory samples (Sobol', Latin hypercube): binomial statements require independence.
    pub independent_runs: bool,
    /// True if the runs are given cases, which are not independent and permit no inference on other runs.
    pub given_cases: bool,
    /// Extensions of the campaign.
    pub extensions: &'a [Extension],
    /// Repeated judgements of the runs.
    pub judgements: &'a [Judgement],
    /// The requirements on single runs.
    pub requirements: &'a [Requirement],
    /// The requirements on the agreement of the facility with space.
    pub agreement: &'a [AgreementRequirement],
}

impl CampaignFacts<'_> {
    /// Returns this campaign's shards in a results folder, with all bytes and run numbers verified.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub fn shards(&self, results: &Path) -> std::result::Result<ShardIndex, softdock_results::ResultsError> {
        ShardIndex::scan(results, self.plan, &self.origin())
    }

    /// Returns the common origin of the campaign's rows.
    pub fn origin(&self) -> Origin {
        let [campaign_hash, version, commit] = [self.hash, self.version, self.commit].map(str::to_owned);
        Origin { campaign_hash, seed: self.seed, version, commit }
    }
}
