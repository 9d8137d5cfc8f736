//! Residuals of readings in steps: what is beyond the step that was read.

use super::part::{MOST_SETS, bounded};
use super::{Part, Trial};
use crate::steps::{by_channel, of_both};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use softdock_engine::blocks::{BlockKind, Reading, Tolerance, beyond};

/// Residuals that are nothing wherever the true value lies in the step that was read.
///
/// A model of the steps themselves fits worse in every place but the right one, with no slope towards it: a bias and a
/// drift about the middle of a session fit as well a step off in most recordings. What lies in the right step at every
/// instant is, of readings that are linear in them, a convex set of parameters (set-membership estimation: Milanese and
/// Vicino, Automatica 27, 1991).
pub struct DeadZone<'a> {
    /// The recordings that are learnt from.
    learn: &'a Part<'a>,
    readings: Vec<Reading<'a>>,
    /// Half a step of each channel, in its unit.
    half: Vec<f64>,
    /// Step of the forces, in N; that of the moments over the sensor's lever where those alone lie on steps.
    pub step: f64,
}

impl<'a> DeadZone<'a> {
    /// Of a sensor's recordings to learn from, whose readings lie on steps; `None` if they do not.
    pub fn of(learn: &'a Part<'a>) -> Option<Self> {
        let block = learn.block;
        let steps @ [force, moment] = of_both(block);
        let by_moment = || Some(moment?.size / block.base[block.field("lever")]);
        let step = force.map(|step| step.size).or_else(by_moment)?;
        let learnt = block.trials.iter().filter(|trial| !trial.held_out);
        let reading = |trial: &'a Trial| {
            let samples = 0..trial.measured[0].len();
            let outputs = samples.flat_map(|k| trial.measured.iter().map(move |row| row[k])).collect();
            Reading { recorded: &trial.recorded, outputs }
        };
        let half = by_channel(steps, |step| 0.5 * step.size);
        Some(Self { learn, readings: learnt.map(reading).collect(), half, step })
    }

    /// Residuals of all experiments, low-passed, averaged over repeats, in standard deviations of the healthy noise, one
    /// after the other, for every parameter set, by CPU lanes; within the step that was read such a share of them counts.
    pub fn residuals(&self, within: f64, sets: &[Vec<f64>]) -> Vec<DVector<f64>> {
        let tolerance = Tolerance { half: self.half.clone(), within };
        let batch = |sets: &[Vec<f64>]| -> Vec<DVector<f64>> {
            let left = beyond(BlockKind::Sensor, &self.readings, sets, &self.learn.block.decimator, &tolerance);
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
    fn what_lies_in_the_step_that_was_read_counts_for_little_or_nothing() {
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
