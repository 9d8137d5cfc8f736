//! Relative torque error of a model as in identification papers: RMS of the low-passed difference of measured and
//! modelled torque, over the RMS of the measured torque.

use crate::data::smooth::motion;
use crate::inference::fit::Fitted;
use crate::model::block::{MeasuredBlock, Trial};
use nalgebra::DMatrix;
use serde::Serialize;
use softdock_kernels::block::drive::OBSERVER;
use statrs::statistics::Statistics;

/// Share by which a torque error may rise by chance.
pub(crate) const RISE: f64 = 0.1;
/// Time that is left out at both ends, where the low-pass rings \[s\].
const ENDS: f64 = 0.1;

/// Relative torque errors of a model, with and without the identified effects.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TorqueError {
    /// Of the nominal model, within its tolerances.
    pub before: f64,
    /// With the answer.
    pub after: f64,
    /// Root mean square of the measured torque below the cut-off \[N m\], of a sliding joint \[N\].
    pub measured_rms: f64,
    /// Cut-off of the low-pass \[Hz\].
    pub cutoff_hz: f64,
}

impl TorqueError {
    /// Computes the errors of a drive's block with two fits, on held-out or training motion; `None` for other blocks
    /// and for recordings too slow for the low-pass.
    pub fn of(block: &MeasuredBlock, held_out: bool, [before, after]: [&Fitted; 2]) -> Option<Self> {
        Self::of_each(block, held_out, before, &[after])?.pop()
    }

    /// Computes the errors of several fits beside that of one, which is simulated once; `None` as for
    /// [`of`](Self::of).
    pub(crate) fn of_each(
        block: &MeasuredBlock,
        held_out: bool,
        before: &Fitted,
        after: &[&Fitted],
    ) -> Option<Vec<Self>> {
        let cutoff = cutoff(block, held_out)?;
        let measured = measured_rms(block, held_out, cutoff)?;
        let error = |fitted: &Fitted| Some(missing(block, held_out, &fitted.values(&block.base), cutoff)? / measured);
        let before = error(before)?;
        after
            .iter()
            .map(|after| Some(Self { before, after: error(after)?, measured_rms: measured, cutoff_hz: cutoff }))
            .collect()
    }

    /// Returns whether the error with the answer is larger by more than a tenth.
    pub(crate) fn rises(&self) -> bool {
        self.after > (1.0 + RISE) * self.before
    }
}

/// Torque that a model of an axis lacks on held-out motion or on what was fitted, over the root of what its link resists
/// turning with \[N/kg^(1/2)\]; `None` as for [`TorqueError::of`].
///
/// An axis whose link acceleration differs by `a` from the computed one lacks `M_ii a` itself, and adds `M_ij a` to
/// another axis: as `M_ij^2 < M_ii M_jj`, its own is the larger of the two by this measure, however light its link is.
pub(crate) fn lacking(block: &MeasuredBlock, held_out: bool, fitted: &Fitted) -> Option<f64> {
    let torque = missing(block, held_out, &fitted.values(&block.base), cutoff(block, held_out)?)?;
    let inertia = block.firsts(held_out).into_iter().flat_map(|trial| link_inertias(block, trial)).mean();
    (inertia > 0.0).then(|| torque / inertia.sqrt())
}

/// Cut-off for a drive's block \[Hz\]; `None` for other blocks and for recordings too slow for it.
fn cutoff(block: &MeasuredBlock, held_out: bool) -> Option<f64> {
    let first = block.trials.iter().find(|trial| trial.held_out == held_out)?;
    block.torque_cutoff.filter(|cutoff| *cutoff <= 0.5 / block.judged_step(first))
}

/// Root mean square of the torque that a model lacks.
///
/// A missing torque T moves the simulated angle off by `e`, held by the observer of the block:
/// `T = J (e'' + 2 w e' + w^2 e)`.
fn missing(block: &MeasuredBlock, held_out: bool, set: &[f64], cutoff: f64) -> Option<f64> {
    let field = |name: &str| set[block.field(name)];
    let own = field("motor_inertia") + field("inertia_error");
    let firsts = block.firsts(held_out);
    let step = block.judged_step(firsts.first()?);
    let torque = |(residual, trial): (DMatrix<f64>, &Trial)| -> Vec<f64> {
        let e = motion(&residual.row(0).iter().copied().collect::<Vec<_>>(), step, cutoff, 1);
        let at = |i: usize| e.acceleration[i] + 2.0 * OBSERVER * e.rate[i] + OBSERVER * OBSERVER * e.value[i];
        link_inertias(block, trial).take(e.value.len()).enumerate().map(|(i, link)| (own + link) * at(i)).collect()
    };
    root_mean_square(block.part(held_out).means(set).into_iter().zip(firsts).map(torque), step)
}

/// Inertia of the link at the judged samples of a recording.
fn link_inertias<'a>(block: &MeasuredBlock, trial: &'a Trial) -> impl Iterator<Item = f64> + use<'a> {
    let (decimator, stride) = (&block.decimator, trial.recorded.stride);
    block.input(trial, "inertia").skip(decimator.margin() * stride).step_by(decimator.every() * stride)
}

/// Root mean square of the measured torque.
fn measured_rms(block: &MeasuredBlock, held_out: bool, cutoff: f64) -> Option<f64> {
    let trials = block.trials.iter().filter(|trial| trial.held_out == held_out);
    let step = block.trials.first()?.recorded.step;
    root_mean_square(trials.map(|trial| motion(&trial.recorded.late, step, cutoff, 1).value), step)
}

/// Root mean square of several series of equal steps \[s\], without their ends.
fn root_mean_square(series: impl Iterator<Item = Vec<f64>>, step: f64) -> Option<f64> {
    let ends = (ENDS / step) as usize;
    let inner = series.filter(|series| series.len() > 4 * ends);
    let (sum, count) = inner.fold((0.0, 0), |(sum, count), series| {
        let own = &series[ends..series.len() - ends];
        (sum + own.iter().map(|value| value * value).sum::<f64>(), count + own.len())
    });
    (count > 0).then(|| (sum / count as f64).sqrt())
}
