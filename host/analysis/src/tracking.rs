//! How the robots follow a test motion: spread of gain, lag, error and overshoot.

use serde::Serialize;
use softdock_results::columns::Loop;

use crate::moments::sorted_quantile;
use crate::number::significant;
use crate::page_data::pass::PageRuns;

/// Metrics of the robots' response to a test motion with text, unit and factor to it; null in campaigns without one.
const METRICS: [(&str, &str, &str, f64); 4] = [
    ("tracking_gain", "gain: amplitude over that of the command", "", 1.0),
    ("tracking_lag", "lag: phase behind the command", " deg", 180.0 / std::f64::consts::PI),
    ("tracking_error", "error: root mean square of place less command", " mm", 1e3),
    ("tracking_overshoot", "overshoot: greatest speed over that of the command, less 1", " %", 100.0),
];

/// Spread of one column.
#[derive(Serialize)]
pub(crate) struct TrackingRow {
    name: String,
    lo: String,
    median: String,
    hi: String,
}

/// Quantiles of an even sample of the runs, one row per metric; none without a test motion.
pub(crate) fn tracking_rows(runs: &PageRuns) -> Vec<TrackingRow> {
    let row = |(metric, name, unit, factor): (&str, &str, &str, f64)| {
        let column = runs.column(Loop::Hil.metric_named(metric).name())?;
        let values = runs.even.iter().map(|run| f64::from(run.numbers[column])).filter(|value| value.is_finite());
        let mut sorted: Vec<f64> = values.map(|value| factor * value).collect();
        sorted.sort_by(f64::total_cmp);
        let shown = |share| format!("{}{unit}", significant(sorted_quantile(&sorted, share), 3));
        (!sorted.is_empty()).then(|| TrackingRow {
            name: name.to_owned(),
            lo: shown(0.05),
            median: shown(0.5),
            hi: shown(0.95),
        })
    };
    METRICS.into_iter().filter_map(row).collect()
}
