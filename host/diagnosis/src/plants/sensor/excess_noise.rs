//! Excess noise of a sensor: a zero-mean effect, judged by repeat-to-repeat variance.

use super::quantisation;
use super::quantisation::{Step, of_both};
use crate::data::grid::Piece;
use crate::inference::autocorrelation::{CorrelationTime, power};
use crate::inference::evidence::{CredibleInterval, log_sum};
use crate::inference::noise::deviations;
use crate::model::block::MeasuredBlock;
use crate::plants::sensor::block::READINGS;
use crate::verdict::answer::{Beside, BlockAnswer};
use crate::verdict::estimates::ParameterEstimate;
use nalgebra::DMatrix;
use softdock_campaign::rig::SensorRig;
use softdock_kernels::effects::{Effect, EffectId};
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// Excess noise of a sensor, estimated from repeats.
#[derive(Clone, Debug)]
pub struct ExcessNoise {
    /// Its row of the effect table.
    pub effect: &'static Effect,
    /// Log-odds against the healthy sensor's noise alone: difference of log evidence.
    pub log_odds: f64,
    /// Quantisation step of all raw forces \[N\], which adds noise.
    pub step: Option<Step>,
    /// Log-odds of noise beyond that of the quantisation; `log_odds` without quantisation.
    pub beyond_steps: f64,
    /// Standard deviation of the noise beyond that of the healthy sensor and of the quantisation, with its 95 %
    /// interval: force \[N\], moment \[N m\].
    pub deviation: [CredibleInterval; 2],
    /// Correlation time of the noise, to 1/e \[s\].
    pub correlation_time: f64,
}

impl ExcessNoise {
    /// The steps that all readings lie on, as an effect.
    pub(crate) fn rounding(&self) -> Option<Beside> {
        let Step { size, resolution } = self.step?;
        let known = CredibleInterval { value: size, lo: size - resolution, hi: size + resolution };
        let parameters = BTreeMap::from([("resolution".to_owned(), ParameterEstimate::new(known, "N"))]);
        let effect = EffectId::of("S6_quantisation").effect();
        Some(Beside { effect, name: quantisation::NAME, parameters, log_odds: self.log_odds })
    }

    /// The noise beyond that of the steps, as an effect.
    pub(crate) fn beyond(&self) -> Beside {
        let [force, moment] =
            [(0, "N"), (1, "N m")].map(|(kind, unit)| ParameterEstimate::new(self.deviation[kind], unit));
        let parameters = [("noise_force".to_owned(), force), ("noise_moment".to_owned(), moment)].into();
        Beside { effect: self.effect, name: "noise beyond the sensor's own", parameters, log_odds: self.beyond_steps }
    }
}

impl BlockAnswer {
    /// Returns the answer with excess noise of a sensor, where repeats scatter by more than its own noise, and with the
    /// quantisation that causes it. `without` lists effects that are excluded from the library.
    #[must_use]
    pub fn with_noise(self, noise: &ExcessNoise, without: &[String]) -> Self {
        let stairs = self.effects.iter().any(|effect| effect.id.starts_with("S6"));
        // A quantised reading differs between repeats at the edges of its steps.
        if noise.log_odds < self.threshold || stairs && noise.step.is_none() {
            return self;
        }
        let steps = noise.rounding().filter(|_| !stairs);
        let beyond = Some(noise.beyond()).filter(|beyond| beyond.log_odds >= self.threshold);
        steps.into_iter().chain(beyond).fold(self, |answer, found| {
            match without.iter().any(|id| id == found.effect.id) {
                true => answer.without_name(),
                false => answer.beside(found),
            }
        })
    }
}

/// The effect that repeats can show where the healthy sensor's noise is known.
pub(crate) fn visible(rig: &SensorRig, pieces: &[Piece]) -> Option<&'static str> {
    let is_visible = rig.noise.is_some() && pieces.iter().any(|piece| piece.repeat > 1);
    is_visible.then(|| EffectId::of("S7_noise").effect().id)
}

/// Compares the noise of a sensor's readings with the healthy noise; `None` if that is unknown or nothing was repeated.
pub fn excess_noise(rig: &SensorRig, block: &MeasuredBlock) -> Option<ExcessNoise> {
    let healthy = rig.noise?;
    let series = differences(block);
    if series.is_empty() {
        return None;
    }
    let correlation_time = CorrelationTime::of(&series);
    let step = block.trials[0].recorded.step * block.trials[0].recorded.stride as f64;
    let effect = EffectId::of("S7_noise").effect();
    let samples = 3.0 * correlation_time.samples(&series);
    let mean_power = |kind: usize| (3 * kind..3 * kind + 3).map(|c| power(&series, c)).sum::<f64>() / 3.0;
    let variances = [0, 1].map(|kind| correlation_time.bias(&series) * mean_power(kind));
    let exceeded = |kind: usize, other: f64| {
        let scale = effect.parameters[kind].scale;
        Healthy { deviation: healthy[kind], share: rig.noise_share, scale }.exceeded(variances[kind], other, samples)
    };
    let log_odds = exceeded(0, 0.0).1 + exceeded(1, 0.0).1;
    // Steps are looked for only where there is something that they could explain.
    let steps = if log_odds > 0.0 { of_both(block) } else { [None; 2] };
    let [force, moment] = [0, 1].map(|kind| exceeded(kind, steps[kind].map_or(0.0, Step::variance)));
    let (deviation, beyond_steps) = ([force.0, moment.0], force.1 + moment.1);
    let correlation_time = correlation_time.time * step;
    Some(ExcessNoise { effect, log_odds, step: steps[0], beyond_steps, deviation, correlation_time })
}

/// Noise that is known to a share.
pub(crate) struct Healthy {
    /// Its standard deviation.
    pub(crate) deviation: f64,
    /// Standard deviation of what that is known to, as a share of it.
    pub(crate) share: f64,
    /// Standard deviation of an excess of a plausible size.
    pub(crate) scale: f64,
}

impl Healthy {
    /// Standard deviation beyond it, with its 95 % interval, of a variance that so many independent samples have, up to
    /// `other` of it from elsewhere; and the log-odds for more noise against none.
    pub(crate) fn exceeded(&self, variance: f64, other: f64, samples: f64) -> (CredibleInterval, f64) {
        // A variance of n samples is known to a share of sqrt(2 / n).
        let share = 1.959_964 * (2.0 / samples).sqrt();
        let beyond = |variance: f64| (variance - self.deviation.powi(2)).max(0.0).sqrt();
        let (lo, hi) = (beyond(variance * (1.0 - share) - other), beyond(variance * (1.0 + share)));
        let interval = CredibleInterval { value: beyond(variance - other), lo, hi };
        // What is left is known to the same variance.
        let left = (variance - other).max(self.deviation.powi(2));
        let samples = samples * (left / variance).powi(2);
        (interval, odds(left / self.deviation.powi(2), samples, self.share, self.scale / self.deviation))
    }
}

/// What repeats of a sensor's readings differ by, one row a channel; none without repeats.
pub(crate) fn differences(block: &MeasuredBlock) -> Vec<DMatrix<f64>> {
    let mut repeats: BTreeMap<&str, Vec<DMatrix<f64>>> = BTreeMap::new();
    let shortest = block.trials.iter().map(|trial| trial.measured[0].len()).min().unwrap_or(0);
    for trial in &block.trials {
        let x = DMatrix::from_fn(READINGS.len(), shortest, |c, t| trial.measured[c][t]);
        repeats.entry(&trial.experiment).or_default().push(x);
    }
    repeats.values().flat_map(|list| deviations(list)).map(centred).collect()
}

/// A series without its mean: a constant is no noise.
fn centred(x: DMatrix<f64>) -> DMatrix<f64> {
    let mean = x.column_mean();
    DMatrix::from_fn(x.nrows(), x.ncols(), |c, t| x[(c, t)] - mean[c])
}

/// Log odds of a variance, in units of the healthy one that is known to a share, for an excess of a plausible size
/// against none. The logarithm of a variance is nearly normal; the excess is half-normal, summed by Simpson's rule.
fn odds(ratio: f64, samples: f64, share: f64, scale: f64) -> f64 {
    const PANELS: usize = 400;
    const WIDEST: f64 = 8.0;
    let spread = (2.0 / samples + 4.0 * share * share).sqrt();
    let log_density = |expected: f64| -0.5 * ((ratio.ln() - expected.ln()) / spread).powi(2);
    let width = WIDEST / PANELS as f64;
    let panel = |i: usize| {
        let (z, ends) = (width * i as f64, i == 0 || i == PANELS);
        let weight: f64 = if ends { 1.0 } else { 2.0 + 2.0 * (i % 2) as f64 };
        weight.ln() + log_density(1.0 + (scale * z).powi(2)) - 0.5 * z * z
    };
    let panels: Vec<f64> = (0..=PANELS).map(panel).collect();
    // The half-normal density is 2 / sqrt(2 pi) exp(-z^2 / 2).
    log_sum(panels.iter()) + (width / 3.0 * 2.0 / TAU.sqrt()).ln() - log_density(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_variance_beyond_the_healthy_noise_is_evidence_of_excess() {
        assert!(odds(1.0, 1e4, 0.1, 3.0) < 0.0);
        assert!(odds(1.3, 1e4, 0.1, 3.0) < 3.0, "within the tolerance of the healthy noise");
        assert!(odds(10.0, 1e4, 0.1, 3.0) > 20.0);
        assert!(odds(2.0, 1e4, 0.01, 3.0) > odds(2.0, 1e4, 0.1, 3.0), "the better it is known");
    }
}
