//! Counted shares with their intervals.

use serde::{Deserialize, Serialize};

use crate::exact::{Interval, READING_CONFIDENCE, clopper_pearson};

/// A counted share with its two-sided Clopper-Pearson interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Share {
    /// Cases that count.
    pub count: u64,
    /// All cases.
    pub cases: u64,
    /// Interval of the true share.
    pub interval: Interval,
}

impl Share {
    /// The share with its 95 % interval.
    pub fn of(count: u64, cases: u64) -> Self {
        Self { count, cases, interval: clopper_pearson(count, cases, READING_CONFIDENCE) }
    }
}
