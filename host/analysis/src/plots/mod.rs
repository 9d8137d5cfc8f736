//! The report's figures: what each shows, from data to SVG.

pub mod axis;
pub(crate) mod bands;
pub(crate) mod canvas;
pub(crate) mod cells;
pub(crate) mod energy;
pub mod figure;
pub(crate) mod force;
pub(crate) mod map;
pub(crate) mod margin;
pub(crate) mod sample;
pub(crate) mod scene;
pub(crate) mod success;
pub(crate) mod tracking;

use serde::Serialize;

use crate::number::unit_text;

/// A finished figure with its caption.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Drawing {
    pub(crate) svg: String,
    pub(crate) caption: String,
}

/// Name and unit of an axis; pure numbers have no unit.
pub(crate) fn axis_label(name: &str, unit: &str) -> String {
    if unit == "1" { name.to_owned() } else { format!("{name} [{}]", unit_text(unit)) }
}

/// Milliseconds for short times: factor and unit in which a quantity is shown.
pub(crate) fn shown_in(unit: &'static str, greatest: f64) -> (f64, &'static str) {
    if unit == "s" && greatest < 1.0 { (1e3, "ms") } else { (1.0, unit) }
}

/// Quantile of sorted values; 0 without values.
pub(crate) fn sorted_quantile(sorted: &[f64], share: f64) -> f64 {
    let last = sorted.len().saturating_sub(1);
    sorted.get((share * last as f64).round() as usize).copied().unwrap_or(0.0)
}
