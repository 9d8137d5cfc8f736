//! Differences of the delay between repeats.

use crate::model::block::{MeasuredBlock, Trial};
use crate::plants::command::packets::echo::{Echo, Missed};
use crate::plants::command::packets::lag_and_limit::Behind;
use nalgebra::DMatrix;
use softdock_campaign::rig::CommandRig;
use std::collections::BTreeMap;

/// A row is fast where its weight is below this share of the greatest: the noise there is the delay's.
const FAST: f64 = 0.25;

/// One over the rate at which a row's command was sent \[s/rad\]. Weights are softened where it is slow: the greatest of
/// them is that of no rate at all.
fn per_rate(weight: f64, greatest: f64) -> f64 {
    (weight.powi(-2) - greatest.powi(-2)).sqrt().recip()
}

/// Differences of the delay between repeats, in fast rows.
pub(super) struct Lateness {
    /// That \[s\], as large as a single one's noise; one row, an entry for each repeat.
    pub(super) series: Vec<DMatrix<f64>>,
    /// Standard deviation of what the rounding of the received commands makes of it \[s\].
    pub(super) rounding: f64,
}

/// A recording with the rates at which its commands were sent.
struct Timed<'a> {
    echo: &'a Echo<'a>,
    missed: &'a Missed,
    trial: &'a Trial,
}

/// Of recordings, and the block that was made of them.
pub(super) fn lateness(
    rig: &CommandRig,
    behind: &Behind,
    echoes: &[Echo],
    missed: &[Missed],
    block: &MeasuredBlock,
) -> Lateness {
    let mut repeats: BTreeMap<&str, Vec<Timed>> = BTreeMap::new();
    for ((echo, missed), trial) in echoes.iter().zip(missed).zip(&block.trials) {
        repeats.entry(&trial.experiment).or_default().push(Timed { echo, missed, trial });
    }
    let (mut series, mut squares, mut count) = (Vec::new(), 0.0, 0);
    for timed in repeats.values().filter(|timed| timed.len() > 1) {
        let rows = fast(behind, timed);
        squares += rows.iter().map(|row| row.per_rate.powi(2)).sum::<f64>();
        count += rows.len();
        series.extend(deviations(timed, &rows));
    }
    let step = echoes.first().map_or(1.0, |echo| echo.piece.step);
    let rounding = rig.quantum / 12_f64.sqrt() * behind.magnified(step);
    Lateness { series, rounding: rounding * (squares / count.max(1) as f64).sqrt() }
}

/// A row of some repeats.
struct Row {
    place: usize,
    /// One over the rate at which its command was sent \[s/rad\].
    per_rate: f64,
}

/// Softened inverse of the rate at which a row's command was sent \[s/rad\]; nothing where that is not known.
fn weight(trial: &Trial, row: usize) -> f64 {
    trial.recorded.inputs[2 * trial.recorded.stride * row]
}

/// Rows of some repeats that are fast, and that no limit comes near.
fn fast(behind: &Behind, timed: &[Timed]) -> Vec<Row> {
    let rows = timed.iter().map(|timed| timed.echo.arrived.len()).min().unwrap_or(0);
    let slow = (0..rows).map(|row| weight(timed[0].trial, row)).fold(0.0, f64::max);
    let shows = |Timed { echo, missed, trial }: &Timed, row: usize| {
        let (weight, hidden) = (weight(trial, row), echo.limited[row] || missed.rows[row]);
        weight > 0.0 && weight < FAST * slow && behind.spares(weight.recip()) && !hidden
    };
    let shown = (0..rows).filter(|row| timed.iter().all(|timed| shows(timed, *row)));
    shown.map(|place| Row { place, per_rate: per_rate(weight(timed[0].trial, place), slow) }).collect()
}

fn deviations(timed: &[Timed], rows: &[Row]) -> Vec<DMatrix<f64>> {
    let count = timed.len() as f64;
    let value = |timed: &Timed, row: &Row| timed.echo.arrived[row.place] * row.per_rate;
    let mean: Vec<f64> =
        rows.iter().map(|row| timed.iter().map(|timed| value(timed, row)).sum::<f64>() / count).collect();
    let scale = (count / (count - 1.0)).sqrt();
    let of = |timed: &Timed| DMatrix::from_fn(1, rows.len(), |_, i| (value(timed, &rows[i]) - mean[i]) * scale);
    if rows.is_empty() { Vec::new() } else { timed.iter().map(of).collect() }
}
