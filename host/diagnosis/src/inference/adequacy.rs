//! Whether a fit explains motion that it has not seen: evidence ranks, adequacy decides whether any name may be spoken.

use softdock_kernels::philox;

/// Mean square of whitened residuals up to which a fit is adequate.
pub(crate) const ADEQUATE: f64 = 1.3;

/// Resamples of the bootstrap.
const RESAMPLES: usize = 2000;
/// Blocks of the bootstrap, at least: fewer would hold too few independent stretches.
const FEWEST_BLOCKS: usize = 20;
/// Difference of residuals from which on a sample is changed, in units of the noise.
const CHANGED: f64 = 1e-3;
/// Seed of the bootstrap: the same data give the same interval.
const SEED: u64 = 1;

/// What held-out residuals say, all per sample and in units of the noise's variance.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Adequacy {
    /// Mean square of the whitened residuals with the hypothesis; 1 if nothing but noise is left.
    pub with: f64,
    /// The same by the noise that repeats have if the hypothesis holds: a resonance carries the torque's noise too.
    pub own: f64,
    /// Without the hypothesis.
    pub without: f64,
    /// Share of what is not noise that the hypothesis explains.
    pub explained: f64,
    /// By how much the residual's root mean square falls.
    pub gain: f64,
    /// Its 95 % interval.
    pub gain_lo: f64,
    /// Its 95 % interval.
    pub gain_hi: f64,
}

/// Compares whitened residuals of the same held-out samples with and without a hypothesis, `carried` the power in either
/// of noise that the simulation lets through beyond what the model's own lets through; `own` are those with it, whitened
/// by the noise under it.
pub fn adequacy(with: &[f64], own: &[f64], without: &[f64], carried: [f64; 2]) -> Adequacy {
    let power = |w: &[f64]| w.iter().map(|w| w * w).sum::<f64>() / w.len() as f64;
    // Where as much is carried as is there nothing is left, and a share of nothing would be no number.
    let less = |power: f64, carried: f64| (power - carried).max(f64::MIN_POSITIVE);
    let (x, own, x0) = (less(power(with), carried[0]), power(own), less(power(without), carried[1]));
    let gain = |x: f64, x0: f64| 1.0 - (x / x0).sqrt();
    let count = with.len() as f64;
    let of_sums = |x: f64, x0: f64| gain(less(x / count, carried[0]), less(x0 / count, carried[1]));
    let [gain_lo, gain_hi] = interval(with, without, &of_sums);
    let explained = if x0 > 1.0 { 1.0 - (own - 1.0).max(0.0) / (x0 - 1.0) } else { 0.0 };
    Adequacy { with: x, own, without: x0, explained, gain: gain(x, x0), gain_lo, gain_hi }
}

/// 95 % interval of a function of both sums of squares by the moving-block bootstrap (Kuensch 1989), over the samples that
/// the hypothesis changes: a touch fills a small part of a recording, and that there is one is no chance.
fn interval(with: &[f64], without: &[f64], f: &dyn Fn(f64, f64) -> f64) -> [f64; 2] {
    let is_changed = |pair: &(&f64, &f64)| (pair.0 - pair.1).abs() > CHANGED;
    let (changed, kept): (Vec<_>, Vec<_>) = with.iter().zip(without).partition(is_changed);
    let kept = kept.into_iter().fold((0.0, 0.0), |sum, (x, x0)| (sum.0 + x * x, sum.1 + x0 * x0));
    let (with, without): (Vec<f64>, Vec<f64>) = changed.into_iter().unzip();
    let n = with.len();
    if n == 0 {
        return [f(kept.0, kept.1); 2];
    }
    let length = (n / FEWEST_BLOCKS).clamp(1, 200);
    let running = |w: &[f64]| -> Vec<f64> {
        let sums = w.iter().scan(0.0, |sum, w| {
            *sum += w * w;
            Some(*sum)
        });
        std::iter::once(0.0).chain(sums).collect()
    };
    let (with, without) = (running(&with), running(&without));
    let blocks = n / length;
    // Blocks of whole length leave a rest, which counts as the others do.
    let scale = n as f64 / (blocks * length) as f64;
    let one = |resample: u64| {
        let (mut x, mut x0) = (0.0, 0.0);
        for block in 0..blocks {
            let u = philox::uniform(SEED, "bootstrap", resample, block as u32);
            let from = ((n - length + 1) as f64 * u) as usize;
            x += with[from + length] - with[from];
            x0 += without[from + length] - without[from];
        }
        f(scale * x + kept.0, scale * x0 + kept.1)
    };
    let mut values: Vec<f64> = (0..RESAMPLES as u64).map(one).collect();
    values.sort_by(f64::total_cmp);
    [values[RESAMPLES / 40], values[RESAMPLES - 1 - RESAMPLES / 40]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hypothesis_that_halves_the_residual_gains_a_half() {
        let without: Vec<f64> = (0..2000).map(|i| 10.0 * (0.1 * f64::from(i)).sin()).collect();
        let with: Vec<f64> = without.iter().map(|w| 0.5 * w).collect();
        let found = adequacy(&with, &with, &without, [0.0; 2]);
        assert!((found.gain - 0.5).abs() < 1e-12 && found.gain_lo > 0.49 && found.gain_hi < 0.51, "{found:?}");
        assert!((found.without - 50.0).abs() < 0.5 && (found.explained - 0.765).abs() < 0.01, "{found:?}");
    }

    #[test]
    fn noise_that_a_hypothesis_lets_through_is_no_loss() {
        let noise = |i: i32, k: f64| (f64::from(i) * k).sin() * 2_f64.sqrt();
        let without: Vec<f64> = (0..4000).map(|i| noise(i, 12.9898) + noise(i, 0.01)).collect();
        let with: Vec<f64> = (0..4000).map(|i| noise(i, 12.9898) + noise(i, 1.37)).collect();
        let found = adequacy(&with, &with, &without, [1.0, 0.0]);
        assert!((found.gain - (1.0 - 0.5_f64.sqrt())).abs() < 0.02, "{found:?}");
        assert!(found.gain_lo < found.gain && found.gain < found.gain_hi, "{found:?}");
    }

    #[test]
    fn a_touch_in_a_long_recording_gains_what_it_gains() {
        let noise = |i: i32| (f64::from(i) * 12.9898).sin() * 1.4;
        let touch = |i: i32| if (5000..5100).contains(&i) { 20.0 } else { 0.0 };
        let without: Vec<f64> = (0..10_000).map(|i| noise(i) + touch(i)).collect();
        let with: Vec<f64> = (0..10_000).map(|i| noise(i) + 0.1 * touch(i)).collect();
        let found = adequacy(&with, &with, &without, [0.0; 2]);
        assert!(found.gain_lo > 0.5 && found.gain_lo < found.gain && found.gain < found.gain_hi, "{found:?}");
        let same = adequacy(&with, &with, &with, [0.0; 2]);
        assert_eq!((same.gain_lo, same.gain_hi), (0.0, 0.0), "nothing changed");
    }
}
