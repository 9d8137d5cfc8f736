//! Evidence of a hypothesis: its marginal likelihood by Laplace's method, and the intervals of its parameters.

use super::fit::Fitted;
use crate::model::unknown::{ParameterPrior, Role};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use statrs::distribution::{ContinuousCDF, Normal};

/// Logarithm of the marginal likelihood (evidence), and the posterior covariance.
#[derive(Clone, Debug, PartialEq)]
pub struct MarginalLikelihood {
    /// log Z, up to a constant that all hypotheses share.
    pub log: f64,
    /// Covariance of the free numbers' `z`.
    pub covariance: DMatrix<f64>,
}

/// Returns the evidence of a fit; `dispersion` >= 1 is the factor by which residual variances exceed the noise.
///
/// `log Z = -chi2/2c - z'Pz/2 - log det(1 + P^-1 J'J/c)/2`, P the precision of what is plausible, 1 unless sizes are
/// freed; the priors of sizes have heavy tails; a number that cannot be negative adds the share of its posterior that is
/// allowed, over the half that its prior is (MacKay, Information theory, inference, and learning algorithms, ch. 27).
pub fn evidence(fitted: &Fitted, dispersion: f64) -> MarginalLikelihood {
    let plausible = fitted.plausible();
    let cholesky = regular(fitted.curvature(dispersion));
    let log_det: f64 = 2.0 * cholesky.l().diagonal().iter().map(|d| d.ln()).sum::<f64>();
    let log_det = log_det - plausible.iter().map(|weight| weight.ln()).sum::<f64>();
    let covariance = cholesky.inverse();
    let z = DVector::from_column_slice(&fitted.z);
    let slope = fitted.prior_slope();
    let mut log = -0.5 * (fitted.chi2() / dispersion + slope.dot(&z) + log_det) + excess_of_tails(fitted);
    let gradient = fitted.gradient() / dispersion + slope;
    let shift = &covariance * &gradient;
    for (i, unknown) in fitted.unknowns.iter().enumerate() {
        if unknown.prior.is_one_sided() {
            let sd = covariance[(i, i)].sqrt();
            // At the bound the peak is beyond it, at a distance given by the slope.
            let peak = if z[i] <= 0.0 { (z[i] - shift[i]).min(0.0) } else { z[i] };
            log += 2_f64.ln() + log_normal_cdf(peak / sd);
            log += if z[i] <= 0.0 { 0.5 * (peak / sd).powi(2) } else { 0.0 };
        }
    }
    MarginalLikelihood { log, covariance }
}

/// Prior standard deviations of a size beyond which its prior falls as a power, not as a normal distribution.
const TAIL: f64 = 2.0;

/// Returns by how much the priors of sizes with their heavy tails exceed normal ones, natural logarithm.
///
/// What is plausible is known to a factor at best. With normal tails the prior would decide between causes that are both
/// far larger than is plausible, whatever the data say: 18 standard deviations against 6 are 140 in log-odds. Beyond
/// `TAIL` the prior goes on as a power with the same value and slope, `TAIL^2 (1/2 + ln(z / TAIL))`.
fn excess_of_tails(fitted: &Fitted) -> f64 {
    if fitted.freed {
        return 0.0;
    }
    let sizes = fitted.unknowns.iter().zip(&fitted.z).filter(|(unknown, _)| unknown.role == Role::Size);
    let excess = |z: f64| 0.5 * z * z - TAIL * TAIL * (0.5 + (z / TAIL).ln());
    sizes.map(|(_, z)| z.abs()).filter(|z| *z > TAIL).map(excess).sum()
}

/// Returns the Cholesky factor of a matrix that is positive definite but for roundings: readings of any size, such as a
/// damaged cell, may hide the precision of the priors. Its diagonal is raised until it has a factor.
pub(crate) fn regular(matrix: DMatrix<f64>) -> Cholesky<f64, Dyn> {
    let finite = matrix.map(|entry| if entry.is_finite() { entry } else { 0.0 });
    let largest = finite.diagonal().amax().max(1.0);
    let raised = |power: i32| {
        let diagonal = DMatrix::from_diagonal_element(finite.nrows(), finite.ncols(), largest * 10_f64.powi(power));
        (&finite + diagonal).cholesky()
    };
    let exact = finite.clone().cholesky();
    exact.or_else(|| (-14..=2).find_map(raised)).expect("a dominant diagonal is positive definite")
}

/// log of the standard normal distribution function, far into its tail.
pub(super) fn log_normal_cdf(x: f64) -> f64 {
    if x < -8.0 {
        // Mills' ratio.
        return -0.5 * x * x - (-x).ln() - 0.5 * std::f64::consts::TAU.ln() + (1.0 - 1.0 / (x * x)).ln();
    }
    Normal::standard().cdf(x).ln()
}

/// Value of a parameter with its 95 % credible interval.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct CredibleInterval {
    /// Best value, SI.
    pub value: f64,
    /// Lower bound.
    pub lo: f64,
    /// Upper bound.
    pub hi: f64,
}

/// Prior standard deviations of a factor beyond which it is not identifiable: an interval of all possible values has no
/// information.
const WIDEST: f64 = 8.0;

/// Returns the interval of a free parameter from the standard deviation of its `z`.
pub fn interval(prior: &ParameterPrior, z: f64, sd: f64) -> CredibleInterval {
    let half = 1.959_964 * sd;
    let half = if matches!(prior, ParameterPrior::LogNormal { .. }) { half.min(WIDEST) } else { half };
    let bounds = [z - half, z + half].map(|z| prior.value(prior.allowed(z)));
    CredibleInterval { value: prior.value(z), lo: bounds[0].min(bounds[1]), hi: bounds[0].max(bounds[1]) }
}

/// Returns the nuisance parameter with the greatest z-score.
pub fn greatest_nuisance_deviation(fitted: &Fitted) -> Option<(&str, f64)> {
    let z_scores = fitted.nuisances().map(|(_, unknown, z)| (unknown.name.as_str(), z));
    z_scores.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
}

/// Logarithm of a sum of exponentials.
pub(crate) fn log_sum<'l>(logs: impl Iterator<Item = &'l f64> + Clone) -> f64 {
    let peak = logs.clone().copied().fold(f64::NEG_INFINITY, f64::max);
    peak + logs.map(|log| (log - peak).exp()).sum::<f64>().ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hidden_precision_of_a_prior_leaves_a_factor() {
        let singular = DMatrix::from_element(2, 2, 1e30) + DMatrix::identity(2, 2);
        assert!(singular.clone().cholesky().is_none(), "the identity is lost");
        assert!(regular(singular).inverse().iter().all(|entry| entry.is_finite()));
        assert!(regular(DMatrix::from_element(2, 2, f64::NAN)).inverse().iter().all(|entry| entry.is_finite()));
        let regular = regular(DMatrix::from_diagonal_element(2, 2, 4.0));
        assert_eq!(regular.inverse(), DMatrix::from_diagonal_element(2, 2, 0.25));
    }

    #[test]
    fn unidentified_parameter_has_finite_bounds() {
        let CredibleInterval { value, lo, hi } =
            interval(&ParameterPrior::LogNormal { centre: 0.05, spread: 1.5 }, 1.0, 400.0);
        assert!(lo > 0.0 && lo < 1e-4 * value && hi > 1e4 * value && hi.is_finite(), "{lo} {hi}");
        let known = interval(&ParameterPrior::LogNormal { centre: 1.0, spread: 1.0 }, 0.0, 0.5);
        assert!((known.hi - (1.959_964_f64 * 0.5).exp()).abs() < 1e-12);
    }
}
