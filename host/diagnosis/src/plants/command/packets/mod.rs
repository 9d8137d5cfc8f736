//! Zero-mean effects of the command transmission: packet losses and jitter. Both are judged by the differences of
//! repeats, before a lag or a limit that was found behind them.

mod echo;
mod edges;
mod hold;
mod lag_and_limit;
mod lateness;

use crate::data::grid::Piece;
use crate::inference::autocorrelation::{CorrelationTime, correlation};
use crate::inference::evidence::CredibleInterval;
use crate::model::block::MeasuredBlock;
use crate::plants::command::packets::lateness::{Lateness, lateness};
use crate::plants::sensor::excess_noise::Healthy;
use crate::verdict::answer::{Beside, BlockAnswer, DiagnosisVerdict};
use crate::verdict::estimates::ParameterEstimate;
pub(crate) use echo::missed;
use echo::{Echo, Missed, echoes, missed_in};
pub(crate) use hold::hold;
use lag_and_limit::Behind;
use nalgebra::DMatrix;
use softdock_campaign::rig::CommandRig;
use softdock_kernels::effects::EffectId;
use statrs::distribution::{Beta, ContinuousCDF};
use statrs::function::beta::ln_beta;
use std::collections::BTreeMap;

/// Least probability with which a row shows the value before though its packet came.
const CHANCE: f64 = 1e-4;
/// Rows that differ by at most this many quanta estimate how many are equal by chance.
const NEAR: f64 = 10.0;
/// Kurtosis (3 of a normal distribution) from which on a delay's noise is no jitter but rare and long.
const LONG_TAIL: f64 = 6.0;
/// Share of the excess that neighbouring rows may have in common.
const COLOURED: f64 = 0.5;

/// Returns the ids that are detectable with these recordings: losses with repeats, jitter if the healthy delay is also
/// known.
pub(crate) fn visible(rig: &CommandRig, pieces: &[Piece]) -> Vec<&'static str> {
    let repeated = pieces.iter().any(|piece| piece.repeat > 1);
    let jitter = rig.delay_noise.map(|_| "C3_jitter");
    if repeated { jitter.into_iter().chain(["C4_drops"]).collect() } else { Vec::new() }
}

/// Returns the answer with losses and, if the model file states the healthy jitter, with jitter. Edges of a hold that
/// jitter moves across a tick count as neither.
pub(crate) fn with_random(
    rig: &CommandRig,
    pieces: &[Piece],
    block: &MeasuredBlock,
    without: &[String],
    answer: BlockAnswer,
) -> BlockAnswer {
    // An effect without practical gain masks nothing.
    let found = if answer.answer < DiagnosisVerdict::Named { &[] } else { answer.effects.as_slice() };
    let behind = Behind::of(&rig.values).with(found);
    let echoes = echoes(rig, &behind, pieces);
    let wanted = |id: &str| !without.iter().any(|own| own == id);
    let Random { loss, jitter } = match seen_hold(&answer) {
        Some(hold) => behind_hold(rig, &echoes, hold),
        None => row_by_row(rig, &behind, &echoes, block),
    };
    let with_effect = |answer: BlockAnswer, id: &'static str, name: &'static str, found: &Found| match wanted(id) {
        true => named(answer, id, name, found),
        false => unexplained(answer, found),
    };
    let answer = match loss {
        Some(found) => with_effect(answer, "C4_drops", "packet losses", &found),
        None => answer,
    };
    match jitter {
        Some((found, true)) => with_effect(answer, "C3_jitter", "jitter of the packet delay", &found),
        Some((found, false)) => unexplained(answer, &found),
        None => answer,
    }
}

/// Period and phase of a hold that an answer names \[s\].
fn seen_hold(answer: &BlockAnswer) -> Option<[f64; 2]> {
    let hold = answer.effects.iter().find(|effect| effect.id == "C6_hold")?;
    let value = |field: &str| hold.parameters.get(field).map(|estimate| estimate.value);
    Some([value("hold")?, value("hold_phase")?])
}

/// Losses and jitter by when held packets show; neither without repeats, or where the healthy delay is not known.
fn behind_hold(rig: &CommandRig, echoes: &[Echo], hold: [f64; 2]) -> Random {
    let is_repeated = echoes.iter().any(|echo| echo.piece.repeat > 1);
    let healthy = rig.delay_noise.filter(|_| is_repeated);
    let found = healthy.and_then(|healthy| edges::behind_hold(echoes, hold, healthy, rig.noise_share));
    match found {
        Some([jitter, loss]) => Random { loss: Some(loss), jitter: Some((jitter, true)) },
        None => Random { loss: None, jitter: None },
    }
}

/// Losses and jitter by the rows of recordings without a hold.
fn row_by_row(rig: &CommandRig, behind: &Behind, echoes: &[Echo], block: &MeasuredBlock) -> Random {
    let missed = missed_in(echoes);
    let lateness = lateness(rig, behind, echoes, &missed, block);
    Random { loss: losses(echoes, &missed), jitter: jitter(rig, &lateness) }
}

/// Estimates of both from repeats.
struct Random {
    loss: Option<Found>,
    /// Excess variance of the delay, and whether it is jitter.
    jitter: Option<(Found, bool)>,
}

/// A number without a mean effect, and how much speaks for it.
struct Found {
    field: &'static str,
    unit: &'static str,
    value: CredibleInterval,
    log_odds: f64,
}

/// The answer with one more effect, where it is beyond the threshold.
fn named(answer: BlockAnswer, id: &'static str, name: &'static str, found: &Found) -> BlockAnswer {
    if found.log_odds < answer.threshold {
        return answer;
    }
    let parameters = BTreeMap::from([(found.field.to_owned(), ParameterEstimate::new(found.value, found.unit))]);
    answer.beside(Beside { effect: EffectId::of(id).effect(), name, parameters, log_odds: found.log_odds })
}

/// The answer where losses or the delay's noise are beyond the threshold, and of another kind than the library has. They
/// have no mean: causes that are named by the mean of repeats remain.
fn unexplained(mut answer: BlockAnswer, found: &Found) -> BlockAnswer {
    if found.log_odds < answer.threshold {
        return answer;
    }
    if answer.answer.names() {
        answer
            .inadequate
            .push("repeats differ by a delay that is neither jitter nor losses of this library".to_owned());
        return answer;
    }
    answer.log_odds = answer.log_odds.max(found.log_odds);
    (answer.answer, answer.effects) = (DiagnosisVerdict::NotInLibrary, Vec::new());
    answer
}

/// Returns the log-odds of one of them from the differences of repeats; `None` if not identifiable.
pub(crate) fn odds(rig: &CommandRig, pieces: &[Piece], block: &MeasuredBlock, id: &str) -> Option<f64> {
    let behind = Behind::of(&rig.values);
    let echoes = echoes(rig, &behind, pieces);
    let Random { loss, jitter } = row_by_row(rig, &behind, &echoes, block);
    let found = if id == "C4_drops" { loss } else { jitter.map(|(found, _)| found) };
    found.map(|found| found.log_odds)
}

/// Packets that must have come for one to be lost, as plausible losses have it: the beta prior's second number.
fn came_before() -> f64 {
    1.0 / EffectId::of("C4_drops").effect().parameters[0].scale - 1.0
}

/// Share of the packets that were lost: binomial, with a prior as wide as the effect table has it.
fn losses(echoes: &[Echo], missed_rows: &[Missed]) -> Option<Found> {
    let (mut missed, mut rows, mut near, mut repeats) = (0, 0, 0, 0);
    for (echo, own) in echoes.iter().zip(missed_rows).filter(|(_, own)| own.are_lost) {
        missed += own.rows.iter().filter(|row| **row).count();
        let all = 0..echo.arrived.len();
        rows += all.clone().filter(|row| echo.shows(*row)).count();
        near += all.filter(|row| echo.hardly_changed(*row, NEAR)).count();
        repeats = repeats.max(echo.piece.repeat);
    }
    if repeats < 2 || rows == 0 {
        return None;
    }
    // As many by chance as differ by any one of the next quanta, up or down. With another packet too: two values that are
    // the same have one number, and the further apart, the less often.
    let chance = (near as f64 / (2.0 * NEAR) / rows as f64).max(CHANCE);
    let (missed, came) = (missed as f64, (rows - missed) as f64);
    let wide = came_before();
    let log_odds =
        ln_beta(1.0 + missed, wide + came) - ln_beta(1.0, wide) - missed * chance.ln() - came * (-chance).ln_1p();
    // Fewer than by chance speak for no loss.
    let log_odds = if missed > chance * rows as f64 { log_odds } else { log_odds.min(0.0) };
    let posterior = Beta::new(1.0 + missed, wide + came).ok()?;
    let value = CredibleInterval {
        value: missed / rows as f64,
        lo: posterior.inverse_cdf(0.025),
        hi: posterior.inverse_cdf(0.975),
    };
    Some(Found { field: "drop_probability", unit: "1", value, log_odds })
}

/// Standard deviation of the delay from row to row beyond the healthy one, and whether it is jitter: normal, and
/// independent from row to row. `None` without repeats, where the healthy one is not known, or where rounding hides it.
fn jitter(rig: &CommandRig, Lateness { series, rounding }: &Lateness) -> Option<(Found, bool)> {
    let samples: usize = series.iter().map(DMatrix::ncols).sum();
    let deviation = rig.delay_noise.filter(|_| samples > 0)?;
    let mean_power = |power: i32| series.iter().flatten().map(|x| x.powi(power)).sum::<f64>() / samples as f64;
    let (whole, of_rounding) = (mean_power(2), rounding.powi(2));
    // Behind a long lag the rounding is all that is left.
    let variance = Some(whole - of_rounding).filter(|variance| *variance > of_rounding)?;
    let scale = EffectId::of("C3_jitter").effect().parameters[0].scale;
    let healthy = Healthy { deviation, share: rig.noise_share, scale };
    let (value, log_odds) = healthy.exceeded(variance, 0.0, CorrelationTime::of(series).samples(series));
    let shared = correlation(series, 1) * whole - deviation.powi(2);
    let is_white = shared < COLOURED * (variance - deviation.powi(2));
    let is_normal = mean_power(4) / whole.powi(2) < LONG_TAIL;
    Some((Found { field: "delay_jitter", unit: "s", value, log_odds }, is_white && is_normal))
}
