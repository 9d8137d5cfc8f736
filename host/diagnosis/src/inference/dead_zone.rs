//! Residuals of quantised readings: the part beyond the quantisation step.

use crate::inference::recordings::{BlockRecordings, MOST_SETS, bounded};
use crate::model::block::{ReadingSteps, Trial};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use softdock_engine::blocks::{BlockKind, Reading, Tolerance, beyond};
use softdock_engine::section::Section;

/// Residuals that are zero wherever the true value lies within the quantisation step of the reading.
///
/// A model of the quantisation itself has no slope towards the right parameters: a bias and a drift about the middle of
/// a session fit as well one step off in most recordings. The parameters that keep every reading within its step form a
/// convex set, if readings are linear in them (set-membership estimation: Milanese and Vicino, Automatica 27, 1991).
pub struct DeadZone<'a> {
    /// The recordings that are learnt from.
    learn: &'a BlockRecordings<'a>,
    kind: BlockKind,
    readings: Vec<Reading<'a>>,
    /// Half a step of each channel, in its unit.
    half: Vec<f64>,
    /// Name of the quantisation's size parameter.
    pub size: &'static str,
    /// Its value, by the steps.
    pub step: f64,
}

impl<'a> DeadZone<'a> {
    /// Builds the dead zone from training recordings; `None` if the readings are not quantised.
    pub fn of(learn: &'a BlockRecordings<'a>) -> Option<Self> {
        let block = learn.block;
        let Section::Block(kind) = block.section else { return None };
        let quantisation = block.quantisation?;
        let ReadingSteps { steps, size: step } = (quantisation.steps)(block)?;
        let learnt = block.trials.iter().filter(|trial| !trial.held_out);
        let reading = |trial: &'a Trial| {
            let samples = 0..trial.measured[0].len();
            let outputs = samples.flat_map(|k| trial.measured.iter().map(move |row| row[k])).collect();
            Reading { recorded: &trial.recorded, outputs }
        };
        let half = steps.iter().map(|step| 0.5 * step).collect();
        Some(Self { learn, kind, readings: learnt.map(reading).collect(), half, size: quantisation.size, step })
    }

    /// Returns the residuals of all experiments for every parameter set, simulated by CPU lanes: low-passed, averaged
    /// over repeats, in standard deviations of the healthy noise, concatenated. `within` is the weight of the part
    /// inside the quantisation step.
    pub fn residuals(&self, within: f64, sets: &[Vec<f64>]) -> Vec<DVector<f64>> {
        let tolerance = Tolerance { half: self.half.clone(), within };
        let batch = |sets: &[Vec<f64>]| -> Vec<DVector<f64>> {
            let left = beyond(self.kind, &self.readings, sets, &self.learn.block.decimator, &tolerance);
            let of_set = |set: usize| self.averaged(left.iter().map(|own| own[set].as_slice()));
            (0..sets.len()).into_par_iter().map(of_set).collect()
        };
        sets.chunks(MOST_SETS).flat_map(batch).collect()
    }

    /// Means of the repeats, in standard deviations of the healthy noise, of what is left of each reading.
    fn averaged<'r>(&self, left: impl Iterator<Item = &'r [f64]>) -> DVector<f64> {
        let noise = &self.learn.block.known_noise;
        let scaled = |own: &[f64]| {
            DMatrix::from_fn(noise.len(), own.len() / noise.len(), |c, k| own[k * noise.len() + c] / noise[c])
        };
        let trials: Vec<DMatrix<f64>> = left.map(scaled).collect();
        let means = self.learn.averaged(&trials).into_iter();
        bounded(means.flat_map(|own| Vec::from(own.data)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn residual_within_the_quantisation_step_has_little_weight() {
        for (residual, half, within, left) in [
            (1.9, 2.0, 0.0, 0.0),
            (-1.9, 2.0, 0.1, -0.19),
            (2.5, 2.0, 0.0, 0.5),
            (-2.5, 2.0, 0.1, -0.7),
            (0.3, 0.0, 0.0, 0.3),
        ] {
            let tolerance = Tolerance { half: vec![half], within };
            assert!((tolerance.beyond(0, residual) - left).abs() < 1e-12, "{residual} within {half}");
        }
    }
}
