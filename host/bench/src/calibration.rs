//! Calibration of stated probabilities: reliability curve and expected calibration error.

use serde::Serialize;
use softdock_analysis::Share;

/// Bins of the curve, of equal width; stated probabilities crowd near 1.
const BINS: usize = 10;

/// Bin of the reliability curve.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Bin {
    /// Mean of the stated probabilities.
    pub stated: f64,
    /// Share of right names.
    pub right: Share,
}

/// Agreement of stated probabilities with frequencies.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ProbabilityCalibration {
    /// Bins with names, by rising probability.
    pub bins: Vec<Bin>,
    /// Mean distance of stated probability and frequency, bins weighted by their names (Naeini, Cooper and Hauskrecht
    /// 2015); none without names.
    pub error: Option<f64>,
    /// Mean square of probability less outcome (Brier 1950).
    pub brier: Option<f64>,
}

/// Computes the calibration from the stated probability of each name and whether it is right.
pub fn calibration(names: &[(f64, bool)]) -> ProbabilityCalibration {
    let mut bins: Vec<Vec<(f64, bool)>> = vec![Vec::new(); BINS];
    for (p, right) in names {
        bins[((p * BINS as f64) as usize).min(BINS - 1)].push((*p, *right));
    }
    let count = names.len() as f64;
    let bin = |list: &Vec<(f64, bool)>| {
        let stated = list.iter().map(|name| name.0).sum::<f64>() / list.len() as f64;
        let right = list.iter().filter(|name| name.1).count() as u64;
        Bin { stated, right: Share::of(right, list.len() as u64) }
    };
    let bins: Vec<Bin> = bins.iter().filter(|list| !list.is_empty()).map(bin).collect();
    let off = |bin: &Bin| (bin.stated * bin.right.cases as f64 - bin.right.count as f64).abs() / count;
    let brier = names.iter().map(|(p, right)| (p - f64::from(u8::from(*right))).powi(2)).sum::<f64>() / count;
    let some = !names.is_empty();
    ProbabilityCalibration { error: some.then(|| bins.iter().map(off).sum()), brier: some.then_some(brier), bins }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_is_the_distance_of_probability_and_frequency() {
        let good: Vec<(f64, bool)> = (0..100).map(|i| (0.75, i < 75)).collect();
        assert!(calibration(&good).error.expect("names") < 1e-12);
        let sure: Vec<(f64, bool)> = (0..100).map(|i| (1.0, i < 60)).collect();
        let found = calibration(&sure);
        assert!((found.error.expect("names") - 0.4).abs() < 1e-12 && (found.brier.expect("names") - 0.4).abs() < 1e-12);
        assert_eq!((found.bins.len(), found.bins[0].right.count), (1, 60));
        assert_eq!(calibration(&[]).error, None);
    }
}
