//! Recordings without a hidden effect: their noise, the projection of their nuisance parameters, and their differences
//! to others.

use crate::{GauntletError, Result};
use nalgebra::{DMatrix, DVector};
use softdock_diagnosis::inference::bank::{Bank, Projector};
use softdock_diagnosis::inference::fit::Fitted;
use softdock_diagnosis::inference::noise::Noise;
use softdock_diagnosis::inference::recordings::BlockRecordings;
use softdock_diagnosis::model::block::MeasuredBlock;
use softdock_diagnosis::model::hypothesis::Hypothesis;
use softdock_diagnosis::model::unknown::applied;

/// Step of difference quotients, in standard deviations.
const STEP: f64 = 2e-3;
/// Iterations of the nuisance fit.
const BENDS: usize = 3;

/// Recordings of a block without a hidden effect.
pub(super) struct Healthy {
    /// Recordings without noise: in a bounce, noise changes the motion and thereby its sensitivity to nuisance
    /// parameters.
    still: MeasuredBlock,
    noise: Noise,
    /// The null hypothesis that the noisy recordings give, with its residuals and their derivatives without noise.
    pub(super) null: Fitted,
    /// Whitened held-out residuals under it: with noise, without, and their derivatives by the nuisances.
    pub(super) held_out: DVector<f64>,
    held_out_still: DVector<f64>,
    pub(super) held_out_jacobian: DMatrix<f64>,
}

impl Healthy {
    /// Of recordings with their noise, and without.
    pub(super) fn of(block: &MeasuredBlock, mut still: MeasuredBlock) -> Result<Self> {
        let silent = || GauntletError::Model(format!("{} has no noise", block.name));
        let noise = noise(block).ok_or_else(silent)?;
        // Judged at the samples that the noise allows.
        still.decimator = block.decimator.clone();
        let null = null(block, &noise);
        let values = null.values(&block.base);
        let held_out = block.part(true).whitened(&noise, std::slice::from_ref(&values)).remove(0);
        let (residual, jacobian) = linearised(&still.part(false), &noise, &still.base, &null);
        let (held_out_still, held_out_jacobian) = linearised(&still.part(true), &noise, &still.base, &null);
        let null = Fitted { residual, jacobian, ..null };
        Ok(Self { still, noise, null, held_out, held_out_still, held_out_jacobian })
    }

    /// Returns the bank of a library on these recordings.
    pub(super) fn bank(&self, library: &[Hypothesis]) -> Bank {
        let learn = self.still.part(false);
        let shortcut = learn.shortcut(&self.noise, &self.null.values(&self.still.base));
        Bank::simulate(library, &self.null, &self.still.base, &|sets| shortcut.whitened(sets))
    }

    /// Returns the nuisance parameters that explain a change of the residuals, each within `furthest` tolerances of
    /// nominal, including what these recordings drew.
    pub(super) fn placed(&self, change: &DVector<f64>, furthest: f64) -> DVector<f64> {
        let jacobian = &self.null.jacobian;
        let size = jacobian.ncols();
        let normal = jacobian.tr_mul(jacobian) + DMatrix::identity(size, size);
        let gradient = jacobian.tr_mul(change);
        let within = |i: usize, z: f64| {
            let drawn = self.null.z[i];
            z.clamp((-furthest - drawn).min(0.0), (furthest - drawn).max(0.0))
        };
        let mut z = DVector::zeros(size);
        let mut held = vec![false; size];
        loop {
            let free: Vec<usize> = (0..size).filter(|i| !held[*i]).collect();
            if free.is_empty() {
                return z;
            }
            let own = DMatrix::from_fn(free.len(), free.len(), |i, j| normal[(free[i], free[j])]);
            let pull = |i: usize| {
                let others: f64 = (0..size).filter(|j| held[*j]).map(|j| normal[(i, j)] * z[j]).sum();
                -gradient[i] - others
            };
            let right = DVector::from_iterator(free.len(), free.iter().map(|i| pull(*i)));
            let solved = own.cholesky().map_or_else(|| DVector::zeros(free.len()), |own| own.solve(&right));
            for (place, i) in free.iter().enumerate() {
                z[*i] = within(*i, solved[place]);
                held[*i] |= z[*i] != solved[place];
            }
            if free.iter().all(|i| !held[*i]) {
                return z;
            }
        }
    }

    /// Returns the prior penalty of nuisance parameters, relative to their drawn values, in chi-squared.
    pub(super) fn prior_penalty(&self, z: &DVector<f64>) -> f64 {
        z.iter().zip(&self.null.z).map(|(z, drawn)| z * (z + 2.0 * drawn)).sum()
    }

    /// Returns the sum of squares of whitened residuals after the projection of the nuisance parameters.
    pub(super) fn unexplained(&self, residual: &DVector<f64>) -> f64 {
        residual.dot(&Projector::of(&self.null).reject(residual))
    }

    /// Returns the differences of other noiseless recordings from these, in the whitened training and held-out
    /// residuals, with nuisance parameters fitted within `furthest` tolerances.
    pub(super) fn changed(&self, mut other: MeasuredBlock, furthest: f64) -> [DVector<f64>; 2] {
        other.decimator = self.still.decimator.clone();
        let (learn, test) = (other.part(false), other.part(true));
        let change = |part: &BlockRecordings<'_>, still: &DVector<f64>, jacobian: &DMatrix<f64>, z: &DVector<f64>| {
            let z_there: Vec<f64> = self.null.z.iter().zip(z.iter()).map(|(own, more)| own + more).collect();
            let values = applied(&self.still.base, &self.null.unknowns, &z_there);
            part.whitened(&self.noise, &[values]).remove(0) - still - jacobian * z
        };
        let of_learn = |z: &DVector<f64>| change(&learn, &self.null.residual, &self.null.jacobian, z);
        let mut z = DVector::zeros(self.null.z.len());
        for _ in 0..BENDS {
            z = self.placed(&of_learn(&z), furthest);
        }
        [of_learn(&z), change(&test, &self.held_out_still, &self.held_out_jacobian, &z)]
    }
}

/// Whitened residuals of some recordings under a fit, and their derivatives by its numbers.
fn linearised(
    part: &BlockRecordings<'_>,
    noise: &Noise,
    base: &[f64],
    fitted: &Fitted,
) -> (DVector<f64>, DMatrix<f64>) {
    let moved = |column: usize| {
        let mut z = fitted.z.clone();
        z[column] += STEP;
        applied(base, &fitted.unknowns, &z)
    };
    let sets: Vec<Vec<f64>> = std::iter::once(fitted.values(base)).chain((0..fitted.z.len()).map(moved)).collect();
    let mut residuals = part.whitened(noise, &sets);
    let residual = residuals.remove(0);
    let columns: Vec<DVector<f64>> = residuals.into_iter().map(|with| (with - &residual) / STEP).collect();
    let jacobian = match columns.is_empty() {
        true => DMatrix::zeros(residual.len(), 0),
        false => DMatrix::from_columns(&columns),
    };
    (residual, jacobian)
}

/// Estimates the noise of recordings without a hidden effect, from repeats or quiet stretches, or, if every recording
/// has its own commands, from the residual of the null hypothesis.
fn noise(block: &MeasuredBlock) -> Option<Noise> {
    let mut series = block.noise_alone();
    if series.is_empty() {
        let (learn, test) = (block.part(false), block.part(true));
        let rough = Noise::rough(&learn.means(&block.base), &block.floor)?;
        let values = null(block, &rough).values(&block.base);
        series = learn.means(&values);
        series.extend(test.means(&values));
    }
    Noise::above(&series, &block.floor)
}

/// The null hypothesis, fitted to what is learnt from.
fn null(block: &MeasuredBlock, noise: &Noise) -> Fitted {
    block.part(false).shortcut(noise, &block.base).null()
}
