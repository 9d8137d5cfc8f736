//! Bias compensation for the noise of measured inputs (errors in variables).
//!
//! The simulation propagates the noise of an input into the residuals, depending on the parameters. Least squares
//! prefer parameters that propagate less of it: a torque constant is underestimated by the share of noise in the
//! measured torque's power. Repeats determine the propagated noise for any parameters, so that the cost is `r'r - N
//! c(z)`, with c the propagated power in units of the noise (Söderström, Errors-in-variables methods in system
//! identification, 2018, ch. 5: bias-compensated least squares).

use super::fit::{Fitted, InputNoise, Simulate};
use crate::model::unknown::applied;
use nalgebra::{DMatrix, DVector};

/// Most Gauss-Newton steps, and the shift in standard deviations below which no further one is taken.
const STEPS: usize = 4;
const SETTLED: f64 = 0.1;

/// Returns the bias-compensated fit with freed sizes. `mean` simulates the whitened mean residuals, `deviation` the
/// whitened differences of repeats, if any. Returns `None` if input noise dominates the information on some parameter.
pub fn compensated(fitted: &Fitted, base: &[f64], mean: &Simulate, deviation: Option<&Simulate>) -> Option<Fitted> {
    let (mut at, mut moved) = stepped(fitted, base, mean, deviation)?;
    for _ in 1..STEPS {
        if moved < SETTLED {
            break;
        }
        (at, moved) = stepped(&at, base, mean, deviation)?;
    }
    Some(at)
}

/// A Gauss-Newton step, and how far it moved the number that it moved furthest, in standard deviations.
fn stepped(from: &Fitted, base: &[f64], mean: &Simulate, deviation: Option<&Simulate>) -> Option<(Fitted, f64)> {
    let steps = from.curvature(1.0).cholesky()?.inverse().diagonal().map(f64::sqrt);
    let moved = |place: usize| {
        let mut z = from.z.clone();
        z[place] += steps[place];
        applied(base, &from.unknowns, &z)
    };
    let sets: Vec<Vec<f64>> = std::iter::once(from.values(base)).chain((0..from.z.len()).map(moved)).collect();
    let (residual, jacobian) = derived(mean(&sets), &steps);
    let input_noise = deviation.map(|deviation| {
        let (noise, through) = derived(deviation(&sets), &steps);
        // Whitened means count as single repeats do: their noise has the same power.
        let share = residual.len() as f64 / noise.len() as f64;
        InputNoise { gradient: through.tr_mul(&noise) * share, information: through.tr_mul(&through) * share }
    });
    let here = Fitted { residual, jacobian, input_noise, ..from.clone() };
    let shift = here.curvature(1.0).cholesky()?.solve(&-(here.gradient() + here.prior_slope()));
    let to = |(i, z): (usize, &f64)| here.unknowns[i].prior.allowed(z + shift[i]);
    let z: Vec<f64> = here.z.iter().enumerate().map(to).collect();
    let residual = mean(&[applied(base, &here.unknowns, &z)]).remove(0);
    Some((Fitted { z, residual, ..here }, shift.component_div(&steps).amax()))
}

/// The first of some vectors, and its derivatives by the numbers that the others were moved by.
fn derived(mut all: Vec<DVector<f64>>, steps: &DVector<f64>) -> (DVector<f64>, DMatrix<f64>) {
    let here = all.remove(0);
    let columns: Vec<DVector<f64>> = all.iter().zip(steps).map(|(moved, step)| (moved - &here) / *step).collect();
    (here, DMatrix::from_columns(&columns))
}

#[cfg(test)]
mod tests {
    use super::super::fit::{Start, fit};
    use super::*;
    use crate::model::unknown::{ParameterPrior, Role, Unknown};
    use softdock_kernels::philox;

    const SAMPLES: usize = 3000;
    const REPEATS: usize = 3;
    /// Gain between an input and an output, and standard deviations of the noise of both.
    const GAIN: f64 = 2.0;
    const NOISE: [f64; 2] = [0.3, 0.1];

    fn normal(stream: &str, i: usize) -> f64 {
        (0..12).map(|k| philox::uniform(5, stream, i as u64, k)).sum::<f64>() - 6.0
    }

    /// Residuals of the repeats under a gain: output less gain times input, both as measured, in units of their noise
    /// under no gain.
    fn residuals(gain: f64) -> Vec<DVector<f64>> {
        let one = |repeat: usize| {
            let at = |i: usize, _| {
                let (input, number) = ((0.01 * i as f64).sin(), repeat * SAMPLES + i);
                let measured = input + NOISE[0] * normal("input", number);
                (GAIN * input + NOISE[1] * normal("output", number) - gain * measured) / NOISE[1]
            };
            DVector::from_fn(SAMPLES, at)
        };
        (0..REPEATS).map(one).collect()
    }

    fn mean(gain: f64) -> DVector<f64> {
        residuals(gain).iter().sum::<DVector<f64>>() / (REPEATS as f64).sqrt()
    }

    fn deviations(gain: f64) -> DVector<f64> {
        let all = residuals(gain);
        let mean = all.iter().sum::<DVector<f64>>() / REPEATS as f64;
        let scale = (REPEATS as f64 / (REPEATS as f64 - 1.0)).sqrt();
        DVector::from_vec(all.iter().flat_map(|one| ((one - &mean) * scale).data.as_vec().clone()).collect())
    }

    #[test]
    fn compensated_gain_of_a_noisy_input_is_unbiased() {
        let prior = ParameterPrior::Normal { mean: 1.0, sd: 1.0 };
        let unknowns = vec![Unknown::new("gain", 0, "1", prior, Role::Size)];
        let by = |of: fn(f64) -> DVector<f64>| move |sets: &[Vec<f64>]| sets.iter().map(|set| of(set[0])).collect();
        let (mean, deviation) = (by(mean), by(deviations));
        let fitted = fit(vec![Start::nominal(unknowns)], &[1.0], 1e-3, &mean).remove(0).with_freed_sizes();
        let attenuated = fitted.values(&[1.0])[0];
        let compensated = compensated(&fitted, &[1.0], &mean, Some(&deviation)).expect("identifiable");
        let gain = compensated.values(&[1.0])[0];
        // Noise of the input counts as noise of the residual too, thirty-six times the power of the output's own.
        let noise = (1.0 + (GAIN * NOISE[0] / NOISE[1]).powi(2)).sqrt();
        let sd = noise / compensated.information()[(0, 0)].sqrt();
        assert!((gain - GAIN).abs() < 3.0 * sd, "{gain}, standard deviation {sd}");
        // Attenuated by the share of the noise of three repeats' mean.
        let power = 0.5 / (0.5 + NOISE[0].powi(2) / REPEATS as f64);
        assert!((attenuated - GAIN * power).abs() < 3.0 * sd, "{attenuated}, standard deviation {sd}");
        assert!(GAIN * (1.0 - power) > 6.0 * sd, "the bias exceeds the uncertainty");
    }
}
