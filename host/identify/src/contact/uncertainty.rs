//! Intervals of fitted parameters from the scatter of the gradients: samples that depend on their neighbours, and
//! recordings that differ.

use nalgebra::{DMatrix, DVector};
use softdock_diagnosis::inference::fit::Fitted;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Weight of the prior in the curvature, so that a parameter without any information has a finite, very wide interval.
const FLOOR: f64 = 1e-4;
/// Longest lag of the correlation, as a share of the samples.
const LONGEST_LAG: f64 = 0.1;
/// Fewest groups whose scatter counts.
const FEWEST_GROUPS: usize = 6;
/// Probability within an interval, two-sided.
const CONFIDENCE: f64 = 0.95;

/// Covariance of the standardised parameters, and the quantile of their intervals.
#[derive(Clone, Debug)]
pub struct ParameterUncertainty {
    /// Covariance of `z`.
    pub covariance: DMatrix<f64>,
    /// Half-width of a 95 % interval in standard deviations.
    pub quantile: f64,
    /// Effective number of independent samples.
    pub independent: f64,
}

/// Range of a channel's samples of a group in the residual.
pub type SampleRange = std::ops::Range<usize>;

impl ParameterUncertainty {
    /// Computes the covariance of a fit whose residual consists of series in order of time; those of a group belong to one
    /// touch or toss.
    ///
    /// The larger of two is taken for each parameter: white noise with as many samples as their correlation leaves
    /// independent, and the scatter of the gradients of whole groups.
    pub fn of(fitted: &Fitted, groups: &[Vec<SampleRange>]) -> Self {
        let (residual, jacobian) = (&fitted.residual, &fitted.jacobian);
        let size = jacobian.ncols();
        let tau = correlation_time(residual, groups);
        let independent = residual.len() as f64 / tau;
        let free = (independent - size as f64).max(1.0);
        let inverse = inverse(&(jacobian.transpose() * jacobian + DMatrix::identity(size, size) * FLOOR));
        let white = &inverse * (residual.norm_squared() / free);
        let freedom = free.min(if groups.len() >= FEWEST_GROUPS { groups.len() as f64 - 1.0 } else { f64::INFINITY });
        let quantile = StudentsT::new(0.0, 1.0, freedom.max(2.0))
            .map_or(1.96, |student| student.inverse_cdf(0.5 + 0.5 * CONFIDENCE));
        let mut covariance = white;
        if groups.len() >= FEWEST_GROUPS {
            let count = groups.len() as f64;
            let gradient = |group: &Vec<SampleRange>| -> DVector<f64> {
                let of = |series: &SampleRange| {
                    jacobian.rows(series.start, series.len()).tr_mul(&residual.rows(series.start, series.len()))
                };
                group.iter().map(of).sum()
            };
            let scatter: DMatrix<f64> = groups.iter().map(gradient).map(|g| &g * g.transpose()).sum();
            let clustered = &inverse * scatter * &inverse * (count / (count - 1.0));
            let grown: Vec<f64> = (0..size)
                .map(|i| (clustered[(i, i)] / covariance[(i, i)].max(f64::MIN_POSITIVE)).max(1.0).sqrt())
                .collect();
            covariance = DMatrix::from_fn(size, size, |i, j| covariance[(i, j)] * grown[i] * grown[j]);
        }
        Self { covariance, quantile, independent }
    }

    /// Returns the standard deviation of a combination of the parameters.
    pub fn deviation(&self, weights: &DVector<f64>) -> f64 {
        (weights.transpose() * &self.covariance * weights)[0].max(0.0).sqrt()
    }
}

fn inverse(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    matrix.clone().cholesky().map_or_else(|| matrix.clone().pseudo_inverse(1e-12).expect("finite"), |c| c.inverse())
}

/// Number of samples that count as one: 1 + 2 times the sum of the positive correlations of the residual.
fn correlation_time(residual: &DVector<f64>, groups: &[Vec<SampleRange>]) -> f64 {
    let series: Vec<&SampleRange> = groups.iter().flatten().collect();
    let longest = series.iter().map(|series| series.len()).max().unwrap_or(1);
    let product = |lag: usize| -> f64 {
        let of = |series: &&SampleRange| {
            let own = residual.rows(series.start, series.len());
            (lag..own.len()).map(|i| own[i] * own[i - lag]).sum::<f64>()
        };
        series.iter().map(of).sum()
    };
    let power = product(0).max(f64::MIN_POSITIVE);
    let most = ((LONGEST_LAG * longest as f64) as usize).max(2).min(longest.saturating_sub(1));
    let sum: f64 = (1..=most).map(|lag| product(lag) / power).take_while(|correlation| *correlation > 0.0).sum();
    1.0 + 2.0 * sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use softdock_diagnosis::inference::fit::{Start, fit};
    use softdock_diagnosis::model::unknown::{ParameterPrior, Role, Unknown};
    use softdock_kernels::philox::uniform;

    /// A slope under noise that is averaged over five samples: 95 % of the intervals cover the truth, and not far more.
    #[test]
    fn intervals_cover_under_correlated_noise() {
        let (samples, draws) = (400, 300);
        let covered = (0..draws).filter(|draw| {
            let white = |i: usize| uniform(3, "noise", *draw, i as u32) - 0.5;
            let noise = move |i: usize| (0..5).map(|j| white(i + j)).sum::<f64>();
            let simulate = |sets: &[Vec<f64>]| -> Vec<DVector<f64>> {
                let one = |set: &Vec<f64>| {
                    DVector::from_fn(samples, |i, _| (1.5 - set[0]) * (i as f64 / 40.0).sin() + noise(i))
                };
                sets.iter().map(one).collect()
            };
            let unknown = Unknown::new("slope", 0, "1", ParameterPrior::Normal { mean: 0.0, sd: 30.0 }, Role::Size);
            let found = fit(vec![Start::nominal(vec![unknown])], &[0.0], 1e-3, &simulate).remove(0);
            let uncertainty = ParameterUncertainty::of(&found, &[std::iter::once(0..samples).collect()]);
            let half = 30.0 * uncertainty.quantile * uncertainty.covariance[(0, 0)].sqrt();
            (found.values(&[0.0])[0] - 1.5).abs() < half
        });
        let share = covered.count() as f64 / draws as f64;
        assert!((0.91..=0.985).contains(&share), "{share}");
    }
}
