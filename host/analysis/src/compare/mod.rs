//! Comparison of a facility's variants: rates of false verdicts, their distribution over parameters, and improvement
//! factors.

mod paired;
mod rows;
mod text;

use std::path::Path;

use serde::Serialize;
use softdock_campaign::compare::{Bands, CellMap, Comparison};
use softdock_results::runs::Outcome;
use softdock_results::shards::ShardIndex;

use crate::Result;
use crate::exact::{READING_CONFIDENCE, Share, upper_bound};
use crate::moments::sorted_quantile;
use crate::summary::{AgreementSummary, CauseCount, DeviceShards, Summary, Verdict};
pub use paired::{Factor, Pairs};
use rows::{Columns, Row};
pub use text::compare_text;
pub(crate) use text::{short_times, times};

/// Version of `compare.json`; keys are only added within one major.
pub const COMPARE_SCHEMA: &str = "compare/2";

/// Quantiles of a metric that are shown.
const QUANTILES: [f64; 3] = [0.05, 0.5, 0.95];

/// Variant with its runs.
#[derive(Clone, Debug)]
pub struct VariantInput<'a> {
    /// Name.
    pub name: &'a str,
    /// Title.
    pub title: &'a str,
    /// Replaced keys of the scenario and derived parameters, each with its new value.
    pub changes: &'a [(String, String)],
    /// Its shards.
    pub shards: &'a ShardIndex,
    /// Its results folder.
    pub results: &'a Path,
    /// Its summary.
    pub summary: Summary,
}

/// Comparison of all variants; `compare.json`.
#[derive(Clone, Debug, Serialize)]
pub struct Compared {
    /// [`COMPARE_SCHEMA`].
    pub schema: &'static str,
    /// Campaign id.
    pub campaign: String,
    /// Campaign title.
    pub title: String,
    /// Seed.
    pub seed: u64,
    /// Version of softdock.
    pub version: String,
    /// The commit that it was built from.
    pub commit: String,
    /// Who computed how many shards of all variants.
    pub devices: Vec<DeviceShards>,
    /// The worst of the variants' verdicts. Requirements on space are the same for all.
    pub verdict: Verdict,
    /// 0 verified, 1 not verified, 3 incomplete.
    pub exit_code: u8,
    /// Greatest rate of false verdicts in a trusted cell.
    pub trust: f64,
    /// Parameter of the bands.
    pub along: Option<MapAxis>,
    /// Variants; the first is the reference.
    pub variants: Vec<ComparedVariant>,
}

impl Compared {
    /// Returns whether any variant has a false verdict.
    pub fn any_wrong(&self) -> bool {
        self.variants.iter().any(|variant| variant.wrong.share.count > 0)
    }

    /// Returns the ids of the rules that aborted sessions, with the number of runs of each variant, most frequent
    /// first.
    pub fn abort_causes(&self) -> Vec<(String, Vec<u64>)> {
        let mut all: Vec<(String, Vec<u64>)> = Vec::new();
        for (at, variant) in self.variants.iter().enumerate() {
            for cause in variant.causes.iter().filter(|cause| cause.outcome == Outcome::Aborted.word()) {
                let known = all.iter().position(|(id, _)| *id == cause.cause);
                let place = known.unwrap_or_else(|| {
                    all.push((cause.cause.clone(), vec![0; self.variants.len()]));
                    all.len() - 1
                });
                all[place].1[at] += cause.runs;
            }
        }
        all.sort_by_key(|(_, runs)| std::cmp::Reverse(runs.iter().sum::<u64>()));
        all
    }

    /// Returns whether any session was aborted.
    pub fn any_aborted(&self) -> bool {
        self.variants.iter().any(|variant| variant.agreement.abort_rate.count > 0)
    }
}

/// Parameter with its bands or cells.
#[derive(Clone, Debug, Serialize)]
pub struct MapAxis {
    /// Parameter.
    pub parameter: String,
    /// Unit.
    pub unit: &'static str,
    /// Ends of bands or cells.
    pub edges: Vec<f64>,
}

impl MapAxis {
    fn of(bands: &Bands) -> Self {
        Self { parameter: bands.field.name.clone(), unit: bands.field.unit, edges: bands.edges.clone() }
    }
}

/// Variant of a comparison.
#[derive(Clone, Debug, Serialize)]
pub struct ComparedVariant {
    /// Name.
    pub name: String,
    /// Title.
    pub title: String,
    /// Replaced keys with their new values.
    pub changes: Vec<(String, String)>,
    /// Hash of its campaign.
    pub campaign_hash: String,
    /// Verdict of all requirements.
    pub verdict: Verdict,
    /// Passes in space, of the valid runs.
    pub space_pass: Share,
    /// Passes on the facility, of the valid runs.
    pub facility_pass: Share,
    /// The cells of the agreement and their rates.
    pub agreement: AgreementSummary,
    /// Causes of runs that do not pass on the facility, most frequent first.
    pub causes: Vec<CauseCount>,
    /// False verdicts among the runs with a verdict of the facility.
    pub wrong: Wrong,
    /// Valid runs whose verdict in space differs from the first variant; 0 if both are computed in f64.
    pub space_differs: u64,
    /// Metrics over all runs.
    pub metrics: Vec<Spread>,
    /// The same along a parameter.
    pub bands: Vec<Band>,
    /// Maps, in the order of the campaign file.
    pub maps: Vec<Map>,
}

/// False passes and false fails together.
#[derive(Clone, Debug, Serialize)]
pub struct Wrong {
    /// Share of the valid runs whose session was not aborted.
    pub share: Share,
    /// Runs with verdicts of both variants, by which of them is false.
    pub pairs: Pairs,
    /// Rate of the first variant over this one's; null for the first, and if neither has false verdicts.
    pub factor: Option<Factor>,
}

/// Median and quantiles of a metric of the facility's loop.
#[derive(Clone, Debug, Serialize)]
pub struct Spread {
    /// Metric.
    pub metric: String,
    /// Unit.
    pub unit: &'static str,
    /// Runs with a value.
    pub runs: u64,
    /// 5 % quantile.
    pub lo: Option<f64>,
    /// Median.
    pub median: Option<f64>,
    /// 95 % quantile.
    pub hi: Option<f64>,
}

/// Runs of a band.
#[derive(Clone, Debug, Serialize)]
pub struct Band {
    /// Lower end.
    pub lo: f64,
    /// Upper end.
    pub hi: f64,
    /// False passes among the runs that fail in space.
    pub false_pass_rate: Share,
    /// False fails among the runs that pass in space.
    pub false_fail_rate: Share,
    /// Aborted sessions among the valid runs.
    pub aborted: Share,
    /// Wrong verdicts.
    pub wrong: Wrong,
    /// Metrics.
    pub metrics: Vec<Spread>,
}

/// Map of cells.
#[derive(Clone, Debug, Serialize)]
pub struct Map {
    /// Horizontal axis.
    pub x: MapAxis,
    /// Vertical axis.
    pub y: MapAxis,
    /// Parameter whose band restricts the runs; null for all runs.
    pub slice: Option<MapAxis>,
    /// Metric whose median is mapped; null for false verdicts.
    pub metric: Option<String>,
    /// Rows of cells, by rising y.
    pub cells: Vec<Vec<MapCell>>,
    /// Number of trusted cells.
    pub trusted: usize,
}

/// Cell of a map.
#[derive(Clone, Debug, Serialize)]
pub struct MapCell {
    /// Aborted sessions among the valid runs.
    pub aborted: Share,
    /// False verdicts among the runs with a verdict of the facility.
    pub wrong: Share,
    /// Upper bound of the share of false verdicts, with 95 % confidence; 1 without verdicts.
    pub at_most: f64,
    /// Whether the bound is at most `trust`.
    pub trusted: bool,
    /// Median of the map's metric.
    pub median: Option<f64>,
}

/// Compares the variants; the first is the reference.
pub fn compare(id: &str, title: &str, plan: &Comparison, inputs: &[VariantInput]) -> Result<Compared> {
    let columns = Columns::of(plan);
    let mut variants = Vec::new();
    let mut reference: Option<Vec<Row>> = None;
    for input in inputs {
        let rows = match input.summary.completeness.runs_done {
            0 => Vec::new(),
            _ => columns.read(input.results, input.shards)?,
        };
        variants.push(variant(plan, &columns, input, &rows, reference.as_deref()));
        reference.get_or_insert(rows);
    }
    let codes = || inputs.iter().map(|input| input.summary.exit_code);
    let worst = inputs.iter().max_by_key(|input| input.summary.exit_code).map(|input| &input.summary);
    let made_on = inputs.iter().flat_map(|input| &input.summary.completeness.devices);
    let made_on = made_on.map(|own| (own.backend.as_str(), own.device.as_str(), own.shards));
    Ok(Compared {
        schema: COMPARE_SCHEMA,
        campaign: id.to_owned(),
        title: title.to_owned(),
        seed: worst.map_or(0, |summary| summary.seed),
        version: worst.map_or(String::new(), |summary| summary.version.clone()),
        commit: worst.map_or(String::new(), |summary| summary.commit.clone()),
        devices: DeviceShards::summed(made_on),
        verdict: worst.map_or(Verdict::Undecided, |summary| summary.verdict),
        exit_code: codes().max().unwrap_or(3),
        trust: plan.trust,
        along: plan.along.as_ref().map(MapAxis::of),
        variants,
    })
}

fn variant(
    plan: &Comparison,
    columns: &Columns,
    input: &VariantInput,
    rows: &[Row],
    reference: Option<&[Row]>,
) -> ComparedVariant {
    let all: Vec<&Row> = rows.iter().collect();
    let valid: Vec<&Row> = rows.iter().filter(|row| row.is_valid()).collect();
    let share = |counts: fn(&Row) -> bool| share_of(&valid, counts);
    let differs = |row: &&&Row| {
        twin(reference, row.run)
            .is_some_and(|other| other.is_valid() && other.passes_in_space() != row.passes_in_space())
    };
    ComparedVariant {
        name: input.name.to_owned(),
        title: input.title.to_owned(),
        changes: input.changes.to_vec(),
        campaign_hash: input.summary.campaign_hash.clone(),
        verdict: input.summary.verdict,
        space_pass: share(Row::passes_in_space),
        facility_pass: share(Row::passes_on_facility),
        agreement: input.summary.agreement.clone(),
        causes: input.summary.causes.facility.clone(),
        wrong: wrong(&valid, reference),
        space_differs: valid.iter().filter(differs).count() as u64,
        metrics: spreads(plan, columns, &all),
        bands: plan.along.iter().flat_map(|bands| bands_of(plan, columns, bands, &all, reference)).collect(),
        maps: plan.maps.iter().map(|map| map_of(plan, columns, map, &all)).collect(),
    }
}

fn share_of(rows: &[&Row], counts: impl Fn(&Row) -> bool) -> Share {
    Share::of(rows.iter().filter(|row| counts(row)).count() as u64, rows.len() as u64)
}

/// Returns the reference's run of the same number.
fn twin(reference: Option<&[Row]>, run: u64) -> Option<&Row> {
    let reference = reference?;
    reference.binary_search_by_key(&run, |row| row.run).ok().map(|at| &reference[at])
}

/// Returns the runs with a verdict of the facility.
fn answered<'a>(rows: &[&'a Row]) -> Vec<&'a Row> {
    rows.iter().copied().filter(|row| row.is_answered()).collect()
}

fn wrong(valid: &[&Row], reference: Option<&[Row]>) -> Wrong {
    let mut pairs = Pairs::default();
    let answered = answered(valid);
    for row in &answered {
        if let Some(other) = twin(reference, row.run).filter(|other| other.is_answered()) {
            pairs.add(other.is_wrong(), row.is_wrong());
        }
    }
    let factor = pairs.factor(READING_CONFIDENCE).filter(|_| reference.is_some());
    Wrong { share: share_of(&answered, Row::is_wrong), pairs, factor }
}

fn spreads(plan: &Comparison, columns: &Columns, rows: &[&Row]) -> Vec<Spread> {
    let spread = |(name, unit): &(String, &'static str)| {
        let sorted = sorted(rows, columns.metric(name));
        let quantile = |share| (!sorted.is_empty()).then(|| sorted_quantile(&sorted, share));
        let [lo, median, hi] = QUANTILES.map(quantile);
        Spread { metric: name.clone(), unit, runs: sorted.len() as u64, lo, median, hi }
    };
    plan.metrics.iter().map(spread).collect()
}

/// Values of a column, ascending.
fn sorted(rows: &[&Row], column: usize) -> Vec<f64> {
    let mut values: Vec<f64> = rows.iter().map(|row| row.values[column]).filter(|value| value.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    values
}

/// Returns whether a value is in a cell of an axis; the last cell includes its upper end.
fn holds(edges: &[f64], index: usize, value: f64) -> bool {
    let last = index + 2 == edges.len();
    edges[index] <= value && (value < edges[index + 1] || last && value <= edges[index + 1])
}

fn bands_of(
    plan: &Comparison,
    columns: &Columns,
    bands: &Bands,
    rows: &[&Row],
    reference: Option<&[Row]>,
) -> Vec<Band> {
    let column = columns.input(&bands.field);
    let band = |index: usize| {
        let inside: Vec<&Row> =
            rows.iter().copied().filter(|row| holds(&bands.edges, index, row.values[column])).collect();
        let valid: Vec<&Row> = inside.iter().copied().filter(|row| row.is_valid()).collect();
        let (passed, failed): (Vec<&Row>, Vec<&Row>) = valid.iter().copied().partition(|row| row.passes_in_space());
        Band {
            lo: bands.edges[index],
            hi: bands.edges[index + 1],
            false_pass_rate: share_of(&failed, Row::is_wrong),
            false_fail_rate: share_of(&passed, Row::is_wrong),
            aborted: share_of(&valid, Row::is_aborted),
            wrong: wrong(&valid, reference),
            metrics: spreads(plan, columns, &inside),
        }
    };
    (0..bands.edges.len() - 1).map(band).collect()
}

fn map_of(plan: &Comparison, columns: &Columns, map: &CellMap, rows: &[&Row]) -> Map {
    let [x, y] = [&map.x, &map.y].map(|axis| columns.input(&axis.field));
    let metric = map.metric.as_ref().map(|(name, _)| columns.metric(name));
    let slice = map.slice.as_ref().map(|slice| (&slice.edges, columns.input(&slice.field)));
    let inside = |row: &&&Row| slice.is_none_or(|(edges, column)| holds(edges, 0, row.values[column]));
    let rows: Vec<&Row> = rows.iter().filter(inside).copied().collect();
    let cell = |column: usize, row: usize| {
        let here = |run: &&&Row| holds(&map.x.edges, column, run.values[x]) && holds(&map.y.edges, row, run.values[y]);
        let inside: Vec<&Row> = rows.iter().filter(here).copied().collect();
        let valid: Vec<&Row> = inside.iter().copied().filter(|run| run.is_valid()).collect();
        let wrong = share_of(&answered(&valid), Row::is_wrong);
        let at_most = upper_bound(wrong.count, wrong.cases, READING_CONFIDENCE);
        let values = metric.map(|metric| sorted(&inside, metric)).filter(|values| !values.is_empty());
        MapCell {
            aborted: share_of(&valid, Row::is_aborted),
            wrong,
            at_most,
            trusted: at_most <= plan.trust,
            median: values.map(|values| sorted_quantile(&values, 0.5)),
        }
    };
    let cells: Vec<Vec<MapCell>> = (0..map.y.edges.len() - 1)
        .map(|row| (0..map.x.edges.len() - 1).map(|column| cell(column, row)).collect())
        .collect();
    let trusted = cells.iter().flatten().filter(|cell| cell.trusted).count();
    let metric = map.metric.as_ref().map(|(name, _)| name.clone());
    let slice = map.slice.as_ref().map(MapAxis::of);
    Map { x: MapAxis::of(&map.x), y: MapAxis::of(&map.y), slice, metric, cells, trusted }
}
