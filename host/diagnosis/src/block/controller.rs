//! The block from reference to torque of a joint's controller, from a rig's recordings.

use super::{Channel, MeasuredBlock, Trial, judged_steps, nuisances};
use crate::recording::grid::Piece;
use crate::recording::smooth::{Decimator, motion};
use softdock_campaign::rig::{ControllerRig, DriveRig};
use softdock_engine::blocks::Kind;
use softdock_kernels::block::Recorded;
use softdock_kernels::fields::to_vec;

/// The block of a controller's recordings, one step a period; `held_out` of an experiment's name.
pub fn controller_block(
    rig: &DriveRig,
    controller: &ControllerRig,
    pieces: &[Piece],
    held_out: &dyn Fn(&str) -> bool,
) -> MeasuredBlock {
    let trial = |piece: &Piece| trial(controller, piece, held_out(&piece.experiment));
    let base = to_vec(&controller.values);
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
        quiet: Vec::new(),
    }
}

fn trial(controller: &ControllerRig, piece: &Piece, held_out: bool) -> Trial {
    let each = (piece.step / controller.period).round().max(1.0) as usize;
    let nyquist = 0.5 / piece.step;
    let q = motion(&piece.signals["q"], piece.step, nyquist, each);
    let r = motion(&piece.signals["ref"], piece.step, nyquist, each);
    let f = controller.feedforward;
    let mut late = Vec::with_capacity(r.value.len() * 4);
    for i in 0..r.value.len() {
        let dry = f.coulomb * (r.rate[i] / f.coulomb_speed).tanh();
        let weight = f.gravity_torque * (r.value[i] - f.gravity_angle).cos();
        late.extend([r.value[i], r.rate[i], r.acceleration[i], dry + weight]);
    }
    let instants = q.value.len();
    let inputs = q.value.iter().zip(&q.rate).flat_map(|(angle, rate)| [*angle, *rate]).collect();
    Trial {
        experiment: piece.experiment.clone(),
        held_out,
        recorded: Recorded { step: piece.step / each as f64, instants, stride: each, inputs, late },
        measured: vec![piece.signals["tau"].clone()],
    }
}
