//! Power and correlation time of the noise in a channel of repeats.

use nalgebra::DMatrix;
use rayon::prelude::*;
use std::ops::RangeInclusive;

/// Longest lag at which the noise's memory is looked for, as a share of a recording.
const LONGEST_LAG: f64 = 0.1;

/// Correlation time of noise.
pub(crate) struct CorrelationTime {
    /// Samples until the correlation has fallen to 1/e.
    pub(crate) time: f64,
    /// Effective share of independent samples for a channel's variance (Bartlett).
    pub(crate) independent: f64,
    /// The same for a channel's mean.
    pub(crate) independent_for_mean: f64,
}

impl CorrelationTime {
    /// Of all channels alike, by their mean correlation.
    pub(crate) fn of(series: &[DMatrix<f64>]) -> Self {
        let most = (LONGEST_LAG * series[0].ncols() as f64) as usize;
        let correlation = correlations(series, 0..=most);
        let squares: f64 = correlation[1..].iter().map(|r| r * r).sum();
        let time = correlation.iter().position(|r| *r < (-1.0_f64).exp()).unwrap_or(most);
        // Beyond where it is lost the correlation is chance, and that a mean was taken off.
        let sum: f64 = correlation[1..].iter().take_while(|r| **r > 0.0).sum();
        let (independent, independent_for_mean) = ((1.0 + 2.0 * squares).recip(), (1.0 + 2.0 * sum).recip());
        Self { time: time as f64, independent, independent_for_mean }
    }

    /// Factor by which a variance exceeds the mean square of series whose means, which follow the noise, were taken off.
    pub(crate) fn bias(&self, series: &[DMatrix<f64>]) -> f64 {
        let samples = series[0].ncols() as f64 * self.independent_for_mean;
        samples / (samples - 1.0).max(1.0)
    }

    /// Independent samples of a channel in what repeats differ by.
    pub(crate) fn samples(&self, deviations: &[DMatrix<f64>]) -> f64 {
        let samples: usize = deviations.iter().map(DMatrix::ncols).sum();
        // Of R deviations from a mean R - 1 are independent; three repeats are the usual number.
        samples as f64 * (2.0 / 3.0) * self.independent
    }
}

/// Mean correlation of all channels at a lag.
pub(crate) fn correlation(series: &[DMatrix<f64>], lag: usize) -> f64 {
    correlations(series, lag..=lag)[0]
}

/// The same at each of some lags.
fn correlations(series: &[DMatrix<f64>], lags: RangeInclusive<usize>) -> Vec<f64> {
    let channels = series[0].nrows();
    // A channel's samples one after the other.
    let series: Vec<DMatrix<f64>> = series.iter().map(DMatrix::transpose).collect();
    let product = |c: usize, lag: usize| -> f64 {
        let pairs = |x: &DMatrix<f64>| {
            let (x, rest) = (x.column(c), x.nrows().saturating_sub(lag));
            x.rows(x.nrows() - rest, rest).dot(&x.rows(0, rest))
        };
        series.iter().map(pairs).sum()
    };
    let squares: Vec<f64> = (0..channels).map(|c| product(c, 0)).collect();
    let at = |lag: usize| (0..channels).map(|c| product(c, lag) / squares[c]).sum::<f64>() / channels as f64;
    lags.into_par_iter().map(at).collect()
}

/// Mean square of a channel.
pub(crate) fn power(series: &[DMatrix<f64>], channel: usize) -> f64 {
    let samples: usize = series.iter().map(DMatrix::ncols).sum();
    series.iter().map(|x| x.row(channel).norm_squared()).sum::<f64>() / samples as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use softdock_kernels::philox;

    #[test]
    fn variance_of_coloured_noise_is_unbiased_after_centring() {
        let (keep, length) = (0.98_f64, 1000);
        let series = |k: u64| {
            let mut x = 0.0;
            let mut next = |t: usize| {
                let sum: f64 = (0..12).map(|j| philox::uniform(5, "memory", k * 1_000_000 + t as u64, j)).sum();
                x = keep * x + (1.0 - keep * keep).sqrt() * (sum - 6.0);
                x
            };
            (0..500).for_each(|t| _ = next(t));
            let x = DMatrix::from_fn(1, length, |_, t| next(500 + t));
            let mean = x.mean();
            x.map(|value| value - mean)
        };
        let all: Vec<_> = (0..60).map(series).collect();
        let (correlation_time, found) = (CorrelationTime::of(&all), power(&all, 0));
        assert!((0.87..0.93).contains(&found), "a tenth lies in the means: {found}");
        assert!((found * correlation_time.bias(&all) - 1.0).abs() < 0.03, "{}", found * correlation_time.bias(&all));
        assert!((40.0..56.0).contains(&correlation_time.time), "{}", correlation_time.time);
    }
}
