//! The block from reference to torque of a joint's controller, from a rig's recordings.

use super::{Channel, MeasuredBlock, Trial, judged_steps, nuisances};
use crate::recording::grid::Piece;
use crate::recording::smooth::{Decimator, motion};
use softdock_campaign::rig::{ControllerRig, DriveRig};
use softdock_engine::blocks::{Kind, simulate};
use softdock_kernels::block::Recorded;
use softdock_kernels::block::controller::ControllerValues;
use softdock_kernels::fields::to_vec;

/// The block of a controller's recordings, one step a period; `held_out` of an experiment's name.
pub fn controller_block(
    rig: &DriveRig,
    controller: &ControllerRig,
    pieces: &[Piece],
    held_out: &dyn Fn(&str) -> bool,
) -> MeasuredBlock {
    let trial = |piece: &Piece| trial(controller, piece, held_out(&piece.experiment));
    let period = pieces.first().map_or(controller.period, |piece| piece.step / steps(controller, piece) as f64);
    let base = to_vec(&ControllerValues { period, ..controller.values });
    let clock: Vec<_> = rig.tolerance.iter().copied().filter(|(name, _)| *name == "clock_offset").collect();
    MeasuredBlock {
        kind: Kind::Controller,
        name: "R2 reference to torque",
        nuisances: nuisances(Kind::Controller, &base, &clock),
        base,
        channels: vec![Channel { name: "torque", output: 0, unit: if rig.prismatic { "N" } else { "N m" } }],
        trials: pieces.iter().map(trial).collect(),
        decimator: Decimator::new(judged_steps(pieces, "tau")),
        clock: None,
    }
}

/// The torque of each recording at every period of the controller: what the controller asked for by a parameter set, with
/// what was measured beyond that at the log's samples; between those that is band-limited.
///
/// A reference that is held or limited makes torque jump between two samples of the log, which no interpolation of
/// these shows.
pub fn torque_between(block: &MeasuredBlock, set: &[f64]) -> Vec<Vec<f64>> {
    let each = |trial: &Trial| {
        let recorded = Recorded { stride: 1, ..trial.recorded.clone() };
        let mut asked = simulate(Kind::Controller, &[&recorded], &[set.to_vec()]).remove(0).remove(0);
        let stride = trial.recorded.stride;
        let beyond: Vec<f64> =
            trial.measured[0].iter().zip(asked.iter().step_by(stride)).map(|(tau, asked)| tau - asked).collect();
        let step = trial.recorded.step * stride as f64;
        let beyond = motion(&beyond, step, 0.5 / step, stride).value;
        asked.iter_mut().zip(beyond).for_each(|(asked, beyond)| *asked += beyond);
        asked
    };
    block.trials.iter().map(each).collect()
}

/// Periods of the controller in one of the log.
fn steps(controller: &ControllerRig, piece: &Piece) -> usize {
    (piece.step / controller.period).round().max(1.0) as usize
}

fn trial(controller: &ControllerRig, piece: &Piece, held_out: bool) -> Trial {
    let each = steps(controller, piece);
    let nyquist = 0.5 / piece.step;
    let q = motion(&piece.signals["q"], piece.step, nyquist, each);
    let r = motion(&piece.signals["ref"], piece.step, nyquist, each);
    let f = controller.feedforward;
    let mut late = Vec::with_capacity(r.value.len() * 5);
    for i in 0..r.value.len() {
        let (sin, cos) = (r.value[i] - f.gravity_angle).sin_cos();
        late.extend([r.value[i], r.rate[i], r.acceleration[i], f.gravity_torque * cos, -f.gravity_torque * sin]);
    }
    let instants = q.value.len();
    // The controller runs a period ahead of its log.
    let next = (0..instants).map(|i| (i + 1).min(instants - 1));
    let inputs = next.flat_map(|i| [q.value[i], q.rate[i]]).collect();
    Trial {
        experiment: piece.experiment.clone(),
        held_out,
        recorded: Recorded { step: piece.step / each as f64, instants, stride: each, inputs, late },
        measured: vec![piece.signals["tau"].clone()],
    }
}
