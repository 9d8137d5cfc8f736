//! The legal range of every dispersible parameter, for nominal values and draws alike.

use crate::units::show;
use softdock_kernels::params;
use softdock_kernels::range::Range;

/// Most runs of a campaign.
pub(crate) const MOST_RUNS: u64 = 1_000_000_000;

/// Describes a range: "above 0 kg, at most 1e7 kg".
pub(crate) fn in_words(range: Range, unit: &str) -> String {
    let low = if range.above { "above" } else { "at least" };
    format!("{low} {}, at most {}", show(range.min, unit), show(range.max, unit))
}

/// The whole vector's name of a component (`offset` of `offset_y`).
pub(crate) fn vector_name(field: &str) -> Option<&str> {
    ["_x", "_y", "_z"].iter().find_map(|suffix| field.strip_suffix(suffix))
}

/// The legal range of a field of `Params`, or of the components of a vector.
pub(crate) fn legal(field: &str) -> Range {
    let row = params::row_of(field).or_else(|| params::row_of(&format!("{field}_x")));
    row.and_then(|row| row.range).expect("every row of Params has a range: see its test")
}

/// Least and greatest legal value of a field of `Params`, in its unit.
///
/// # Panics
/// If there is no such field.
pub fn legal_range(field: &str) -> (f64, f64) {
    let range = legal(field);
    (range.min, range.max)
}
