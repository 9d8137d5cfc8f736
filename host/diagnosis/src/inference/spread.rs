//! How far the free numbers of a fit may be off: by noise, by the step of the simulation, and by what the model lacks.
//!
//! What a model lacks pulls each experiment its own way, so that their pulls scatter by more than noise explains (the
//! sandwich by clusters: Liang and Zeger, Biometrika 73 (1986) 13). They are to first order what leaving an experiment out
//! would shift, but an experiment that alone shows an effect says nothing of that effect's scatter.

use super::evidence::Evidence;
use super::fit::Fitted;
use nalgebra::DVector;
use std::ops::Range;

/// Standard deviation of each free number's `z`; `dispersion` as in the evidence, `experiments` the rows of each
/// experiment, `refined` what half the step changes in the whitened residuals.
///
/// `s^2 = s_stat^2 + s_num^2 + s_in^2 + s_gap^2`, the first with the dispersion in it, the third by the noise of inputs.
/// Shifts are those of one Gauss-Newton step.
pub fn deviations(
    fitted: &Fitted,
    evidence: &Evidence,
    dispersion: f64,
    experiments: &[Range<usize>],
    refined: Option<&DVector<f64>>,
) -> Vec<f64> {
    let mut variance = evidence.covariance.diagonal();
    if let Some(change) = refined {
        let shift = &evidence.covariance * fitted.jacobian.tr_mul(change) / dispersion;
        variance += shift.component_mul(&shift);
    }
    if let Some(noise) = &fitted.input_noise {
        // Noise that comes through the sensitivities tells nothing, and moves the numbers all the same.
        variance += (&evidence.covariance * &noise.information * &evidence.covariance).diagonal() / dispersion;
    }
    variance += gap(fitted, evidence, dispersion, experiments);
    variance.iter().map(|variance| variance.sqrt()).collect()
}

/// Variance by what each experiment pulls, beyond what noise explains of it.
fn gap(fitted: &Fitted, evidence: &Evidence, dispersion: f64, experiments: &[Range<usize>]) -> DVector<f64> {
    let covariance = &evidence.covariance;
    let mut sum = DVector::zeros(fitted.z.len());
    if experiments.len() < 2 {
        return sum;
    }
    for rows in experiments {
        let own = fitted.jacobian.rows(rows.start, rows.len());
        let share = rows.len() as f64 / fitted.residual.len() as f64;
        let mut pull = own.tr_mul(&fitted.residual.rows(rows.start, rows.len()));
        fitted.input_noise.iter().for_each(|noise| pull -= &noise.pull * share);
        let pull = covariance * (pull / dispersion);
        // Of noise that the fit follows: cov (G - G cov G) cov, G the experiment's own precision.
        let weight = covariance * (own.transpose() * own / dispersion);
        let noise = &weight * covariance - &weight * &weight * covariance;
        sum += pull.component_mul(&pull) - noise.diagonal();
    }
    let count = experiments.len() as f64;
    sum.map(|excess| (excess * count / (count - 1.0)).max(0.0))
}

#[cfg(test)]
mod tests {
    use super::super::evidence::evidence;
    use super::super::unknown::{Prior, Role, Unknown};
    use super::*;
    use nalgebra::DMatrix;
    use softdock_kernels::philox;

    const ROWS: usize = 400;

    fn noise(i: usize) -> f64 {
        (0..12).map(|k| philox::uniform(11, "n", i as u64, k)).sum::<f64>() - 6.0
    }

    /// One number, measured in three experiments that are each off by as much, in standard deviations of one sample.
    fn fitted(off: [f64; 3]) -> Fitted {
        let prior = Prior::Normal { mean: 0.0, sd: 1.0 };
        let unknown = Unknown { name: "p".to_owned(), field: 0, unit: "1", prior, role: Role::Size };
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

    fn deviation(off: [f64; 3], refined: Option<&DVector<f64>>) -> f64 {
        let fitted = fitted(off);
        let experiments = [0..ROWS, ROWS..2 * ROWS, 2 * ROWS..3 * ROWS];
        deviations(&fitted, &evidence(&fitted, 1.0), 1.0, &experiments, refined)[0]
    }

    #[test]
    fn noise_alone_adds_little_and_experiments_that_disagree_much() {
        let plain = 1.0 / (3.0 * ROWS as f64).sqrt();
        assert!((0.99..1.8).contains(&(deviation([0.0; 3], None) / plain)), "{}", deviation([0.0; 3], None) / plain);
        // The mean of three that scatter by 0.5.
        let apart = deviation([-0.5, 0.0, 0.5], None);
        assert!((apart / (0.5 / 3_f64.sqrt()) - 1.0).abs() < 0.2, "{apart}");
    }

    #[test]
    fn an_experiment_that_alone_shows_an_effect_says_nothing_of_its_scatter() {
        let mut fitted = fitted([0.0; 3]);
        fitted.jacobian.rows_mut(ROWS, 2 * ROWS).fill(0.0);
        let experiments = [0..ROWS, ROWS..2 * ROWS, 2 * ROWS..3 * ROWS];
        let own = deviations(&fitted, &evidence(&fitted, 1.0), 1.0, &experiments, None)[0];
        assert!((own * (ROWS as f64).sqrt() - 1.0).abs() < 0.5, "{own}");
    }

    #[test]
    fn what_a_finer_step_moves_counts() {
        let change = DVector::from_element(3 * ROWS, 0.3);
        assert!((deviation([0.0; 3], Some(&change)) - 0.3).abs() < 0.01);
    }
}
