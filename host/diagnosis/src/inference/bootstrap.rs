//! Intervals of the gain of a hypothesis by the moving-block bootstrap (Kuensch 1989) over residuals with and without
//! it.

use softdock_kernels::noise::normals;
use softdock_kernels::philox;
use statrs::statistics::Statistics;

/// Resamples.
const RESAMPLES: usize = 2000;
/// Blocks, at least: fewer would hold too few independent stretches.
const FEWEST_BLOCKS: usize = 20;
/// Samples of a block, at most.
const LONGEST_BLOCK: usize = 200;
/// Difference of residuals from which on a sample is changed, in units of the noise.
const CHANGED: f64 = 1e-3;
/// Seed: the same data give the same interval.
const SEED: u64 = 1;

/// Whitened residuals of the same samples, with a hypothesis and without it.
pub(crate) type Pair<'a> = [&'a [f64]; 2];

/// 95 % interval, on the recorded motion, of a function of the mean squares with and without.
pub(crate) fn interval(pair: Pair<'_>, f: &dyn Fn([f64; 2]) -> f64) -> [f64; 2] {
    let blocks = Blocks::of(pair);
    middle(|resample| f(blocks.powers(resample)))
}

/// Returns the 95 % interval on an unrecorded motion from the scatter of the recorded ones; `None` for fewer than two.
///
/// Every resample takes one of them at random, and blocks of it (two-stage bootstrap; Davison and Hinkley 1997, 3.8).
/// `shown` is the logarithm of how much of the hypothesis a motion shows, and `f` the function where a motion shows so many
/// times as much: resamples of k motions vary by 1 - 1/k of these logarithms' variance, one more about their mean by
/// 1 + 1/k, and smoothing makes up the difference (ibid., 3.4).
pub(crate) fn interval_elsewhere(
    motions: &[Pair<'_>],
    shown: &dyn Fn([f64; 2]) -> f64,
    f: &dyn Fn([f64; 2], f64) -> f64,
) -> Option<[f64; 2]> {
    let motions: Vec<Blocks> = motions.iter().map(|pair| Blocks::of(*pair)).collect();
    let known = motions.iter().map(|motion| shown(motion.recorded()));
    let width = known.std_dev() * (2.0 / motions.len() as f64).sqrt();
    let of = |resample: u64| {
        let [which, u, v] = [0, 1, 2].map(|index| philox::uniform(SEED, "motion", resample, index));
        let motion = &motions[(motions.len() as f64 * which) as usize];
        f(motion.powers(resample), (width * normals(u, v).first).exp())
    };
    (motions.len() > 1).then(|| middle(of))
}

/// What lies between the 2.5 and 97.5 % points of resampled values.
fn middle(one: impl Fn(u64) -> f64) -> [f64; 2] {
    let mut values: Vec<f64> = (0..RESAMPLES as u64).map(one).collect();
    values.sort_by(f64::total_cmp);
    [values[RESAMPLES / 40], values[RESAMPLES - 1 - RESAMPLES / 40]]
}

/// Squares to draw blocks from: of the samples that the hypothesis changes, for a touch fills a small part of a recording,
/// and that there is one is no chance.
struct Blocks {
    /// All samples.
    samples: usize,
    /// Sums of squares of those that are not changed.
    kept: [f64; 2],
    /// Running sums of squares of those that are.
    running: [Vec<f64>; 2],
    /// Samples of a block, and how many blocks fit.
    length: usize,
    blocks: usize,
}

impl Blocks {
    fn of([with, without]: Pair<'_>) -> Self {
        let samples = with.len();
        let is_changed = |pair: &(&f64, &f64)| (pair.0 - pair.1).abs() > CHANGED;
        let (changed, kept): (Vec<_>, Vec<_>) = with.iter().zip(without).partition(is_changed);
        let kept = kept.into_iter().fold([0.0, 0.0], |sum, (x, x0)| [sum[0] + x * x, sum[1] + x0 * x0]);
        let (with, without): (Vec<f64>, Vec<f64>) = changed.into_iter().unzip();
        let n = with.len();
        let running = [with, without].map(|w| {
            let sums = w.iter().scan(0.0, |sum, w| {
                *sum += w * w;
                Some(*sum)
            });
            std::iter::once(0.0).chain(sums).collect()
        });
        let length = (n / FEWEST_BLOCKS).clamp(1, LONGEST_BLOCK);
        Self { samples, kept, running, length, blocks: n / length }
    }

    /// Mean squares with and without, as recorded.
    fn recorded(&self) -> [f64; 2] {
        [0, 1].map(|i| {
            (self.running[i].last().expect("a running sum begins with 0") + self.kept[i]) / self.samples as f64
        })
    }

    /// Mean squares with and without, of a resample.
    fn powers(&self, resample: u64) -> [f64; 2] {
        let n = self.running[0].len() - 1;
        let mut sums = [0.0; 2];
        for block in 0..self.blocks {
            let u = philox::uniform(SEED, "bootstrap", resample, block as u32);
            let from = ((n - self.length + 1) as f64 * u) as usize;
            for (sum, running) in sums.iter_mut().zip(&self.running) {
                *sum += running[from + self.length] - running[from];
            }
        }
        // Blocks of whole length do not cover the remainder, which counts as the others do.
        let scale = n as f64 / (self.blocks * self.length).max(1) as f64;
        [0, 1].map(|i| (scale * sums[i] + self.kept[i]) / self.samples as f64)
    }
}
