//! Standard deviations of fitted parameters: from noise, discretisation error, considered parameters and model error.
//!
//! Model error shifts the gradient of each experiment differently, so that the gradients scatter by more than noise
//! (the sandwich estimator by clusters: Liang and Zeger, Biometrika 73 (1986) 13). To first order, this is the shift
//! from leaving an experiment out. An experiment that alone shows an effect contains no information on the scatter of
//! that effect.
//!
//! Noise that depends on an effect (a limited command keeps its initial delay error while limited) is not white after
//! whitening. The differences of repeats under the fit shift the gradient alike, so they form clusters, too.

use super::evidence::{MarginalLikelihood, regular};
use super::fit::Fitted;
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// Rows of an experiment in the whitened residuals.
pub struct ExperimentRows {
    /// Rows of its mean residual.
    pub rows: Range<usize>,
    /// Number of repeats.
    pub repeats: usize,
}

/// Sources of parameter errors of a fit.
pub struct ErrorSources<'a> {
    /// All experiments, in the order of their rows.
    pub experiments: &'a [ExperimentRows],
    /// Changes of the whitened residuals from sources that are not fitted: half the step, and each considered parameter
    /// shifted by its standard deviation.
    pub shifts: Vec<DVector<f64>>,
    /// Whitened differences of repeats under the fit, concatenated.
    pub repeats: Option<&'a DVector<f64>>,
}

/// Returns the standard deviation of each free parameter's `z`; `dispersion` as in the evidence.
///
/// `s^2 = s_stat^2 + sum s_shift^2 + s_in^2 + max(s_gap^2, s_rep^2)`: statistical (with the dispersion), shifts, input
/// noise, and the larger of model error and repeat-to-repeat variance. Shifts are those of one Gauss-Newton step.
pub fn deviations(fitted: &Fitted, evidence: &MarginalLikelihood, dispersion: f64, seen: &ErrorSources) -> Vec<f64> {
    let mut variance = evidence.covariance.diagonal();
    for change in &seen.shifts {
        let shift = &evidence.covariance * fitted.jacobian.tr_mul(change) / dispersion;
        variance += shift.component_mul(&shift);
    }
    if let Some(noise) = &fitted.input_noise {
        // Noise in the sensitivities has no information, but shifts the parameters.
        variance += (&evidence.covariance * &noise.information * &evidence.covariance).diagonal() / dispersion;
    }
    let clusters = Clusters { fitted, covariance: &evidence.covariance, dispersion };
    let by_repeats = seen.repeats.map(|repeats| clusters.by_repeats(seen.experiments, repeats));
    let gap = clusters.gap(seen.experiments);
    variance += by_repeats.map_or(gap.clone(), |by_repeats| by_repeats.sup(&gap));
    variance.iter().map(|variance| variance.sqrt()).collect()
}

/// Returns the factor by which the gradients of independent clusters of `rows` residuals scatter more than unit noise,
/// averaged over the free parameters: the factor by which a likelihood of all residuals is overconfident (Pauli,
/// Racugno and Ventura, Statistica Sinica 21 (2011) 149).
pub fn scatter(fitted: &Fitted, rows: usize) -> f64 {
    let count = fitted.z.len();
    if count == 0 {
        return 1.0;
    }
    let clusters = fitted.residual.len() / rows;
    let gradient = |k: usize| fitted.jacobian.rows(k * rows, rows).tr_mul(&fitted.residual.rows(k * rows, rows));
    let gradients = DMatrix::from_columns(&(0..clusters).map(gradient).collect::<Vec<_>>());
    let curvature = regular(fitted.curvature(1.0));
    curvature.solve(&(&gradients * gradients.transpose())).trace() / count as f64
}

/// Gradients of clusters of residuals.
struct Clusters<'a> {
    fitted: &'a Fitted,
    covariance: &'a DMatrix<f64>,
    dispersion: f64,
}

impl Clusters<'_> {
    /// An experiment's own precision, by the covariance of all.
    fn weight(&self, rows: &Range<usize>) -> DMatrix<f64> {
        let own = self.fitted.jacobian.rows(rows.start, rows.len());
        self.covariance * (own.transpose() * own / self.dispersion)
    }

    /// Returns the shift of the parameters by a gradient.
    fn shift(&self, gradient: DVector<f64>) -> DVector<f64> {
        self.covariance * (gradient / self.dispersion)
    }

    /// Returns the variance from the gradient of each experiment, beyond noise.
    fn gap(&self, experiments: &[ExperimentRows]) -> DVector<f64> {
        let Self { fitted, covariance, .. } = self;
        let mut sum = DVector::zeros(fitted.z.len());
        if experiments.len() < 2 {
            return sum;
        }
        for ExperimentRows { rows, .. } in experiments {
            let own = fitted.jacobian.rows(rows.start, rows.len());
            let share = rows.len() as f64 / fitted.residual.len() as f64;
            let mut gradient = own.tr_mul(&fitted.residual.rows(rows.start, rows.len()));
            fitted.input_noise.iter().for_each(|noise| gradient -= &noise.gradient * share);
            let shift = self.shift(gradient);
            // Of noise that the fit follows: cov (G - G cov G) cov, G the experiment's own precision.
            let weight = self.weight(rows);
            let noise = &weight * *covariance - &weight * &weight * *covariance;
            sum += shift.component_mul(&shift) - noise.diagonal();
        }
        let count = experiments.len() as f64;
        sum.map(|excess| (excess * count / (count - 1.0)).max(0.0))
    }

    /// Returns the variance from the differences of repeats, beyond that of the whitened noise.
    fn by_repeats(&self, experiments: &[ExperimentRows], differences: &DVector<f64>) -> DVector<f64> {
        let (mut sum, mut start) = (DVector::zeros(self.fitted.z.len()), 0);
        for ExperimentRows { rows, repeats } in experiments.iter().filter(|experiment| experiment.repeats > 1) {
            let own = self.fitted.jacobian.rows(rows.start, rows.len());
            for _ in 0..*repeats {
                let shift = self.shift(own.tr_mul(&differences.rows(start, rows.len())));
                sum += shift.component_mul(&shift) / *repeats as f64;
                start += rows.len();
            }
            sum -= (self.weight(rows) * self.covariance).diagonal();
        }
        sum.map(|excess| excess.max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::super::evidence::evidence;
    use super::*;
    use crate::model::unknown::{ParameterPrior, Role, Unknown};
    use softdock_kernels::philox;

    const ROWS: usize = 400;

    fn noise(i: usize) -> f64 {
        (0..12).map(|k| philox::uniform(11, "n", i as u64, k)).sum::<f64>() - 6.0
    }

    /// One number, measured in three experiments that are each off by as much, in standard deviations of one sample.
    fn fitted(off: [f64; 3]) -> Fitted {
        let prior = ParameterPrior::Normal { mean: 0.0, sd: 1.0 };
        let unknown = Unknown::new("p", 0, "1", prior, Role::Size);
        let residual = DVector::from_fn(3 * ROWS, |i, _| noise(i) + off[i / ROWS]);
        let mean = residual.mean();
        let jacobian = DMatrix::from_element(3 * ROWS, 1, 1.0);
        Fitted {
            hypothesis: 0,
            unknowns: vec![unknown],
            z: vec![-mean],
            residual: residual.add_scalar(-mean),
            jacobian,
            carried: 0.0,
            input_noise: None,
            freed: false,
        }
    }

    fn experiments() -> [ExperimentRows; 3] {
        [0, 1, 2].map(|i| ExperimentRows { rows: i * ROWS..(i + 1) * ROWS, repeats: 2 })
    }

    fn deviation(off: [f64; 3], shifts: Vec<DVector<f64>>, repeats: Option<&DVector<f64>>) -> f64 {
        let fitted = fitted(off);
        deviations(
            &fitted,
            &evidence(&fitted, 1.0),
            1.0,
            &ErrorSources { experiments: &experiments(), shifts, repeats },
        )[0]
    }

    #[test]
    fn disagreeing_experiments_widen_the_deviation_and_noise_does_not() {
        let plain = 1.0 / (3.0 * ROWS as f64).sqrt();
        let alone = deviation([0.0; 3], Vec::new(), None) / plain;
        assert!((0.99..1.8).contains(&alone), "{alone}");
        // The mean of three that scatter by 0.5.
        let apart = deviation([-0.5, 0.0, 0.5], Vec::new(), None);
        assert!((apart / (0.5 / 3_f64.sqrt()) - 1.0).abs() < 0.2, "{apart}");
    }

    #[test]
    fn disagreeing_repeats_widen_the_deviation() {
        // Two repeats, each off by as much as the other to the other side, and noise; each experiment's mean is known to
        // that over the root of two, times the root of two as a single one's noise would be.
        let repeats = |off: f64| {
            DVector::from_fn(6 * ROWS, |i, _| noise(i) + if (i / ROWS).is_multiple_of(2) { off } else { -off })
        };
        let plain = 1.0 / (3.0 * ROWS as f64).sqrt();
        let alone = deviation([0.0; 3], Vec::new(), Some(&repeats(0.0))) / plain;
        assert!((0.99..1.8).contains(&alone), "{alone}");
        let apart = deviation([0.0; 3], Vec::new(), Some(&repeats(0.4)));
        assert!((apart / (0.4 / 3_f64.sqrt()) - 1.0).abs() < 0.2, "{apart}");
    }

    #[test]
    fn single_informative_experiment_adds_no_scatter() {
        let mut fitted = fitted([0.0; 3]);
        fitted.jacobian.rows_mut(ROWS, 2 * ROWS).fill(0.0);
        let seen = ErrorSources { experiments: &experiments(), shifts: Vec::new(), repeats: None };
        let own = deviations(&fitted, &evidence(&fitted, 1.0), 1.0, &seen)[0];
        assert!((own * (ROWS as f64).sqrt() - 1.0).abs() < 0.5, "{own}");
    }

    #[test]
    fn considered_parameters_widen_the_deviation() {
        let change = DVector::from_element(3 * ROWS, 0.3);
        assert!((deviation([0.0; 3], vec![change], None) - 0.3).abs() < 0.01);
    }
}
