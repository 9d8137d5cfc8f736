//! Block from wrench to motion of a free body, from recordings of a test rig.

use crate::data::bandwidth::judged_steps;
use crate::data::grid::Piece;
use crate::data::smooth::motion;
use crate::model::block::{MeasuredBlock, MeasuredOutput, Trial};
use crate::model::place;
use softdock_campaign::rig::BodyRig;
use softdock_engine::blocks::BlockKind;
use softdock_engine::decimator::Decimator;
use softdock_kernels::block::Recorded;
use softdock_kernels::fields::to_vec;

/// Longest step of the simulation \[s\].
const LONGEST_STEP: f64 = 2e-3;
/// Largest decimation factor: booms oscillate at up to a tenth of the sampling rate.
const MOST_STEPS: usize = 4;
/// A wrench jumps where it changes by more than so many times its median change.
const JUMP: f64 = 10.0;
/// Standard deviations of the clock's offset within which a jump may be.
const SURE: f64 = 3.0;

/// Input signals.
pub const WRENCH: [&str; 6] = ["force.x", "force.y", "force.z", "moment.x", "moment.y", "moment.z"];
/// Measured signals, in the order of the block's outputs.
pub const MOTION: [(&str, &str); 6] = [
    ("acceleration.x", "m/s^2"),
    ("acceleration.y", "m/s^2"),
    ("acceleration.z", "m/s^2"),
    ("rate.x", "rad/s"),
    ("rate.y", "rad/s"),
    ("rate.z", "rad/s"),
];

/// Builds the block from the recordings of a body. `held_out` decides by the name of the experiment.
///
/// Position and attitude are not compared: accelerometer and gyroscope show every effect, without integrating the
/// disturbances twice.
pub fn body_block(rig: &BodyRig, pieces: &[Piece], held_out: &dyn Fn(&str) -> bool, finer: usize) -> MeasuredBlock {
    let base = to_vec(&rig.values);
    let steps = MOTION.iter().map(|row| judged_steps(pieces, row.0)).min().unwrap_or(MOST_STEPS);
    let channel =
        |(output, row): (usize, &(&'static str, &'static str))| MeasuredOutput { name: row.0, output, unit: row.1 };
    let clock = rig.tolerance.iter().find(|row| row.0 == "clock_offset").map_or(0.0, |row| row.1);
    let channels = MOTION.iter().enumerate().map(channel).collect();
    MeasuredBlock {
        trials: pieces.iter().map(|piece| trial(piece, held_out(&piece.experiment), finer, clock)).collect(),
        decimator: Decimator::new(steps.min(MOST_STEPS)),
        ..MeasuredBlock::of(BlockKind::Body.into(), place::BODY.name, base, &rig.tolerance, channels)
    }
}

fn trial(piece: &Piece, held_out: bool, finer: usize, clock: f64) -> Trial {
    let each = (piece.step / LONGEST_STEP).ceil() as usize * finer;
    let steady = steady(piece, clock);
    let rate = ["rate.x", "rate.y", "rate.z"]
        .map(|signal| motion(&piece.signals[signal], piece.step, 0.5 / piece.step, each).value);
    let instants = rate[0].len();
    let (mut inputs, mut late) = (Vec::with_capacity(4 * instants), Vec::with_capacity(6 * instants));
    for i in 0..instants {
        inputs.extend([rate[0][i], rate[1][i], rate[2][i], if steady[i / each] { 1.0 } else { 0.0 }]);
        // A wrench acts from its stamp to the next: over the step that ends here it is that of the stamp before.
        late.extend(WRENCH.map(|signal| piece.signals[signal][i.saturating_sub(1) / each]));
    }
    let measured = |(channel, row): (usize, &(&str, &str))| -> Vec<f64> {
        let samples = piece.signals[row.0].iter().zip(&steady);
        samples.map(|(value, steady)| if channel < 3 && !steady { 0.0 } else { *value }).collect()
    };
    Trial {
        experiment: piece.experiment.clone(),
        held_out,
        recorded: Recorded {
            step: piece.step / each as f64,
            instants,
            stride: each,
            inputs,
            late,
            offsets: Vec::new(),
        },
        measured: MOTION.iter().enumerate().map(measured).collect(),
    }
}

/// Rows at which the wrench does not jump within what the clocks are off: elsewhere an acceleration is not known.
fn steady(piece: &Piece, clock: f64) -> Vec<bool> {
    let mut steady = vec![true; piece.samples()];
    let reach = (SURE * clock / piece.step).ceil().max(1.0) as usize - 1;
    for signal in WRENCH {
        let changes: Vec<f64> = piece.signals[signal].windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
        let mut sorted = changes.clone();
        sorted.sort_by(f64::total_cmp);
        let least = (JUMP * sorted[sorted.len() / 2]).max(f64::MIN_POSITIVE);
        for (row, _) in changes.iter().enumerate().filter(|(_, change)| **change > least) {
            let last = steady.len() - 1;
            steady[(row + 1).saturating_sub(reach)..=(row + 1 + reach).min(last)].fill(false);
        }
    }
    steady
}
