//! A requirement to be signed: a metric, its limit, and with which probability and confidence it must hold.

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
    /// Field name of [`Metrics`](softdock_kernels::metrics::Metrics) (`peak_force`).
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
