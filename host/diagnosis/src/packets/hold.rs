//! Period of a hold, by the numbers of the packets that came through it.

use crate::recording::grid::Piece;

/// Fewest packets that tell a period.
const FEWEST: usize = 20;
/// Shortest period whose instants are told from the ones beside by a packet's number, in packets.
const SHORTEST: f64 = 1.4;
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
    let numbers = piece.signals.get("received.sequence")?;
    // Where each number shows first, by numbers: a restless delay brings them in another order.
    let mut first: Vec<(f64, usize)> = Vec::new();
    for (row, raw) in numbers.iter().enumerate() {
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
    let counts = counts(&numbers)?;
    let period = period(&numbers, &counts)?;
    // It came between its row and the one before.
    let phase = |((_, row), count): (&(f64, usize), &f64)| *row as f64 - 0.5 - count * period;
    let mut phases: Vec<f64> = first.iter().zip(&counts).map(phase).collect();
    phases.sort_by(f64::total_cmp);
    Some([period * piece.step, phases[phases.len() / 2].rem_euclid(period) * piece.step])
}

/// Period that leaves most room for when its first instant was, in packets: every number is the last whole one of its
/// instant. The room is a concave function of the period, which has one such place; `None` if there is no room.
fn period(numbers: &[f64], counts: &[f64]) -> Option<f64> {
    let room = |period: f64| {
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
        if room(low + third) < room(high - third) { low += third } else { high -= third }
    }
    let period = 0.5 * (low + high);
    (room(period) > 0.0).then_some(period)
}

/// How many periods after the first number each came, if all are of a hold's instants; `None` if they are not.
///
/// Every number n of the m-th instant says that m P lies between n and n + 1, counted from where the first one did: a
/// beginning tells which m the next numbers have, and these tell P to a share of their distance.
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
    fn a_period_is_told_by_numbers_alone() {
        for own in [1.6, 2.088_547, 2.277_577, 4.0, 4.177_095, 8.3] {
            for lost in [0, 37] {
                let numbers = numbers(own, |m| lost > 0 && m % lost == 5);
                let found = counts(&numbers).and_then(|counts| period(&numbers, &counts)).expect("a hold");
                assert!((found / own - 1.0).abs() < 2e-5, "{own}: {found}");
            }
        }
    }

    #[test]
    fn packets_that_get_lost_are_no_hold() {
        for share in [0.0, 0.01, 0.3, 0.5] {
            let draw = |m: usize| softdock_kernels::philox::uniform(3, "losses", 0, m as u32);
            assert_eq!(counts(&numbers(1.0, |m| draw(m) < share)), None, "{share}");
        }
    }
}
