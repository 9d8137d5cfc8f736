//! Latent inputs: the signal that, added to a measured input, explains a block's residual; estimated through the
//! simulator.
//!
//! The signal is piecewise linear between knots; the evidence determines the size of its second differences (an
//! integrated random walk, the prior of a smoothing spline: Wahba 1978). No measured signal is differentiated.

use nalgebra::{DMatrix, DVector};

/// Signal with its uncertainty.
#[derive(Clone, Debug, PartialEq)]
pub struct Latent {
    /// Values at the knots.
    pub value: Vec<f64>,
    /// Standard deviations of the values.
    pub sd: Vec<f64>,
}

/// Ratios of neighbouring roughnesses that are tried, and how many.
const RATIO: f64 = 10.0;
const TRIED: i32 = 9;

/// Estimates the most probable signal from whitened residuals. `response` has their change per unit at each knot;
/// `size` is an upper bound of the signal's magnitude.
pub fn latent(residual: &DVector<f64>, response: &DMatrix<f64>, size: f64) -> Option<Latent> {
    let moments = (response.transpose() * response, -(response.transpose() * residual));
    // From as rough as its size allows to nearly straight.
    let tried = (0..TRIED).filter_map(|k| Fit::of(&moments, size * RATIO.powi(-k) * 0.1, size));
    let best = tried.max_by(|a, b| a.evidence.total_cmp(&b.evidence))?;
    Some(Latent { value: best.value.iter().copied().collect(), sd: best.variance.iter().map(|v| v.sqrt()).collect() })
}

struct Fit {
    evidence: f64,
    value: DVector<f64>,
    variance: DVector<f64>,
}

impl Fit {
    /// With second differences of a size `rough`.
    fn of((gram, product): &(DMatrix<f64>, DVector<f64>), rough: f64, size: f64) -> Option<Self> {
        let prior = prior(gram.ncols(), rough, size);
        let log_det = |factor: &nalgebra::Cholesky<f64, nalgebra::Dyn>| -> f64 {
            2.0 * factor.l().diagonal().iter().map(|d| d.ln()).sum::<f64>()
        };
        let before = log_det(&prior.clone().cholesky()?);
        let posterior = (gram + prior).cholesky()?;
        let value = posterior.solve(product);
        let evidence = 0.5 * (product.dot(&value) - log_det(&posterior) + before);
        Some(Self { evidence, value, variance: posterior.inverse().diagonal() })
    }
}

/// Precision of the signal before any data.
fn prior(knots: usize, rough: f64, size: f64) -> DMatrix<f64> {
    let mut precision = DMatrix::identity(knots, knots) / (size * size);
    let weights = [1.0, -2.0, 1.0];
    for first in 0..knots.saturating_sub(2) {
        for (i, a) in weights.iter().enumerate() {
            for (j, b) in weights.iter().enumerate() {
                precision[(first + i, first + j)] += a * b / (rough * rough);
            }
        }
    }
    precision
}

#[cfg(test)]
mod tests {
    use super::*;
    use softdock_kernels::philox;

    #[test]
    fn latent_signal_is_estimated_within_its_uncertainty() {
        let (knots, every) = (60, 10);
        let truth = |knot: usize| 3.0 * (knot as f64 * 0.2).sin();
        // Each knot's unit is felt for two knots' time.
        let felt = |i: usize, knot: usize| match i as f64 / f64::from(every) - knot as f64 {
            late if (0.0..2.0).contains(&late) => -4.0 * (1.0 - 0.5 * late),
            _ => 0.0,
        };
        let rows = (knots + 2) * every as usize;
        let response = DMatrix::from_fn(rows, knots, felt);
        let noise = |i: usize| (0..12).map(|k| philox::uniform(4, "n", i as u64, k)).sum::<f64>() - 6.0;
        let signal = DVector::from_fn(knots, |knot, _| truth(knot));
        // Residual and response: what is missing in the simulation is left over.
        let residual = -(&response * signal) + DVector::from_fn(rows, |i, _| noise(i));
        let found = latent(&residual, &response, 10.0).expect("a signal");
        let off: f64 = (0..knots).map(|k| ((found.value[k] - truth(k)) / found.sd[k]).powi(2)).sum::<f64>();
        assert!((0.5..1.6).contains(&(off / knots as f64)), "{off}");
        assert!(found.sd.iter().all(|sd| *sd < 0.3), "{:?}", found.sd);
    }
}
