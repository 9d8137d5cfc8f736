//! Whiteness of a residual: its correlation over time.

use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Lags of the Ljung-Box statistic.
const LAGS: usize = 10;

/// Whiteness of a residual, at the rate at which a low-passed white noise would be independent.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Whiteness {
    /// Correlation of neighbours.
    pub lag_one: f64,
    /// Ljung-Box statistic over ten lags.
    pub ljung_box: f64,
    /// Probability of a greater statistic if the residual were white.
    pub p_value: f64,
}

impl Whiteness {
    /// Tests every `every`-th sample of a residual.
    pub fn of(residual: &[f64], every: usize) -> Self {
        let series: Vec<f64> = residual.iter().copied().step_by(every.max(1)).collect();
        let n = series.len() as f64;
        let mean = series.iter().sum::<f64>() / n;
        let product = |lag: usize| series.iter().zip(&series[lag..]).map(|(a, b)| (a - mean) * (b - mean)).sum::<f64>();
        let power = product(0).max(f64::MIN_POSITIVE);
        let lags = LAGS.min(series.len().saturating_sub(2));
        let ljung_box =
            (1..=lags).map(|lag| (product(lag) / power).powi(2) / (n - lag as f64)).sum::<f64>() * n * (n + 2.0);
        let p_value = ChiSquared::new(lags as f64).map_or(1.0, |chi| 1.0 - chi.cdf(ljung_box));
        Self { lag_one: product(1) / power, ljung_box, p_value }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use softdock_kernels::philox;

    #[test]
    fn white_and_coloured_noise_are_distinguished() {
        let white: Vec<f64> = (0..2000).map(|i| philox::uniform(1, "white", i, 0) - 0.5).collect();
        let test = Whiteness::of(&white, 1);
        assert!(test.lag_one.abs() < 0.06 && test.p_value > 0.01, "{test:?}");
        let coloured: Vec<f64> = white.windows(2).map(|pair| pair[0] + 0.5 * pair[1]).collect();
        let test = Whiteness::of(&coloured, 1);
        assert!((test.lag_one - 0.4).abs() < 0.06 && test.p_value < 1e-6, "{test:?}");
        assert!(Whiteness::of(&coloured, 2).lag_one.abs() < 0.1, "every second sample is independent");
    }
}
