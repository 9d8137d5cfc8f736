//! Period of a hold, from the numbers of its packets.

use crate::data::grid::Piece;
use std::f64::consts::TAU;

/// Smallest number of packets that determine a period.
const FEWEST: usize = 20;
/// Shortest period whose instants are separable by packet numbers, in packets.
const SHORTEST: f64 = 1.4;
/// Fewest packets that a shorter period passes over.
const FEWEST_PASSED: usize = 10;
/// Share of them, as vectors on the circle of their beat, that they have in common: 1 where they come evenly, nearly nothing
/// where they come by chance.
const EVEN: f64 = 0.7;
/// Range of trial beats as shares of the mean beat (jitter skips further packets), and beats between two of them, a
/// tenth of the recording's resolution.
const BEATS: [f64; 2] = [0.9, 1.01];
const FINE: f64 = 0.1;
/// Phases of a shorter period that are tried.
const PHASES: usize = 50;
/// By how much the mean of the usual gaps may be off, in packets.
const ROUGH: f64 = 0.25;
/// By how much a number on an even grid may differ from a whole one.
const WHOLE: f64 = 0.01;
/// Times that the place of a period is narrowed down.
const NARROWINGS: usize = 40;
/// By how much a packet's number may differ from the last one before the hold's instant, rounding aside.
const SLACK: f64 = 1e-6;

/// Period of a hold and when it takes a new packet first \[s\], by the receiver's clock from the recording's start; `None`
/// where packets have no numbers or come one by one, a few lost ones aside.
pub(crate) fn hold(pieces: &[Piece]) -> Option<[f64; 2]> {
    pieces.iter().find_map(of)
}

fn of(piece: &Piece) -> Option<[f64; 2]> {
    let received = piece.signals.get("received.sequence")?;
    // First row of each number, sorted by number: jitter changes their order.
    let mut first: Vec<(f64, usize)> = Vec::new();
    for (row, raw) in received.iter().enumerate() {
        let number = raw.round();
        if number < 0.0 || (raw - number).abs() > WHOLE {
            continue;
        }
        if let Err(place) = first.binary_search_by(|known| known.0.total_cmp(&number)) {
            first.insert(place, (number, row));
        }
    }
    if first.len() < FEWEST {
        return None;
    }
    let numbers: Vec<f64> = first.iter().map(|(number, _)| *number).collect();
    let Some(counts) = counts(&numbers) else {
        let is_new: Vec<bool> =
            std::iter::once(false).chain(received.windows(2).map(|pair| (pair[1] - pair[0]).abs() > 0.5)).collect();
        return short(&numbers, &is_new).map(|rows| rows.map(|rows| rows * piece.step));
    };
    let period = period(&numbers, &counts)?;
    // It came between its row and the one before.
    let phase = |((_, row), count): (&(f64, usize), &f64)| *row as f64 - 0.5 - count * period;
    let mut phases: Vec<f64> = first.iter().zip(&counts).map(phase).collect();
    phases.sort_by(f64::total_cmp);
    Some([period * piece.step, phases[phases.len() / 2].rem_euclid(period) * piece.step])
}

/// Returns period and phase, in rows, of a hold slightly slower than the packets, which come one per row: it
/// periodically skips a packet, and some rows have none. Jitter adds further skips and empty rows, so the period is
/// estimated from the beat, and the phase from the predicted rows.
fn short(numbers: &[f64], is_new: &[bool]) -> Option<[f64; 2]> {
    let passed: Vec<f64> = numbers.windows(2).filter(|pair| pair[1] - pair[0] > 1.5).map(|pair| pair[0]).collect();
    let (count, whole) = (passed.len() as f64, numbers.last()? - numbers[0]);
    if passed.len() < FEWEST_PASSED || count / whole > 1.0 - 1.0 / SHORTEST {
        return None;
    }
    let evenness = |beats: f64| {
        let sum = passed.iter().fold([0.0; 2], |[x, y], place| {
            let (sine, cosine) = (TAU * beats * place / whole).sin_cos();
            [x + cosine, y + sine]
        });
        sum[0].hypot(sum[1]) / count
    };
    let tried = ((BEATS[1] - BEATS[0]) * count / FINE) as usize;
    let tried = (0..=tried).map(|k| BEATS[0] * count + FINE * k as f64).map(|beats| (evenness(beats), beats));
    let (most, beats) = tried.max_by(|a, b| a.0.total_cmp(&b.0))?;
    let period = 1.0 / (1.0 - beats / whole);
    let foretold = |phase: f64| {
        let instants = |row: f64| ((row - phase) / period).floor();
        let is_right = |(row, own): (usize, &bool)| (instants(row as f64) > instants(row as f64 - 1.0)) == *own;
        is_new.iter().enumerate().filter(|(row, own)| is_right((*row, own))).count()
    };
    let phases = (0..PHASES).map(|k| period * k as f64 / PHASES as f64);
    let phase = phases.max_by_key(|phase| foretold(*phase))?;
    (most > EVEN).then_some([period, phase])
}

/// Returns the period, in packets, with the widest range of its first instant: every number is the integer part of its
/// instant. The width is a concave function of the period; `None` if it is not positive.
fn period(numbers: &[f64], counts: &[f64]) -> Option<f64> {
    let span = |period: f64| {
        let after = |(number, count): (&f64, &f64)| number - numbers[0] - count * period;
        let [least, most] = numbers
            .iter()
            .zip(counts)
            .map(after)
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], own| [least.min(own), most.max(own)]);
        1.0 + least - most
    };
    let (whole, last) = (numbers.last()? - numbers[0], *counts.last()?);
    let (mut low, mut high) = ((whole - 1.0) / last, (whole + 1.0) / last);
    for _ in 0..NARROWINGS {
        let third = (high - low) / 3.0;
        if span(low + third) < span(high - third) { low += third } else { high -= third }
    }
    let period = 0.5 * (low + high);
    (span(period) > 0.0).then_some(period)
}

/// Returns the number of periods of each packet after the first, if all are of a hold's instants; `None` otherwise.
///
/// Every number n of the m-th instant bounds m P between n and n + 1, counted from the first one. A first estimate
/// gives the m of the next numbers, which refine P to a share of their distance.
fn counts(numbers: &[f64]) -> Option<Vec<f64>> {
    let gaps: Vec<f64> = numbers.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let mut sorted = gaps.clone();
    sorted.sort_by(f64::total_cmp);
    // None is lost in the usual gap, nor in one that differs by the rounding.
    let usual = sorted[sorted.len() / 2];
    let near: Vec<f64> = gaps.iter().copied().filter(|gap| (gap - usual).abs() < 1.5).collect();
    let rough = near.iter().sum::<f64>() / near.len() as f64;
    if rough < SHORTEST {
        return None;
    }
    let (mut low, mut high) = (rough - ROUGH, rough + ROUGH);
    let mut counts = vec![0.0];
    for (gap, number) in gaps.iter().zip(&numbers[1..]) {
        let count = counts[counts.len() - 1] + (gap / rough).round().max(1.0);
        counts.push(count);
        let whole = number - numbers[0];
        // The first number may be anywhere below its instant too.
        (low, high) = (low.max((whole - 1.0) / count), high.min((whole + 1.0) / count));
        if low > high + SLACK {
            return None;
        }
    }
    Some(counts)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(period: f64, lost: impl Fn(usize) -> bool) -> Vec<f64> {
        (0..1000).filter(|m| !lost(*m)).map(|m| (m as f64 * period + 0.3).floor()).collect()
    }

    #[test]
    fn hold_period_is_determined_by_packet_numbers() {
        for own in [1.6, 2.088_547, 2.277_577, 4.0, 4.177_095, 8.3] {
            for lost in [0, 37] {
                let numbers = numbers(own, |m| lost > 0 && m % lost == 5);
                let found = counts(&numbers).and_then(|counts| period(&numbers, &counts)).expect("a hold");
                assert!((found / own - 1.0).abs() < 2e-5, "{own}: {found}");
            }
        }
    }

    #[test]
    fn hold_period_near_the_packet_period_is_determined_despite_jitter() {
        let jitter = |m: f64| 0.03 * softdock_kernels::philox::uniform(5, "restless", 0, m as u32);
        for (own, phase) in [(1.03, 0.3), (1.044_274, 0.9), (1.31, 0.6)] {
            let held = |row: usize| {
                let instant = ((row as f64 - phase) / own).floor();
                (instant * own + phase + jitter(instant + 10.0)).floor()
            };
            let rows: Vec<f64> = (0..8000).map(held).collect();
            let is_new: Vec<bool> = (0..rows.len()).map(|row| row > 0 && rows[row] != rows[row - 1]).collect();
            let mut numbers = rows;
            numbers.dedup();
            let [period, found] = short(&numbers, &is_new).expect("a hold");
            assert!((period / own - 1.0).abs() < 2e-5, "{own}: {period}");
            let apart = (found - phase).rem_euclid(own);
            assert!(apart.min(own - apart) < 0.1, "{phase}: {found}");
        }
    }

    #[test]
    fn lost_packets_are_not_a_hold() {
        for share in [0.0, 0.01, 0.3, 0.5] {
            let draw = |m: usize| softdock_kernels::philox::uniform(3, "losses", 0, m as u32);
            let numbers = numbers(1.0, |m| draw(m) < share);
            let is_new: Vec<bool> = (0..1000).map(|m| draw(m) >= share).collect();
            assert_eq!((counts(&numbers), short(&numbers, &is_new)), (None, None), "{share}");
        }
    }
}
