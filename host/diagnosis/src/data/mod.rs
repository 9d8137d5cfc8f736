//! Measured recordings: read through a model's `[log]`, resampled to an even grid, with findings; held-out data.

pub(crate) mod bandwidth;
pub mod clock;
pub(crate) mod dialect;
pub(crate) mod drive_log;
pub mod grid;
pub mod hold_out;
pub(crate) mod outliers;
pub(crate) mod plausibility;
pub mod quality;
pub(crate) mod recordings;
pub(crate) mod repeats;
pub(crate) mod segments;
pub mod smooth;
pub(crate) mod stamps;
pub mod state;
pub mod table;

/// The middle of some values, or between the two in the middle.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let half = values.len() / 2;
    if values.len().is_multiple_of(2) { 0.5 * (values[half - 1] + values[half]) } else { values[half] }
}
