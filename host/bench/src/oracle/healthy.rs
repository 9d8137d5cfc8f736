//! The recordings with nothing hidden: their noise, what the nuisances explain of them, and how others look beside them.

use crate::{Error, Result};
use nalgebra::{DMatrix, DVector};
use softdock_diagnosis::block::MeasuredBlock;
use softdock_diagnosis::inference::bank::Bank;
use softdock_diagnosis::inference::fit::{Fitted, Start, fit};
use softdock_diagnosis::inference::noise::Noise;
use softdock_diagnosis::inference::unknown::applied;
use softdock_diagnosis::library::Hypothesis;

/// Step of difference quotients, in standard deviations.
const STEP: f64 = 2e-3;

/// A block's recordings with nothing hidden.
pub(super) struct Healthy {
    block: MeasuredBlock,
    noise: Noise,
    /// The null hypothesis.
    pub(super) null: Fitted,
    /// The block's parameters by it.
    values: Vec<f64>,
    /// Whitened held-out residuals under it, and their derivatives by its nuisances.
    pub(super) held_out: DVector<f64>,
    pub(super) held_out_jacobian: DMatrix<f64>,
}

impl Healthy {
    pub(super) fn of(block: MeasuredBlock) -> Result<Self> {
        let test = block.part(true);
        let silent = || Error::Model(format!("{} has no noise", block.name));
        let noise = noise(&block).ok_or_else(silent)?;
        let null = null(&block, &noise);
        let moved = |column: usize| {
            let mut z = null.z.clone();
            z[column] += STEP;
            applied(&block.base, &null.unknowns, &z)
        };
        let values = null.values(&block.base);
        let sets: Vec<Vec<f64>> = std::iter::once(values.clone()).chain((0..null.z.len()).map(moved)).collect();
        let mut residuals = test.whitened(&noise, &sets);
        let held_out = residuals.remove(0);
        let columns: Vec<DVector<f64>> = residuals.into_iter().map(|with| (with - &held_out) / STEP).collect();
        let held_out_jacobian = match columns.is_empty() {
            true => DMatrix::zeros(held_out.len(), 0),
            false => DMatrix::from_columns(&columns),
        };
        Ok(Self { block, noise, null, values, held_out, held_out_jacobian })
    }

    /// The bank of a library on these recordings.
    pub(super) fn bank(&self, library: &[Hypothesis]) -> Bank {
        let learn = self.block.part(false);
        let shortcut = learn.shortcut(&self.noise, &self.block.base);
        Bank::simulate(library, &self.null, &self.block.base, &|sets| shortcut.whitened(sets))
    }

    /// Whitened residuals of other recordings of the same motions at the null hypothesis of these: to learn from, held out.
    pub(super) fn residuals(&self, mut other: MeasuredBlock) -> [DVector<f64>; 2] {
        // Judged at the samples that the noise of these recordings allows.
        other.decimator = self.block.decimator.clone();
        let of = |held_out| other.part(held_out).whitened(&self.noise, std::slice::from_ref(&self.values)).remove(0);
        [of(false), of(true)]
    }
}

/// The noise of recordings with nothing hidden: by their repeats or quiet stretches, or, where every recording has its own
/// commands, what the nuisances leave of them.
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
    let learn = block.part(false);
    let start = Start::nominal(block.nuisances.clone());
    let shortcut = learn.shortcut(noise, &block.base);
    fit(vec![start], &block.base, block.quotient(), &|sets| shortcut.whitened(sets)).remove(0)
}
