//! Adequacy of a fit on held-out motion: the evidence ranks hypotheses, adequacy decides whether a cause is named.

use super::bootstrap::{Pair, interval, interval_elsewhere};
use super::evidence::log_normal_cdf;

/// Mean square of whitened residuals up to which a fit is adequate, however many they are.
pub(crate) const ADEQUATE: f64 = 1.3;
/// Standard deviations by which a ratio of powers must exceed 1 to be significant.
const CERTAIN: f64 = 4.0;

/// Share of the residual that a hypothesis explains on a motion that hardly excites it.
const FAINT: f64 = 0.01;

/// Held-out residuals per sample, in units of the noise variance of the held-out motions.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Adequacy {
    /// Mean square of the whitened residuals with the hypothesis; noise alone gives 1.
    pub with: f64,
    /// The same with the noise of repeats under the hypothesis, since a resonance also propagates the noise of the
    /// torque.
    pub own: f64,
    /// Without the hypothesis.
    pub without: f64,
    /// Share of the non-noise power that the hypothesis explains.
    pub explained: f64,
    /// Mean square up to which a fit is adequate, including chance for this number of samples.
    pub tolerated: f64,
    /// Relative reduction of the residual's root mean square.
    pub gain: f64,
    /// Bound of its 95 % interval.
    pub gain_lo: f64,
    /// Bound of its 95 % interval.
    pub gain_hi: f64,
    /// 95 % interval of the gain on a motion that was not recorded, if several were.
    pub gain_elsewhere: Option<[f64; 2]>,
}

impl Adequacy {
    /// Returns whether the fit leaves no more than noise.
    pub(crate) fn leaves_noise(&self) -> bool {
        self.own <= self.tolerated
    }
}

/// Noise level of motions, in units of the noise that whitens their residuals.
#[derive(Clone, Copy, Debug)]
pub struct Level {
    /// Power of the noise.
    pub power: f64,
    /// Number of independent samples that determine it.
    pub samples: f64,
}

impl Level {
    /// Level of the training noise, used if the motions have no repeats.
    pub const LEARNT: Self = Self { power: 1.0, samples: f64::INFINITY };
}

/// Returns the greatest ratio of two powers of the same noise that counts as chance for these numbers of independent
/// samples, at least [`ADEQUATE`].
pub(crate) fn tolerated(samples: [f64; 2]) -> f64 {
    let chance = samples.iter().map(|count| 2.0 / count).sum::<f64>().sqrt();
    ADEQUATE.max((CERTAIN * chance).exp())
}

/// Compares whitened residuals of the same held-out samples with and without a hypothesis. `carried` is the propagated
/// input noise in either, beyond that of the nominal parameters; `level` the noise level of these motions; `own` as in
/// [`Adequacy`].
pub fn adequacy(with: &[f64], own: f64, without: &[f64], carried: [f64; 2], level: Level) -> Adequacy {
    let (x, x0) = (less(power(with), carried[0]) / level.power, less(power(without), carried[1]) / level.power);
    let tolerated = tolerated([with.len() as f64, level.samples]);
    let [gain_lo, gain_hi] = gain_interval([with, without], carried);
    let explained = if x0 > 1.0 { 1.0 - (own - 1.0).max(0.0) / (x0 - 1.0) } else { 0.0 };
    let gain = gain(cleared([power(with), power(without)], carried));
    Adequacy { with: x, own, without: x0, explained, tolerated, gain, gain_lo, gain_hi, gain_elsewhere: None }
}

/// Returns the 95 % interval of the gain on the motion of the residuals; see [`adequacy`].
pub fn gain_interval(pair: Pair<'_>, carried: [f64; 2]) -> [f64; 2] {
    interval(pair, &|powers| gain(cleared(powers, carried)))
}

/// 95 % interval of the gain on a motion that was not recorded, by the residuals of those that were, learnt from or held
/// out; `None` of one alone.
pub(crate) fn gain_elsewhere(motions: &[Pair<'_>], carried: [f64; 2]) -> Option<[f64; 2]> {
    let shown = |powers| {
        let [x, x0] = cleared(powers, carried);
        (x0 / x - 1.0).max(FAINT).ln()
    };
    let gain_of = |powers, times| {
        let [x, x0] = cleared(powers, carried);
        gain([x, if x < x0 { (x0 - x).mul_add(times, x) } else { x0 }])
    };
    interval_elsewhere(motions, &shown, &gain_of)
}

/// Longest lag of the scatter's correlation, as a share of the samples.
const LONGEST_LAG: f64 = 0.02;

/// Returns the log-odds that one fit is closer to the data than another when neither is true, from their whitened
/// residuals at the same samples: the difference of their squares against its scatter along the recording, with the
/// correlation of neighbouring samples (Vuong, Econometrica 57 (1989) 307; Newey and West, Econometrica 55 (1987) 703).
/// 0 for equal fits.
pub(crate) fn log_odds_of_closeness(closer: &[f64], other: &[f64]) -> f64 {
    let count = closer.len();
    let difference: Vec<f64> = closer.iter().zip(other).map(|(own, other)| other * other - own * own).collect();
    let sum: f64 = difference.iter().sum();
    let mean = sum / count as f64;
    let lags = (LONGEST_LAG * count as f64) as usize;
    let product =
        |lag: usize| -> f64 { difference.iter().zip(&difference[lag..]).map(|(a, b)| (a - mean) * (b - mean)).sum() };
    let weight = |lag: usize| 2.0 * (1.0 - lag as f64 / (lags + 1) as f64);
    let scatter = product(0) + (1..=lags).map(|lag| weight(lag) * product(lag)).sum::<f64>();
    let z = sum / scatter.max(f64::MIN_POSITIVE).sqrt();
    if sum == 0.0 { 0.0 } else { log_normal_cdf(z) - log_normal_cdf(-z) }
}

/// Mean square.
fn power(w: &[f64]) -> f64 {
    w.iter().map(|w| w * w).sum::<f64>() / w.len() as f64
}

/// By how much the root mean square falls, by the mean squares with and without.
fn gain([x, x0]: [f64; 2]) -> f64 {
    1.0 - (x / x0).sqrt()
}

/// Returns the powers with and without a hypothesis, less the propagated input noise. If repeats scatter less than
/// under the nominal parameters, the difference counts as explained.
fn cleared(powers: [f64; 2], carried: [f64; 2]) -> [f64; 2] {
    [0, 1].map(|i| less(powers[i], carried[i].max(0.0)))
}

/// Limits the difference to a positive value, so that ratios are finite.
fn less(power: f64, carried: f64) -> f64 {
    (power - carried).max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hypothesis_that_halves_the_residual_gains_a_half() {
        let without: Vec<f64> = (0..2000).map(|i| 10.0 * (0.1 * f64::from(i)).sin()).collect();
        let with: Vec<f64> = without.iter().map(|w| 0.5 * w).collect();
        let found = adequacy(&with, power(&with), &without, [0.0; 2], Level::LEARNT);
        assert!((found.gain - 0.5).abs() < 1e-12 && found.gain_lo > 0.49 && found.gain_hi < 0.51, "{found:?}");
        assert!((found.without - 50.0).abs() < 0.5 && (found.explained - 0.765).abs() < 0.01, "{found:?}");
    }

    #[test]
    fn propagated_noise_does_not_reduce_the_gain() {
        let noise = |i: i32, k: f64| (f64::from(i) * k).sin() * 2_f64.sqrt();
        let without: Vec<f64> = (0..4000).map(|i| noise(i, 12.9898) + noise(i, 0.01)).collect();
        let with: Vec<f64> = (0..4000).map(|i| noise(i, 12.9898) + noise(i, 1.37)).collect();
        let found = adequacy(&with, power(&with), &without, [1.0, 0.0], Level::LEARNT);
        assert!((found.gain - (1.0 - 0.5_f64.sqrt())).abs() < 0.02, "{found:?}");
        assert!(found.gain_lo < found.gain && found.gain < found.gain_hi, "{found:?}");
    }

    #[test]
    fn gain_interval_on_other_motion_exceeds_the_recorded_gains() {
        let noise = |i: i32| (f64::from(i) * 12.9898).sin() * 1.4;
        let shown = |size: f64| -> Vec<f64> { (0..2000).map(|i| noise(i) + size * noise(7 * i + 3)).collect() };
        let (none, little, much) = (shown(0.0), shown(0.5), shown(5.0));
        let of = |motions: &[Pair<'_>]| gain_elsewhere(motions, [0.0; 2]);
        let [lo, hi] = of(&[[&none, &little], [&none, &little], [&none, &little]]).expect("three motions");
        assert!((0.10..0.106).contains(&lo) && (0.106..0.11).contains(&hi), "motions alike: {lo} {hi}");
        let [lo, hi] = of(&[[&none, &little], [&none, &much], [&none, &little]]).expect("three motions");
        assert!((0.0..0.05).contains(&lo) && (0.85..0.99).contains(&hi), "{lo} {hi}");
        assert_eq!(of(&[[&none, &much]]), None, "one motion does not determine others");
    }

    #[test]
    fn closeness_is_as_sure_as_the_scatter_along_the_recording() {
        let noise = |i: u32, k: f64| (f64::from(i) * k).sin() * 2_f64.sqrt();
        let odds = |size: f64, beat: f64| {
            let other = |i: u32| noise(i, 12.9898) + size * (1.0 + noise(i, beat));
            let all = |of: &dyn Fn(u32) -> f64| (0..4000).map(of).collect::<Vec<f64>>();
            log_odds_of_closeness(&all(&|i| noise(i, 12.9898)), &all(&other))
        };
        assert_eq!(odds(0.0, 0.1), 0.0);
        assert!(odds(0.5, 0.1) > 20.0, "{}", odds(0.5, 0.1));
        assert!(odds(0.5, 0.005) < 0.5 * odds(0.5, 0.1), "in few stretches: {}", odds(0.5, 0.005));
    }

    #[test]
    fn few_samples_widen_the_adequacy_limit() {
        assert!((tolerated([467.0, 934.0]) - 1.378).abs() < 1e-3, "a few seconds of motion");
        assert!((tolerated([467.0, f64::INFINITY]) - 1.299).abs() < 2e-3, "whose noise is known");
        assert_eq!(tolerated([4000.0, 8000.0]), ADEQUATE, "a minute");
    }

    #[test]
    fn gain_of_a_short_touch_is_independent_of_the_recording_length() {
        let noise = |i: i32| (f64::from(i) * 12.9898).sin() * 1.4;
        let touch = |i: i32| if (5000..5100).contains(&i) { 20.0 } else { 0.0 };
        let without: Vec<f64> = (0..10_000).map(|i| noise(i) + touch(i)).collect();
        let with: Vec<f64> = (0..10_000).map(|i| noise(i) + 0.1 * touch(i)).collect();
        let found = adequacy(&with, power(&with), &without, [0.0; 2], Level::LEARNT);
        assert!(found.gain_lo > 0.5 && found.gain_lo < found.gain && found.gain < found.gain_hi, "{found:?}");
        let same = adequacy(&with, power(&with), &with, [0.0; 2], Level::LEARNT);
        assert_eq!((same.gain_lo, same.gain_hi), (0.0, 0.0), "nothing changed");
    }
}
