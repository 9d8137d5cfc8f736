//! Demands on measured quantities, judged by exact bounds.
//!
//! A demand is a range of the true quantity. It is refuted if the exact interval of the quantity excludes the range.
//! The intervals of all demands of a score hold together with 99 % (Bonferroni), so that a diagnosis that meets every
//! demand fails at most one score in a hundred, whatever the number of cases. A demand is met if the 95 % interval is
//! within the range. In between, the cases do not decide: the demand is not refuted.

use crate::calibration::Bin;
use serde::Serialize;
use softdock_analysis::{READING_CONFIDENCE, Share, clopper_pearson};

/// Joint confidence of the intervals that refute demands.
const JOINT_CONFIDENCE: f64 = 0.99;

/// Status of a demand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum DemandStatus {
    /// The 95 % interval is within the demand.
    Met,
    /// The cases do not decide.
    NotRefuted,
    /// The interval at the joint confidence excludes the demand.
    Refuted,
    /// There is no case.
    NoCases,
}

impl DemandStatus {
    /// Returns the status in words.
    pub fn word(self) -> &'static str {
        match self {
            Self::Met => "met",
            Self::NotRefuted => "not refuted",
            Self::Refuted => "NOT MET",
            Self::NoCases => "-",
        }
    }
}

/// Acceptance criterion with its result.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AcceptanceCriterion {
    /// Demand.
    pub demand: String,
    /// A share with its exact 95 % interval.
    pub share: Option<Share>,
    /// Value, if the result is not a share.
    pub value: Option<f64>,
    /// Status.
    pub status: DemandStatus,
}

/// Measured quantity with exact bounds of its true value.
#[derive(Clone, Debug)]
pub(super) enum Measured {
    /// Share of independent cases.
    Share { count: usize, cases: usize },
    /// Share of values of which `groups` are independent. Their number counts, which is conservative.
    Grouped { count: usize, cases: usize, groups: usize },
    /// Smallest of several shares: count and cases of each.
    Smallest(Vec<(usize, usize)>),
    /// Median of values and a limit: the share of values within the limit is at least one half if the true median is.
    Median { value: Option<f64>, within: usize, cases: usize },
    /// Mean distance of stated probability and frequency.
    Calibration { error: Option<f64>, bins: Vec<Bin> },
    /// Difference of two shares, the first less the second.
    Difference([Share; 2]),
}

impl Measured {
    fn has_cases(&self) -> bool {
        match self {
            Self::Share { cases, .. } | Self::Grouped { cases, .. } | Self::Median { cases, .. } => *cases > 0,
            Self::Smallest(shares) => !shares.is_empty(),
            Self::Calibration { bins, .. } => !bins.is_empty(),
            Self::Difference(shares) => shares.iter().all(|share| share.cases > 0),
        }
    }

    /// Returns lower and upper bound of the true quantity, which hold together with a confidence.
    fn bounds(&self, confidence: f64) -> [f64; 2] {
        match self {
            Self::Share { count, cases } | Self::Median { within: count, cases, .. } => {
                interval(*count, *cases, confidence)
            }
            Self::Grouped { count, cases, groups } => {
                let count = (count * groups) as f64 / *cases as f64;
                let [lo, _] = interval(count.floor() as usize, *groups, confidence);
                let [_, hi] = interval(count.ceil() as usize, *groups, confidence);
                [lo, hi]
            }
            Self::Smallest(shares) => {
                let own = shared(confidence, shares.len());
                let all = shares.iter().map(|(count, cases)| interval(*count, *cases, own));
                all.fold([1.0_f64; 2], |least, own| [least[0].min(own[0]), least[1].min(own[1])])
            }
            Self::Calibration { bins, .. } => calibrated(bins, confidence),
            Self::Difference(shares) => {
                let own = shared(confidence, 2);
                let [a, b] = shares.map(|share| interval(share.count as usize, share.cases as usize, own));
                [a[0] - b[1], a[1] - b[0]]
            }
        }
    }

    /// Returns what is reported: a share, or a value.
    fn reported(&self) -> (Option<Share>, Option<f64>) {
        let share = |count: usize, cases: usize| Some(Share::of(count as u64, cases as u64));
        if !self.has_cases() {
            return (None, None);
        }
        match self {
            Self::Share { count, cases } | Self::Grouped { count, cases, .. } => (share(*count, *cases), None),
            Self::Smallest(shares) => {
                let rate = |(count, cases): &(usize, usize)| *count as f64 / *cases as f64;
                let least = shares.iter().min_by(|a, b| rate(a).total_cmp(&rate(b)));
                (least.and_then(|(count, cases)| share(*count, *cases)), None)
            }
            Self::Median { value, .. } | Self::Calibration { error: value, .. } => (None, *value),
            Self::Difference([a, b]) => {
                let rate = |share: &Share| share.count as f64 / share.cases as f64;
                (None, Some(rate(a) - rate(b)))
            }
        }
    }
}

/// Returns the confidence of each of several intervals that hold together with a confidence (Bonferroni).
fn shared(confidence: f64, intervals: usize) -> f64 {
    1.0 - (1.0 - confidence) / intervals.max(1) as f64
}

fn interval(count: usize, cases: usize, confidence: f64) -> [f64; 2] {
    let interval = clopper_pearson(count as u64, cases as u64, confidence);
    [interval.lo, interval.hi]
}

/// Returns the bounds of the calibration error, from those of the frequency of every bin.
fn calibrated(bins: &[Bin], confidence: f64) -> [f64; 2] {
    let own = shared(confidence, bins.len());
    let all: f64 = bins.iter().map(|bin| bin.right.cases as f64).sum();
    bins.iter().fold([0.0; 2], |[least, most], bin| {
        let [lo, hi] = interval(bin.right.count as usize, bin.right.cases as usize, own);
        let weight = bin.right.cases as f64 / all;
        let nearest = (lo - bin.stated).max(bin.stated - hi).max(0.0);
        let farthest = (hi - bin.stated).max(bin.stated - lo);
        [least + weight * nearest, most + weight * farthest]
    })
}

/// Demand on a measured quantity.
#[derive(Clone, Debug)]
pub(super) struct Demand {
    text: String,
    /// Range of the true quantity.
    range: [f64; 2],
    measured: Measured,
}

impl Demand {
    pub(super) fn at_least(text: impl Into<String>, least: f64, measured: Measured) -> Self {
        Self { text: text.into(), range: [least, f64::INFINITY], measured }
    }

    pub(super) fn at_most(text: impl Into<String>, most: f64, measured: Measured) -> Self {
        Self { text: text.into(), range: [f64::NEG_INFINITY, most], measured }
    }

    pub(super) fn within(text: impl Into<String>, range: [f64; 2], measured: Measured) -> Self {
        Self { text: text.into(), range, measured }
    }

    /// Returns the status; `confidence` is that of the interval that refutes it.
    fn status(&self, confidence: f64) -> DemandStatus {
        if !self.measured.has_cases() {
            return DemandStatus::NoCases;
        }
        let [least, most] = self.range;
        let [lo, hi] = self.measured.bounds(confidence);
        if lo > most || hi < least {
            return DemandStatus::Refuted;
        }
        let [lo, hi] = self.measured.bounds(READING_CONFIDENCE);
        if lo >= least && hi <= most { DemandStatus::Met } else { DemandStatus::NotRefuted }
    }
}

/// Judges all demands of a score together.
pub(super) fn judged(demands: Vec<Demand>) -> Vec<AcceptanceCriterion> {
    let asked = demands.iter().filter(|demand| demand.measured.has_cases()).count();
    let confidence = shared(JOINT_CONFIDENCE, asked);
    let criterion = |demand: Demand| {
        let (share, value) = demand.measured.reported();
        AcceptanceCriterion { status: demand.status(confidence), demand: demand.text, share, value }
    };
    demands.into_iter().map(criterion).collect()
}

#[cfg(test)]
mod tests;
