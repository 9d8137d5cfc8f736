//! Residuals of readings in steps: what is beyond the step that was read.

use super::MeasuredBlock;
use crate::inference::noise::mean;
use crate::steps::{by_channel, of_both};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use softdock_engine::decimator::Decimator;

/// Parameter sets whose raw outputs are held at once.
const MOST_SETS: usize = 16;

/// Residuals that are nothing wherever the true value lies in the step that was read.
///
/// A model of the steps themselves fits worse in every place but the right one, with no slope towards it: a bias and a
/// drift about the middle of a session fit as well a step off in most recordings. What lies in the right step at every
/// instant is, of readings that are linear in them, a convex set of parameters (set-membership estimation: Milanese and
/// Vicino, Automatica 27, 1991).
pub struct DeadZone {
    /// The block, all samples of which are compared.
    raw: MeasuredBlock,
    decimator: Decimator,
    /// Half a step of each channel, in its unit.
    half: Vec<f64>,
    /// Step of the forces, in N; that of the moments over the sensor's lever where those alone lie on steps.
    pub step: f64,
}

impl DeadZone {
    /// Of a block whose readings lie on steps; `None` if they do not.
    pub fn of(block: &MeasuredBlock) -> Option<Self> {
        let steps @ [force, moment] = of_both(block);
        let by_moment = || Some(moment?.size / block.base[block.field("lever")]);
        let step = force.map(|step| step.size).or_else(by_moment)?;
        let raw = MeasuredBlock { decimator: Decimator::none(), ..block.clone() };
        let half = by_channel(steps, |step| 0.5 * step.size);
        Some(Self { raw, decimator: block.decimator.clone(), half, step })
    }

    /// Residuals of all experiments, averaged over repeats, in standard deviations of the healthy noise, one after the
    /// other, for every parameter set; within the step that was read such a share of them counts.
    pub fn residuals(&self, within: f64, sets: &[Vec<f64>]) -> Vec<DVector<f64>> {
        let part = self.raw.part(false);
        let of_set = |trials: Vec<DMatrix<f64>>| {
            let beyond: Vec<DMatrix<f64>> = trials.into_iter().map(|residual| self.beyond(within, &residual)).collect();
            let means = part.experiments.iter().map(|(_, members)| mean(&super::cut(members, &beyond)));
            super::bounded(means.flat_map(|own| own.as_slice().to_vec()).collect())
        };
        let batch = |sets: &[Vec<f64>]| -> Vec<DVector<f64>> {
            part.of_trials(&part.all(), sets).into_par_iter().map(of_set).collect()
        };
        sets.chunks(MOST_SETS).flat_map(batch).collect()
    }

    /// What of a recording's residual is beyond half a step, low-passed, in standard deviations of the healthy noise.
    fn beyond(&self, within: f64, residual: &DMatrix<f64>) -> DMatrix<f64> {
        let of = |(channel, half): (usize, &f64)| {
            let scaled = |r: &f64| outside(*r, *half, within) / self.raw.known_noise[channel];
            self.decimator.pass(residual.row(channel).iter().map(scaled).collect(), 1)
        };
        super::table(self.half.iter().enumerate().map(of).collect())
    }
}

/// What of a residual is further from nothing than `half`, and such a share of the rest.
fn outside(residual: f64, half: f64, within: f64) -> f64 {
    residual - (1.0 - within) * residual.clamp(-half, half)
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
            assert!((outside(residual, half, within) - left).abs() < 1e-12, "{residual} within {half}");
        }
    }
}
