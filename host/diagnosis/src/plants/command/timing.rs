//! Recordings of events: delay from a command to its target and motion, and skew between two clocks.
//!
//! A flag or a first change shows that an event occurred after the previous row: a delay between two such rows is known
//! to one row either way, whatever the noise.

use crate::data::grid::{Finding, Piece};
use crate::inference::evidence::CredibleInterval;
use crate::model::isolability::BlockView;
use crate::model::place::{CLOCKS, FIRST_MOTION, TARGET};
use crate::verdict::answer::{BlockAnswer, DiagnosisVerdict, EffectFound, Residual};
use crate::verdict::estimates::EffectSize;
use crate::verdict::estimates::ParameterEstimate;
use softdock_campaign::rig::CommandRig;
use softdock_kernels::effects::EffectId;
use statrs::distribution::{ContinuousCDF, StudentsT};
use std::collections::BTreeMap;

/// Delays of an event: block, signal, description.
const MOVED: [(&str, &str, &str); 2] = [
    (TARGET.name, "target.rate", "delay until the target changes"),
    (FIRST_MOTION.name, "motion.rate", "delay until the first motion"),
];
/// Flags above this are set.
const SET: f64 = 0.5;
/// A change counts from so many times what the signal did at rest on.
const BEYOND: f64 = 2.0;
/// A change counts from this share of the greatest on, however still the signal was.
const LEAST: f64 = 1e-3;
/// Probability with which a flag or a first change lies more than a row off.
const MISREAD: f64 = 1e-4;
/// Log-odds from which on an effect counts as present.
const THRESHOLD: f64 = 5.0;
/// Stretches of a recording by whose rates a clock's rate is known.
const STRETCHES: usize = 10;
/// Difference of two clocks' rates that rounding makes.
const ROUNDING: f64 = 1e-9;

/// The views of what events and stamps can show.
pub(crate) fn views(pieces: &[Piece]) -> Vec<BlockView> {
    let has = |signal: &str| pieces.iter().all(|piece| piece.signals.contains_key(signal));
    let view = |block, inputs: &[&'static str], output: &'static str, effect: &'static str| BlockView {
        block,
        inputs: inputs.to_vec(),
        outputs: vec![output],
        missing: Vec::new(),
        effects: vec![effect],
    };
    let moved = MOVED.iter().filter(|row| has("sent.event") && has(row.1));
    let mut all: Vec<BlockView> = moved.map(|row| view(row.0, &["sent.event"], row.1, "C1_transport_delay")).collect();
    if has("received.t") {
        all.push(view(CLOCKS.name, &["t"], "received.t", "C5_clock_skew"));
    }
    all
}

/// Returns the reason why delays of these events are provisional.
pub(crate) fn reason(pieces: &[Piece]) -> String {
    let count: usize = pieces.iter().map(|piece| events(piece).len()).sum();
    match count {
        1 => "one event: the event-to-event variance of the delay is unknown".to_owned(),
        _ => format!("{count} events were timed, none was held out"),
    }
}

/// The answers of events and stamps, and what could not be timed.
pub(crate) fn answers(rig: &CommandRig, pieces: &[Piece]) -> (Vec<BlockAnswer>, Vec<Finding>) {
    let (mut answers, mut findings) = (Vec::new(), Vec::new());
    for (block, signal, name) in MOVED {
        let delays: Vec<CredibleInterval> = pieces.iter().flat_map(|piece| delays(piece, signal)).collect();
        let events: usize = pieces.iter().filter(|p| p.signals.contains_key(signal)).map(|p| events(p).len()).sum();
        if delays.len() < events {
            let what = format!("`{signal}` does not change after {} of {events} events", events - delays.len());
            findings.push(Finding { recording: "all recordings".to_owned(), what });
        }
        answers.extend(timed(rig, block, name, &delays));
    }
    answers.extend(clocks(pieces));
    (answers, findings)
}

/// Rows from which on a command's flag is set.
fn events(piece: &Piece) -> Vec<usize> {
    let Some(flag) = piece.signals.get("sent.event") else {
        return Vec::new();
    };
    (1..flag.len()).filter(|row| flag[row - 1] < SET && flag[*row] >= SET).collect()
}

/// Returns the delay of each event until a signal changes, with the bounds from the rows; events without a change are
/// omitted.
fn delays(piece: &Piece, signal: &str) -> Vec<CredibleInterval> {
    let (events, Some(values)) = (events(piece), piece.signals.get(signal)) else {
        return Vec::new();
    };
    let (mut before, mut all) = (0, Vec::new());
    for (number, event) in events.iter().enumerate() {
        let end = events.get(number + 1).copied().unwrap_or(values.len());
        // The motion of the event before has come to rest half way.
        let rest = if number == 0 { 0 } else { (before + event) / 2 };
        if let Some(row) = first_change(&values[rest..end], event - rest) {
            let delay = (row + rest - event) as f64 * piece.step;
            all.push(CredibleInterval { value: delay, lo: (delay - piece.step).max(0.0), hi: delay + piece.step });
        }
        before = *event;
    }
    all
}

/// The first row from `event` on that differs from the mean before it by more than any row at rest did.
fn first_change(values: &[f64], event: usize) -> Option<usize> {
    let mean = values[..event].iter().sum::<f64>() / event as f64;
    let greatest = |values: &[f64]| values.iter().map(|value| (value - mean).abs()).fold(0.0, f64::max);
    let least = (BEYOND * greatest(&values[..event])).max(LEAST * greatest(&values[event..]));
    (event..values.len()).find(|row| (values[*row] - mean).abs() > least)
}

/// Returns the answer from the delays of all events against the model's delay, which is the same for all of them.
fn timed(
    rig: &CommandRig,
    block: &'static str,
    name: &'static str,
    delays: &[CredibleInterval],
) -> Option<BlockAnswer> {
    let first = delays.first()?;
    let whole = delays.iter().fold(*first, |whole, own| CredibleInterval {
        value: whole.value,
        lo: whole.lo.min(own.lo),
        hi: whole.hi.max(own.hi),
    });
    let known = rig.values.transport_delay + rig.values.delay;
    let value = delays.iter().map(|delay| delay.value).sum::<f64>() / delays.len() as f64 - known;
    let beyond = CredibleInterval { value, lo: whole.lo - known, hi: whole.hi - known };
    let outside = delays.iter().filter(|delay| known < delay.lo || known > delay.hi).count();
    let log_odds = -MISREAD.ln() * (2.0 * outside as f64 - delays.len() as f64);
    let noise = 0.5 * (first.hi - first.lo);
    Some(answer(block, ("C1_transport_delay", name, "delay", "s"), beyond, log_odds, noise, delays.len()))
}

/// How the other clock runs against the rows' own, if it is recorded and is another one.
fn clocks(pieces: &[Piece]) -> Option<BlockAnswer> {
    let mut rates = Vec::new();
    for piece in pieces {
        let stamps = piece.signals.get("received.t")?;
        let stretch = stamps.len() / STRETCHES;
        rates.extend(stamps.chunks_exact(stretch).map(|stamps| slope(stamps) / piece.step - 1.0));
    }
    if rates.iter().all(|rate| rate.abs() < ROUNDING) {
        return None;
    }
    let count = rates.len() as f64;
    let mean = rates.iter().sum::<f64>() / count;
    let spread = (rates.iter().map(|rate| (rate - mean).powi(2)).sum::<f64>() / (count - 1.0) / count).sqrt();
    let (sd, row) = (spread.max(ROUNDING), EffectId::of("C5_clock_skew").effect());
    let wide = row.parameters[0].scale.hypot(sd);
    let log_odds = 0.5 * (mean * mean * (sd.powi(-2) - wide.powi(-2))) - (wide / sd).ln();
    let reach = StudentsT::new(0.0, 1.0, count - 1.0).ok()?.inverse_cdf(0.975) * sd;
    let skew = CredibleInterval { value: mean, lo: mean - reach, hi: mean + reach };
    let skew_field = ("C5_clock_skew", "skew", "clock_skew", "1");
    Some(answer(CLOCKS.name, skew_field, skew, log_odds, sd, pieces.iter().map(Piece::samples).sum()))
}

/// Least squares slope over the number of the row.
fn slope(values: &[f64]) -> f64 {
    let middle = 0.5 * (values.len() - 1) as f64;
    let (mut product, mut square) = (0.0, 0.0);
    for (row, value) in values.iter().enumerate() {
        let x = row as f64 - middle;
        (product, square) = (product + x * (value - values[0]), square + x * x);
    }
    product / square
}

/// The answer of one number of an effect (id, name, field, unit) that is null in the model; its noise in the number's
/// unit.
fn answer(
    block: &'static str,
    (id, name, field, unit): (&'static str, &'static str, &'static str, &'static str),
    found: CredibleInterval,
    log_odds: f64,
    noise: f64,
    samples: usize,
) -> BlockAnswer {
    let present = log_odds >= THRESHOLD;
    let estimate = ParameterEstimate { value: found.value, lo: found.lo, hi: found.hi, unit: unit.to_owned() };
    let parameters = BTreeMap::from([(field.to_owned(), estimate)]);
    let effect = EffectFound {
        id,
        name,
        block,
        p: 1.0 / (1.0 + (-log_odds).exp()),
        log_odds,
        size: EffectSize::among(&parameters, &[field]),
        parameters,
        covariance: Vec::new(),
    };
    let before = (found.value / noise).abs();
    BlockAnswer {
        inadequate: Vec::new(),
        possible: Vec::new(),
        block,
        answer: if present { DiagnosisVerdict::Named } else { DiagnosisVerdict::NoEffect },
        effects: if present { vec![effect] } else { Vec::new() },
        form: None,
        partner_missing: Vec::new(),
        log_odds,
        threshold: THRESHOLD,
        gain: None,
        residual: Residual { before, after: if present { 0.0 } else { before } },
        torque_error: None,
        remaining: Vec::new(),
        fitted: Vec::new(),
        free_run: None,
        held_out: false,
        ruled_out: Vec::new(),
        not_visible: Vec::new(),
        confounded: Vec::new(),
        nuisances_beyond_prior: Vec::new(),
        samples,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn piece(signals: &[(&str, Vec<f64>)]) -> Piece {
        let signals = signals.iter().map(|(name, values)| ((*name).to_owned(), values.clone())).collect();
        Piece { experiment: "step".to_owned(), repeat: 1, start: 0.0, offset: 0.0, step: 0.008, signals }
    }

    #[test]
    fn a_delay_between_two_rows_is_known_to_a_row_either_way() {
        let flag: Vec<f64> = (0..400).map(|row| if row >= 250 { 1.0 } else { 0.0 }).collect();
        let moved = |from: usize| -> Vec<f64> {
            let noise = |row: usize| 1e-3 * (row as f64 * 7.0).sin();
            (0..400).map(|row| noise(row) + if row >= from { 0.1 * (row - from + 1) as f64 } else { 0.0 }).collect()
        };
        let piece = piece(&[("sent.event", flag), ("motion.rate", moved(253))]);
        let found = delays(&piece, "motion.rate");
        let (value, lo, hi) = (found[0].value, found[0].lo, found[0].hi);
        assert!((value - 0.024).abs() < 1e-12 && (lo - 0.016).abs() < 1e-12 && (hi - 0.032).abs() < 1e-12);
        assert!(found.len() == 1 && delays(&piece, "target.rate").is_empty());
    }

    #[test]
    fn only_a_skewed_clock_is_named() {
        let stamps = |rate: f64| -> Vec<f64> {
            (0..800).map(|row| rate * 0.008 * row as f64 + 1e-4 * (row as f64 * 5.0).sin()).collect()
        };
        let skew = clocks(&[piece(&[("received.t", stamps(1.015))])]).expect("stamps");
        let found = &skew.effects[0].parameters["clock_skew"];
        assert!((found.value - 0.015).abs() < 1e-4 && found.lo < 0.015 && found.hi > 0.015, "{found:?}");
        assert_eq!(
            clocks(&[piece(&[("received.t", stamps(1.0))])]).expect("stamps").answer,
            DiagnosisVerdict::NoEffect
        );
    }
}
