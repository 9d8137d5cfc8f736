//! Paired comparison of two facilities on the same draws: factor between their rates of false verdicts.

use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, Normal};

/// Pairs of runs by which verdict is false.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Pairs {
    /// False on both.
    pub both: u64,
    /// False on the reference only.
    pub reference_only: u64,
    /// False on the variant only.
    pub variant_only: u64,
}

/// Ratio of the reference's rate to the variant's; above 1 the variant is better.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Factor {
    /// Observed ratio; null if the variant has no false verdict.
    pub value: Option<f64>,
    /// Lower end of the interval.
    pub lo: f64,
    /// Upper end; null if there is none.
    pub hi: Option<f64>,
    /// Confidence of the interval.
    pub confidence: f64,
}

impl Pairs {
    /// Adds a run.
    pub fn add(&mut self, reference_wrong: bool, variant_wrong: bool) {
        self.both += u64::from(reference_wrong && variant_wrong);
        self.reference_only += u64::from(reference_wrong && !variant_wrong);
        self.variant_only += u64::from(!reference_wrong && variant_wrong);
    }

    /// Returns the ratio of the two paired rates with the hybrid Wilson interval of Bonett and Price (J. Educ. Behav.
    /// Stat. 31, 2006), which keeps its coverage in small samples and with empty cells; `None` if neither has a false
    /// verdict.
    pub fn factor(self, confidence: f64) -> Option<Factor> {
        let (both, first, second) = (self.both as f64, self.reference_only as f64, self.variant_only as f64);
        let (one, two, all) = (both + first, both + second, both + first + second);
        if all == 0.0 {
            return None;
        }
        let standard = Normal::new(0.0, 1.0).expect("the standard normal distribution");
        let share = |wrong: f64| (wrong + 1.0) / (all + 2.0);
        let error = |wrong: f64| ((1.0 - share(wrong)) / (wrong + 1.0)).sqrt();
        let of_ratio = ((first + second + 2.0) / ((one + 1.0) * (two + 1.0))).sqrt();
        let z = standard.inverse_cdf(0.5 + 0.5 * confidence) * of_ratio / (error(one) + error(two));
        let wilson = |wrong: f64| {
            let (centre, half) = (2.0 * wrong + z * z, z * (z * z + 4.0 * wrong * (1.0 - wrong / all)).sqrt());
            ((centre - half) / (2.0 * (all + z * z)), (centre + half) / (2.0 * (all + z * z)))
        };
        let ((one_lo, one_hi), (two_lo, two_hi)) = (wilson(one), wilson(two));
        let finite = |ratio: f64| Some(ratio).filter(|ratio| ratio.is_finite() && *ratio < 1e9);
        Some(Factor {
            value: finite(one / two),
            lo: one_lo.max(0.0) / two_hi,
            hi: finite(one_hi / two_lo.max(0.0)).filter(|_| two > 0.0),
            confidence,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Exchanging the variants inverts the interval; for many runs it converges to that of the logarithm, whose
    /// variance is the discordant pairs over the product of both counts.
    #[test]
    fn paired_interval_is_symmetric_and_exact_in_large_samples() {
        let ends = |both, reference_only, variant_only| {
            let factor = Pairs { both, reference_only, variant_only }.factor(0.95).expect("a factor");
            (factor.lo, factor.value.expect("a ratio"), factor.hi.expect("an end"))
        };
        let (one, other) = (ends(59, 6, 16), ends(59, 16, 6));
        assert!((one.0 * other.2 - 1.0).abs() < 1e-12 && (one.2 * other.0 - 1.0).abs() < 1e-12);
        let (lo, ratio, hi) = ends(40_000, 60_000, 10_000);
        let half = 1.959_964 * f64::sqrt(70_000.0 / (100_000.0 * 50_000.0));
        assert!((ratio - 2.0).abs() < 1e-12);
        assert!((lo / (2.0 * (-half).exp()) - 1.0).abs() < 1e-3 && (hi / (2.0 * half.exp()) - 1.0).abs() < 1e-3);
    }

    #[test]
    fn zero_failures_give_a_one_sided_interval() {
        let factor = Pairs { both: 0, reference_only: 40, variant_only: 0 }.factor(0.95).expect("a factor");
        assert!(factor.value.is_none() && factor.hi.is_none() && factor.lo > 8.0, "{factor:?}");
        assert!(Pairs::default().factor(0.95).is_none());
    }

    /// Of pairs with known rates, at least 93 in 100 intervals hold the ratio.
    #[test]
    fn paired_interval_has_its_coverage() {
        let mut state = 7_u64;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let trial = |uniform: &mut dyn FnMut() -> f64| {
            let mut pairs = Pairs::default();
            for _ in 0..200 {
                let (one, two) = (uniform(), uniform());
                // The reference is wrong in 30 % of the runs; of these the variant in 20 %, of the others in 5 %.
                pairs.add(one < 0.3, two < if one < 0.3 { 0.2 } else { 0.05 });
            }
            let (factor, exact) = (pairs.factor(0.95).expect("a factor"), 0.3 / (0.3 * 0.2 + 0.7 * 0.05));
            factor.lo <= exact && factor.hi.is_none_or(|hi| exact <= hi)
        };
        let held = (0..2000).filter(|_| trial(&mut uniform)).count();
        assert!((1860..=1980).contains(&held), "{held} of 2000");
    }
}
