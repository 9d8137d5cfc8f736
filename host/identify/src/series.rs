//! Joint motion as a finite Fourier series that starts and ends at rest (paper, eq. 6).

use std::f64::consts::PI;

/// `q(t) = mean + sum_k a_k cos(k w t) + b_k sin(k w t)`, k from 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Fundamental frequency w \[rad/s\].
    pub omega: f64,
    /// Mean angle \[rad\].
    pub mean: f64,
    /// Coefficients (a_k, b_k) \[rad\].
    pub coefficients: Vec<(f64, f64)>,
}

impl Series {
    /// Builds a series from the coefficients of all harmonics but the last, which makes rate and acceleration zero at t
    /// = 0.
    pub fn at_rest(period: f64, mean: f64, free: &[(f64, f64)]) -> Self {
        let last = (free.len() + 1) as f64;
        let sum = free.iter().enumerate().fold((0.0, 0.0), |(a, b), (index, (ak, bk))| {
            let k = (index + 1) as f64;
            (a + k * k * ak, b + k * bk)
        });
        let mut coefficients = free.to_vec();
        coefficients.push((-sum.0 / (last * last), -sum.1 / last));
        Self { omega: 2.0 * PI / period, mean, coefficients }
    }

    /// Returns angle \[rad\], rate \[rad/s\] and acceleration \[rad/s^2\] at a time \[s\].
    pub fn at(&self, time: f64) -> [f64; 3] {
        let mut out = [self.mean, 0.0, 0.0];
        for (index, (a, b)) in self.coefficients.iter().enumerate() {
            let w = (index + 1) as f64 * self.omega;
            let (sin, cos) = (w * time).sin_cos();
            out[0] += a * cos + b * sin;
            out[1] += w * (b * cos - a * sin);
            out[2] -= w * w * (a * cos + b * sin);
        }
        out
    }

    /// Returns the series with all coefficients but the mean scaled.
    pub fn scaled(&self, factor: f64) -> Self {
        let coefficients = self.coefficients.iter().map(|(a, b)| (a * factor, b * factor)).collect();
        Self { coefficients, ..self.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motion_starts_at_rest_and_its_derivatives_are_its_own() {
        let series = Series::at_rest(8.0, 0.5, &[(0.3, -0.2), (0.1, 0.25)]);
        let [_, rate, acceleration] = series.at(0.0);
        assert!(rate.abs() < 1e-14 && acceleration.abs() < 1e-14);
        let (time, step) = (1.7, 1e-5);
        let [_, rate, acceleration] = series.at(time);
        let slope = |order: usize| (series.at(time + step)[order] - series.at(time - step)[order]) / (2.0 * step);
        assert!((slope(0) - rate).abs() < 1e-9 && (slope(1) - acceleration).abs() < 1e-9);
        assert!((series.at(time)[0] - series.at(time + 8.0)[0]).abs() < 1e-12);
    }
}
