//! From counts to verdicts: builds the [`Summary`] of a results folder.

use std::collections::BTreeMap;
use std::path::Path;

use softdock_campaign::requirement::{AgreementRequirement, Rate, Requirement, Subject};
use softdock_kernels::metrics::flags;
use softdock_results::parity::{HALF_STEP, PARITY, Repetition, read_repetition};
use softdock_results::runs::{AGREEMENT_WORDS, Agreement, Status};
use softdock_results::shards::ShardIndex;

use crate::content::Content;
use crate::exact::{READING_CONFIDENCE, Share, allowed_failures, upper_bound, wilson};
use crate::facts::{CampaignFacts, InvalidRuns};
use crate::parity::Parity;
use crate::summary::{
    Accounting, AgreementSummary, Completeness, DeviceShards, FlagCount, IgnoredFile, LoopSummary, OuterSummary,
    PerLoop, RateSummary, RequirementSummary, SUMMARY_SCHEMA, Summary, Verdict,
};
use crate::tally::{AgreementCounts, DrawCount, LoopTally, Tally};
use crate::{AnalysisError, Result};

/// Missing shards that a summary lists.
const LISTED_SHARDS: usize = 100;

/// Reads a results folder and judges it; see [`summarise`].
///
/// # Errors
/// If the folder cannot be read.
pub fn summarise_folder(results: &Path, facts: &CampaignFacts) -> Result<Summary> {
    summarise(&Content::read(results, facts)?, facts)
}

/// Judges the content of a results folder.
///
/// A file under `runs/` that is damaged, stray or of another campaign is ignored and listed. Its shard is missing,
/// unless another file contains it.
///
/// # Errors
/// If a file can no longer be read.
pub fn summarise(content: &Content, facts: &CampaignFacts) -> Result<Summary> {
    let mut tally = Tally::new(facts);
    count(&mut tally, &content.results, &content.shards, facts)?;
    summary_of(content, facts, &tally)
}

/// Adds the runs of shards to a tally.
pub(crate) fn count(tally: &mut Tally, results: &Path, shards: &ShardIndex, facts: &CampaignFacts) -> Result<()> {
    for batch in shards.read_columns(&Tally::columns(facts)) {
        tally.add(&batch?, facts).map_err(|error| AnalysisError::of_column(results, &error))?;
    }
    Ok(())
}

/// The summary of content whose runs have been counted.
pub(crate) fn summary_of(content: &Content, facts: &CampaignFacts, tally: &Tally) -> Result<Summary> {
    let (results, index) = (content.results.as_path(), &content.shards);
    let mut completeness = completeness(results, index, tally);
    let mut repeated = |kind: &Repetition| match read_repetition(kind, results, index) {
        Ok(table) => table.map(|table| Parity::of(kind, &table)),
        Err(error) => {
            completeness.ignored.push(ignored(results, &results.join(kind.file), &error.to_string()));
            None
        }
    };
    let (parity, half_step) = (repeated(&PARITY), repeated(&HALF_STEP));
    let foreign = content.traces.foreign.iter().chain(&content.foreign_events);
    completeness.ignored.extend(foreign.map(|(path, reason)| ignored(results, path, reason)));
    Ok(Summary { parity, half_step, ..judge(facts, completeness, tally) })
}

fn judge(facts: &CampaignFacts, completeness: Completeness, tally: &Tally) -> Summary {
    let complete = completeness.is_complete();
    let requirements: Vec<_> = facts
        .requirements
        .iter()
        .enumerate()
        .map(|(at, requirement)| requirement_summary(facts, requirement, at, tally, complete))
        .collect();
    let agreement_requirements: Vec<_> =
        facts.agreement.iter().map(|requirement| rate_summary(facts, requirement, tally, complete)).collect();
    let verdicts = requirements.iter().map(|requirement| requirement.verdict);
    let verdicts: Vec<Verdict> = verdicts.chain(agreement_requirements.iter().map(|rate| rate.verdict)).collect();
    // A campaign without requirements has no verdict.
    let verdict = match facts.independent_runs && !verdicts.is_empty() {
        true => overall(verdicts.into_iter()),
        false => Verdict::Undecided,
    };
    let exit_code = match (complete, verdict) {
        (false, _) => 3,
        (true, Verdict::Verified) => 0,
        (true, _) => 1,
    };
    let [space, facility] = tally.joint.map(|count| Share::of(count, tally.counted));
    Summary {
        schema: SUMMARY_SCHEMA.to_owned(),
        campaign: facts.id.to_owned(),
        title: facts.title.to_owned(),
        campaign_hash: facts.hash.to_owned(),
        seed: facts.seed,
        version: facts.version.to_owned(),
        commit: facts.commit.to_owned(),
        verdict,
        exit_code,
        independent_runs: facts.independent_runs,
        given_cases: facts.given_cases,
        extensions: facts.extensions.to_vec(),
        judgements: facts.judgements.to_vec(),
        invalid_runs: match facts.invalid {
            InvalidRuns::CountAsFailures => "count-as-failures",
            InvalidRuns::ReportOnly => "report-only",
        }
        .to_owned(),
        results_hash: None,
        completeness,
        accounting: accounting(tally),
        requirements,
        agreement_requirements,
        joint: PerLoop { space, facility },
        agreement: agreement_of(&tally.agreement),
        causes: PerLoop { space: tally.causes[0].listed(), facility: tally.causes[1].listed() },
        parity: None,
        half_step: None,
    }
}

/// Returns the overall verdict: one failed requirement fails the campaign, one undecided requirement makes it
/// undecided.
fn overall(verdicts: impl Iterator<Item = Verdict>) -> Verdict {
    verdicts.fold(Verdict::Verified, |sum, verdict| match (sum, verdict) {
        (Verdict::NotVerified, _) | (_, Verdict::NotVerified) => Verdict::NotVerified,
        (Verdict::Undecided, _) | (_, Verdict::Undecided) => Verdict::Undecided,
        _ => Verdict::Verified,
    })
}

fn completeness(results: &Path, index: &ShardIndex, tally: &Tally) -> Completeness {
    let made_on = index.complete.values().map(|file| (file.backend.as_str(), file.device.as_str(), 1));
    Completeness {
        runs_planned: index.plan.runs,
        runs_done: tally.status.iter().sum(),
        shards_planned: index.plan.shards(),
        shards_done: index.complete.len() as u32,
        shards_missing: index.missing().into_iter().take(LISTED_SHARDS).collect(),
        devices: DeviceShards::summed(made_on),
        ignored: index.foreign.iter().map(|(path, reason)| ignored(results, path, reason)).collect(),
    }
}

/// A file by its name below the results folder: no path of the machine stands in a summary.
fn ignored(results: &Path, path: &Path, reason: &str) -> IgnoredFile {
    let below = path.strip_prefix(results).unwrap_or(path);
    let (file, whole) = (below.display().to_string(), path.display().to_string());
    IgnoredFile { reason: reason.replace(&format!("{whole}: "), ""), file }
}

fn accounting(tally: &Tally) -> Accounting {
    let count = |((bit, name, meaning), (runs, invalid_runs)): (&(u32, &str, &str), &(u64, u64))| FlagCount {
        flag: (*name).to_owned(),
        meaning: (*meaning).to_owned(),
        invalidates: bit & flags::INVALID != 0,
        runs: *runs,
        invalid_runs: *invalid_runs,
    };
    Accounting {
        pass: tally.status[Status::Pass as usize],
        fail: tally.status[Status::Fail as usize],
        invalid: tally.status[Status::Invalid as usize],
        flags: flags::TABLE.iter().zip(&tally.flags).map(count).filter(|flag| flag.runs > 0).collect(),
    }
}

fn requirement_summary(
    facts: &CampaignFacts,
    requirement: &Requirement,
    at: usize,
    tally: &Tally,
    complete: bool,
) -> RequirementSummary {
    let [space, facility] = &tally.requirements[at];
    let invalid = tally.status[Status::Invalid as usize];
    let judged = |counts| loop_summary(facts, requirement, counts, invalid, complete);
    let loops = PerLoop { space: judged(space), facility: judged(facility) };
    let is_on_space = requirement.subject == Subject::Space;
    RequirementSummary {
        id: requirement.id.clone(),
        column_id: requirement.column_id(),
        text: requirement.text.clone(),
        sentence: requirement.sentence(),
        subject: requirement.subject.word().to_owned(),
        verdict: if is_on_space { loops.space.verdict } else { loops.facility.verdict },
        metric: requirement.metric.name.clone(),
        unit: requirement.unit().to_owned(),
        at_most: requirement.limits.at_most,
        at_least: requirement.limits.at_least,
        probability: requirement.probability,
        confidence: requirement.confidence,
        agreement: is_on_space.then(|| agreement_of(&tally.requirement_agreement[at])),
        loops,
    }
}

/// A requirement on the agreement. Of an incomplete campaign nothing is stated: the number of its cases is not known.
fn rate_summary(
    facts: &CampaignFacts,
    requirement: &AgreementRequirement,
    tally: &Tally,
    complete: bool,
) -> RateSummary {
    let of = |counts: &AgreementCounts| rate_counts(requirement.rate, counts, facts.invalid);
    let DrawCount { runs: cases, failures } = of(&tally.agreement);
    let probability = 1.0 - requirement.at_most;
    let bound = |draw: &DrawCount| upper_bound(draw.failures, draw.runs, requirement.confidence);
    let draws: BTreeMap<u32, DrawCount> =
        tally.agreement_draws.iter().map(|(draw, counts)| (*draw, of(counts))).collect();
    let outer = (draws.len() > 1 && facts.independent_runs)
        .then(|| outer_summary(&draws, 1.0 - probability, requirement.confidence));
    let holds = match &outer {
        Some(outer) => outer.verified == outer.draws,
        None => bound(&DrawCount { runs: cases, failures }) <= 1.0 - probability,
    };
    let allowed = allowed_failures(cases, probability, requirement.confidence);
    RateSummary {
        id: requirement.id.clone(),
        text: requirement.text.clone(),
        sentence: requirement.sentence(),
        verdict: match (facts.independent_runs && complete, holds) {
            (false, _) => Verdict::Undecided,
            (true, true) => Verdict::Verified,
            (true, false) => Verdict::NotVerified,
        },
        rate: requirement.rate.word().to_owned(),
        at_most: requirement.at_most,
        confidence: requirement.confidence,
        share: Share::of(failures, cases),
        invalid: match facts.invalid {
            InvalidRuns::CountAsFailures => tally.agreement[Agreement::Invalid as usize],
            InvalidRuns::ReportOnly => 0,
        },
        allowed: allowed.filter(|_| facts.independent_runs),
        bound: facts.independent_runs.then(|| bound(&DrawCount { runs: cases, failures })),
        outer,
    }
}

/// Cases of a rate, and those that count. An invalid run that counts as a failure is a case that counts.
fn rate_counts(rate: Rate, counts: &AgreementCounts, invalid: InvalidRuns) -> DrawCount {
    let of = |agreement: Agreement| counts[agreement as usize];
    let passed = of(Agreement::TruePass) + of(Agreement::FalseFail) + of(Agreement::AbortedPass);
    let failed = of(Agreement::FalsePass) + of(Agreement::TrueFail) + of(Agreement::AbortedFail);
    let (failures, runs) = match rate {
        Rate::FalsePass => (of(Agreement::FalsePass), failed),
        Rate::FalseFail => (of(Agreement::FalseFail), passed),
        Rate::Abort => (of(Agreement::AbortedPass) + of(Agreement::AbortedFail), passed + failed),
    };
    let invalid = if invalid == InvalidRuns::CountAsFailures { of(Agreement::Invalid) } else { 0 };
    DrawCount { runs: runs + invalid, failures: failures + invalid }
}

fn loop_summary(
    facts: &CampaignFacts,
    requirement: &Requirement,
    counts: &LoopTally,
    invalid: u64,
    complete: bool,
) -> LoopSummary {
    let DrawCount { runs, failures } = counts.total();
    // An incomplete campaign is measured by what its planned runs would allow: early fail, never early pass.
    let judged_runs = if complete { runs } else { facts.plan.runs };
    let allowed = allowed_failures(judged_runs, requirement.probability, requirement.confidence);
    // Binomial statements need independent runs: without them nothing is claimed.
    let allowed = allowed.filter(|_| facts.independent_runs);
    let outer = (counts.draws.len() > 1 && facts.independent_runs)
        .then(|| outer_summary(&counts.draws, 1.0 - requirement.probability, requirement.confidence));
    let verified = match &outer {
        Some(outer) => outer.verified == outer.draws,
        None => allowed.is_some_and(|allowed| failures <= allowed),
    };
    let failed_early = outer.is_none() && allowed.is_some_and(|allowed| failures > allowed);
    let verdict = match (facts.independent_runs, complete) {
        (false, _) => Verdict::Undecided,
        (true, true) if verified => Verdict::Verified,
        (true, true) => Verdict::NotVerified,
        (true, false) if failed_early => Verdict::NotVerified,
        (true, false) => Verdict::Undecided,
    };
    LoopSummary {
        verdict,
        runs,
        failures,
        causes: counts.causes.listed(),
        invalid,
        allowed,
        failure_rate_bound: facts.independent_runs.then(|| upper_bound(failures, runs, requirement.confidence)),
        wilson: facts.independent_runs.then(|| wilson(failures, runs, READING_CONFIDENCE)),
        worst: counts.worst,
        tolerance_limit: counts.tolerance_limit().filter(|_| facts.independent_runs),
        outer,
    }
}

/// Returns the summary of the outer (epistemic) draws: every draw has its own verdict, and the worst one counts.
fn outer_summary(draws: &BTreeMap<u32, DrawCount>, greatest_rate: f64, confidence: f64) -> OuterSummary {
    let bound = |draw: &DrawCount| upper_bound(draw.failures, draw.runs, confidence);
    let verified = draws.values().filter(|draw| bound(draw) <= greatest_rate).count();
    let worst = draws.iter().max_by(|(_, one), (_, two)| bound(one).total_cmp(&bound(two)));
    let (worst_draw, worst) = worst.map_or((0, DrawCount::default()), |(number, draw)| (*number, *draw));
    OuterSummary {
        draws: draws.len() as u64,
        verified: verified as u64,
        worst_draw,
        worst_runs: worst.runs,
        worst_failures: worst.failures,
        worst_bound: bound(&worst),
    }
}

/// The agreement of runs that are counted by kind, in the order of [`Agreement`].
pub fn agreement_of(counts: &[u64; AGREEMENT_WORDS.len()]) -> AgreementSummary {
    let count = |agreement: Agreement| counts[agreement as usize];
    let runs: u64 = counts.iter().sum();
    let share = |agreement| Share::of(count(agreement), runs);
    let (true_pass, false_pass) = (count(Agreement::TruePass), count(Agreement::FalsePass));
    let (true_fail, false_fail) = (count(Agreement::TrueFail), count(Agreement::FalseFail));
    let (aborted_pass, aborted_fail) = (count(Agreement::AbortedPass), count(Agreement::AbortedFail));
    AgreementSummary {
        true_pass: share(Agreement::TruePass),
        false_pass: share(Agreement::FalsePass),
        true_fail: share(Agreement::TrueFail),
        false_fail: share(Agreement::FalseFail),
        aborted_pass: share(Agreement::AbortedPass),
        aborted_fail: share(Agreement::AbortedFail),
        invalid: share(Agreement::Invalid),
        abort_rate: Share::of(aborted_pass + aborted_fail, runs - count(Agreement::Invalid)),
        // An aborted session is no false verdict: it counts among the cases only.
        false_pass_rate: Share::of(false_pass, false_pass + true_fail + aborted_fail),
        false_fail_rate: Share::of(false_fail, false_fail + true_pass + aborted_pass),
        misleading_passes: Share::of(false_pass, false_pass + true_pass),
    }
}
