//! Search of start values: thousands of parameter sets on the lanes of the engine, the best of which are refined.

use nalgebra::DVector;
use softdock_diagnosis::inference::fit::{Fitted, Simulate, Start, fit};
use softdock_diagnosis::model::unknown::{Unknown, applied};
use softdock_kernels::philox;
use statrs::distribution::{ContinuousCDF, Normal};

/// Sets that are simulated at once: their residuals are in memory together.
const BATCH: usize = 64;
/// Standard deviations of the prior over which starts are spread.
const SPREAD: f64 = 1.2;
/// Step of difference quotients, as a share of a prior standard deviation.
const QUOTIENT: f64 = 1e-4;

/// Size of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchSize {
    /// Parameter sets that are simulated as starts.
    pub sets: usize,
    /// The best of them, which are refined.
    pub refined: usize,
    /// Seed of the starts.
    pub seed: u64,
}

impl Default for SearchSize {
    fn default() -> Self {
        Self { sets: 2048, refined: 8, seed: 1 }
    }
}

/// Fits parameters: many starts over their priors, then Levenberg-Marquardt from the best.
pub fn search(unknowns: &[Unknown], base: &[f64], size: SearchSize, simulate: &Simulate) -> Fitted {
    let standard = Normal::new(0.0, SPREAD).expect("a legal deviation");
    let start = |number: usize| -> Vec<f64> {
        let z = |unknown: &Unknown| {
            let share = philox::uniform(size.seed, &unknown.name, number as u64, 0);
            let z = standard.inverse_cdf(share);
            if unknown.prior.is_one_sided() { z.abs() } else { z }
        };
        // The first is the middle of the priors.
        unknowns.iter().map(|unknown| if number == 0 { unknown.prior.allowed(0.1) } else { z(unknown) }).collect()
    };
    let mut scored: Vec<(f64, Vec<f64>)> = Vec::with_capacity(size.sets);
    let numbers: Vec<usize> = (0..size.sets.max(1)).collect();
    for batch in numbers.chunks(BATCH) {
        let starts: Vec<Vec<f64>> = batch.iter().map(|number| start(*number)).collect();
        let sets: Vec<Vec<f64>> = starts.iter().map(|z| applied(base, unknowns, z)).collect();
        let costs = simulate(&sets).into_iter().map(|residual| cost(&residual));
        scored.extend(costs.zip(starts));
    }
    scored.sort_by(|one, other| one.0.total_cmp(&other.0));
    let starts = scored.into_iter().take(size.refined.max(1)).map(|(_, z)| Start::new(0, unknowns.to_vec(), z));
    fit(starts.collect(), base, QUOTIENT, simulate).remove(0)
}

/// Sum of squares; infinite where a simulation has no finite result.
fn cost(residual: &DVector<f64>) -> f64 {
    let sum = residual.norm_squared();
    if sum.is_finite() { sum } else { f64::INFINITY }
}
