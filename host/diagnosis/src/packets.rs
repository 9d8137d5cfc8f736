//! What has no mean on a command's way: packets that get lost, and a delay that differs from packet to packet. Both are
//! judged by what repeats of one command differ by.

use crate::answer::{BlockAnswer, EffectFound, Estimate, Verdict};
use crate::block::{MeasuredBlock, Trial};
use crate::inference::evidence::Interval;
use crate::inference::memory::{Memory, correlation};
use crate::recording::grid::Piece;
use crate::variance::Healthy;
use nalgebra::DMatrix;
use softdock_campaign::rig::CommandRig;
use softdock_kernels::effects::EffectId;
use statrs::distribution::{Beta, ContinuousCDF};
use statrs::function::beta::ln_beta;
use std::collections::BTreeMap;

/// Quanta by which a command must move from row to row for a packet to be missed.
const MOVED: f64 = 30.0;
/// Share of packets that the next row follows with another one, below which packets are held and not lost.
const AGAIN: f64 = 0.4;
/// Least probability with which a row shows the value before though its packet came.
const CHANCE: f64 = 1e-4;
/// Rows that differ by up to so many quanta tell how many do not differ by chance.
const NEAR: f64 = 10.0;
/// Kurtosis (3 of a normal distribution) from which on a delay's noise is no jitter but rare and long.
const LONG_TAIL: f64 = 6.0;
/// Share of the excess that neighbouring rows may have in common.
const COLOURED: f64 = 0.5;
/// A row is fast where its weight is below this share of the greatest: the noise there is the delay's.
const FAST: f64 = 0.25;

/// Ids of those that these recordings could show: losses by repeats alone, jitter where the healthy delay is known too.
pub(crate) fn visible(rig: &CommandRig, pieces: &[Piece]) -> Vec<&'static str> {
    let repeated = pieces.iter().any(|piece| piece.repeat > 1);
    let jitter = rig.delay_noise.map(|_| "C3_jitter");
    if repeated { jitter.into_iter().chain(["C4_drops"]).collect() } else { Vec::new() }
}

/// Rows of a recording that brought no packet.
pub(crate) struct Missed {
    /// Those that say nothing of the command's way: losses, and edges of a hold that a restless delay has moved.
    pub(crate) rows: Vec<bool>,
    /// Whether they are losses.
    are_lost: bool,
}

/// Rows whose value and number are those of the row before, though the command had moved, in each recording. A hold is no
/// loss, and without repeats nothing is.
pub(crate) fn missed(rig: &CommandRig, pieces: &[Piece]) -> Vec<Missed> {
    let held: Vec<Vec<bool>> = pieces.iter().map(|piece| held(rig, piece)).collect();
    let of = |(piece, own): (&Piece, &Vec<bool>)| {
        let same = |other: &&Piece| other.experiment == piece.experiment && other.repeat != piece.repeat;
        let others: Vec<&Vec<bool>> =
            pieces.iter().zip(&held).filter(|(other, _)| same(other)).map(|(_, held)| held).collect();
        let common = |row: usize| own[row] && others.iter().all(|held| held.get(row) == Some(&true));
        let common: Vec<bool> = (0..own.len()).map(common).collect();
        let are_lost = !is_hold(own, &common);
        let rows = own.iter().zip(&common).map(|(held, common)| *held && (are_lost || !common)).collect();
        Missed { rows, are_lost }
    };
    pieces.iter().zip(&held).map(of).collect()
}

/// Whether rows without a packet are those of a hold: the same in all repeats, or the usual thing after a packet.
fn is_hold(own: &[bool], common: &[bool]) -> bool {
    let count = |rows: &[bool]| rows.iter().filter(|row| **row).count();
    let came = own.windows(2).filter(|pair| !pair[0]).count();
    let again = own.windows(2).filter(|pair| !pair[0] && !pair[1]).count();
    2 * count(common) > count(own) || (again as f64) < AGAIN * came as f64
}

/// Rows whose value and number are those of the row before, though the command had moved.
fn held(rig: &CommandRig, piece: &Piece) -> Vec<bool> {
    let quantum = quantum(rig);
    let same = |change: Option<f64>| change.is_some_and(|change| change < 0.5 * quantum);
    (0..piece.samples()).map(|row| same(changed(rig, piece, row))).collect()
}

fn quantum(rig: &CommandRig) -> f64 {
    rig.quantum.max(f64::EPSILON)
}

/// By how much the received command changed at a row that has the packet of the row before, though the command had
/// moved.
fn changed(rig: &CommandRig, piece: &Piece, row: usize) -> Option<f64> {
    let change = |signal: &str| -> Option<f64> {
        let values = piece.signals.get(signal)?;
        Some((values[row] - values[row.checked_sub(1)?]).abs())
    };
    let is_same = change("received.sequence").is_none_or(|change| change < 0.5);
    change("sent").filter(|sent| is_same && *sent > MOVED * quantum(rig)).and_then(|_| change("received"))
}

/// The answer with losses and, if the model file says how restless a healthy delay is, jitter. Edges of a hold that a
/// restless delay moves to either side of a tick are neither.
pub(crate) fn with_random(
    rig: &CommandRig,
    pieces: &[Piece],
    block: &MeasuredBlock,
    without: &[String],
    answer: BlockAnswer,
) -> BlockAnswer {
    let is_held = answer.effects.iter().any(|effect| effect.id.starts_with("C6"));
    let wanted = |id: &str| !is_held && !without.iter().any(|own| own == id);
    let answer = match losses(rig, pieces).filter(|_| wanted("C4_drops")) {
        Some(found) => named(answer, "C4_drops", "packets that get lost", &found),
        None => answer,
    };
    match jitter(rig, block) {
        Some((found, true)) if wanted("C3_jitter") => {
            named(answer, "C3_jitter", "delay that differs from packet to packet", &found)
        }
        Some((found, false)) if !is_held && found.log_odds >= answer.threshold => unexplained(answer, &found),
        _ => answer,
    }
}

/// A number without a mean effect, and how much speaks for it.
struct Found {
    field: &'static str,
    unit: &'static str,
    value: Interval,
    log_odds: f64,
}

/// The answer with one more effect, where it is beyond the threshold.
fn named(mut answer: BlockAnswer, id: &'static str, name: &'static str, found: &Found) -> BlockAnswer {
    if found.log_odds < answer.threshold {
        return answer;
    }
    if answer.answer < Verdict::Named {
        // What has no practical effect is not the answer any more.
        answer.effects.clear();
    }
    let Interval { value, lo, hi } = found.value;
    let estimate = Estimate { value, lo, hi, unit: found.unit.to_owned() };
    answer.effects.push(EffectFound {
        id: EffectId::of(id).effect().id,
        name,
        block: answer.block,
        p: 1.0 / (1.0 + (-found.log_odds).exp()),
        parameters: BTreeMap::from([(found.field.to_owned(), estimate)]),
        covariance: Vec::new(),
    });
    answer.log_odds = answer.log_odds.max(found.log_odds);
    answer.answer = answer.answer.max(Verdict::Named);
    answer
}

/// The answer where the delay's noise is too large, and of another kind than the library has.
fn unexplained(mut answer: BlockAnswer, found: &Found) -> BlockAnswer {
    answer.log_odds = answer.log_odds.max(found.log_odds);
    (answer.answer, answer.effects) = (Verdict::NotInLibrary, Vec::new());
    answer
}

/// Share of the packets that were lost: binomial, with a prior as wide as the effect table has it.
fn losses(rig: &CommandRig, pieces: &[Piece]) -> Option<Found> {
    let (mut missed, mut rows, mut near, mut repeats) = (0, 0, 0, 0);
    let least = MOVED * quantum(rig);
    for (piece, own) in pieces.iter().zip(self::missed(rig, pieces)).filter(|(_, own)| own.are_lost) {
        missed += own.rows.iter().filter(|row| **row).count();
        rows += piece.signals["sent"].windows(2).filter(|pair| (pair[1] - pair[0]).abs() > least).count();
        let is_near = |change: &f64| (0.5..NEAR + 0.5).contains(&(change / quantum(rig)));
        near += (0..piece.samples()).filter_map(|row| changed(rig, piece, row)).filter(is_near).count();
        repeats = repeats.max(piece.repeat);
    }
    if repeats < 2 || rows == 0 {
        return None;
    }
    // As many by chance as differ by any one of the next quanta, up or down.
    let chance = (near as f64 / (2.0 * NEAR) / rows as f64).max(CHANCE);
    let (missed, came) = (missed as f64, (rows - missed) as f64);
    let wide = 1.0 / EffectId::of("C4_drops").effect().parameters[0].scale - 1.0;
    let log_odds =
        ln_beta(1.0 + missed, wide + came) - ln_beta(1.0, wide) - missed * chance.ln() - came * (-chance).ln_1p();
    let posterior = Beta::new(1.0 + missed, wide + came).ok()?;
    let value =
        Interval { value: missed / rows as f64, lo: posterior.inverse_cdf(0.025), hi: posterior.inverse_cdf(0.975) };
    Some(Found { field: "drop_probability", unit: "1", value, log_odds })
}

/// Standard deviation of the delay from row to row beyond the healthy one, and whether it is jitter: normal, and
/// independent from row to row. `None` without repeats, or where the healthy one is not known.
fn jitter(rig: &CommandRig, block: &MeasuredBlock) -> Option<(Found, bool)> {
    let series = lateness(block);
    let samples: usize = series.iter().map(DMatrix::ncols).sum();
    let deviation = rig.delay_noise.filter(|_| samples > 0)?;
    let mean_power = |power: i32| series.iter().flatten().map(|x| x.powi(power)).sum::<f64>() / samples as f64;
    let variance = mean_power(2);
    let scale = EffectId::of("C3_jitter").effect().parameters[0].scale;
    let healthy = Healthy { deviation, share: rig.noise_share, scale };
    let (value, log_odds) = healthy.exceeded(variance, Memory::of(&series).samples(&series));
    let shared = correlation(&series, 1) * variance - deviation.powi(2);
    let is_white = shared < COLOURED * (variance - deviation.powi(2));
    let is_normal = mean_power(4) / variance.powi(2) < LONG_TAIL;
    Some((Found { field: "delay_jitter", unit: "s", value, log_odds }, is_white && is_normal))
}

/// What repeats' delays differ by in fast rows \[s\], as large as a single one's noise.
fn lateness(block: &MeasuredBlock) -> Vec<DMatrix<f64>> {
    let mut repeats: BTreeMap<&str, Vec<&Trial>> = BTreeMap::new();
    for trial in &block.trials {
        repeats.entry(&trial.experiment).or_default().push(trial);
    }
    repeats.values().filter(|trials| trials.len() > 1).flat_map(|trials| deviations(trials)).collect()
}

fn deviations(trials: &[&Trial]) -> Vec<DMatrix<f64>> {
    let weight = |trial: &Trial, row: usize| trial.recorded.inputs[2 * trial.recorded.stride * row];
    let rows = trials.iter().map(|trial| trial.measured[0].len()).min().unwrap_or(0);
    let slow = (0..rows).map(|row| weight(trials[0], row)).fold(0.0, f64::max);
    let fast = |row: &usize| trials.iter().all(|t| weight(t, *row) > 0.0 && weight(t, *row) < FAST * slow);
    let fast: Vec<usize> = (0..rows).filter(fast).collect();
    let (count, value) = (trials.len() as f64, |trial: &Trial, row: usize| trial.measured[0][row]);
    let mean: Vec<f64> =
        fast.iter().map(|row| trials.iter().map(|trial| value(trial, *row)).sum::<f64>() / count).collect();
    let scale = (count / (count - 1.0)).sqrt();
    let of = |trial: &&Trial| DMatrix::from_fn(1, fast.len(), |_, i| (value(trial, fast[i]) - mean[i]) * scale);
    if fast.is_empty() { Vec::new() } else { trials.iter().map(of).collect() }
}
