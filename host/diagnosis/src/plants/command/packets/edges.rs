//! Jitter and losses behind a hold, from the row that first shows each held packet, against the expected row.
//!
//! Jitter moves an instant across the tick of a row if it is near one, to either side; a loss delays any instant by a
//! row. The distance of the instants from their ticks is known from the hold's period, so that the two are separable.

use crate::inference::evidence::{CredibleInterval, log_sum};
use crate::plants::command::packets::{CHANCE, Echo, Found, came_before};
use softdock_kernels::effects::EffectId;
use statrs::distribution::{ContinuousCDF, Normal};

/// Parts of a row into which instants are sorted.
const PARTS: usize = 50;
/// Rows by which a held packet may be late, and is as late as that if it is later.
const LATEST: usize = 3;
/// Values of each unknown that are summed over.
const VALUES: usize = 40;
/// Smallest and greatest jitter \[s\] and probability of a loss that are looked for.
const JITTERS: [f64; 2] = [1e-6, 5e-3];
const LOSSES: [f64; 2] = [1e-5, 0.6];
/// Shifts of all instants that are tried, in parts of a row: the hold's phase is known to a few.
const SHIFTS: i32 = 4;
/// Deviations of the healthy noise that are tried, in those that it is known to.
const HEALTHY: [f64; 5] = [-2.0, -1.0, 0.0, 1.0, 2.0];

/// How often held packets showed early, in time or late, by how near to its tick their instant was.
struct Edges {
    /// By part of a row; early, in time, late by one row, by two, ...
    counts: Vec<[f64; LATEST + 2]>,
    /// A row \[s\].
    step: f64,
}

/// Jitter and losses behind a hold of a period and a phase \[s\]; `None` where packets have no numbers. The healthy delay
/// has a standard deviation \[s\] that is known to a share.
pub(super) fn behind_hold(echoes: &[Echo], hold: [f64; 2], healthy: f64, share: f64) -> Option<[Found; 2]> {
    Some(Edges::of(echoes, hold)?.judged(healthy, share))
}

/// Values of an unknown with the logarithms of their weights.
type Weighted = Vec<(f64, f64)>;

impl Edges {
    fn of(echoes: &[Echo], [period, phase]: [f64; 2]) -> Option<Self> {
        let step = echoes.first()?.piece.step;
        let mut counts = vec![[0.0; LATEST + 2]; PARTS];
        for echo in echoes {
            let numbers = echo.piece.signals.get("received.sequence")?;
            let mut last = f64::NEG_INFINITY;
            for (row, number) in numbers.iter().enumerate() {
                // Jitter may repeat the previous packet.
                if *number < last + 0.5 {
                    continue;
                }
                let is_first = last < 0.0;
                last = *number;
                let instant = |count: f64| (phase + count * period) / step;
                let count = ((row as f64 - 0.5 - instant(0.0)) / (period / step)).round();
                let due = instant(count).ceil();
                // Rows from the instant to its tick, 0 to 1.
                let part = (((due - instant(count)) * PARTS as f64) as usize).min(PARTS - 1);
                let late = row as f64 - due;
                if !is_first && late >= -1.0 && 2.0 * late < period / step {
                    counts[part][((late + 1.0) as usize).min(LATEST + 1)] += 1.0;
                }
            }
        }
        Some(Self { counts, step })
    }

    /// Jitter and losses, each with its log-odds against none, the other being there or not as is better.
    fn judged(&self, healthy: f64, share: f64) -> [Found; 2] {
        let steady = normalised(HEALTHY.iter().map(|z| (healthy * (z * share).exp(), -0.5 * z * z)).collect());
        let (jitters, losses) = (jitters(), losses());
        let jittered: Weighted = jitters.iter().map(|(jitter, log)| (healthy.hypot(*jitter), *log)).collect();
        let shifts = (-SHIFTS..=SHIFTS).map(|shift| (shift, self.best(shift, &jittered, &losses)));
        let shift = shifts.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(shift, _)| shift);
        let of = |noises: &Weighted, losses: &Weighted| self.logs(shift, noises, losses);
        let none = vec![(0.0, 0.0)];
        let all = [[of(&steady, &none), of(&steady, &losses)], [of(&jittered, &none), of(&jittered, &losses)]];
        let [[neither, lost], [jittered, both]] =
            all.each_ref().map(|row| row.each_ref().map(|logs| log_sum(logs.iter().flatten())));
        let by_jitter = all[1][usize::from(both > jittered)].iter().map(|row| log_sum(row.iter()));
        let jitter = Found {
            field: "delay_jitter",
            unit: "s",
            value: interval(jitters.iter().map(|(jitter, _)| *jitter).zip(by_jitter)),
            log_odds: jittered.max(both) - neither.max(lost),
        };
        let with_losses = &all[usize::from(both > lost)][1];
        let by_loss = (0..losses.len()).map(|place| log_sum(with_losses.iter().map(|row| &row[place])));
        let loss = Found {
            field: "drop_probability",
            unit: "1",
            value: interval(losses.iter().map(|(loss, _)| *loss).zip(by_loss)),
            log_odds: lost.max(both) - neither.max(jittered),
        };
        [jitter, loss]
    }

    /// Log-likelihood of a noise \[s\] and a probability of losses, if all instants are so many parts of a row nearer to
    /// their ticks.
    fn log(&self, shift: i32, noise: f64, loss: f64) -> f64 {
        let normal = Normal::standard();
        let beyond = |margin: f64| normal.sf(margin * self.step / noise).max(1e-300);
        let loss = loss + CHANCE - loss * CHANCE;
        let of = |(part, counts): (usize, &[f64; LATEST + 2])| {
            let margin = (part as f64 + 0.5 - f64::from(shift)) / PARTS as f64;
            let early = beyond(1.0 - margin);
            let mut log = counts[0] * early.ln();
            let mut later = 1.0 - early;
            for (late, count) in counts[1..].iter().enumerate() {
                let lost = loss + (1.0 - loss) * beyond(margin + late as f64);
                log += count * (later * (1.0 - lost)).max(1e-300).ln();
                later *= lost;
            }
            log
        };
        self.counts.iter().enumerate().map(of).sum()
    }

    /// Log-likelihoods with their priors, by noise and by loss.
    fn logs(&self, shift: i32, noises: &Weighted, losses: &Weighted) -> Vec<Vec<f64>> {
        let of = |(noise, own): &(f64, f64)| {
            losses.iter().map(|(loss, other)| self.log(shift, *noise, *loss) + own + other).collect()
        };
        noises.iter().map(of).collect()
    }

    /// How well a shift explains what showed, at the best.
    fn best(&self, shift: i32, noises: &Weighted, losses: &Weighted) -> f64 {
        let few = |list: &Weighted| list.iter().step_by(4).copied().collect::<Weighted>();
        self.logs(shift, &few(noises), &few(losses)).into_iter().flatten().fold(f64::NEG_INFINITY, f64::max)
    }
}

/// Plausible jitters: half-normal, spread evenly over their logarithm.
fn jitters() -> Weighted {
    let scale = EffectId::of("C3_jitter").effect().parameters[0].scale;
    let prior = |jitter: f64| -0.5 * (jitter / scale).powi(2) + jitter.ln();
    normalised(spread(JITTERS).map(|jitter| (jitter, prior(jitter))).collect())
}

/// Plausible probabilities of a loss, as [`losses`](super::losses) has them.
fn losses() -> Weighted {
    let wide = came_before();
    normalised(spread(LOSSES).map(|loss| (loss, (wide - 1.0) * (-loss).ln_1p() + loss.ln())).collect())
}

/// Values between two, their logarithms evenly spread.
fn spread([least, most]: [f64; 2]) -> impl Iterator<Item = f64> {
    (0..VALUES).map(move |i| least * (most / least).powf(i as f64 / (VALUES - 1) as f64))
}

/// Values with the logarithms of weights that sum to 1.
fn normalised(values: Weighted) -> Weighted {
    let sum = log_sum(values.iter().map(|(_, log)| log));
    values.into_iter().map(|(value, log)| (value, log - sum)).collect()
}

/// Median and 95 % interval of values with log weights, in rising order.
fn interval(values: impl Iterator<Item = (f64, f64)>) -> CredibleInterval {
    let (values, logs): (Vec<f64>, Vec<f64>) = values.unzip();
    let sum = log_sum(logs.iter());
    let below: Vec<f64> = logs
        .iter()
        .scan(0.0, |below, log| {
            let half = 0.5 * (log - sum).exp();
            let middle = *below + half;
            *below = middle + half;
            Some(middle)
        })
        .collect();
    let quantile = |share: f64| match below.iter().position(|own| *own >= share) {
        None => values[values.len() - 1],
        Some(0) => values[0],
        Some(place) => {
            let (low, high) = (below[place - 1], below[place]);
            let along = (share - low) / (high - low);
            values[place - 1] * (values[place] / values[place - 1]).powf(along)
        }
    };
    CredibleInterval { value: quantile(0.5), lo: quantile(0.025), hi: quantile(0.975) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use softdock_kernels::philox::uniform;

    const STEP: f64 = 1e-3;
    const HEALTHY_NOISE: f64 = 2e-5;

    /// Edges of many instants with such a noise \[s\] and probability of losses.
    fn drawn(noise: f64, loss: f64) -> Edges {
        let mut counts = vec![[0.0; LATEST + 2]; PARTS];
        for k in 0..18_000 {
            let draw = |name: &str, row: u32| uniform(5, name, k, row);
            let margin = draw("margin", 0);
            let late = |row: u32| {
                let normal = Normal::standard().inverse_cdf(draw("noise", row));
                normal * noise / STEP > margin + f64::from(row) - 1.0 || (row > 0 && draw("loss", row) < loss)
            };
            let row = (0..).find(|row| !late(*row)).expect("a packet that comes");
            counts[(margin * PARTS as f64) as usize][(row as usize).min(LATEST + 1)] += 1.0;
        }
        Edges { counts, step: STEP }
    }

    #[test]
    fn jitter_and_losses_are_separated() {
        let of = |noise: f64, loss: f64| {
            drawn(noise, loss).judged(HEALTHY_NOISE, 0.1).map(|found| (found.log_odds, found.value))
        };
        let [jitter, loss] = of(HEALTHY_NOISE, 0.0);
        assert!(jitter.0 < 1.0 && loss.0 < 1.0, "{jitter:?} {loss:?}");
        let [jitter, loss] = of(1e-4, 0.0);
        assert!(jitter.0 > 50.0 && loss.0 < 1.0, "{jitter:?} {loss:?}");
        assert!(jitter.1.lo < 9.9e-5 && jitter.1.hi > 9.7e-5, "{jitter:?}");
        let [jitter, loss] = of(HEALTHY_NOISE, 2e-3);
        assert!(jitter.0 < 1.0 && loss.0 > 20.0, "{jitter:?} {loss:?}");
        assert!(loss.1.lo < 2e-3 && loss.1.hi > 2e-3, "{loss:?}");
        let [jitter, loss] = of(1e-4, 4e-3);
        assert!(jitter.0 > 50.0 && loss.0 > 20.0, "{jitter:?} {loss:?}");
    }
}
