//! Minimisation without derivatives: a population that is drawn from a normal distribution, which moves to its best part.
//!
//! Whole tosses diverge at edges, so that their errors have no useful derivatives (cross-entropy method: Rubinstein and
//! Kroese, 2004).

use nalgebra::{DMatrix, DVector};
use softdock_kernels::philox;
use statrs::distribution::{ContinuousCDF, Normal};

/// Share of a population that the next one is drawn from.
const ELITE: f64 = 0.25;
/// Weight of the new covariance against the last one.
const NEW: f64 = 0.7;
/// Least variance, so that no direction is lost.
const LEAST_VARIANCE: f64 = 1e-6;

/// Size of a minimisation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PopulationSize {
    /// Sets of a population.
    pub sets: usize,
    /// Populations.
    pub generations: usize,
    /// Seed.
    pub seed: u64,
}

impl Default for PopulationSize {
    fn default() -> Self {
        Self { sets: 64, generations: 20, seed: 1 }
    }
}

/// Evaluated set: its place and its costs, one for each case.
#[derive(Clone, Debug)]
pub struct EvaluatedSet {
    /// Standardised parameters.
    pub z: Vec<f64>,
    /// Cost of each case.
    pub costs: Vec<f64>,
}

impl EvaluatedSet {
    /// Returns the mean cost; a case that diverged makes it infinite.
    pub fn cost(&self) -> f64 {
        let mean = self.costs.iter().sum::<f64>() / self.costs.len() as f64;
        if mean.is_finite() { mean } else { f64::INFINITY }
    }
}

/// Function that returns the costs of sets, one for each case.
pub type CaseCosts<'a> = dyn Fn(&[Vec<f64>]) -> Vec<Vec<f64>> + 'a;

/// Minimises the mean cost from a start, in standard deviations of the parameters; gives all that was evaluated, best first.
pub fn minimise(start: &[f64], size: PopulationSize, evaluate: &CaseCosts) -> Vec<EvaluatedSet> {
    let dimension = start.len();
    let standard = Normal::new(0.0, 1.0).expect("a legal deviation");
    let mut mean = DVector::from_column_slice(start);
    let mut covariance: DMatrix<f64> = DMatrix::identity(dimension, dimension);
    let mut all: Vec<EvaluatedSet> = Vec::new();
    for generation in 0..size.generations.max(1) {
        let factor: DMatrix<f64> =
            covariance.clone().cholesky().map_or_else(|| DMatrix::identity(dimension, dimension), |c| c.l());
        let draw = |number: usize| -> Vec<f64> {
            let index = (generation * size.sets + number) as u64;
            let normal =
                |axis: usize| standard.inverse_cdf(philox::uniform(size.seed, "population", index, axis as u32));
            // The first of all is the start itself.
            let scale = if index == 0 { 0.0 } else { 1.0 };
            let deviates: DVector<f64> = DVector::from_fn(dimension, |axis, _| scale * normal(axis));
            (&mean + &factor * deviates).iter().copied().collect()
        };
        let places: Vec<Vec<f64>> = (0..size.sets).map(draw).collect();
        let costs = evaluate(&places);
        let mut own: Vec<EvaluatedSet> =
            places.into_iter().zip(costs).map(|(z, costs)| EvaluatedSet { z, costs }).collect();
        own.sort_by(|one, other| one.cost().total_cmp(&other.cost()));
        let elite: Vec<DVector<f64>> = own
            .iter()
            .take(((ELITE * size.sets as f64) as usize).max(2))
            .map(|set| DVector::from_column_slice(&set.z))
            .collect();
        let count = elite.len() as f64;
        mean = elite.iter().sum::<DVector<f64>>() / count;
        let scatter: DMatrix<f64> = elite.iter().map(|z| (z - &mean) * (z - &mean).transpose()).sum();
        covariance = covariance * (1.0 - NEW) + scatter * (NEW / count);
        covariance += DMatrix::identity(dimension, dimension) * LEAST_VARIANCE;
        all.extend(own);
    }
    all.sort_by(|one, other| one.cost().total_cmp(&other.cost()));
    all
}

/// Best of the evaluated sets for each of `resamples` bootstrap samples of the cases.
pub fn bootstrap(all: &[EvaluatedSet], resamples: usize, seed: u64) -> Vec<Vec<f64>> {
    let cases = all[0].costs.len();
    // Sets that are far worse in the mean win no resample.
    let near = &all[..all.len().min(NEAR)];
    let resample = |number: usize| {
        let mut weights = vec![0.0; cases];
        for draw in 0..cases {
            let share = philox::uniform(seed, "bootstrap", number as u64, draw as u32);
            weights[((share * cases as f64) as usize).min(cases - 1)] += 1.0;
        }
        let cost = |set: &EvaluatedSet| set.costs.iter().zip(&weights).map(|(cost, weight)| cost * weight).sum::<f64>();
        near.iter().min_by(|one, other| cost(one).total_cmp(&cost(other))).expect("never empty").z.clone()
    };
    (0..resamples).map(resample).collect()
}

/// Sets among which a bootstrap sample chooses.
const NEAR: usize = 800;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_narrow_valley_is_followed_to_its_minimum() {
        let cost = |z: &Vec<f64>| vec![(z[0] - 2.0).powi(2) + 50.0 * (z[1] - z[0] + 0.5).powi(2) + 0.3];
        let evaluate = |sets: &[Vec<f64>]| sets.iter().map(cost).collect::<Vec<_>>();
        let all = minimise(&[0.0, 0.0], PopulationSize { sets: 40, generations: 30, seed: 2 }, &evaluate);
        assert!((all[0].z[0] - 2.0).abs() < 0.02 && (all[0].z[1] - 1.5).abs() < 0.02, "{:?}", all[0]);
        assert_eq!(all.len(), 1200);
        assert!(all.windows(2).all(|pair| pair[0].cost() <= pair[1].cost()));
    }

    /// The minimum is the mean of the cases: its bootstrap deviation is that of a mean.
    #[test]
    fn bootstrap_has_the_deviation_of_a_mean() {
        let cases: Vec<f64> = (0..50).map(|i| philox::uniform(5, "cases", i, 0)).collect();
        let cost = |z: &Vec<f64>| cases.iter().map(|case| (z[0] - case).powi(2)).collect::<Vec<_>>();
        let evaluate = |sets: &[Vec<f64>]| sets.iter().map(cost).collect::<Vec<_>>();
        let all = minimise(&[0.3], PopulationSize { sets: 100, generations: 12, seed: 2 }, &evaluate);
        let best: Vec<f64> = bootstrap(&all, 400, 1).into_iter().map(|z| z[0]).collect();
        let mean = best.iter().sum::<f64>() / 400.0;
        let deviation = (best.iter().map(|b| (b - mean).powi(2)).sum::<f64>() / 400.0).sqrt();
        let truth = cases.iter().sum::<f64>() / 50.0;
        let of_mean = (cases.iter().map(|c| (c - truth).powi(2)).sum::<f64>() / 50.0 / 50.0).sqrt();
        assert!(
            (mean - truth).abs() < 0.2 * of_mean && (deviation / of_mean - 1.0).abs() < 0.25,
            "{deviation} {of_mean}"
        );
    }
}
