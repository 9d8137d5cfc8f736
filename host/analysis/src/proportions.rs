//! Differences of two shares with their intervals: paired and independent samples.
//!
//! Newcombe, Stat. Med. 17 (1998) 873 (independent, method 10) and 2635 (paired, method 10): Wilson's intervals of both
//! shares joined, in pairs with the correlation that the pairs show. McNemar's test is the exact one.

use serde::{Deserialize, Serialize};
use statrs::distribution::{Binomial, DiscreteCDF};

use crate::exact::{Interval, wilson};

/// Pairs of runs by which of the two failed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PairedFailures {
    /// Both failed.
    pub both: u64,
    /// The first alone failed.
    pub first_only: u64,
    /// The second alone failed.
    pub second_only: u64,
    /// Neither failed.
    pub neither: u64,
}

impl PairedFailures {
    /// Adds a pair.
    pub fn add(&mut self, first_fails: bool, second_fails: bool) {
        *match (first_fails, second_fails) {
            (true, true) => &mut self.both,
            (true, false) => &mut self.first_only,
            (false, true) => &mut self.second_only,
            (false, false) => &mut self.neither,
        } += 1;
    }

    /// Number of pairs.
    pub fn pairs(self) -> u64 {
        self.both + self.first_only + self.second_only + self.neither
    }

    /// Failures of the first and of the second.
    pub fn failures(self) -> [u64; 2] {
        [self.both + self.first_only, self.both + self.second_only]
    }

    /// Exact two-sided p-value of McNemar's test: the probability of a split of the changed pairs at least as uneven if
    /// both directions were equally likely; 1 without a changed pair.
    pub fn mcnemar(self) -> f64 {
        let (changed, fewer) = (self.first_only + self.second_only, self.first_only.min(self.second_only));
        let half = Binomial::new(0.5, changed).expect("one half is a probability");
        if changed == 0 { 1.0 } else { (2.0 * half.cdf(fewer)).min(1.0) }
    }

    /// The second failure rate less the first, with Newcombe's interval for pairs; 0 and -1 to 1 without a pair.
    pub fn difference(self, confidence: f64) -> (f64, Interval) {
        let pairs = self.pairs();
        let [first, second] = self.failures();
        if pairs == 0 {
            return (0.0, Interval { lo: -1.0, hi: 1.0, confidence });
        }
        let n = pairs as f64;
        joined([(first, pairs), (second, pairs)], self.correlation(n), confidence)
    }

    /// Correlation of the pairs, a positive one corrected for continuity.
    fn correlation(self, n: f64) -> f64 {
        let [both, first, second, neither] =
            [self.both, self.first_only, self.second_only, self.neither].map(|count| count as f64);
        let margins = (both + first) * (second + neither) * (both + second) * (first + neither);
        let product = both * neither - first * second;
        let numerator = if product > 0.0 { (product - 0.5 * n).max(0.0) } else { product };
        if margins > 0.0 { numerator / margins.sqrt() } else { 0.0 }
    }
}

/// The second share less the first of two independent samples, each as count and cases, with Newcombe's interval; 0 and
/// -1 to 1 if one has no case.
pub fn independent_difference(first: (u64, u64), second: (u64, u64), confidence: f64) -> (f64, Interval) {
    match first.1.min(second.1) {
        0 => (0.0, Interval { lo: -1.0, hi: 1.0, confidence }),
        _ => joined([first, second], 0.0, confidence),
    }
}

fn joined([first, second]: [(u64, u64); 2], correlation: f64, confidence: f64) -> (f64, Interval) {
    let share = |(count, cases): (u64, u64)| count as f64 / cases as f64;
    let (p1, p2) = (share(first), share(second));
    let (one, two) = (wilson(first.0, first.1, confidence), wilson(second.0, second.1, confidence));
    let reach = |a: f64, b: f64| (a * a - 2.0 * correlation * a * b + b * b).max(0.0).sqrt();
    let difference = p2 - p1;
    let interval = Interval {
        lo: (difference - reach(p2 - two.lo, one.hi - p1)).max(-1.0),
        hi: (difference + reach(two.hi - p2, p1 - one.lo)).min(1.0),
        confidence,
    };
    (difference, interval)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(interval: Interval, lo: f64, hi: f64) {
        assert!((interval.lo - lo).abs() < 5e-5 && (interval.hi - hi).abs() < 5e-5, "{interval:?}");
    }

    /// Newcombe 1998 (873), example: 56/70 against 48/80, method 10.
    #[test]
    fn independent_intervals_are_those_of_the_literature() {
        let (difference, interval) = independent_difference((48, 80), (56, 70), 0.95);
        assert!((difference - 0.2).abs() < 1e-12);
        near(interval, 0.0524, 0.3339);
        let (other, mirrored) = independent_difference((56, 70), (48, 80), 0.95);
        assert!((difference + other).abs() < 1e-12 && (interval.lo + mirrored.hi).abs() < 1e-12);
    }

    #[test]
    fn equal_pairs_differ_by_zero_and_no_pairs_give_the_full_interval() {
        let (difference, interval) = PairedFailures { both: 5, neither: 95, ..Default::default() }.difference(0.95);
        assert!(difference == 0.0 && interval.lo < 0.0 && interval.hi > 0.0 && interval.hi < 0.05, "{interval:?}");
        let nothing = PairedFailures::default();
        assert_eq!((nothing.mcnemar(), nothing.difference(0.95).1.hi), (1.0, 1.0));
        assert_eq!(independent_difference((0, 0), (3, 4), 0.95).1.lo, -1.0);
    }

    /// 1 of 10 changed pairs in one direction: 2 (1 + 10) / 2^10.
    #[test]
    fn mcnemar_is_the_exact_binomial_test() {
        let pairs = PairedFailures { both: 3, first_only: 1, second_only: 9, neither: 50 };
        assert!((pairs.mcnemar() - 22.0 / 1024.0).abs() < 1e-12, "{}", pairs.mcnemar());
        assert_eq!(PairedFailures { first_only: 4, second_only: 4, ..pairs }.mcnemar(), 1.0);
    }

    /// Of pairs with known rates, at least 93 in 100 intervals hold the difference, and a correlation narrows them.
    #[test]
    fn paired_intervals_have_their_coverage() {
        let mut state = 11_u64;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let mut trial = || {
            let mut pairs = PairedFailures::default();
            for _ in 0..200 {
                let (one, two) = (uniform(), uniform());
                let first = one < 0.1;
                pairs.add(first, two < if first { 0.8 } else { 0.05 });
            }
            let (_, interval) = pairs.difference(0.95);
            let [first, second] = pairs.failures();
            let (_, apart) = independent_difference((first, 200), (second, 200), 0.95);
            assert!(interval.hi - interval.lo < apart.hi - apart.lo);
            let exact = 0.1 * 0.8 + 0.9 * 0.05 - 0.1;
            interval.lo <= exact && exact <= interval.hi
        };
        let held = (0..2000).filter(|_| trial()).count();
        assert!((1860..=1985).contains(&held), "{held} of 2000");
    }
}
