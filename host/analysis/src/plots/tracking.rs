//! How the robots follow a test motion: spread of gain, lag, error and overshoot, and both former over the frequency.

use serde::Serialize;

use crate::Result;
use crate::moments::sorted_quantile;
use crate::number::significant;
use crate::plots::Drawing;
use crate::plots::axis::Axis;
use crate::plots::figure::{Figure, Size, colour};
use crate::plots::sample::{Sample, TRACKING};
use softdock_results::columns::input_named;

/// The [`TRACKING`] columns in words, with the unit and its factor.
const WORDS: [(&str, &str, f64); TRACKING.len()] = [
    ("gain: amplitude over that of the command", "", 1.0),
    ("lag: phase behind the command", " deg", 180.0 / std::f64::consts::PI),
    ("error: root mean square of place less command", " mm", 1e3),
    ("overshoot: greatest speed over that of the command, less 1", " %", 100.0),
];

/// Spread of one column.
#[derive(Serialize)]
pub(crate) struct TrackingRow {
    name: String,
    lo: String,
    median: String,
    hi: String,
}

/// One row per column; none without a test motion.
pub(crate) fn tracking_rows(sample: &Sample) -> Vec<TrackingRow> {
    let row = |((name, unit, factor), values): ((&str, &str, f64), &Vec<Option<f64>>)| {
        let mut sorted: Vec<f64> = values.iter().flatten().map(|value| factor * value).collect();
        sorted.sort_by(f64::total_cmp);
        let shown = |share| format!("{}{unit}", significant(sorted_quantile(&sorted, share), 3));
        (!sorted.is_empty()).then(|| TrackingRow {
            name: name.to_owned(),
            lo: shown(0.05),
            median: shown(0.5),
            hi: shown(0.95),
        })
    };
    WORDS.into_iter().zip(&sample.tracking).filter_map(row).collect()
}

/// Gain and lag of each run against the frequency of its test motion, where that varies.
pub(crate) fn tracking_figures(sample: &Sample) -> Result<Vec<Drawing>> {
    let Some(frequency) = sample.inputs.iter().find(|input| input.column == input_named("test_frequency").name())
    else {
        return Ok(Vec::new());
    };
    let mut figures = Vec::new();
    for (column, label) in [(0, "gain"), (1, "lag [deg]")] {
        let values = frequency.values.iter().zip(&sample.tracking[column]);
        let points: Vec<(f64, f64)> =
            values.filter_map(|(at, value)| Some((*at, WORDS[column].2 * (*value)?))).collect();
        let ends = points.iter().fold((0.0f64, 0.0f64), |(lo, hi), (_, value)| (lo.min(*value), hi.max(*value)));
        if points.len() < 3 {
            continue;
        }
        let x = Axis::fitting("frequency of the test motion [Hz]", frequency.moments.lo, frequency.moments.hi);
        let y = Axis::linear(label, ends.0, ends.1).padded(0.04);
        let figure = Figure::new(format!("{label} against frequency"), Size::Half, x, y);
        let svg = figure.points(points, colour::FACILITY, 2.0, 0.6).svg()?;
        figures.push(Drawing { svg, caption: format!("Each dot is a run: {}.", WORDS[column].0) });
    }
    Ok(figures)
}
