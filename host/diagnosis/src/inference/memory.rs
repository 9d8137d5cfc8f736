//! How much noise there is in a channel of repeats, and how long it remembers.

use nalgebra::DMatrix;

/// Longest lag at which the noise's memory is looked for, as a share of a recording.
const LONGEST_LAG: f64 = 0.1;

/// How long noise remembers.
pub(crate) struct Memory {
    /// Samples until the correlation has fallen to 1/e.
    pub(crate) time: f64,
    /// Share of the samples that, were they independent, would tell a channel's variance as well (Bartlett).
    pub(crate) independent: f64,
}

impl Memory {
    /// Of all channels alike, by their mean correlation.
    pub(crate) fn of(series: &[DMatrix<f64>]) -> Self {
        let most = (LONGEST_LAG * series[0].ncols() as f64) as usize;
        let correlation: Vec<f64> = (0..=most).map(|lag| correlation(series, lag)).collect();
        let squares: f64 = correlation[1..].iter().map(|r| r * r).sum();
        let time = correlation.iter().position(|r| *r < (-1.0_f64).exp()).unwrap_or(most);
        Self { time: time as f64, independent: (1.0 + 2.0 * squares).recip() }
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
    let channels = series[0].nrows();
    let of = |c: usize| {
        let at = |lag: usize| -> f64 {
            let pairs = |x: &DMatrix<f64>| (lag..x.ncols()).map(|t| x[(c, t)] * x[(c, t - lag)]).sum::<f64>();
            series.iter().map(pairs).sum()
        };
        at(lag) / at(0)
    };
    (0..channels).map(of).sum::<f64>() / channels as f64
}

/// Mean square of a channel.
pub(crate) fn power(series: &[DMatrix<f64>], channel: usize) -> f64 {
    let samples: usize = series.iter().map(DMatrix::ncols).sum();
    series.iter().map(|x| x.row(channel).norm_squared()).sum::<f64>() / samples as f64
}
