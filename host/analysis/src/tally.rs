//! One pass over a campaign's runs, batch by batch: counters, worst runs and the tails of the margins.
//!
//! Memory does not grow with the number of runs, only with the failures that a requirement allows (16 bytes each).

use std::collections::{BTreeMap, BinaryHeap};

use softdock_campaign::requirement::{Requirement, SUCCESS, Subject};
use softdock_kernels::metrics::flags;
use softdock_results::Table;
use softdock_results::columns::{AGREEMENT, ColumnError, ColumnHandle, FLAGS, Loop, OUTER, RUN, STATUS, Texts, Words};
use softdock_results::runs::{AGREEMENT_WORDS, Agreement, Outcome, Phase, STATUS_WORDS, Status};

use crate::causes::{LIMIT, NO_VALUE};
use crate::exact::tolerance_rank;
use crate::facts::{CampaignFacts, InvalidRuns};
use crate::summary::{CauseCount, RunMargin};

/// Margins kept for a tolerance limit; a requirement that needs more gets none.
const LONGEST_TAIL: u64 = 1_000_000;

/// Phase of a cause that is in none.
const NO_PHASE: &str = "none";

/// Runs by their agreement.
pub(crate) type AgreementCounts = [u64; AGREEMENT_WORDS.len()];

/// What is counted over all runs.
pub(crate) struct Tally {
    invalid: InvalidRuns,
    pub(crate) status: [u64; STATUS_WORDS.len()],
    pub(crate) agreement: AgreementCounts,
    /// The same per outer draw.
    pub(crate) agreement_draws: BTreeMap<u32, AgreementCounts>,
    /// Runs, and invalid runs, with each flag of the flag table.
    pub(crate) flags: Vec<(u64, u64)>,
    /// Why loops did not pass the task: space, facility.
    pub(crate) causes: [Causes; 2],
    /// Per requirement: space, facility.
    pub(crate) requirements: Vec<[LoopTally; 2]>,
    /// Per requirement: the facility's verdict on it alone against that of space.
    pub(crate) requirement_agreement: Vec<AgreementCounts>,
    /// Runs in which every requirement on space holds in space; in which every requirement holds on the facility.
    pub(crate) joint: [u64; 2],
    /// Runs that verdicts stand on.
    pub(crate) counted: u64,
}

/// What is counted for one requirement in one loop.
pub(crate) struct LoopTally {
    /// Per outer draw.
    pub(crate) draws: BTreeMap<u32, DrawCount>,
    pub(crate) worst: Option<RunMargin>,
    pub(crate) causes: Causes,
    tail: Tail,
}

/// Causes by outcome, id and phase.
#[derive(Default)]
pub(crate) struct Causes(BTreeMap<(&'static str, String, &'static str), CauseCount>);

/// Runs listed of a cause.
const EXAMPLES: usize = 10;

impl Causes {
    fn add(&mut self, run: u64, cause: &RowCause) {
        let key = (cause.outcome.word(), cause.id.to_owned(), cause.phase);
        let count = self.0.entry(key).or_insert_with(|| CauseCount {
            outcome: cause.outcome.word().to_owned(),
            cause: cause.id.to_owned(),
            phase: cause.phase.to_owned(),
            runs: 0,
            limit: cause.limit,
            values: None,
            examples: Vec::new(),
        });
        count.runs += 1;
        if let Some(value) = cause.value {
            let [least, greatest] = count.values.unwrap_or([value; 2]);
            count.values = Some([least.min(value), greatest.max(value)]);
        }
        // The first runs, in whichever order they are counted.
        let place = count.examples.partition_point(|known| *known < run);
        if place < EXAMPLES {
            count.examples.insert(place, run);
            count.examples.truncate(EXAMPLES);
        }
    }

    /// The causes, most frequent first.
    pub(crate) fn listed(&self) -> Vec<CauseCount> {
        let mut all: Vec<CauseCount> = self.0.values().cloned().collect();
        all.sort_by_key(|cause| std::cmp::Reverse(cause.runs));
        all
    }
}

/// Why one loop of a run did not pass.
#[derive(Clone, Copy)]
struct RowCause<'a> {
    outcome: Outcome,
    id: &'a str,
    phase: &'static str,
    value: Option<f64>,
    limit: Option<f64>,
}

/// Runs of one outer draw.
#[derive(Clone, Copy, Default)]
pub(crate) struct DrawCount {
    pub(crate) runs: u64,
    pub(crate) failures: u64,
}

/// The smallest margins, up to the rank of the tolerance limit.
struct Tail {
    rank: Option<u64>,
    smallest: BinaryHeap<(OrderedMargin, u64)>,
}

/// A margin in the order of numbers.
#[derive(Clone, Copy, PartialEq)]
struct OrderedMargin(f64);

impl Eq for OrderedMargin {}

impl PartialOrd for OrderedMargin {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for OrderedMargin {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

impl Tail {
    /// A run without a margin lies below every margin.
    fn add(&mut self, margin: Option<f64>, run: u64) {
        let Some(rank) = self.rank else { return };
        self.smallest.push((OrderedMargin(margin.unwrap_or(f64::NEG_INFINITY)), run));
        if self.smallest.len() as u64 > rank {
            self.smallest.pop();
        }
    }

    fn limit(&self) -> Option<RunMargin> {
        let (OrderedMargin(margin), run) = *self.smallest.peek()?;
        let full = self.rank == Some(self.smallest.len() as u64);
        (full && margin.is_finite()).then_some(RunMargin { run, margin })
    }
}

impl LoopTally {
    fn new(requirement: &Requirement, runs: u64) -> Self {
        let rank = tolerance_rank(runs, requirement.probability, requirement.confidence);
        let tail = Tail { rank: rank.filter(|rank| *rank <= LONGEST_TAIL), smallest: BinaryHeap::new() };
        Self { draws: BTreeMap::new(), worst: None, causes: Causes::default(), tail }
    }

    fn add(&mut self, run: u64, outer: u32, margin: Option<f64>, pass: bool) {
        let draw = self.draws.entry(outer).or_default();
        draw.runs += 1;
        draw.failures += u64::from(!pass);
        self.tail.add(margin, run);
        let is_worse = |margin: &f64| self.worst.is_none_or(|worst| (*margin, run) < (worst.margin, worst.run));
        if let Some(margin) = margin.filter(is_worse) {
            self.worst = Some(RunMargin { run, margin });
        }
    }

    /// All runs and failures.
    pub(crate) fn total(&self) -> DrawCount {
        let add = |sum: DrawCount, draw: &DrawCount| DrawCount {
            runs: sum.runs + draw.runs,
            failures: sum.failures + draw.failures,
        };
        self.draws.values().fold(DrawCount::default(), add)
    }

    /// The Wilks limit; with several outer draws the margins are not one sample, and there is none.
    pub(crate) fn tolerance_limit(&self) -> Option<RunMargin> {
        if self.draws.len() > 1 { None } else { self.tail.limit() }
    }
}

/// The columns of one batch.
struct Batch<'a> {
    run: &'a [u64],
    outer: &'a [u32],
    flags: &'a [u32],
    status: Words<'a, Status>,
    agreement: Words<'a, Agreement>,
    /// Space, facility.
    causes: [CauseColumns<'a>; 2],
    /// Per requirement: space, facility.
    outcomes: Vec<[Outcomes<'a>; 2]>,
}

/// How one loop ended, and why.
struct CauseColumns<'a> {
    outcome: Words<'a, Outcome>,
    id: Texts<'a>,
    phase: Words<'a, Option<Phase>>,
    value: &'a [Option<f64>],
    limit: &'a [Option<f64>],
}

impl<'a> CauseColumns<'a> {
    fn names(side: Loop) -> [String; 5] {
        [
            side.outcome().into_name(),
            side.cause().into_name(),
            side.cause_phase().into_name(),
            side.cause_value().into_name(),
            side.cause_limit().into_name(),
        ]
    }

    fn of(table: &'a Table, side: Loop) -> Result<Self, ColumnError> {
        Ok(Self {
            outcome: table.get(&side.outcome())?,
            id: table.get(&side.cause())?,
            phase: table.get(&side.cause_phase())?,
            value: table.get(&side.cause_value())?,
            limit: table.get(&side.cause_limit())?,
        })
    }

    /// Why a row did not pass; none if it did.
    fn at(&self, row: usize) -> Option<RowCause<'a>> {
        let outcome = self.outcome.at(row);
        let phase = self.phase.at(row).map_or(NO_PHASE, Phase::word);
        let cause = RowCause { outcome, id: self.id.at(row), phase, value: self.value[row], limit: self.limit[row] };
        (outcome != Outcome::Pass).then_some(cause)
    }
}

/// The outcome columns of one requirement in one loop.
struct Outcomes<'a> {
    margins: &'a [Option<f64>],
    passes: &'a [Option<bool>],
    /// Of the metric, if it has a column.
    values: Option<&'a [Option<f64>]>,
}

impl Tally {
    pub(crate) fn new(facts: &CampaignFacts) -> Self {
        let tally = |requirement: &Requirement| Loop::BOTH.map(|_| LoopTally::new(requirement, facts.plan.runs));
        Self {
            invalid: facts.invalid,
            status: [0; STATUS_WORDS.len()],
            agreement: [0; AGREEMENT_WORDS.len()],
            agreement_draws: BTreeMap::new(),
            flags: vec![(0, 0); flags::TABLE.len()],
            causes: [Causes::default(), Causes::default()],
            requirements: facts.requirements.iter().map(tally).collect(),
            requirement_agreement: vec![[0; AGREEMENT_WORDS.len()]; facts.requirements.len()],
            joint: [0; 2],
            counted: 0,
        }
    }

    /// Names of the columns that are read.
    pub(crate) fn columns(facts: &CampaignFacts) -> Vec<String> {
        let fixed = [RUN.name(), OUTER.name(), STATUS.name(), AGREEMENT.name(), FLAGS.name()].map(str::to_owned);
        let outcomes = facts.requirements.iter().flat_map(|requirement| {
            let id = requirement.column_id();
            Loop::BOTH.into_iter().flat_map(move |side| [side.margin(&id).into_name(), side.pass(&id).into_name()])
        });
        let metrics = facts.requirements.iter();
        let mut metrics: Vec<String> = metrics
            .flat_map(|requirement| Loop::BOTH.into_iter().filter_map(|side| metric_column(side, requirement)))
            .map(ColumnHandle::into_name)
            .collect();
        metrics.sort();
        metrics.dedup();
        let causes = Loop::BOTH.into_iter().flat_map(CauseColumns::names);
        fixed.into_iter().chain(causes).chain(outcomes).chain(metrics).collect()
    }

    /// Counts a batch; an error names the column that is not what it should be.
    pub(crate) fn add(&mut self, table: &Table, facts: &CampaignFacts) -> Result<(), ColumnError> {
        let batch = Batch::of(table, facts)?;
        (0..table.rows()).for_each(|row| self.add_row(&batch, row, facts));
        Ok(())
    }

    fn add_row(&mut self, batch: &Batch, row: usize, facts: &CampaignFacts) {
        let (status, agreement) = (batch.status.at(row), batch.agreement.at(row));
        let invalid = status == Status::Invalid;
        self.status[status as usize] += 1;
        self.agreement[agreement as usize] += 1;
        self.agreement_draws.entry(batch.outer[row]).or_default()[agreement as usize] += 1;
        for (count, (bit, ..)) in self.flags.iter_mut().zip(flags::TABLE) {
            let set = u64::from(batch.flags[row] & bit != 0);
            count.0 += set;
            count.1 += set * u64::from(invalid);
        }
        let ended = [batch.causes[0].at(row), batch.causes[1].at(row)];
        for (causes, cause) in self.causes.iter_mut().zip(&ended) {
            cause.iter().for_each(|cause| causes.add(batch.run[row], cause));
        }
        if invalid && self.invalid == InvalidRuns::ReportOnly {
            return;
        }
        self.counted += 1;
        let mut all = [!invalid; 2];
        for (at, requirement) in facts.requirements.iter().enumerate() {
            let (tallies, outcomes) = (&mut self.requirements[at], &batch.outcomes[at]);
            let [in_space, on_facility] = [0, 1].map(|side: usize| outcomes[side].passes[row]);
            let alone = if invalid { Agreement::Invalid } else { Agreement::of(in_space == Some(true), on_facility) };
            self.requirement_agreement[at][alone as usize] += 1;
            for (side, all) in all.iter_mut().enumerate() {
                let (tally, outcomes) = (&mut tallies[side], &outcomes[side]);
                let pass = !invalid && outcomes.passes[row] == Some(true);
                let margin = outcomes.margins[row].filter(|_| !invalid);
                tally.add(batch.run[row], batch.outer[row], margin, pass);
                if !pass {
                    let own = ended[side].filter(|cause| cause.outcome != Outcome::Fail);
                    let value = outcomes.values.and_then(|values| values[row]).filter(|_| margin.is_some());
                    let cause = own.unwrap_or_else(|| shortfall(requirement, value, ended[side]));
                    tally.causes.add(batch.run[row], &cause);
                }
                *all &= pass || side == 0 && requirement.subject != Subject::Space;
            }
        }
        for (joint, all) in self.joint.iter_mut().zip(all) {
            *joint += u64::from(all);
        }
    }
}

/// Why a loop that gave an answer fails a requirement: its metric is beyond the limit, or there is none. On success the
/// cause of the loop itself counts.
fn shortfall<'a>(requirement: &Requirement, value: Option<f64>, ended: Option<RowCause<'a>>) -> RowCause<'a> {
    if let (true, Some(cause)) = (requirement.metric.name == SUCCESS, ended) {
        return cause;
    }
    let id = if value.is_some() { LIMIT } else { NO_VALUE };
    let limit = value.and_then(|value| requirement.limits.nearer(value));
    RowCause { outcome: Outcome::Fail, id, phase: NO_PHASE, value, limit }
}

/// Column of the metric of a requirement in one loop; none where the loop has no such column.
pub(crate) fn metric_column(side: Loop, requirement: &Requirement) -> Option<ColumnHandle<f64>> {
    let column = requirement.metric.column.as_ref()?;
    side.has_metric(&requirement.metric.name).then(|| side.metric_column(column))
}

impl<'a> Batch<'a> {
    fn of(table: &'a Table, facts: &CampaignFacts) -> Result<Self, ColumnError> {
        let outcome = |side: Loop, requirement: &Requirement| {
            let id = requirement.column_id();
            let (margins, passes) = (table.get(&side.margin(&id))?, table.get(&side.pass(&id))?);
            let values = metric_column(side, requirement).map(|column| table.get(&column)).transpose()?;
            Ok::<_, ColumnError>(Outcomes { margins, passes, values })
        };
        let both =
            |requirement: &Requirement| Ok([outcome(Loop::Space, requirement)?, outcome(Loop::Hil, requirement)?]);
        Ok(Self {
            run: table.get(&RUN)?,
            outer: table.get(&OUTER)?,
            flags: table.get(&FLAGS)?,
            status: table.get(&STATUS)?,
            agreement: table.get(&AGREEMENT)?,
            causes: [CauseColumns::of(table, Loop::Space)?, CauseColumns::of(table, Loop::Hil)?],
            outcomes: facts.requirements.iter().map(both).collect::<Result<_, ColumnError>>()?,
        })
    }
}
