//! Zero-phase low-pass and projection on a Fourier series, applied alike to positions, torques and regressor columns.

use std::f64::consts::PI;

/// Smoother of time series.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Smoother {
    /// Butterworth low-pass of order 4, forwards and backwards: order 8, no phase.
    LowPass {
        /// Cut-off of one pass \[Hz\].
        cutoff: f64,
    },
    /// Projection of one period of samples on its mean and so many harmonics.
    Fourier {
        /// Harmonics kept.
        harmonics: usize,
    },
}

impl Smoother {
    /// Returns the smoothed series; `step` is the sampling period \[s\].
    pub fn smooth(&self, series: &[f64], step: f64) -> Vec<f64> {
        match self {
            Self::LowPass { cutoff } => low_pass(series, *cutoff, step),
            Self::Fourier { harmonics } => Fourier::fit(series, *harmonics).values(0),
        }
    }

    /// Returns the smoothed series with its first and second derivative.
    pub fn derivatives(&self, series: &[f64], step: f64) -> [Vec<f64>; 3] {
        match self {
            Self::LowPass { cutoff } => {
                let value = low_pass(series, *cutoff, step);
                let rate = gradient(&value, step);
                let acceleration = gradient(&rate, step);
                [value, rate, acceleration]
            }
            Self::Fourier { harmonics } => {
                let fit = Fourier::fit(series, *harmonics);
                let omega = 2.0 * PI / (series.len() as f64 * step);
                let scaled = |order: i32| fit.values(order).iter().map(|v| v * omega.powi(order)).collect();
                [fit.values(0), scaled(1), scaled(2)]
            }
        }
    }
}

/// A finite Fourier series over one period of equal steps.
struct Fourier {
    samples: usize,
    mean: f64,
    /// Cosine and sine coefficients of the harmonics 1..
    coefficients: Vec<(f64, f64)>,
}

impl Fourier {
    /// Least squares; on a whole period of equal steps that is the discrete Fourier transform.
    fn fit(series: &[f64], harmonics: usize) -> Self {
        let n = series.len();
        let harmonics = harmonics.min((n - 1) / 2);
        let table = Circle::new(n);
        let scale = 2.0 / n as f64;
        let coefficient = |k: usize| {
            let sum = series.iter().enumerate().fold((0.0, 0.0), |(c, s), (i, value)| {
                let (cos, sin) = table.at(k * i);
                (c + value * cos, s + value * sin)
            });
            (sum.0 * scale, sum.1 * scale)
        };
        Self {
            samples: n,
            mean: series.iter().sum::<f64>() / n as f64,
            coefficients: (1..=harmonics).map(coefficient).collect(),
        }
    }

    /// The series, or its derivative of this order by phase, at the samples.
    fn values(&self, order: i32) -> Vec<f64> {
        let table = Circle::new(self.samples);
        let value = |i: usize| {
            let mean = if order == 0 { self.mean } else { 0.0 };
            self.coefficients.iter().enumerate().fold(mean, |sum, (index, (a, b))| {
                let k = index + 1;
                let (cos, sin) = table.at(k * i);
                // Each derivative multiplies by k and turns (a, b) by a quarter.
                let (a, b) = match order.rem_euclid(4) {
                    0 => (*a, *b),
                    1 => (*b, -a),
                    2 => (-a, -b),
                    _ => (-b, *a),
                };
                sum + (k as f64).powi(order) * (a * cos + b * sin)
            })
        };
        (0..self.samples).map(value).collect()
    }
}

/// Cosine and sine of whole multiples of a turn's n-th part.
struct Circle(Vec<(f64, f64)>);

impl Circle {
    fn new(n: usize) -> Self {
        let at = |i: usize| {
            let (sin, cos) = (2.0 * PI * i as f64 / n as f64).sin_cos();
            (cos, sin)
        };
        Self((0..n).map(at).collect())
    }

    fn at(&self, multiple: usize) -> (f64, f64) {
        self.0[multiple % self.0.len()]
    }
}

/// Returns the mean over the whole periods of a series; `period` in samples.
pub fn period_mean(series: &[f64], period: usize) -> Vec<f64> {
    let periods = (series.len() / period).max(1);
    (0..period).map(|i| (0..periods).map(|k| series[k * period + i]).sum::<f64>() / periods as f64).collect()
}

/// Central differences, one-sided at the ends.
fn gradient(series: &[f64], step: f64) -> Vec<f64> {
    let last = series.len() - 1;
    let slope = |i: usize| {
        let (before, after) = (i.saturating_sub(1), (i + 1).min(last));
        (series[after] - series[before]) / ((after - before) as f64 * step)
    };
    (0..=last).map(slope).collect()
}

/// Forwards and backwards through a Butterworth low-pass of order 4, the ends continued point-symmetrically.
fn low_pass(series: &[f64], cutoff: f64, step: f64) -> Vec<f64> {
    let last = series.len() - 1;
    let margin = ((10.0 / (cutoff * step)).ceil() as usize).min(last);
    let before = (1..=margin).rev().map(|i| 2.0 * series[0] - series[i]);
    let after = (1..=margin).map(|i| 2.0 * series[last] - series[last - i]);
    let mut long: Vec<f64> = before.chain(series.iter().copied()).chain(after).collect();
    let sections = [1.0, 3.0].map(|k: f64| Section::low_pass(cutoff, 0.5 / (k * PI / 8.0).cos(), step));
    for _ in 0..2 {
        sections.iter().for_each(|section| section.pass(&mut long));
        long.reverse();
    }
    long[margin..=margin + last].to_vec()
}

/// A filter of second order, gain 1 at rest.
struct Section {
    b: [f64; 3],
    a: [f64; 2],
}

impl Section {
    /// Bilinear transform of a second-order low-pass with quality `q`, its frequency pre-warped.
    fn low_pass(cutoff: f64, q: f64, step: f64) -> Self {
        let k = (PI * cutoff * step).tan();
        let norm = 1.0 / (1.0 + k / q + k * k);
        let b = k * k * norm;
        Self { b: [b, 2.0 * b, b], a: [2.0 * (k * k - 1.0) * norm, (1.0 - k / q + k * k) * norm] }
    }

    /// Filters in place, starting at rest at the first value.
    fn pass(&self, series: &mut [f64]) {
        let first = series[0];
        let (mut x, mut y) = ([0.0; 2], [0.0; 2]);
        for value in series.iter_mut() {
            let now = *value - first;
            let out = self.b[0] * now + self.b[1] * x[0] + self.b[2] * x[1] - self.a[0] * y[0] - self.a[1] * y[1];
            (x, y) = ([now, x[0]], [out, y[0]]);
            *value = out + first;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn low_pass_keeps_slow_waves_in_phase_and_stops_fast_ones() {
        let step = 0.004;
        let wave = |f: f64| -> Vec<f64> { (0..2500).map(|i| (2.0 * PI * f * i as f64 * step).sin()).collect() };
        let gain = |f: f64| {
            let smooth = low_pass(&wave(f), 10.0, step);
            let inner = 500..2000;
            let dot = |a: &[f64], b: &[f64]| inner.clone().map(|i| a[i] * b[i]).sum::<f64>();
            dot(&smooth, &wave(f)) / dot(&wave(f), &wave(f))
        };
        assert!((gain(1.0) - 1.0).abs() < 1e-6, "{}", gain(1.0));
        assert!((gain(10.0) - 0.5).abs() < 1e-3, "both passes at the cut-off: {}", gain(10.0));
        assert!(gain(30.0).abs() < 1e-3, "{}", gain(30.0));
        let line: Vec<f64> = (0..300).map(|i| 3.0 + 0.5 * f64::from(i)).collect();
        let smooth = low_pass(&line, 10.0, step);
        assert!(smooth.iter().zip(&line).all(|(a, b)| (a - b).abs() < 1e-3), "a line stays a line");
    }

    #[test]
    fn fourier_series_are_differentiated_exactly() {
        let (n, step) = (500, 0.01);
        let omega = 2.0 * PI / 5.0;
        let at = |i: usize| omega * i as f64 * step;
        let series: Vec<f64> = (0..n).map(|i| 1.0 + (2.0 * at(i)).sin() + 0.3 * (40.0 * at(i)).cos()).collect();
        let [value, rate, acceleration] = Smoother::Fourier { harmonics: 10 }.derivatives(&series, step);
        for i in [0, 77, 250, 499] {
            let phase = 2.0 * at(i);
            assert!((value[i] - 1.0 - phase.sin()).abs() < 1e-12, "the 40th harmonic is gone");
            assert!((rate[i] - 2.0 * omega * phase.cos()).abs() < 1e-11);
            assert!((acceleration[i] + 4.0 * omega * omega * phase.sin()).abs() < 1e-10);
        }
    }
}
