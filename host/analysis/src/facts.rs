//! What summary and report must know of a campaign.

use softdock_campaign::requirement::{AgreementRequirement, Requirement};
use softdock_results::shards::{Origin, ShardIndex, ShardPlan};
use std::path::Path;

use crate::summary::{Extension, Judgement};

/// What an invalid run counts as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InvalidRuns {
    /// A failure of every requirement: the policy for sign-off.
    CountAsFailures,
    /// Nothing; they are reported, and the verdict stands on the other runs.
    ReportOnly,
}

/// A checked campaign, as far as the analysis looks at it.
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
    /// The commit that it was built from.
    pub commit: &'a str,
    /// Runs and how they are cut into shards.
    pub plan: ShardPlan,
    /// What an invalid run counts as.
    pub invalid: InvalidRuns,
    /// False for Sobol and Latin hypercube samples: they are for exploring, binomial statements need independence.
    pub independent_runs: bool,
    /// True if the runs are given cases: nothing can be concluded from them on other runs. They are not independent.
    pub given_cases: bool,
    /// When the campaign got more runs.
    pub extensions: &'a [Extension],
    /// When the runs were judged anew.
    pub judgements: &'a [Judgement],
    /// The requirements on single runs.
    pub requirements: &'a [Requirement],
    /// The requirements on the agreement of the facility with space.
    pub agreement: &'a [AgreementRequirement],
}

impl CampaignFacts<'_> {
    /// The shards of a results folder that are this campaign's; every byte and run number of them has been checked.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub fn shards(&self, results: &Path) -> std::result::Result<ShardIndex, softdock_results::ResultsError> {
        ShardIndex::scan(results, self.plan, &self.origin())
    }

    /// What the campaign's rows have in common.
    pub fn origin(&self) -> Origin {
        let [campaign_hash, version, commit] = [self.hash, self.version, self.commit].map(str::to_owned);
        Origin { campaign_hash, seed: self.seed, version, commit }
    }
}
