//! The block from command sent to command received, from recordings of both.

use super::{Channel, MeasuredBlock, Trial, nuisances};
use crate::packets::lost;
use crate::recording::grid::Piece;
use crate::recording::smooth::{Decimator, motion};
use softdock_campaign::rig::CommandRig;
use softdock_engine::blocks::Kind;
use softdock_kernels::block::Recorded;
use softdock_kernels::block::command::CommandValues;
use softdock_kernels::fields::to_vec;

/// Samples that one judged sample stands for: a hold shows at the rate of its packets, up to half that of the samples.
const STEPS: usize = 1;
/// Time after a recording's start for which it is not known what was sent before \[s\].
const LEAD: f64 = 0.05;
/// Half width over standard deviation of a uniform distribution.
const UNIFORM: f64 = 1.732_050_8;
/// Restlessness of a delay that nothing is known of, as a share of the packets' period.
const RESTLESSNESS: f64 = 0.01;
/// Rate below which the noise is not the delay's alone, as a share of the root mean square.
const LEAST_RATE: f64 = 0.01;

/// What is fed, and what is measured.
pub const INPUTS: [&str; 1] = ["sent"];
/// See [`INPUTS`].
pub const OUTPUTS: [&str; 1] = ["received"];

/// The block of a command's recordings; `held_out` of an experiment's name.
pub fn command_block(
    rig: &CommandRig,
    pieces: &[Piece],
    held_out: &dyn Fn(&str) -> bool,
    finer: usize,
) -> MeasuredBlock {
    let restlessness = rig.delay_noise.unwrap_or(RESTLESSNESS * rig.period);
    let base = to_vec(&CommandValues { blur: UNIFORM * restlessness, ..rig.values });
    let lost = lost(rig, pieces);
    let trial = |(piece, lost): (&Piece, &Vec<bool>)| {
        let slowest = slowest(rig, piece, restlessness);
        trial(rig, piece, lost, slowest, held_out(&piece.experiment), finer)
    };
    MeasuredBlock {
        kind: Kind::Command,
        name: "R1 command sent to command received",
        nuisances: nuisances(Kind::Command, &base, &rig.tolerance),
        base,
        channels: vec![Channel { name: "received", output: 0, unit: "s" }],
        trials: pieces.iter().zip(&lost).map(trial).collect(),
        decimator: Decimator::new(STEPS),
        clock: None,
    }
}

/// Rate at which a restless delay and the rounding of both commands make the same noise.
fn slowest(rig: &CommandRig, piece: &Piece, restlessness: f64) -> f64 {
    let sent = &piece.signals["sent"];
    let power = sent.windows(2).map(|pair| ((pair[1] - pair[0]) / piece.step).powi(2)).sum::<f64>();
    let usual = (power / (sent.len() - 1) as f64).sqrt();
    (rig.quantum / 6_f64.sqrt() / restlessness).max(LEAST_RATE * usual).max(f64::MIN_POSITIVE)
}

/// Rows that brought no packet weigh nothing, as does the start.
fn trial(rig: &CommandRig, piece: &Piece, lost: &[bool], slowest: f64, held_out: bool, finer: usize) -> Trial {
    let step = piece.step / finer as f64;
    let sent = motion(&piece.signals["sent"], piece.step, 0.5 / piece.step, finer);
    let instants = sent.value.len();
    let known = (rig.values.transport_delay / step).round() as usize;
    let weight = |i: usize| {
        let silent = i as f64 * step < LEAD || lost[i / finer];
        if silent { 0.0 } else { 1.0 / sent.rate[i.saturating_sub(known)].hypot(slowest) }
    };
    let inputs = (0..instants).flat_map(|i| [weight(i), i as f64 * step]).collect();
    let late = (0..instants).flat_map(|i| [sent.value[i], 0.5 * step * step * sent.acceleration[i]]).collect();
    let received = piece.signals["received"].iter().enumerate();
    Trial {
        experiment: piece.experiment.clone(),
        held_out,
        measured: vec![received.map(|(i, value)| value * weight(i * finer)).collect()],
        recorded: Recorded { step, instants, stride: finer, inputs, late },
    }
}
