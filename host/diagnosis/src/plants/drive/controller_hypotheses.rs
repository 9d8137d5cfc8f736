//! Effects of the reference transmission to a controller: delay, lag, clock, hold, rate limit.

use crate::model::block::{MeasuredBlock, Trial};
use crate::model::hypothesis::{Hypothesis, Shelf};
use crate::model::unknown::{ParameterPrior, Role};
use rayon::prelude::*;
use softdock_engine::blocks::{BlockKind, simulate};

/// Returns the hypotheses of a controller.
pub fn effects(block: &MeasuredBlock) -> Vec<Hypothesis> {
    let mut shelf = Shelf::of(block);
    let references = || block.trials.iter().flat_map(|trial| trial.recorded.late.chunks(LATE));
    let fastest = references().fold(0.0_f64, |peak, r| peak.max(r[1].abs()));
    let late = ParameterPrior::Positive { scale: 5e-3 };
    shelf.add("C1_transport_delay", "transport delay", &[("delay", late, Role::Size)], &[0.5], &[]);
    shelf.add("C2_lag", "lag", &[("lag", late, Role::Size)], &[0.5], &[]);
    let skew = ParameterPrior::Normal { mean: 0.0, sd: 2e-4 };
    shelf.add("C5_clock_skew", "skew", &[("clock_skew", skew, Role::Size)], &[1.0], &[]);
    let hold = [("hold", late, Role::Size)];
    let lacking = Lacking::all(block);
    let sizes: Vec<f64> = seen_hold(&lacking).map(|seen| late.place(seen)).into_iter().chain([0.8]).collect();
    shelf.add("C6_hold", "hold between packets", &hold, &sizes, &[]);
    let limit = ParameterPrior::Below { top: fastest, share: 0.2 };
    let sizes: Vec<f64> = seen_limit(&lacking).map(|seen| limit.place(seen)).into_iter().chain([1.0]).collect();
    let rate = [("rate_limit", limit, Role::Size)];
    shelf.add("C7_rate_limit", "rate limit", &rate, &sizes, &[]);
    shelf.all
}

/// Fields of a reference.
const LATE: usize = 5;
/// Longest hold that is looked for \[s\].
const LONGEST_HOLD: f64 = 0.04;
/// Time of each recording by which holds are compared at first \[s\], and ratio of neighbours among them: what they differ
/// by at its end is less than a period of a controller.
const GLANCE: f64 = 2.0;
const RATIO: f64 = 7e-4;
/// Rounds in which the ratio is refined, each this many times.
const ROUNDS: i32 = 4;
const FINER: f64 = 10.0;
/// Share of the torque's misfit that a hold must explain to be tried.
const SEEN: f64 = 0.1;

/// Returns the period of the hold that explains most of the missing torque; `None` if none explains much.
///
/// The edges of a hold move by their number times what its period moves by, so that a fit finds the period from
/// nearby only. What the reference asks for has no memory: what it would ask for with a hold is looked up.
fn seen_hold(lacking: &[Lacking]) -> Option<f64> {
    let period = lacking.first()?.period;
    let count = (LONGEST_HOLD / period).ln() / RATIO;
    let tried = (0..count.max(0.0) as i32).into_par_iter().map(|k| period * (RATIO * f64::from(k)).exp());
    let left = |hold: f64, until: f64| lacking.iter().map(|own| own.left(hold, until)).sum::<f64>();
    let least = |a: &(f64, f64), b: &(f64, f64)| a.0.total_cmp(&b.0);
    let (glance, mut best) = tried.map(|hold| (left(hold, GLANCE), hold)).min_by(least)?;
    if glance > (1.0 - SEEN) * left(period, GLANCE) {
        return None;
    }
    for round in 1..=ROUNDS {
        let step = RATIO * FINER.powi(-round);
        let near = (-20..=20).map(|k| best * (step * f64::from(k)).exp());
        best = near.map(|hold| (left(hold, f64::INFINITY), hold)).min_by(least)?.1;
    }
    Some(best)
}

/// Returns the rate limit of the reference that explains most of the missing torque; `None` if none explains much.
fn seen_limit(lacking: &[Lacking]) -> Option<f64> {
    let fastest = lacking.iter().map(Lacking::fastest).fold(0.0, f64::max);
    let left = |limit: f64| lacking.iter().map(|own| own.left_by_limit(limit)).sum::<f64>();
    let lower = |k: i32| SLOWEST_LIMIT * (f64::from(k) / f64::from(LIMITS)).powi(2);
    let tried = (1..=LIMITS).into_par_iter().map(|k| fastest * (1.0 - lower(k)));
    let (least, best) = tried.map(|limit| (left(limit), limit)).min_by(|a, b| a.0.total_cmp(&b.0))?;
    (least < (1.0 - SEEN) * left(fastest)).then_some(best)
}

/// Limits that are tried, and share of the fastest rate by which the lowest is below it. They are closest near the fastest
/// rate: a limit that acts for a moment has a valley no wider than by how much it is below.
const LIMITS: i32 = 160;
const SLOWEST_LIMIT: f64 = 0.8;

/// Missing torque of a recording, and the torque commanded by its reference alone.
struct Lacking {
    /// Period of the controller \[s\], and periods in one of the log.
    period: f64,
    stride: usize,
    /// Measured torque less what the controller asks for, at the log's samples.
    torque: Vec<f64>,
    /// Torque commanded by the reference at every period of the controller.
    asked: Vec<f64>,
    /// The reference's angle there, and what the controller makes of angle and rate.
    angle: Vec<f64>,
    gains: [f64; 2],
}

impl Lacking {
    /// Of the first recording of each experiment that is learnt from.
    fn all(block: &MeasuredBlock) -> Vec<Self> {
        block.firsts(false).into_iter().map(|trial| Self::of(block, trial)).collect()
    }

    fn of(block: &MeasuredBlock, trial: &Trial) -> Self {
        let sets = [block.base.clone()];
        let simulated = simulate(BlockKind::Controller, &[&trial.recorded], &sets).remove(0).remove(0);
        let field = |name: &str| block.base[block.field(name)];
        let (gain, rate_gain) = (field("position_gain"), field("velocity_gain") + field("viscous"));
        let (inertia, coulomb, speed) = (field("inertia"), field("coulomb"), field("coulomb_speed"));
        let asked =
            |r: &[f64]| gain * r[0] + rate_gain * r[1] + inertia * r[2] + coulomb * (r[1] / speed).tanh() + r[3];
        Self {
            period: trial.recorded.step,
            stride: trial.recorded.stride,
            torque: trial.measured[0].iter().zip(simulated).map(|(tau, asked)| tau - asked).collect(),
            asked: trial.recorded.late.chunks(LATE).map(asked).collect(),
            angle: trial.recorded.late.iter().step_by(LATE).copied().collect(),
            gains: [gain, rate_gain],
        }
    }

    /// Greatest rate of the reference.
    fn fastest(&self) -> f64 {
        let rates = self.angle.windows(2).map(|pair| (pair[1] - pair[0]).abs() / self.period);
        rates.fold(0.0, f64::max)
    }

    /// Returns the residual sum of squares under a rate limit: while the limited reference lags behind the sent one,
    /// the controller receives it late and slower.
    fn left_by_limit(&self, limit: f64) -> f64 {
        let (mut at, mut sum) = (self.angle[0], 0.0);
        for (tick, sent) in self.angle.iter().enumerate() {
            let way = sent - at;
            let reach = limit * self.period;
            at += way.clamp(-reach, reach);
            if tick % self.stride == 0 {
                let faster = (self.angle[(tick + 1).min(self.angle.len() - 1)] - sent) / self.period;
                let behind = way.abs() > reach;
                let slower = if behind { limit.copysign(way) - faster } else { 0.0 };
                let change = self.gains[0] * (at - sent) + self.gains[1] * slower;
                sum += (self.torque[tick / self.stride] - change).powi(2);
            }
        }
        sum
    }

    /// Returns the residual sum of squares under a hold until a time \[s\].
    fn left(&self, hold: f64, until: f64) -> f64 {
        let periods = hold / self.period;
        let count = (until / (self.period * self.stride as f64)).min(self.torque.len() as f64) as usize;
        let at = |sample: usize| {
            let tick = (sample * self.stride) as f64;
            // Conversions cut off what is not whole, without a call, as `floor` would be.
            let held = f64::from((tick / periods + 1e-6) as u32) * periods;
            let before = held as usize;
            let share = held - before as f64;
            let next = self.asked[(before + 1).min(self.asked.len() - 1)];
            let asked = self.asked[before] + share * (next - self.asked[before]);
            (self.torque[sample] - (asked - self.asked[sample * self.stride])).powi(2)
        };
        (0..count).map(at).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_rate_limit_is_detected() {
        // Of two sines the rate exceeds 98.4 % of its peak for some milliseconds of every two seconds.
        let period = 1e-3;
        let angle: Vec<f64> = (0..6000)
            .map(|tick| f64::from(tick) * period)
            .map(|t| 0.2 * (std::f64::consts::PI * t).sin() + 0.1 * (5.0 * std::f64::consts::PI * t).sin())
            .collect();
        let mut own =
            Lacking { period, stride: 4, torque: vec![0.0; 1500], asked: Vec::new(), angle, gains: [35e3, 0.0] };
        let limit = 0.984 * own.fastest();
        // What the controller makes of the angle that arrives.
        let mut at = own.angle[0];
        for (tick, sent) in own.angle.iter().enumerate() {
            at += (sent - at).clamp(-limit * period, limit * period);
            if tick % own.stride == 0 {
                own.torque[tick / own.stride] = own.gains[0] * (at - sent);
            }
        }
        let seen = seen_limit(&[own]).expect("the limit explains all of it");
        assert!((seen / limit - 1.0).abs() < 2e-3, "{seen} for {limit}");
    }
}
