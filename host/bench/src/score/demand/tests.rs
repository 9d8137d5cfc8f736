//! Properties of the rule: a build that meets every demand fails at most one score in a hundred, and one that does not
//! fails where the cases suffice.

use super::*;
use crate::calibration::calibration;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};

/// Probabilities of 0 to n successes in n cases.
fn binomial(cases: usize, rate: f64) -> Vec<f64> {
    let log_odds = (rate / (1.0 - rate)).ln();
    let mut log = cases as f64 * (1.0 - rate).ln();
    let mut all = vec![log.exp()];
    for k in 0..cases {
        log += ((cases - k) as f64 / (k + 1) as f64).ln() + log_odds;
        all.push(log.exp());
    }
    all
}

/// Probability that a demand on a share is refuted at a true rate.
fn refuted(range: [f64; 2], cases: usize, rate: f64, confidence: f64) -> f64 {
    let of = |count| Demand::within("", range, Measured::Share { count, cases }).status(confidence);
    let all = binomial(cases, rate).into_iter().enumerate();
    all.filter(|(count, _)| of(*count) == DemandStatus::Refuted).map(|(_, p)| p).sum()
}

#[test]
fn demanded_rate_is_refuted_at_most_as_often_as_the_confidence_allows() {
    let ranges =
        [[0.75, 1.0], [0.9, 1.0], [0.98, 1.0], [0.99, 1.0], [0.0, 0.01], [0.0, 0.05], [0.92, 0.97], [0.9, 0.98]];
    for (range, cases) in ranges.into_iter().flat_map(|range| [1, 3, 13, 40, 300].map(|cases| (range, cases))) {
        for rate in range.into_iter().filter(|rate| (0.001..0.999).contains(rate)) {
            for confidence in [0.95, 0.99, 0.9995] {
                let p = refuted(range, cases, rate, confidence);
                assert!(p <= 1.0 - confidence + 1e-9, "{range:?}, {cases} cases, rate {rate}: refuted with {p}");
            }
        }
    }
}

#[test]
fn rate_far_outside_a_demand_is_refuted_with_enough_cases() {
    for (range, rate) in [([0.9, 1.0], 0.75), ([0.0, 0.02], 0.1), ([0.92, 0.97], 0.8), ([0.92, 0.97], 0.9999)] {
        let p = refuted(range, 300, rate, 0.9995);
        assert!(p > 0.9, "{range:?}, rate {rate}: refuted with {p} only");
    }
}

#[test]
fn few_cases_decide_nothing() {
    let of = |count, cases| Demand::within("", [0.92, 0.97], Measured::Share { count, cases }).status(0.9995);
    assert_eq!(of(13, 13), DemandStatus::NotRefuted);
    assert_eq!(of(0, 0), DemandStatus::NoCases);
    assert_eq!(of(1000, 1000), DemandStatus::Refuted, "too wide");
    assert_eq!(of(4704, 4909), DemandStatus::Met);
}

#[test]
fn correlated_values_count_as_often_as_their_groups() {
    let of = |groups| Measured::Grouped { count: 90, cases: 100, groups }.bounds(0.99);
    let (all, few) = (of(100), of(10));
    assert_eq!(all, Measured::Share { count: 90, cases: 100 }.bounds(0.99));
    assert!(few[0] < all[0] && few[1] >= all[1], "{few:?} {all:?}");
}

/// Draws of a build.
struct Draws(Pcg64);

impl Draws {
    fn holds(&mut self, rate: f64) -> bool {
        ((self.0.next_u64() >> 11) as f64) < rate * (1_u64 << 53) as f64
    }

    fn count(&mut self, cases: usize, rate: f64) -> usize {
        (0..cases).filter(|_| self.holds(rate)).count()
    }

    fn share(&mut self, cases: usize, rate: f64) -> Measured {
        Measured::Share { count: self.count(cases, rate), cases }
    }
}

/// The demands of a score of a build whose rates are the demanded ones less `excess`, with so many cases.
fn build(draws: &mut Draws, cases: usize, excess: f64) -> Vec<Demand> {
    let mut all = Vec::new();
    for least in [0.90, 0.98, 0.90, 0.90, 0.95, 0.99] {
        all.push(Demand::at_least("", least, draws.share(cases, least - excess)));
    }
    for most in [0.01, 0.05, 0.02, 0.02] {
        all.push(Demand::at_most("", most, draws.share(cases, most + excess)));
    }
    let strata = (0..20).map(|_| (draws.count(cases.div_ceil(10), 0.85 - excess), cases.div_ceil(10)));
    all.push(Demand::at_least("", 0.85, Measured::Smallest(strata.collect())));
    // Three equal values in every group.
    let count = 3 * draws.count(cases, 0.92 - excess);
    all.push(Demand::within("", [0.92, 0.97], Measured::Grouped { count, cases: 3 * cases, groups: cases }));
    let within = draws.count(cases, 0.5 - excess);
    all.push(Demand::at_least("", 0.5, Measured::Median { value: None, within, cases }));
    let named: Vec<(f64, bool)> = (0..cases).map(|_| (0.99, draws.holds(0.94 - excess))).collect();
    let own = calibration(&named);
    all.push(Demand::at_most("", 0.05, Measured::Calibration { error: own.error, bins: own.bins }));
    let [a, b] = [0.7 - excess, 0.5].map(|rate| Share::of(draws.count(cases, rate) as u64, cases as u64));
    all.push(Demand::at_least("", 0.2, Measured::Difference([a, b])));
    all
}

/// Share of the scores of such a build that fail.
fn failing(cases: usize, excess: f64, scores: usize) -> f64 {
    let mut draws = Draws(Pcg64::seed_from_u64(7 + cases as u64));
    let fails = |marks: Vec<AcceptanceCriterion>| marks.iter().any(|mark| mark.status == DemandStatus::Refuted);
    let failed = (0..scores).filter(|_| fails(judged(build(&mut draws, cases, excess)))).count();
    failed as f64 / scores as f64
}

#[test]
fn healthy_build_fails_at_most_one_score_in_a_hundred() {
    for cases in [3, 13, 60, 300] {
        let share = failing(cases, 0.0, 1500);
        assert!(share <= 0.01, "{cases} cases: {share} of the scores fail");
    }
}

#[test]
fn build_far_from_its_demands_fails() {
    assert!(failing(300, 0.15, 100) > 0.95);
}
