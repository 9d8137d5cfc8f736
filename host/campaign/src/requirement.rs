//! A requirement to be signed: a metric, its limit, and with which probability and confidence it must hold.

use crate::check::{Checker, span_of};
use crate::ranges::Range;
use crate::suggest::suggestion;
use crate::written::campaign::RequirementTable;
use softdock_kernels::fields::{Field, fields};
use softdock_kernels::metrics::Metrics;

/// Metric of a loop that is no number of the monitor: 1 if every criterion of the task holds, 0 if not; not available
/// where the session was aborted.
pub const SUCCESS: &str = "success";

/// On which side of the limit a metric passes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Passes at or below the limit; margin = limit - value.
    AtMost,
    /// Passes at or above the limit; margin = value - limit.
    AtLeast,
}

/// One checked requirement.
#[derive(Clone, Debug, PartialEq)]
pub struct Requirement {
    /// Id as in the user's documents (`ARM-CON-110`).
    pub id: String,
    /// The requirement's text.
    pub text: String,
    /// Field name of [`softdock_kernels::metrics::Metrics`] (`peak_contact_force`).
    pub metric: String,
    /// Unit of the metric and its limit (SI).
    pub unit: &'static str,
    /// Passing side.
    pub side: Side,
    /// The limit, SI.
    pub limit: f64,
    /// Share of cases that must pass, 0..1.
    pub probability: f64,
    /// Confidence of the demonstration, 0..1.
    pub confidence: f64,
}

impl Requirement {
    /// Distance to the limit, positive inside; `None` if the metric is not available.
    pub fn margin(&self, value: Option<f64>) -> Option<f64> {
        value.map(|value| match self.side {
            Side::AtMost => self.limit - value,
            Side::AtLeast => value - self.limit,
        })
    }

    /// Id as it appears in column names (`arm_con_110`).
    pub fn column_id(&self) -> String {
        self.id.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '_' }).collect()
    }
}

/// A share of cases that runs can demonstrate; beyond it rare-event methods only estimate.
const SHARE: Range = Range::above(0.0, 0.999_999);

/// Checks the requirements of a campaign file.
pub(crate) fn read(c: &mut Checker, tables: &[RequirementTable]) -> Vec<Requirement> {
    let mut metrics = fields::<f64, Metrics<f64>>();
    metrics.insert(0, Field { name: SUCCESS.to_owned(), unit: "1", meaning: "1 if every criterion of the task holds" });
    let mut checked: Vec<Requirement> = Vec::new();
    for table in tables {
        let Some(metric) = metrics.iter().find(|metric| metric.name == table.metric.value) else {
            let names: Vec<&str> = metrics.iter().map(|metric| metric.name.as_str()).collect();
            let message = format!("there is no metric `{}`", table.metric.value);
            c.refuse(&table.metric.span, message, suggestion(&table.metric.value, &names));
            continue;
        };
        let (side, limit) = limit(c, table, metric.unit);
        let requirement = Requirement {
            id: table.id.value.clone(),
            text: table.text.value.clone(),
            metric: metric.name.clone(),
            unit: metric.unit,
            side,
            limit,
            probability: c.number(&table.probability, "1", SHARE),
            confidence: c.number(&table.confidence, "1", SHARE),
        };
        if requirement.id.trim().is_empty() {
            c.refuse(&table.id.span, "the id is empty", "write the id of the requirements document");
        } else if let Some(twin) = checked.iter().find(|other| other.column_id() == requirement.column_id()) {
            let message = format!("this id gives the same columns as `{}`", twin.id);
            c.refuse(&table.id.span, message, "give every requirement an id of its own (letters and digits count)");
        }
        checked.push(requirement);
    }
    checked
}

fn limit(c: &mut Checker, table: &RequirementTable, unit: &str) -> (Side, f64) {
    let any = Range::size(1e15);
    match (&table.at_most, &table.at_least) {
        (Some(limit), None) => (Side::AtMost, c.number(limit, unit, any)),
        (None, Some(limit)) => (Side::AtLeast, c.number(limit, unit, any)),
        (at_most, _) => {
            let both = at_most.is_some();
            let message = if both { "two limits" } else { "no limit" };
            let span = span_of(&table.at_least).unwrap_or(table.id.span.clone());
            c.refuse(&span, message, "give one of at_most and at_least (two requirements make a band)");
            (Side::AtMost, 0.0)
        }
    }
}
