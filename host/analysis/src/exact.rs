//! Exact binomial statistics for sign-off: bounds, allowed failures, numbers of runs, tolerance limits.
//!
//! Clopper and Pearson, Biometrika 26 (1934); Wilson, J. Am. Stat. Assoc. 22 (1927); Wilks, Ann. Math. Stat. 12 (1941).
//! The Beta quantiles are those of `statrs`; against SciPy they agree within 1e-7 relative up to a million runs.

use serde::{Deserialize, Serialize};
use statrs::distribution::{Beta, ContinuousCDF, Normal};

/// Confidence of two-sided intervals, which are informative and not for sign-off.
pub const READING_CONFIDENCE: f64 = 0.95;

/// Probability that a system with the tolerated failure rate passes a campaign.
pub const POWER: f64 = 0.9;

/// Two-sided interval of a share.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// Lower end.
    pub lo: f64,
    /// Upper end.
    pub hi: f64,
    /// Confidence: probability that such an interval contains the true share.
    pub confidence: f64,
}

/// Counted share with its two-sided Clopper-Pearson interval.
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
    /// Returns the share with its 95 % interval.
    pub fn of(count: u64, cases: u64) -> Self {
        Self { count, cases, interval: clopper_pearson(count, cases, READING_CONFIDENCE) }
    }
}

/// Returns the one-sided upper Clopper-Pearson bound of the true share.
///
/// It is 1 if every case counts, or without cases.
pub fn upper_bound(count: u64, cases: u64, confidence: f64) -> f64 {
    if count >= cases {
        return 1.0;
    }
    if count == 0 {
        // The closed form of Beta(1, n) keeps full accuracy.
        return -f64::exp_m1(f64::ln_1p(-confidence) / cases as f64);
    }
    quantile(count as f64 + 1.0, (cases - count) as f64, confidence)
}

/// Returns the one-sided lower Clopper-Pearson bound of the true share.
pub fn lower_bound(count: u64, cases: u64, confidence: f64) -> f64 {
    1.0 - upper_bound(cases.saturating_sub(count), cases, confidence)
}

/// Returns the two-sided Clopper-Pearson interval.
pub fn clopper_pearson(count: u64, cases: u64, confidence: f64) -> Interval {
    let one_sided = 0.5 + 0.5 * confidence;
    let lo = match count {
        0 => 0.0,
        count if count >= cases => lower_bound(count, cases, one_sided),
        // As a quantile of its own: 1 - upper_bound would lose the digits of small shares.
        count => quantile(count as f64, (cases - count) as f64 + 1.0, 1.0 - one_sided),
    };
    Interval { lo, hi: upper_bound(count, cases, one_sided), confidence }
}

/// Returns the share of runs over several epistemic draws, each with its count and cases, with a two-sided interval
/// that combines the sampling error of the runs (Clopper-Pearson) and the variance between draws.
pub fn pooled(draws: &[(u64, u64)], confidence: f64) -> (f64, Interval) {
    let (count, cases) = draws.iter().fold((0, 0), |(k, n), draw| (k + draw.0, n + draw.1));
    let chance = clopper_pearson(count, cases, confidence);
    if cases == 0 {
        return (0.0, chance);
    }
    let share = count as f64 / cases as f64;
    let filled: Vec<(f64, f64)> =
        draws.iter().filter(|d| d.1 > 0).map(|d| (d.0 as f64 / d.1 as f64, d.1 as f64)).collect();
    let own = |n: f64| share * (1.0 - share) / n;
    let spread = filled.iter().map(|(p, n)| (p - share).powi(2) - own(*n)).sum::<f64>() / filled.len() as f64;
    let normal = Normal::standard().inverse_cdf(0.5 + 0.5 * confidence);
    // Variance between draws beyond the sampling error of their runs.
    let draws = normal * spread.max(0.0).sqrt();
    let interval = Interval {
        lo: (share - (share - chance.lo).hypot(draws)).max(0.0),
        hi: (share + (chance.hi - share).hypot(draws)).min(1.0),
        confidence,
    };
    (share, interval)
}

/// Returns the two-sided Wilson interval, whose coverage is right on average only; informative, not for sign-off.
pub fn wilson(count: u64, cases: u64, confidence: f64) -> Interval {
    if cases == 0 {
        return Interval { lo: 0.0, hi: 1.0, confidence };
    }
    let standard = Normal::new(0.0, 1.0).expect("the standard normal distribution");
    let z = standard.inverse_cdf(0.5 + 0.5 * confidence);
    let n = cases as f64;
    let share = count as f64 / n;
    let centre = share + z * z / (2.0 * n);
    let half = z * f64::sqrt(share * (1.0 - share) / n + z * z / (4.0 * n * n));
    let scale = 1.0 + z * z / n;
    Interval { lo: ((centre - half) / scale).max(0.0), hi: ((centre + half) / scale).min(1.0), confidence }
}

/// Returns the largest number of failures among `runs` that demonstrates `probability` with `confidence`; `None` if
/// none does.
pub fn allowed_failures(runs: u64, probability: f64, confidence: f64) -> Option<u64> {
    let demonstrates = |failures| upper_bound(failures, runs, confidence) <= 1.0 - probability;
    if runs == 0 || !demonstrates(0) {
        return None;
    }
    let (mut yes, mut no) = (0, runs);
    while no - yes > 1 {
        let middle = yes + (no - yes) / 2;
        if demonstrates(middle) { yes = middle } else { no = middle }
    }
    Some(yes)
}

/// Returns the smallest number of runs that allows `failures` failures; `None` for a probability or confidence that no
/// number of runs demonstrates.
pub fn smallest_runs(failures: u64, probability: f64, confidence: f64) -> Option<u64> {
    let possible = probability > 0.0 && probability < 1.0 && confidence > 0.0 && confidence < 1.0;
    let enough = |runs| upper_bound(failures, runs, confidence) <= 1.0 - probability;
    let (mut no, mut yes) = (failures, failures.max(1));
    while possible && !enough(yes) {
        no = yes;
        yes = yes.checked_mul(2)?;
    }
    while possible && yes - no > 1 {
        let middle = no + (yes - no) / 2;
        if enough(middle) { yes = middle } else { no = middle }
    }
    possible.then_some(yes)
}

/// Returns the true failure rate at which a campaign of `runs` with `allowed` failures is passed with probability
/// [`POWER`].
pub fn tolerated_rate(runs: u64, allowed: u64) -> f64 {
    // P(X <= r | p) = 1 - I_p(r + 1, n - r) = POWER.
    upper_bound(allowed, runs, 1.0 - POWER)
}

/// Returns the rank from the worst (1) of the order statistic beyond which at least `probability` of all cases are,
/// with `confidence` (Wilks); `None` if the sample is too small.
pub fn tolerance_rank(runs: u64, probability: f64, confidence: f64) -> Option<u64> {
    allowed_failures(runs, probability, confidence).map(|allowed| allowed + 1)
}

fn quantile(a: f64, b: f64, probability: f64) -> f64 {
    Beta::new(a, b).expect("positive shape parameters").inverse_cdf(probability)
}
