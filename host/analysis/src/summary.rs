//! The summary of a campaign: `summary.json`, the terminal's verdict and the report's tables in one type.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::exact::{Interval, Share};
use crate::parity::Parity;

/// Version of `summary.json`; keys are only added within one major.
pub const SUMMARY_SCHEMA: &str = "summary/3";

/// A verdict on one requirement or on a whole campaign.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Demonstrated with the asked probability and confidence.
    Verified,
    /// Not demonstrated.
    NotVerified,
    /// No statement: runs are missing, or they are not independent.
    Undecided,
}

impl Verdict {
    /// The verdict in capitals.
    pub fn word(self) -> &'static str {
        match self {
            Self::Verified => "VERIFIED",
            Self::NotVerified => "NOT VERIFIED",
            Self::Undecided => "UNDECIDED",
        }
    }
}

/// A whole campaign.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// [`SUMMARY_SCHEMA`].
    pub schema: String,
    /// Campaign id.
    pub campaign: String,
    /// Campaign title.
    pub title: String,
    /// Campaign hash.
    pub campaign_hash: String,
    /// Seed.
    pub seed: u64,
    /// Version of softdock that made the runs.
    pub version: String,
    /// The commit that it was built from.
    #[serde(default)]
    pub commit: String,
    /// Verdict of all requirements, each on its own subject; undecided without any.
    pub verdict: Verdict,
    /// 0 verified, 1 not verified, 3 incomplete.
    pub exit_code: u8,
    /// False if the sample is one for exploring.
    pub independent_runs: bool,
    /// True if the runs are given cases instead of a sample.
    #[serde(default)]
    pub given_cases: bool,
    /// When the campaign got more runs: a verdict after looking at an earlier one has less than the stated confidence.
    #[serde(default)]
    pub extensions: Vec<Extension>,
    /// When the runs were judged by other criteria or requirements than before.
    #[serde(default)]
    pub judgements: Vec<Judgement>,
    /// "count-as-failures" or "report-only".
    pub invalid_runs: String,
    /// Hash of every file that the verdict follows from, and of what was made from the runs: `softdock verify` computes it
    /// again.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub results_hash: Option<String>,
    /// Shards and runs.
    pub completeness: Completeness,
    /// Runs by status and flag.
    pub accounting: Accounting,
    /// One entry per requirement on single runs.
    pub requirements: Vec<RequirementSummary>,
    /// One entry per requirement on the agreement.
    pub agreement_requirements: Vec<RateSummary>,
    /// Runs in which every requirement on space holds in space; in which every requirement holds on the facility.
    pub joint: PerLoop<Share>,
    /// The facility's verdicts against those of space: the task's criteria and every requirement on space together.
    pub agreement: AgreementSummary,
    /// Why loops did not pass the task, most frequent first.
    pub causes: PerLoop<Vec<CauseCount>>,
    /// Runs repeated in f64, if there are any.
    pub parity: Option<Parity>,
    /// Runs repeated at half the substep, if there are any.
    #[serde(default)]
    pub half_step: Option<Parity>,
}

/// A campaign that got more runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Extension {
    /// Number of runs before.
    pub runs_before: u64,
    /// Number of runs after.
    pub runs_after: u64,
}

/// Runs that were judged anew: by other criteria, metrics or requirements than before.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Judgement {
    /// Hash of the campaign by which the runs were judged before.
    pub hash_before: String,
    /// Hash of the campaign by which they were judged then.
    pub hash_after: String,
    /// The changed keys, each with its old and new value.
    pub changes: Vec<String>,
}

/// The same quantity for both loops.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PerLoop<T> {
    /// In space.
    pub space: T,
    /// On the facility.
    pub facility: T,
}

/// What is planned and what is there.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Completeness {
    /// Runs of the campaign.
    pub runs_planned: u64,
    /// Runs in whole shards.
    pub runs_done: u64,
    /// Shards of the campaign.
    pub shards_planned: u32,
    /// Whole shards.
    pub shards_done: u32,
    /// The first missing shards, at most 100.
    pub shards_missing: Vec<u32>,
    /// Who computed how many shards.
    pub devices: Vec<DeviceShards>,
    /// Files among the shards that count for nothing: damaged, of another campaign, or stray.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub ignored: Vec<IgnoredFile>,
}

/// A file that counts for nothing.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct IgnoredFile {
    /// Its name below the results folder.
    pub file: String,
    /// Why it does not count.
    pub reason: String,
}

impl Completeness {
    /// True if every shard is there.
    pub fn is_complete(&self) -> bool {
        self.shards_done == self.shards_planned
    }
}

/// Shards of one device.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct DeviceShards {
    /// `cpu` or `gpu`.
    pub backend: String,
    /// The device, as its driver calls it.
    pub device: String,
    /// Number of shards.
    pub shards: u32,
}

impl DeviceShards {
    /// Sums shards by backend and device, sorted by both.
    pub(crate) fn summed<'a>(shards: impl Iterator<Item = (&'a str, &'a str, u32)>) -> Vec<Self> {
        let mut devices: BTreeMap<(&str, &str), u32> = BTreeMap::new();
        for (backend, device, shards) in shards {
            *devices.entry((backend, device)).or_default() += shards;
        }
        let of = |((backend, device), shards): ((&str, &str), u32)| Self {
            backend: backend.to_owned(),
            device: device.to_owned(),
            shards,
        };
        devices.into_iter().map(of).collect()
    }
}

/// Runs by what became of them; none is left out.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Accounting {
    /// Every requirement on space holds; without any, the task succeeds in space.
    pub pass: u64,
    /// Some of these does not hold.
    pub fail: u64,
    /// The numbers cannot be trusted.
    pub invalid: u64,
    /// Runs with each flag that occurs.
    pub flags: Vec<FlagCount>,
}

impl Accounting {
    /// All runs.
    pub fn runs(&self) -> u64 {
        self.pass + self.fail + self.invalid
    }
}

/// Runs with one flag.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FlagCount {
    /// Name of the flag.
    pub flag: String,
    /// What it means.
    pub meaning: String,
    /// Whether it makes a run invalid.
    pub invalidates: bool,
    /// Runs that carry it.
    pub runs: u64,
    /// Runs that carry it and are invalid.
    pub invalid_runs: u64,
}

/// One requirement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RequirementSummary {
    /// Id as in the user's documents.
    pub id: String,
    /// Id in column names.
    pub column_id: String,
    /// Text.
    pub text: String,
    /// The requirement as a sentence with its numbers.
    pub sentence: String,
    /// Where it must hold: `space` or `facility`.
    pub subject: String,
    /// Verdict on its subject.
    pub verdict: Verdict,
    /// Metric.
    pub metric: String,
    /// Unit of metric, limits and margin.
    pub unit: String,
    /// Upper limit.
    pub at_most: Option<f64>,
    /// Lower limit.
    pub at_least: Option<f64>,
    /// Share of cases that must pass.
    pub probability: f64,
    /// Confidence of the demonstration.
    pub confidence: f64,
    /// In space and on the facility.
    pub loops: PerLoop<LoopSummary>,
    /// The facility's verdicts on this requirement alone against those of space; null for one on the facility.
    pub agreement: Option<AgreementSummary>,
}

/// One requirement on the agreement of the facility with space.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RateSummary {
    /// Id as in the user's documents.
    pub id: String,
    /// Text.
    pub text: String,
    /// The requirement as a sentence with its numbers.
    pub sentence: String,
    /// Verdict.
    pub verdict: Verdict,
    /// `false_pass_rate`, `false_fail_rate` or `abort_rate`.
    pub rate: String,
    /// Greatest rate that is accepted.
    pub at_most: f64,
    /// Confidence of the demonstration.
    pub confidence: f64,
    /// Wrong or missing answers among the cases; invalid runs stand in both if they count as failures.
    pub share: Share,
    /// Invalid runs among them.
    pub invalid: u64,
    /// Wrong or missing answers with which these cases still demonstrate the requirement; null if no number does, or if
    /// the runs are not independent.
    pub allowed: Option<u64>,
    /// One-sided Clopper-Pearson bound of the rate, at the requirement's confidence; null if the runs are not
    /// independent.
    pub bound: Option<f64>,
    /// The draws of the epistemic inputs, if there are several.
    pub outer: Option<OuterSummary>,
}

/// One requirement in one loop.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LoopSummary {
    /// The verdict that this loop would have; the requirement's own is that of its subject.
    pub verdict: Verdict,
    /// Runs that the verdict stands on.
    pub runs: u64,
    /// Failures among them, counted invalid runs and aborted sessions included.
    pub failures: u64,
    /// Why they failed, most frequent first.
    pub causes: Vec<CauseCount>,
    /// Invalid runs.
    pub invalid: u64,
    /// Failures with which the planned runs still demonstrate the requirement; null if no number does, or if the runs
    /// are not independent.
    pub allowed: Option<u64>,
    /// One-sided Clopper-Pearson bound of the failure rate, at the requirement's confidence; null if the runs are not
    /// independent.
    pub failure_rate_bound: Option<f64>,
    /// Two-sided Wilson interval of the failure rate (informative); null if the runs are not independent.
    pub wilson: Option<Interval>,
    /// The valid run with the smallest margin.
    pub worst: Option<RunMargin>,
    /// Wilks: at least the asked share of all cases lies above this margin, at the asked confidence.
    pub tolerance_limit: Option<RunMargin>,
    /// The draws of the epistemic inputs, if there are several.
    pub outer: Option<OuterSummary>,
}

/// Runs that did not pass for one cause.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CauseCount {
    /// `fail`, `aborted` or `invalid`.
    pub outcome: String,
    /// Id of the criterion, rule or flag; of a requirement: `limit` (its metric is beyond it) or `no_value`.
    pub cause: String,
    /// The phase of the run in which it was: `approach`, `contact`, `latch` or `none`.
    pub phase: String,
    /// Number of runs.
    pub runs: u64,
    /// The limit, in the SI unit of the criterion or rule, if it is one number.
    pub limit: Option<f64>,
    /// Least and greatest value that broke it, in that unit.
    pub values: Option<[f64; 2]>,
    /// The first runs, at most 10.
    pub examples: Vec<u64>,
}

/// A run and its margin.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunMargin {
    /// Run number.
    pub run: u64,
    /// Margin, positive inside the limit.
    pub margin: f64,
}

/// Verdicts over the outer draws.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OuterSummary {
    /// Number of draws.
    pub draws: u64,
    /// Draws whose own runs demonstrate the requirement.
    pub verified: u64,
    /// Number of the draw with the highest failure bound.
    pub worst_draw: u32,
    /// Runs of that draw.
    pub worst_runs: u64,
    /// Failures among them.
    pub worst_failures: u64,
    /// One-sided Clopper-Pearson bound of its failure rate.
    pub worst_bound: f64,
}

/// Counts and rates of the facility's verdicts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AgreementSummary {
    /// Both pass; share of all runs.
    pub true_pass: Share,
    /// The facility passes what fails in space; share of all runs.
    pub false_pass: Share,
    /// Both fail; share of all runs.
    pub true_fail: Share,
    /// The facility fails what passes in space; share of all runs.
    pub false_fail: Share,
    /// The facility gives no answer to what passes in space; share of all runs.
    pub aborted_pass: Share,
    /// The facility gives no answer to what fails in space; share of all runs.
    pub aborted_fail: Share,
    /// Invalid; share of all runs.
    pub invalid: Share,
    /// Aborted sessions among the valid runs.
    pub abort_rate: Share,
    /// False passes among the runs that fail in space.
    pub false_pass_rate: Share,
    /// False fails among the runs that pass in space.
    pub false_fail_rate: Share,
    /// Runs that fail in space among the runs that the facility passes.
    pub misleading_passes: Share,
}
