//! Effects of the command transmission: delay, lag, clock, hold, rate limit. The zero-mean effects, jitter and losses,
//! are judged by repeat-to-repeat variance.

use crate::model::block::{MeasuredBlock, Trial};
use crate::model::hypothesis::{Hypothesis, Shelf};
use crate::model::unknown::{ParameterPrior, Role};
use softdock_kernels::block::Recorded;

/// Plausible delay or lag \[s\]: robot interfaces cycle with 1 to 8 ms, and a few cycles pass on the way.
const LATE: f64 = 5e-3;
/// Plausible difference of two clocks: free-running crystals to 100 ppm, and operating systems' to twice that.
const SKEW: f64 = 2e-4;
/// Default period of a hold \[s\]: RSI's cycle.
const USUAL_HOLD: f64 = 4e-3;
/// Natural logarithm of the factor that a seen period may be wrong by: a row in a thousand.
const HOLD_SPREAD: f64 = 1e-3;

/// Returns the hypotheses of a command; `hold` is the period and phase \[s\] of a hold, from the packet numbers. A servo
/// has errors of its position, and no second clock.
pub fn effects(block: &MeasuredBlock, hold: Option<[f64; 2]>, is_servo: bool) -> Vec<Hypothesis> {
    let mut shelf = Shelf::of(block);
    let either = |sd: f64| ParameterPrior::Normal { mean: 0.0, sd };
    let delay = [("delay", either(LATE), Role::Size)];
    shelf.add("C1_transport_delay", "transport delay", &delay, &[0.2], &[]);
    let lag = [("lag", ParameterPrior::Positive { scale: LATE }, Role::Size)];
    shelf.add("C2_lag", "lag", &lag, &[0.2], &[]);
    if is_servo {
        servo(&mut shelf, block);
    } else {
        let skew = [("clock_skew", either(SKEW), Role::Size)];
        shelf.add("C5_clock_skew", "skew", &skew, &[1.0], &[]);
    }
    let row = block.trials.first().map_or(0.0, |trial| trial.recorded.step * trial.recorded.stride as f64);
    let seen = hold.or_else(|| block.trials.iter().find_map(seen_hold));
    let [centre, phase] = seen.unwrap_or([USUAL_HOLD, 0.0]);
    let hold = [
        ("hold_share", ParameterPrior::Positive { scale: 1.0 }, Role::Size),
        ("hold", ParameterPrior::LogNormal { centre, spread: HOLD_SPREAD }, Role::Form),
        ("hold_phase", ParameterPrior::Normal { mean: phase, sd: row }, Role::Form),
    ];
    let near: Vec<Vec<f64>> = (-8..=8).map(|k| vec![0.125 * f64::from(k), 0.0]).collect();
    shelf.add("C6_hold", "hold between packets", &hold, &[1.0], &near);
    let below = ParameterPrior::Below { top: fastest(block), share: 0.2 };
    // A deep limit is found from where it shows alone: a command that is behind by much fits nothing beside it.
    let seen = block.trials.iter().filter_map(seen_rate).fold(0.0, f64::max);
    let seen = Some(below.place(seen)).filter(|z| *z > LEAST_LIMIT);
    let limit = [("rate_limit", below, Role::Size)];
    let sizes: Vec<f64> = [0.3, 1.0, 3.0].into_iter().chain(seen).collect();
    shelf.add("C7_rate_limit", "rate limit", &limit, &sizes, &[]);
    shelf.all
}

/// Plausible dead band and offset of a servo, as a share of the range of its commands.
const SERVO_ERROR: f64 = 0.02;

/// Adds the errors of a servo without integral action.
fn servo(shelf: &mut Shelf, block: &MeasuredBlock) {
    let sent = || block.trials.iter().flat_map(|trial| trial.recorded.late.iter().step_by(2).copied());
    let (least, most) = sent().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), own| (own.min(lo), own.max(hi)));
    let scale = (SERVO_ERROR * (most - least)).max(f64::MIN_POSITIVE);
    let band = [("dead_band", ParameterPrior::Positive { scale }, Role::Size)];
    shelf.add("C8_dead_band", "dead band", &band, &[0.2, 1.0], &[]);
    let offset = [("position_offset", ParameterPrior::Normal { mean: 0.0, sd: scale }, Role::Size)];
    shelf.add("C9_position_offset", "static position error", &offset, &[1.0], &[]);
}

/// Standard deviations of a limit's prior from which on one that is seen differs from none.
const LEAST_LIMIT: f64 = 0.05;
/// Share of the rows that a received command's rate exceeds by chance.
const BEYOND: f64 = 0.002;

/// Rate \[rad/s\] that a received command hardly ever exceeds; `None` where nothing is known of its rate.
fn seen_rate(trial: &Trial) -> Option<f64> {
    let Recorded { step, stride, inputs, .. } = &trial.recorded;
    let weights = inputs.iter().step_by(2 * stride).copied();
    let received: Vec<f64> = trial.measured[0].iter().zip(weights).map(|(value, weight)| value / weight).collect();
    let change = |pair: &[f64]| (pair[1] - pair[0]).abs() / (step * *stride as f64);
    // Rows without information have weight zero.
    let mut rates: Vec<f64> = received.windows(2).map(change).filter(|rate| rate.is_finite()).collect();
    rates.sort_by(f64::total_cmp);
    let place = (rates.len() as f64 * (1.0 - BEYOND)) as usize;
    rates.get(place).copied()
}

/// Greatest rate at which a command was sent \[rad/s\].
fn fastest(block: &MeasuredBlock) -> f64 {
    let of = |trial: &Trial| {
        let sent: Vec<f64> = trial.recorded.late.iter().step_by(2).copied().collect();
        sent.windows(2).map(|pair| (pair[1] - pair[0]).abs() / trial.recorded.step).fold(0.0, f64::max)
    };
    block.trials.iter().map(of).fold(f64::MIN_POSITIVE, f64::max)
}

/// Period at which a received command takes new values, and when it does so first \[s\]; `None` where it does at nearly
/// every row.
///
/// The longest stretch of motion gives a first estimate; every later edge, counted from its start, refines it.
fn seen_hold(trial: &Trial) -> Option<[f64; 2]> {
    let stretches = edges(trial);
    let longest = stretches.iter().max_by_key(|stretch| stretch.len())?;
    let waits = longest.windows(2).filter(|pair| pair[1] - pair[0] > 1).count();
    if longest.len() < FEWEST_EDGES || (waits as f64) < SEEN * longest.len() as f64 {
        return None;
    }
    let (start, end) = (longest[0], longest[longest.len() - 1]);
    let mut period = (end - start) as f64 / (longest.len() - 1) as f64;
    for edge in stretches.iter().flatten().filter(|edge| **edge >= end) {
        let rows = (edge - start) as f64;
        period = rows / (rows / period).round();
    }
    let row = trial.recorded.step * trial.recorded.stride as f64;
    // A new value came between its row and the one before.
    Some([period * row, (start as f64 - 0.5).rem_euclid(period) * row])
}

/// Smallest number of edges that determine a period.
const FEWEST_EDGES: usize = 20;
/// Share of them that must follow after a row without one: fewer are losses.
const SEEN: f64 = 0.3;

/// Returns the rows at which the received command takes a new value, for each stretch of fast motion; rows with weight
/// zero are skipped.
fn edges(trial: &Trial) -> Vec<Vec<usize>> {
    let weights: Vec<f64> = trial.recorded.inputs.iter().step_by(2 * trial.recorded.stride).copied().collect();
    let slow = 0.5 * weights.iter().copied().fold(0.0, f64::max);
    // Received commands over the rate at which they were sent move by about a row's time in a row.
    let least = NEW * trial.recorded.step * trial.recorded.stride as f64;
    let (mut stretches, mut last) = (vec![Vec::new()], None);
    for (row, weight) in weights.iter().enumerate().filter(|(_, weight)| **weight > 0.0) {
        let value = trial.measured[0][row] / weight;
        let is_new = last.is_some_and(|last: f64| (value - last).abs() * weight > least);
        match stretches.last_mut() {
            Some(stretch) if *weight < slow && is_new => stretch.push(row),
            Some(stretch) if *weight >= slow && !stretch.is_empty() => stretches.push(Vec::new()),
            _ => {}
        }
        last = Some(value);
    }
    stretches
}

/// Share of a row's motion from which on a value is new.
const NEW: f64 = 0.25;
