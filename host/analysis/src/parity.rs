//! Differences between repeated runs: the campaign's backend and f64, the substep and half of it.

use serde::{Deserialize, Serialize};
use softdock_kernels::metrics::flags::HIL_UNSTABLE;
use softdock_results::columns::{FLAGS, Loop, RUN};
use softdock_results::parity::Repetition;
use softdock_results::{Column, Table, Values};
use std::collections::BTreeSet;

use crate::exact::Share;

/// Factor on a margin's RMS difference within which a changed verdict is expected.
const EXPLAINED: f64 = 3.0;

/// Comparison of repeated runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Parity {
    /// Repeated runs.
    pub runs: u64,
    /// Runs with a different verdict.
    pub flipped: Share,
    /// Of these, runs in which the facility's loop diverged in only one of the two.
    pub diverged: u64,
    /// Differences of each metric and margin.
    pub metrics: Vec<MetricParity>,
    /// The verdicts that differ, at most 100.
    pub flips: Vec<Flip>,
}

/// Difference of one column.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MetricParity {
    /// Column name.
    pub column: String,
    /// Unit.
    pub unit: String,
    /// Runs in which both have a value.
    pub compared: u64,
    /// Runs in which only one of the two has a value.
    pub only_one: u64,
    /// Largest difference.
    pub max_difference: f64,
    /// Run of the largest difference.
    pub max_run: Option<u64>,
    /// Root mean square of the differences.
    pub rms_difference: f64,
}

/// Verdict that differs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Flip {
    /// Run number.
    pub run: u64,
    /// Column name.
    pub column: String,
    /// Margin of the repeated run, for a requirement.
    pub margin: Option<f64>,
    /// Whether that margin is within three RMS differences of zero.
    pub within_three_rms: Option<bool>,
    /// Whether the facility's loop diverged in only one of the two: where every contact injects energy, rounding
    /// decides which run separates.
    pub diverged: bool,
}

/// Flips that are listed one by one.
const LISTED_FLIPS: usize = 100;

impl Parity {
    /// The comparison, from a table of repeated runs.
    pub fn of(kind: &Repetition, table: &Table) -> Self {
        let runs = table.get(&RUN).unwrap_or_default();
        let metrics: Vec<MetricParity> =
            pairs(kind, table).filter_map(|(backend, truth)| metric_parity(runs, backend, truth)).collect();
        let mut flips: Vec<Flip> = Vec::new();
        for (backend, truth) in pairs(kind, table) {
            let differing = (0..runs.len()).filter(|row| differs(&backend.values, &truth.values, *row));
            flips.extend(differing.map(|row| flip(kind, table, &metrics, backend, runs[row], row)));
        }
        let runs_of =
            |flips: &mut dyn Iterator<Item = &Flip>| flips.map(|flip| flip.run).collect::<BTreeSet<u64>>().len() as u64;
        let flipped = runs_of(&mut flips.iter());
        let diverged = runs_of(&mut flips.iter().filter(|flip| flip.diverged));
        flips.sort_by(|one, two| (one.run, &one.column).cmp(&(two.run, &two.column)));
        flips.truncate(LISTED_FLIPS);
        let cases = runs.len() as u64;
        Self { runs: cases, flipped: Share::of(flipped, cases), diverged, metrics, flips }
    }
}

/// Every column with its twin.
fn pairs<'a>(kind: &'a Repetition, table: &'a Table) -> impl Iterator<Item = (&'a Column, &'a Column)> {
    table.columns.iter().filter_map(|column| {
        let truth = table.column(&format!("{}{}", kind.prefix, column.name))?;
        Some((column, truth))
    })
}

fn metric_parity(runs: &[u64], backend: &Column, truth: &Column) -> Option<MetricParity> {
    let (Values::F64(one), Values::F64(two)) = (&backend.values, &truth.values) else { return None };
    let (mut compared, mut only_one, mut squares) = (0, 0, 0.0);
    let (mut max_difference, mut max_run) = (0.0, None);
    for ((one, two), run) in one.iter().zip(two).zip(runs) {
        match (one, two) {
            (Some(one), Some(two)) => {
                let difference = (one - two).abs();
                compared += 1;
                squares += difference * difference;
                if difference > max_difference {
                    (max_difference, max_run) = (difference, Some(*run));
                }
            }
            (None, None) => {}
            _ => only_one += 1,
        }
    }
    let rms_difference = if compared == 0 { 0.0 } else { f64::sqrt(squares / compared as f64) };
    let (column, unit) = (backend.name.clone(), backend.unit.clone());
    Some(MetricParity { column, unit, compared, only_one, max_difference, max_run, rms_difference })
}

/// Whether a verdict or a status differs; numbers are no verdicts, flags are findings.
fn differs(one: &Values, two: &Values, row: usize) -> bool {
    match (one, two) {
        (Values::Bool(one), Values::Bool(two)) => one[row] != two[row],
        (Values::Words { .. }, Values::Words { .. }) => one.word(row) != two.word(row),
        _ => false,
    }
}

fn flip(kind: &Repetition, table: &Table, metrics: &[MetricParity], backend: &Column, run: u64, row: usize) -> Flip {
    let column = Loop::of_pass(&backend.name).map(|(side, id)| side.margin(id));
    let margin = column.as_ref().and_then(|column| table.get(&kind.second(column)).ok()?[row]);
    let rms = metrics.iter().find(|metric| column.as_ref().is_some_and(|column| column.name() == metric.column));
    let within_three_rms = margin.zip(rms).map(|(margin, metric)| margin.abs() <= EXPLAINED * metric.rms_difference);
    let [one, two] = [FLAGS.clone(), kind.second(&FLAGS)]
        .map(|column| table.get(&column).is_ok_and(|flags| flags[row] & HIL_UNSTABLE != 0));
    Flip { run, column: backend.name.clone(), margin, within_three_rms, diverged: one != two }
}
