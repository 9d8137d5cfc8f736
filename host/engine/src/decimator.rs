//! A low-pass with decimation of sampled signals, in lanes: of what is simulated far finer than it is judged, most need
//! never be stored.

use softdock_kernels::lanes::Lane;
use std::f64::consts::PI;

/// A linear-phase low-pass with decimation: what it gives is aligned with the samples that it keeps.
#[derive(Clone, Debug, PartialEq)]
pub struct Decimator {
    /// Taps from the middle one outwards: those before it are the same.
    taps: Vec<f64>,
    every: usize,
}

/// Samples that one kept sample is made of, to either side of it, for each that is kept.
const REACH: usize = 10;
/// Sums that run beside one another: as many as hide how long an addition takes.
const SUMS: usize = 5;

impl Decimator {
    /// For samples at equal steps: keeps every so many, and of the frequencies those below 0.8 of the new Nyquist
    /// frequency. A windowed sinc (Blackman), 10 kept samples long to either side.
    pub fn new(every: usize) -> Self {
        let half = REACH * every;
        let cutoff = 0.45 / every as f64;
        let tap = |i: usize| {
            let x = i as f64;
            let sinc = if i == 0 { 2.0 * cutoff } else { (2.0 * PI * cutoff * x).sin() / (PI * x) };
            let phase = PI * x / half as f64;
            sinc * (0.42 + 0.5 * phase.cos() + 0.08 * (2.0 * phase).cos())
        };
        let taps: Vec<f64> = (0..=half).map(tap).collect();
        let sum = taps[0] + 2.0 * taps[1..].iter().sum::<f64>();
        Self { taps: taps.iter().map(|tap| tap / sum).collect(), every }
    }

    /// Lets all pass, sample by sample.
    pub fn none() -> Self {
        Self { taps: vec![1.0], every: 1 }
    }

    /// Steps of the samples that one kept sample stands for.
    pub fn every(&self) -> usize {
        self.every
    }

    /// Samples at either end for which nothing is given.
    pub fn margin(&self) -> usize {
        self.taps.len() - 1
    }

    /// How many samples are kept of so many.
    pub fn kept(&self, samples: usize) -> usize {
        (samples + self.every).saturating_sub(2 * self.margin() + 1) / self.every
    }

    /// The kept samples of some channels, both sample by sample.
    ///
    /// Loops, no closures: these would be functions of their own, without the instruction set of the lanes.
    #[inline(always)]
    pub fn pass<L: Lane>(&self, samples: Vec<L>, channels: usize) -> Vec<L> {
        if self.margin() == 0 {
            return samples;
        }
        let kept = self.kept(samples.len() / channels);
        let mut passed = Vec::with_capacity(kept * channels);
        for number in 0..kept {
            let middle = (self.margin() + number * self.every) * channels;
            for channel in 0..channels {
                passed.push(self.at(&samples, middle + channel, channels));
            }
        }
        passed
    }

    /// One kept sample of one channel; `stride` from one sample of it to the next.
    #[inline(always)]
    fn at<L: Lane>(&self, samples: &[L], middle: usize, stride: usize) -> L {
        let mut sums = [L::lit(0.0); SUMS];
        let beside = self.taps[1..].chunks_exact(SUMS);
        for (group, taps) in beside.enumerate() {
            for (place, sum) in sums.iter_mut().enumerate() {
                let away = (group * SUMS + place + 1) * stride;
                *sum = (samples[middle - away] + samples[middle + away]).mul_add(L::lit(taps[place]), *sum);
            }
        }
        let mut whole = samples[middle] * L::lit(self.taps[0]);
        for sum in sums {
            whole = whole + sum;
        }
        whole
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slow_waves_stay_in_place_and_what_would_alias_is_dropped() {
        let wave = |f: f64| -> Vec<f64> { (0..1000).map(|i| (2.0 * PI * f * f64::from(i)).cos()).collect() };
        let decimator = Decimator::new(2);
        let slow = decimator.pass(wave(0.1), 1);
        for (k, value) in slow.iter().enumerate() {
            let at = (decimator.margin() + 2 * k) as f64;
            assert!((value - (2.0 * PI * 0.1 * at).cos()).abs() < 1e-3, "{k}");
        }
        assert!(decimator.pass(wave(0.31), 1).iter().all(|value| value.abs() < 1e-3));
        assert_eq!(slow.len(), decimator.kept(1000));
    }

    #[test]
    fn channels_pass_as_if_each_were_alone() {
        let wave = |f: f64, i: usize| (2.0 * PI * f * i as f64).sin();
        let rates = [0.02, 0.05, 0.11];
        for every in [1, 3, 4] {
            let decimator = Decimator::new(every);
            let both = (0..300).flat_map(|i| rates.map(|f| wave(f, i))).collect();
            let passed = decimator.pass::<f64>(both, rates.len());
            for (channel, f) in rates.into_iter().enumerate() {
                let alone = decimator.pass((0..300).map(|i| wave(f, i)).collect(), 1);
                let own: Vec<f64> = passed.iter().skip(channel).step_by(rates.len()).copied().collect();
                assert_eq!(own, alone, "every {every}, channel {channel}");
            }
        }
        assert_eq!(Decimator::none().pass(vec![1.0, 2.0], 2), [1.0, 2.0]);
    }
}
