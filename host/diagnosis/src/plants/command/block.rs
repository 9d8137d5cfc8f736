//! Block from the command sent to the command received, from recordings of both.

use crate::data::grid::Piece;
use crate::data::smooth::{band_powers, motion};
use crate::model::block::{MeasuredBlock, MeasuredOutput, Trial};
use crate::model::place;
use crate::plants::command::packets::missed;
use softdock_campaign::rig::CommandRig;
use softdock_engine::blocks::BlockKind;
use softdock_engine::decimator::Decimator;
use softdock_kernels::block::Recorded;
use softdock_kernels::block::command::CommandValues;
use softdock_kernels::fields::to_vec;
use softdock_kernels::philox;

/// Decimation factor: a hold shows at the packet rate, up to half the sampling rate.
const STEPS: usize = 1;
/// Time at a recording's start and end that weighs nothing \[s\]: it is not known what was sent before, and smoothing rings.
const ENDS: f64 = 0.15;
/// Bands in which a command's power is compared with that of its rounding.
const BANDS: usize = 50;
/// By how much the command's band exceeds what stands out of its rounding: its smoothing must not ring for long.
const BAND: f64 = 4.0;
/// Half width over standard deviation of a uniform distribution.
const UNIFORM: f64 = 1.732_050_8;
/// Delay jitter assumed where the model file has none, as a share of the packet period.
const DELAY_JITTER: f64 = 0.01;
/// Rate below which the noise is not the delay's alone, as a share of the root mean square.
const LEAST_RATE: f64 = 0.3;

/// Width of the dither on what was received, in quanta: its variance is that of the rounding of a dozen repeats' mean.
const DITHER: f64 = 4.0;
/// Seed of the dither: the same data give the same answer.
const SEED: u64 = 3;

/// Input signals.
pub const INPUTS: [&str; 1] = ["sent"];
/// Measured signals.
pub const OUTPUTS: [&str; 1] = ["received"];

/// Builds the block from the recordings of a command. `held_out` decides by the name of the experiment.
pub fn command_block(
    rig: &CommandRig,
    pieces: &[Piece],
    held_out: &dyn Fn(&str) -> bool,
    finer: usize,
) -> MeasuredBlock {
    let delay_jitter = rig.delay_noise.unwrap_or(DELAY_JITTER * rig.period);
    let base = to_vec(&CommandValues { blur: UNIFORM * delay_jitter, ..rig.values });
    let longest = pieces.iter().map(|piece| piece.samples() as f64 * piece.step).fold(rig.period, f64::max);
    // Jitter may change the delay by the end of a recording, which resembles a clock skew of this size.
    let skew = [("clock_skew", delay_jitter / longest)];
    let tolerance = [&rig.tolerance[..], if rig.is_servo { &[] } else { &skew }].concat();
    let slowest = slowest(rig, pieces, delay_jitter);
    let missed = missed(rig, pieces);
    let trial = |piece: &Piece| {
        let repeats = pieces.iter().zip(&missed).filter(|(other, _)| other.experiment == piece.experiment);
        let silent = silent(piece, repeats.map(|(_, missed)| &missed.rows));
        trial(rig, piece, &silent, slowest, held_out(&piece.experiment), finer)
    };
    let channels = vec![MeasuredOutput { name: "received", output: 0, unit: "s" }];
    MeasuredBlock {
        trials: pieces.iter().map(trial).collect(),
        decimator: Decimator::new(STEPS),
        considered: vec![("limit_lag", delay_jitter)],
        ..MeasuredBlock::of(BlockKind::Command.into(), place::ECHO.name, base, &tolerance, channels)
    }
}

/// Returns the rate above which the noise is attributed to the delay: a share of the usual rate of all recordings, or more
/// where the rounding of both commands is as large as the effect of the jitter.
fn slowest(rig: &CommandRig, pieces: &[Piece], delay_jitter: f64) -> f64 {
    let power = |piece: &Piece| {
        let changes = piece.signals["sent"].windows(2);
        changes.map(|pair| ((pair[1] - pair[0]) / piece.step).powi(2)).sum::<f64>()
    };
    let rows = pieces.iter().map(|piece| piece.samples() - 1).sum::<usize>();
    let usual = (pieces.iter().map(power).sum::<f64>() / rows as f64).sqrt();
    (rig.quantum / 6_f64.sqrt() / delay_jitter).max(LEAST_RATE * usual).max(f64::MIN_POSITIVE)
}

/// Highest frequency \[Hz\] that a command is followed to: its rounding, the same in all repeats, would pass for an effect.
fn band(rig: &CommandRig, piece: &Piece) -> f64 {
    let (sent, nyquist) = (&piece.signals["sent"], 0.5 / piece.step);
    let samples = sent.len() as f64;
    // Of white noise behind the taper, whose mean square is 3/8.
    let rounding = rig.quantum.powi(2) / 12.0 * 0.375 * samples * samples / (2 * BANDS) as f64;
    let highest = band_powers(sent, BANDS).iter().rposition(|power| *power > 4.0 * rounding).unwrap_or(0);
    (BAND * nyquist * (highest + 1) as f64 / BANDS as f64).min(nyquist)
}

/// Returns the rows without information: the ends, and those missed by any repeat. A row that counts in some repeats
/// only would add the model error to the repeat-to-repeat variance.
fn silent<'a>(piece: &Piece, missed: impl Iterator<Item = &'a Vec<bool>>) -> Vec<bool> {
    let (rows, ends) = (piece.samples(), (ENDS / piece.step).round() as usize);
    let mut silent: Vec<bool> = (0..rows).map(|row| row.min(rows - 1 - row) < ends).collect();
    for repeat in missed {
        silent.iter_mut().zip(repeat).for_each(|(silent, missed)| *silent |= missed);
    }
    silent
}

/// Rows without information have weight zero.
fn trial(rig: &CommandRig, piece: &Piece, silent: &[bool], slowest: f64, held_out: bool, finer: usize) -> Trial {
    let step = piece.step / finer as f64;
    let sent = motion(&piece.signals["sent"], piece.step, band(rig, piece), finer);
    let instants = sent.value.len();
    let known = (rig.values.transport_delay / step).round() as usize;
    let weight = |i: usize| {
        if silent[i / finer] { 0.0 } else { 1.0 / sent.rate[i.saturating_sub(known)].hypot(slowest) }
    };
    let inputs = (0..instants).flat_map(|i| [weight(i), i as f64 * step]).collect();
    let late = (0..instants).flat_map(|i| [sent.value[i], 0.5 * step * step * sent.acceleration[i]]).collect();
    // The rounding of a command that is held or limited is the same in all repeats, and would pass for an effect.
    let dither = |i: usize| {
        let draw = philox::uniform(SEED, &piece.experiment, piece.repeat as u64, i as u32);
        DITHER * rig.quantum * (draw - 0.5)
    };
    let received = piece.signals["received"].iter().enumerate();
    Trial {
        experiment: piece.experiment.clone(),
        held_out,
        measured: vec![received.map(|(i, value)| (value + dither(i)) * weight(i * finer)).collect()],
        recorded: Recorded { step, instants, stride: finer, inputs, late, offsets: Vec::new() },
    }
}
