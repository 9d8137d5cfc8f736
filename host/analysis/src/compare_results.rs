//! Comparison of two results folders: failures, rates and their difference, changed runs, metrics.
//!
//! With equal seeds, runs of the same number are pairs, since each parameter has its own random stream. Otherwise the
//! folders are two independent samples.

use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

use serde::Serialize;
use softdock_campaign::requirement::Requirement;
use softdock_results::columns::{AGREEMENT, ColumnError, ColumnHandle, Loop, RUN, STATUS};
use softdock_results::runs::{Agreement, Status};
use softdock_results::shards::ShardIndex;
use softdock_results::{Column, ColumnKind, Table, Values};
use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::exact::{Interval, READING_CONFIDENCE, Share};
use crate::facts::{CampaignFacts, InvalidRuns};
use crate::moments::Moments;
use crate::number::{digits_of, interval, with_unit};
use crate::proportions::{PairedFailures, independent_difference};
use crate::summary::PerLoop;
use crate::terminal::table;
use crate::{AnalysisError, Result};

/// Version of the comparison as JSON; keys are only added within one major.
pub const COMPARE_RESULTS_SCHEMA: &str = "compare_results/1";

/// Runs of a list that are shown.
const LISTED: usize = 20;

/// Metrics that the text shows.
const SHOWN_METRICS: usize = 12;

/// One results folder.
#[derive(Clone, Debug)]
pub struct ResultsInput<'a> {
    /// Name in the output.
    pub name: &'a str,
    /// Path of the folder.
    pub results: &'a Path,
    /// Its campaign.
    pub facts: CampaignFacts<'a>,
    /// Number of outer draws; 1 without an outer loop.
    pub outer_draws: u32,
    /// False for given cases that are numbered from 0: their numbers are not those of draws.
    pub numbered_as_drawn: bool,
}

/// Comparison of the second results folder with the first.
#[derive(Clone, Debug, Serialize)]
pub struct ResultsComparison {
    /// [`COMPARE_RESULTS_SCHEMA`].
    pub schema: &'static str,
    /// The first folder.
    pub first: ComparedResults,
    /// The second folder.
    pub second: ComparedResults,
    /// Whether runs of the same number are pairs; otherwise the samples are independent.
    pub paired: bool,
    /// Runs in both folders.
    pub pairs: u64,
    /// Pairs whose inputs are not the same in both.
    pub pairs_of_other_inputs: u64,
    /// Input columns that differ in some pair.
    pub input_columns_that_differ: Vec<String>,
    /// Requirements that both campaigns have, in the order of the first.
    pub requirements: Vec<RequirementDifference>,
    /// Requirements of one campaign alone.
    pub requirements_of_one: Vec<String>,
    /// Pairs whose status changed, most frequent first; empty without pairs.
    pub status_changes: Vec<StatusChange>,
    /// Metrics with a mean in both folders, in file order.
    pub metrics: Vec<MetricDifference>,
}

/// Description of a folder.
#[derive(Clone, Debug, Serialize)]
pub struct ComparedResults {
    /// Name in the output.
    pub name: String,
    /// Campaign id.
    pub campaign: String,
    /// Campaign hash.
    pub campaign_hash: String,
    /// Seed.
    pub seed: u64,
    /// Runs of the campaign.
    pub runs_planned: u64,
    /// Existing runs.
    pub runs_done: u64,
    /// Whether every shard exists.
    pub complete: bool,
    /// Whether the runs are an independent sample.
    pub independent_runs: bool,
    /// Number of outer draws.
    pub outer_draws: u32,
}

/// Requirement in both folders.
#[derive(Clone, Debug, Serialize)]
pub struct RequirementDifference {
    /// Id.
    pub id: String,
    /// Whether metric and limits are the same in both.
    pub same_limit: bool,
    /// In space and on the facility.
    pub loops: PerLoop<FailureDifference>,
}

/// Failures of a requirement in a loop.
#[derive(Clone, Debug, Serialize)]
pub struct FailureDifference {
    /// Failures in the first folder, invalid runs as its campaign counts them.
    pub first: Share,
    /// Failures in the second folder.
    pub second: Share,
    /// Second failure rate less the first.
    pub difference: f64,
    /// Newcombe's interval of the difference.
    pub interval: Interval,
    /// The pairs, if there are any.
    pub pairs: Option<PairedFailures>,
    /// Exact two-sided p-value of McNemar's test, if there are pairs.
    pub mcnemar: Option<f64>,
    /// The first runs that fail in the second folder alone.
    pub newly_failed: Vec<u64>,
    /// The first runs that fail in the first folder alone.
    pub newly_passed: Vec<u64>,
}

/// Runs whose status differs in the second folder.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StatusChange {
    /// Column: `status` or `agreement`.
    pub column: &'static str,
    /// Word in the first folder.
    pub first: String,
    /// Word in the second folder.
    pub second: String,
    /// Number of runs.
    pub runs: u64,
    /// The first of them, at most 20.
    pub examples: Vec<u64>,
}

/// A metric in both folders.
#[derive(Clone, Debug, Serialize)]
pub struct MetricDifference {
    /// Column.
    pub column: String,
    /// SI unit.
    pub unit: String,
    /// Runs of the means: pairs with the metric in both, or the runs of each folder with it.
    pub runs: [u64; 2],
    /// Mean in the first folder.
    pub first: f64,
    /// Mean in the second folder.
    pub second: f64,
    /// Second mean less the first.
    pub difference: f64,
    /// Interval of the difference (Student, in pairs; Welch, of independent samples); none from fewer than two runs.
    pub interval: Option<Interval>,
}

/// Compares two folders in one pass over both.
///
/// # Errors
/// If a folder holds no run, a file of another campaign, or a damaged one.
pub fn compare_results(first: &ResultsInput, second: &ResultsInput) -> Result<ResultsComparison> {
    let (one, two) = (described(first)?, described(second)?);
    let same_runs = first.facts.hash == second.facts.hash || first.numbered_as_drawn && second.numbered_as_drawn;
    let can_pair = same_runs && first.facts.seed == second.facts.seed;
    let shared: Vec<(&Requirement, &Requirement)> = first
        .facts
        .requirements
        .iter()
        .filter_map(|own| Some((own, second.facts.requirements.iter().find(|r| r.column_id() == own.column_id())?)))
        .collect();
    let indexes = [first.facts.shards(first.results)?, second.facts.shards(second.results)?];
    let columns = [indexes[0].columns()?, indexes[1].columns()?];
    let layout = Layout::of(&columns, &shared);
    let mut cursors = [Cursor::open(first, &indexes[0], &layout), Cursor::open(second, &indexes[1], &layout)];
    let mut sums = Sums::new(&layout);
    let mut rows = [cursors[0].next()?, cursors[1].next()?];
    loop {
        let order = match (&rows[0], &rows[1]) {
            (None, None) => break,
            (Some(_), None) => Ordering::Less,
            (None, Some(_)) => Ordering::Greater,
            (Some(one), Some(two)) => one.run.cmp(&two.run),
        };
        let taken = [
            if order.is_le() { std::mem::replace(&mut rows[0], cursors[0].next()?) } else { None },
            if order.is_ge() { std::mem::replace(&mut rows[1], cursors[1].next()?) } else { None },
        ];
        sums.add(&taken, [first.facts.invalid, second.facts.invalid], can_pair);
    }
    let paired = can_pair && sums.pairs > 0;
    let only = |own: &ResultsInput, other: &ResultsInput| {
        let other: Vec<String> = other.facts.requirements.iter().map(Requirement::column_id).collect();
        let own = own.facts.requirements.iter().filter(|r| !other.contains(&r.column_id()));
        own.map(|r| r.id.clone()).collect::<Vec<_>>()
    };
    Ok(ResultsComparison {
        schema: COMPARE_RESULTS_SCHEMA,
        paired,
        pairs: if paired { sums.pairs } else { 0 },
        pairs_of_other_inputs: sums.other_inputs,
        input_columns_that_differ: sums.differing_inputs(&layout),
        requirements: shared.iter().enumerate().map(|(at, pair)| sums.requirement(at, *pair, paired)).collect(),
        requirements_of_one: [only(first, second), only(second, first)].concat(),
        status_changes: sums.status_changes(),
        metrics: layout.metrics.iter().enumerate().filter_map(|(at, column)| sums.metric(at, column, paired)).collect(),
        first: one,
        second: two,
    })
}

fn described(input: &ResultsInput) -> Result<ComparedResults> {
    let facts = &input.facts;
    let index = facts.shards(input.results)?;
    if let Some((path, reason)) = index.foreign.first() {
        return Err(AnalysisError::Results { path: path.clone(), what: reason.clone() });
    }
    let runs = index.complete.keys().map(|shard| facts.plan.range(*shard)).map(|range| range.end - range.start).sum();
    if runs == 0 {
        return Err(AnalysisError::Results { path: input.results.to_owned(), what: "no whole shard".to_owned() });
    }
    Ok(ComparedResults {
        name: input.name.to_owned(),
        campaign: facts.id.to_owned(),
        campaign_hash: facts.hash.to_owned(),
        seed: facts.seed,
        runs_planned: facts.plan.runs,
        runs_done: runs,
        complete: index.is_complete(),
        independent_runs: facts.independent_runs,
        outer_draws: input.outer_draws,
    })
}

/// The columns that both folders have.
struct Layout {
    /// Per requirement: pass columns in space and on the facility.
    passes: Vec<[ColumnHandle<bool>; 2]>,
    metrics: Vec<Column>,
    inputs: Vec<String>,
    /// Columns that are read.
    names: Vec<String>,
}

impl Layout {
    fn of([first, second]: &[Table; 2], shared: &[(&Requirement, &Requirement)]) -> Self {
        let both = |column: &&Column| {
            let other = second.column(&column.name);
            other.is_some_and(|other| matches!((&column.values, &other.values), (Values::F64(_), Values::F64(_))))
        };
        let of =
            |kind: ColumnKind| first.columns.iter().filter(move |column| column.kind == kind).filter(both).cloned();
        let pass = |requirement: &Requirement| Loop::BOTH.map(|side| side.pass(&requirement.column_id()));
        let passes: Vec<[ColumnHandle<bool>; 2]> = shared.iter().map(|(requirement, _)| pass(requirement)).collect();
        let metrics: Vec<Column> = of(ColumnKind::Metric).collect();
        let inputs: Vec<String> = of(ColumnKind::Input).map(|column| column.name).collect();
        let fixed = [RUN.name(), STATUS.name(), AGREEMENT.name()].into_iter();
        let columns = metrics.iter().map(|column| &column.name).chain(&inputs).map(String::as_str);
        let names = fixed.chain(passes.iter().flatten().map(ColumnHandle::name)).chain(columns);
        let names = names.map(str::to_owned).collect();
        Self { passes, metrics, inputs, names }
    }
}

/// Run of a comparison.
struct Row {
    run: u64,
    status: Status,
    agreement: Agreement,
    /// Per requirement: fails in space, on the facility.
    fails: Vec<[bool; 2]>,
    metrics: Vec<Option<f64>>,
    inputs: Vec<Option<f64>>,
}

impl Row {
    /// The rows of a batch, in its order.
    fn all(batch: &Table, layout: &Layout) -> std::result::Result<Vec<Self>, ColumnError> {
        let (run, status, agreement) = (batch.get(&RUN)?, batch.get(&STATUS)?, batch.get(&AGREEMENT)?);
        let passes = layout.passes.iter().map(|[space, facility]| Ok([batch.get(space)?, batch.get(facility)?]));
        let passes = passes.collect::<std::result::Result<Vec<_>, ColumnError>>()?;
        let numbers = |name: &String| batch.get(&ColumnHandle::<f64>::named(name.clone()));
        let metrics = layout.metrics.iter().map(|column| numbers(&column.name));
        let metrics = metrics.collect::<std::result::Result<Vec<_>, _>>()?;
        let inputs = layout.inputs.iter().map(numbers).collect::<std::result::Result<Vec<_>, _>>()?;
        let row = |row: usize| Self {
            run: run[row],
            status: status.at(row),
            agreement: agreement.at(row),
            fails: passes.iter().map(|loops| loops.map(|passes| passes[row] != Some(true))).collect(),
            metrics: metrics.iter().map(|values| values[row]).collect(),
            inputs: inputs.iter().map(|values| values[row]).collect(),
        };
        Ok((0..batch.rows()).map(row).collect())
    }

    fn is_invalid(&self) -> bool {
        self.status == Status::Invalid
    }
}

/// The runs of a folder, one after the other.
struct Cursor<'a> {
    batches: Box<dyn Iterator<Item = std::result::Result<Table, softdock_results::ResultsError>> + 'a>,
    /// Rest of the last batch.
    rows: std::vec::IntoIter<Row>,
    results: &'a Path,
    layout: &'a Layout,
}

impl<'a> Cursor<'a> {
    fn open(input: &'a ResultsInput, index: &ShardIndex, layout: &'a Layout) -> Self {
        let batches = Box::new(index.read_columns(&layout.names));
        Self { batches, rows: Vec::new().into_iter(), results: input.results, layout }
    }

    fn next(&mut self) -> Result<Option<Row>> {
        loop {
            if let Some(row) = self.rows.next() {
                return Ok(Some(row));
            }
            let Some(batch) = self.batches.next() else { return Ok(None) };
            let rows = Row::all(&batch?, self.layout);
            self.rows = rows.map_err(|error| AnalysisError::of_column(self.results, &error))?.into_iter();
        }
    }
}

/// Failures of a requirement in a loop.
#[derive(Clone, Default)]
struct Failures {
    /// Failures and runs of each folder, paired or not.
    single: [(u64, u64); 2],
    pairs: PairedFailures,
    newly_failed: Vec<u64>,
    newly_passed: Vec<u64>,
}

/// Sums over both folders.
struct Sums {
    pairs: u64,
    other_inputs: u64,
    inputs_differ: Vec<bool>,
    failures: Vec<[Failures; 2]>,
    changes: BTreeMap<(usize, String, String), (u64, Vec<u64>)>,
    /// Per metric: each folder alone.
    single: Vec<[Moments; 2]>,
    /// Per metric: first, second and their difference in pairs.
    paired: Vec<[Moments; 3]>,
}

/// Columns whose changes are listed.
fn changing() -> [&'static str; 2] {
    [STATUS.name(), AGREEMENT.name()]
}

impl Sums {
    fn new(layout: &Layout) -> Self {
        Self {
            pairs: 0,
            other_inputs: 0,
            inputs_differ: vec![false; layout.inputs.len()],
            failures: vec![Default::default(); layout.passes.len()],
            changes: BTreeMap::new(),
            single: vec![Default::default(); layout.metrics.len()],
            paired: vec![Default::default(); layout.metrics.len()],
        }
    }

    /// Adds a run of one folder, or of both.
    fn add(&mut self, rows: &[Option<Row>; 2], policy: [InvalidRuns; 2], can_pair: bool) {
        let counts = |at: usize, row: &Row| !(row.is_invalid() && policy[at] == InvalidRuns::ReportOnly);
        for (at, row) in rows.iter().enumerate() {
            let Some(row) = row else { continue };
            for (failures, fails) in self.failures.iter_mut().zip(&row.fails).filter(|_| counts(at, row)) {
                for (failures, fails) in failures.iter_mut().zip(fails) {
                    failures.single[at].0 += u64::from(*fails || row.is_invalid());
                    failures.single[at].1 += 1;
                }
            }
            for (moments, value) in self.single.iter_mut().zip(&row.metrics) {
                if let Some(value) = value {
                    moments[at].add(*value);
                }
            }
        }
        let [Some(one), Some(two)] = rows else { return };
        if !can_pair {
            return;
        }
        self.pairs += 1;
        let mut other = false;
        for (differ, (one, two)) in self.inputs_differ.iter_mut().zip(one.inputs.iter().zip(&two.inputs)) {
            let same = one.map(f64::to_bits) == two.map(f64::to_bits);
            *differ |= !same;
            other |= !same;
        }
        self.other_inputs += u64::from(other);
        let words = [[one.status.word(), two.status.word()], [one.agreement.word(), two.agreement.word()]];
        for (column, [before, after]) in words.into_iter().enumerate().filter(|(_, [before, after])| before != after) {
            let (runs, examples) = self.changes.entry((column, before.to_owned(), after.to_owned())).or_default();
            *runs += 1;
            if examples.len() < LISTED {
                examples.push(one.run);
            }
        }
        if counts(0, one) && counts(1, two) {
            for (failures, (before, after)) in self.failures.iter_mut().zip(one.fails.iter().zip(&two.fails)) {
                for (failures, (before, after)) in failures.iter_mut().zip(before.iter().zip(after)) {
                    let (before, after) = (*before || one.is_invalid(), *after || two.is_invalid());
                    failures.pairs.add(before, after);
                    let list = if after { &mut failures.newly_failed } else { &mut failures.newly_passed };
                    if before != after && list.len() < LISTED {
                        list.push(one.run);
                    }
                }
            }
        }
        for (moments, (before, after)) in self.paired.iter_mut().zip(one.metrics.iter().zip(&two.metrics)) {
            if let (Some(before), Some(after)) = (before, after) {
                moments[0].add(*before);
                moments[1].add(*after);
                moments[2].add(after - before);
            }
        }
    }

    fn differing_inputs(&self, layout: &Layout) -> Vec<String> {
        let differing = layout.inputs.iter().zip(&self.inputs_differ).filter(|(_, differs)| **differs);
        differing.map(|(name, _)| name.clone()).collect()
    }

    fn requirement(&self, at: usize, (one, two): (&Requirement, &Requirement), paired: bool) -> RequirementDifference {
        let [space, facility] = [0, 1].map(|side: usize| failure_difference(&self.failures[at][side], paired));
        let same_limit = one.metric == two.metric && one.limits == two.limits;
        RequirementDifference { id: one.id.clone(), same_limit, loops: PerLoop { space, facility } }
    }

    fn status_changes(&self) -> Vec<StatusChange> {
        let change = |((column, first, second), (runs, examples)): (&(usize, String, String), &(u64, Vec<u64>))| {
            let (first, second, examples) = (first.clone(), second.clone(), examples.clone());
            (*column, StatusChange { column: changing()[*column], first, second, runs: *runs, examples })
        };
        let mut all: Vec<(usize, StatusChange)> = self.changes.iter().map(change).collect();
        all.sort_by_key(|(column, change)| (*column, std::cmp::Reverse(change.runs)));
        all.into_iter().map(|(_, change)| change).collect()
    }

    fn metric(&self, at: usize, column: &Column, paired: bool) -> Option<MetricDifference> {
        let (runs, [first, second], error) = if paired {
            let [first, second, difference] = &self.paired[at];
            ([first.count; 2], [first.mean, second.mean], difference.of_mean())
        } else {
            let [one, two] = &self.single[at];
            let error = one.of_mean().zip(two.of_mean()).map(|((one, free_one), (two, free_two))| {
                // Welch and Satterthwaite.
                let whole = one + two;
                let free = whole * whole / (one * one / free_one + two * two / free_two);
                (whole, if free.is_finite() { free.max(1.0) } else { 1.0 })
            });
            ([one.count, two.count], [one.mean, two.mean], error)
        };
        let difference = second - first;
        let interval = error.map(|(variance, free)| {
            let student = StudentsT::new(0.0, 1.0, free).expect("at least one degree of freedom");
            let half = student.inverse_cdf(0.5 + 0.5 * READING_CONFIDENCE) * variance.sqrt();
            Interval { lo: difference - half, hi: difference + half, confidence: READING_CONFIDENCE }
        });
        let (column, unit) = (column.name.clone(), column.unit.clone());
        let there = runs.iter().all(|runs| *runs > 0);
        there.then_some(MetricDifference { column, unit, runs, first, second, difference, interval })
    }
}

fn failure_difference(failures: &Failures, paired: bool) -> FailureDifference {
    if !paired {
        let [one, two] = failures.single;
        let (difference, interval) = independent_difference(one, two, READING_CONFIDENCE);
        let (first, second) = (Share::of(one.0, one.1), Share::of(two.0, two.1));
        let (newly_failed, newly_passed) = (Vec::new(), Vec::new());
        return FailureDifference {
            first,
            second,
            difference,
            interval,
            pairs: None,
            mcnemar: None,
            newly_failed,
            newly_passed,
        };
    }
    let pairs = failures.pairs;
    let [first, second] = pairs.failures().map(|count| Share::of(count, pairs.pairs()));
    let (difference, interval) = pairs.difference(READING_CONFIDENCE);
    FailureDifference {
        first,
        second,
        difference,
        interval,
        pairs: Some(pairs),
        mcnemar: Some(pairs.mcnemar()),
        newly_failed: failures.newly_failed.clone(),
        newly_passed: failures.newly_passed.clone(),
    }
}

/// The comparison as aligned plain text for the terminal.
pub fn compare_results_text(compared: &ResultsComparison) -> String {
    let mut out = String::new();
    for (name, folder) in [("A", &compared.first), ("B", &compared.second)] {
        let _ = writeln!(
            out,
            "{name}  {}  {}, {} of {} runs, seed {}",
            folder.name, folder.campaign, folder.runs_done, folder.runs_planned, folder.seed
        );
    }
    design_lines(&mut out, compared);
    failure_lines(&mut out, compared);
    change_lines(&mut out, compared);
    metric_lines(&mut out, compared);
    out
}

/// Writes the design of the comparison and its limits.
fn design_lines(out: &mut String, compared: &ResultsComparison) {
    let (one, two) = (&compared.first, &compared.second);
    let _ = if compared.paired {
        let alone = [one, two].map(|folder| folder.runs_done.saturating_sub(compared.pairs));
        let left_out = match alone {
            [0, 0] => String::new(),
            [one, two] => format!("; {one} runs of A and {two} of B without a partner are ignored"),
        };
        writeln!(out, "  {} pairs of runs with the same number and seed{left_out}", compared.pairs)
    } else {
        writeln!(out, "  two independent samples: no runs of one number and seed")
    };
    if compared.pairs_of_other_inputs > 0 {
        let columns = &compared.input_columns_that_differ;
        let shown = columns.iter().take(6).cloned().collect::<Vec<_>>().join(", ");
        let more = if columns.len() > 6 { ", ..." } else { "" };
        let _ = writeln!(out, "  {} pairs have other inputs: {shown}{more}", compared.pairs_of_other_inputs);
    }
    if [one, two].iter().any(|folder| !folder.independent_runs) {
        out.push_str("  the runs are no independent sample: intervals and p-values are informative, as if it were\n");
    }
    if [one, two].iter().any(|folder| folder.outer_draws > 1) {
        out.push_str("  intervals do not contain the spread of the outer draws: runs of one draw share its inputs\n");
    }
    if [one, two].iter().any(|folder| !folder.complete) {
        out.push_str("  incomplete: only the runs of whole shards are compared\n");
    }
}

fn failure_lines(out: &mut String, compared: &ResultsComparison) {
    out.push_str("\nfailures: A, B, and the rate of B less that of A\n");
    let mut rows = Vec::new();
    for requirement in &compared.requirements {
        let name =
            if requirement.same_limit { requirement.id.clone() } else { format!("{} (other limit)", requirement.id) };
        for (name, side, failures) in
            [(name, "space", &requirement.loops.space), (String::new(), "facility", &requirement.loops.facility)]
        {
            let share = |share: &Share| format!("{} of {} ({})", share.count, share.cases, interval(&share.interval));
            let difference = format!("{} points, {}", signed(100.0 * failures.difference), points(&failures.interval));
            let pairs = failures.mcnemar.map_or(String::new(), |p| format!("McNemar p = {}", digits_of(p, 2)));
            rows.push([name, side.to_owned(), share(&failures.first), share(&failures.second), difference, pairs]);
        }
    }
    if rows.is_empty() {
        out.push_str("  the campaigns share no requirement\n");
    }
    table(out, &rows);
    if !compared.requirements_of_one.is_empty() {
        let _ = writeln!(out, "  in one campaign alone: {}", compared.requirements_of_one.join(", "));
    }
}

fn change_lines(out: &mut String, compared: &ResultsComparison) {
    if !compared.paired {
        return;
    }
    out.push_str("\nruns that changed from A to B\n");
    let list = |runs: &[u64], all: u64| {
        let numbers = runs.iter().map(u64::to_string).collect::<Vec<_>>().join(", ");
        if all > runs.len() as u64 { format!("{numbers}, ...") } else { numbers }
    };
    let change = |change: &StatusChange| {
        let words = format!("{} -> {}", change.first, change.second);
        [change.column.to_owned(), words, change.runs.to_string(), list(&change.examples, change.runs)]
    };
    let mut rows: Vec<[String; 4]> = compared.status_changes.iter().map(change).collect();
    for requirement in &compared.requirements {
        for (side, failures) in [("space", &requirement.loops.space), ("facility", &requirement.loops.facility)] {
            let Some(pairs) = failures.pairs else { continue };
            let kinds = [
                ("pass -> fail", pairs.second_only, &failures.newly_failed),
                ("fail -> pass", pairs.first_only, &failures.newly_passed),
            ];
            for (words, count, runs) in kinds.into_iter().filter(|(_, count, _)| *count > 0) {
                let name = format!("{} {side}", requirement.id);
                rows.push([name, words.to_owned(), count.to_string(), list(runs, count)]);
            }
        }
    }
    if rows.is_empty() {
        out.push_str("  none\n");
    }
    table(out, &rows);
}

fn metric_lines(out: &mut String, compared: &ResultsComparison) {
    // In units of its own interval, so that metrics of any unit can be ordered; one without spread comes first.
    let weight = |metric: &&MetricDifference| {
        let half = metric.interval.map_or(f64::INFINITY, |interval| 0.5 * (interval.hi - interval.lo));
        metric.difference.abs() / half.max(f64::MIN_POSITIVE)
    };
    let mut metrics: Vec<&MetricDifference> = compared.metrics.iter().filter(|m| m.difference != 0.0).collect();
    metrics.sort_by(|one, two| weight(two).total_cmp(&weight(one)));
    let _ = writeln!(out, "\nmeans: A, B, and B less A (95 %)");
    let row = |metric: &&MetricDifference| {
        let value = |value: f64| with_unit(value, &metric.unit);
        let ends = metric.interval.map_or("-".to_owned(), |i| format!("{} to {}", value(i.lo), value(i.hi)));
        [metric.column.clone(), value(metric.first), value(metric.second), value(metric.difference), ends]
    };
    table(out, &metrics.iter().take(SHOWN_METRICS).map(row).collect::<Vec<_>>());
    let same = compared.metrics.len() - metrics.len();
    let more = metrics.len().saturating_sub(SHOWN_METRICS);
    let _ = writeln!(out, "  {more} metrics more that differ are in --json; {same} have equal means");
}

/// `+1.2`.
fn signed(value: f64) -> String {
    if value > 0.0 { format!("+{}", digits_of(value, 3)) } else { digits_of(value, 3) }
}

/// An interval of a difference of shares, in percentage points.
fn points(interval: &Interval) -> String {
    format!("{} to {} ({} %)", signed(100.0 * interval.lo), signed(100.0 * interval.hi), 100.0 * interval.confidence)
}
