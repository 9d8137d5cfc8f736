//! Signals for the baseline methods: mean of the repeats, differentiated by Savitzky-Golay filters, and the torques
//! that nominal plant and controller do not explain.

use crate::recordings_folder::files;
use crate::{GauntletError, Result};
use nalgebra::DMatrix;
use softdock_campaign::Rig;
use softdock_campaign::rig::{DriveRig, RigModel};
use softdock_diagnosis::data::grid::{Piece, read};
use std::collections::BTreeMap;
use std::path::Path;

/// Samples on either side of one that its polynomial is fitted to: 84 ms in all at 250 Hz.
const HALF: usize = 10;
/// Degree of the polynomials: the fourth derivative is the last that is used.
const DEGREE: usize = 4;

/// One sample.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sample {
    /// Time since the recording began \[s\].
    pub(super) time: f64,
    /// Angle and its first four derivatives \[rad, s\].
    pub(super) angle: [f64; 5],
    /// Reference with its first two derivatives.
    pub(super) reference: [f64; 3],
    /// Torque and its first derivative \[N m, s\].
    pub(super) torque: [f64; 2],
    /// Torque beyond what the nominal plant needs for the motion \[N m\].
    pub(super) unexplained: f64,
    /// Torque beyond the command of the nominal controller \[N m\].
    pub(super) unasked: f64,
}

/// Samples of all experiments, with the nominal plant.
pub(super) struct Signals {
    pub(super) samples: Vec<Sample>,
    pub(super) rig: DriveRig,
}

impl Signals {
    /// Of a folder's training recordings.
    pub(super) fn read(folder: &Path) -> Result<Self> {
        let rig =
            Rig::load(&folder.join("model.toml")).map_err(|problems| GauntletError::Model(problems.to_string()))?;
        let mut repeats: BTreeMap<String, Vec<Piece>> = BTreeMap::new();
        for file in files(&folder.join("training"))? {
            for piece in read(&file, &rig)?.0 {
                repeats.entry(piece.experiment.clone()).or_default().push(piece);
            }
        }
        let RigModel::Drive(drive) = rig.plant else {
            return Err(GauntletError::Model("the baseline methods support drives only".to_owned()));
        };
        let samples = repeats.values().flat_map(|list| samples(&drive, list)).collect();
        Ok(Self { samples, rig: *drive })
    }
}

/// The samples of an experiment, its repeats averaged; those near the ends, which have no polynomial, left out.
fn samples(rig: &DriveRig, repeats: &[Piece]) -> Vec<Sample> {
    let count = repeats.iter().map(Piece::samples).min().unwrap_or(0);
    let mean = |signal: &str| -> Vec<f64> {
        let at = |i: usize| repeats.iter().map(|piece| piece.signals[signal][i]).sum::<f64>() / repeats.len() as f64;
        (0..count).map(at).collect()
    };
    let (q, reference, torque) = (mean("q"), mean("ref"), mean("tau"));
    let step = repeats[0].step;
    let filter = savitzky_golay(step);
    let derivative = |series: &[f64], i: usize, order: usize| -> f64 {
        filter.row(order).iter().zip(&series[i - HALF..=i + HALF]).map(|(weight, value)| weight * value).sum()
    };
    let sample = |i: usize| {
        let angle = std::array::from_fn(|order| derivative(&q, i, order));
        let reference = std::array::from_fn(|order| derivative(&reference, i, order));
        let torque = [derivative(&torque, i, 0), derivative(&torque, i, 1)];
        let sample = Sample { time: i as f64 * step, angle, reference, torque, ..Sample::default() };
        Sample { unexplained: torque[0] - needed(rig, &sample), unasked: torque[0] - asked(rig, &sample), ..sample }
    };
    (HALF..count.saturating_sub(HALF)).map(sample).collect()
}

/// Torque that the nominal plant needs for a motion.
fn needed(rig: &DriveRig, sample: &Sample) -> f64 {
    let [q, v, a, ..] = sample.angle;
    let p = &rig.values;
    (p.motor_inertia + rig.link_inertia) * a
        + p.viscous * v
        + p.coulomb * direction(v)
        + rig.gravity_torque * (q - rig.gravity_angle).cos()
}

/// Torque that the nominal controller asks for.
fn asked(rig: &DriveRig, sample: &Sample) -> f64 {
    let Some(controller) = &rig.controller else {
        return 0.0;
    };
    let ([q, v, ..], [r, r1, r2]) = (sample.angle, sample.reference);
    let (p, f) = (&controller.values, &controller.feedforward);
    p.position_gain * (r - q)
        + p.velocity_gain * (r1 - v)
        + p.inertia * r2
        + p.viscous * r1
        + p.coulomb * (r1 / p.coulomb_speed).tanh()
        + f.gravity_torque * (r - f.gravity_angle).cos()
}

/// Sign of a speed, without a step that no differentiated recording has \[rad/s\].
pub(super) fn direction(speed: f64) -> f64 {
    (speed / 2e-3).tanh()
}

/// Weights by which neighbouring samples give value and derivatives in their middle: least squares of a polynomial
/// (Savitzky and Golay, Anal. Chem. 36 (1964)); one row an order.
fn savitzky_golay(step: f64) -> DMatrix<f64> {
    let width = 2 * HALF + 1;
    // In units of half the width, so that the powers stay of one size.
    let place = |i: usize| (i as f64 - HALF as f64) / HALF as f64;
    let powers = DMatrix::from_fn(width, DEGREE + 1, |i, order| place(i).powi(order as i32));
    let fitted = powers.pseudo_inverse(1e-12).expect("the tolerance is positive");
    let unit = HALF as f64 * step;
    let factor = |order: usize| (1..=order).map(|k| k as f64).product::<f64>() / unit.powi(order as i32);
    DMatrix::from_fn(DEGREE + 1, width, |order, i| factor(order) * fitted[(order, i)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_of_a_polynomial_are_exact() {
        let (step, filter) = (0.004, savitzky_golay(0.004));
        let series: Vec<f64> = (0..2 * HALF + 1)
            .map(|i| {
                let t = (i as f64 - HALF as f64) * step;
                1.0 + 2.0 * t + 3.0 * t * t + 4.0 * t.powi(3) + 5.0 * t.powi(4)
            })
            .collect();
        for (order, expected) in [1.0, 2.0, 6.0, 24.0, 120.0].into_iter().enumerate() {
            let found: f64 = filter.row(order).iter().zip(&series).map(|(weight, value)| weight * value).sum();
            assert!((found - expected).abs() < 1e-5 * expected, "order {order}: {found}");
        }
    }
}
