//! Noise of a block's residuals: a vector autoregression, fitted where no systematic error occurs.
//!
//! Repeats of a command differ by noise alone, so the model is fitted to their differences; a model fitted to the
//! residual would absorb the effect. It is a vector model because feedback couples the noise of the channels.

use nalgebra::{DMatrix, DVectorView};

/// Highest order that is tried.
const MOST_LAGS: usize = 20;

/// A vector autoregression `x[t] = sum_k A_k x[t-k] + e[t]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Noise {
    /// The matrices A_1, A_2, ...
    lags: Vec<DMatrix<f64>>,
    /// Inverse of the Cholesky factor of the innovations' covariance.
    whitener: DMatrix<f64>,
}

impl Noise {
    /// Fits the model to series of pure noise, with the order by the Bayesian information criterion (BIC).
    ///
    /// Returns `None` if there are too few samples, or a channel without any noise.
    pub fn fit(series: &[DMatrix<f64>]) -> Option<Self> {
        Self::above(series, &[])
    }

    /// Fits the model with additional white noise of these standard deviations, channel by channel: the resolution of
    /// the channels. Empty for none.
    pub fn above(series: &[DMatrix<f64>], floor: &[f64]) -> Option<Self> {
        let channels = series.first()?.nrows();
        let samples: usize = series.iter().map(DMatrix::ncols).sum();
        // Series of one sample each have no past.
        let longest = series.iter().map(DMatrix::ncols).max()?;
        let most = MOST_LAGS.min(samples / (20 * channels)).min(longest.saturating_sub(1));
        let moments = Moments::of(series, most).above(floor);
        (0..=most).filter_map(|order| Self::of_order(&moments, order)).min_by(|a, b| a.1.total_cmp(&b.1)).map(|x| x.0)
    }

    /// Returns white noise with the power of the second differences of residuals: the estimate before any systematic
    /// error is known.
    pub fn rough(residuals: &[DMatrix<f64>], floor: &[f64]) -> Option<Self> {
        let channels = residuals.first()?.nrows();
        let variance = |channel: usize| {
            let difference =
                |x: &DMatrix<f64>, t: usize| x[(channel, t)] - 2.0 * x[(channel, t + 1)] + x[(channel, t + 2)];
            let (mut sum, mut count) = (0.0, 0);
            for x in residuals {
                sum += (2..x.ncols()).map(|t| difference(x, t - 2).powi(2)).sum::<f64>();
                count += x.ncols().saturating_sub(2);
            }
            sum / (6 * count) as f64 + floor.get(channel).map_or(0.0, |sd| sd * sd)
        };
        let whitener =
            DMatrix::from_fn(channels, channels, |i, j| if i == j { variance(i).sqrt().recip() } else { 0.0 });
        whitener.iter().all(|value| value.is_finite()).then_some(Self { lags: Vec::new(), whitener })
    }

    /// Least squares of one order, and its criterion.
    fn of_order(moments: &Moments, order: usize) -> Option<(Self, f64)> {
        let channels = moments.power.nrows();
        let (width, count) = (order * channels, moments.count);
        if count <= width + channels {
            return None;
        }
        let cross = moments.cross.rows(0, width);
        let weights = match order {
            0 => DMatrix::zeros(0, channels),
            _ => moments.gram.view((0, 0), (width, width)).into_owned().cholesky()?.solve(&cross),
        };
        let covariance = (&moments.power - cross.transpose() * &weights) / (count - width) as f64;
        let factor = covariance.cholesky()?;
        let log_det: f64 = 2.0 * factor.l().diagonal().iter().map(|d| d.ln()).sum::<f64>();
        let criterion = count as f64 * log_det + (width * channels) as f64 * (count as f64).ln();
        let lag = |k: usize| weights.rows(k * channels, channels).transpose();
        let whitener = factor.l().try_inverse()?;
        Some((Self { lags: (0..order).map(lag).collect(), whitener }, criterion))
    }

    /// Returns the order of the autoregression.
    pub fn order(&self) -> usize {
        self.lags.len()
    }

    /// Returns the innovations of a residual in units of their standard deviation, channel by channel at each instant;
    /// `repeats` is the number of averaged residuals. The first instants, which have no past, are omitted.
    pub fn whiten(&self, residual: &DMatrix<f64>, repeats: usize) -> Vec<f64> {
        let (channels, order) = (residual.nrows(), self.order());
        let taps = self.taps() * (repeats as f64).sqrt();
        let count = residual.ncols().saturating_sub(order);
        let mut innovations = Vec::with_capacity(channels * count);
        for window in residual.as_slice().windows(taps.nrows()).step_by(channels) {
            let window = DVectorView::from_slice(window, taps.nrows());
            innovations.extend(taps.column_iter().map(|taps| taps.dot(&window)));
        }
        innovations
    }

    /// Weights of an instant's channels and of those of the instants before it, the oldest first, in each innovation: a
    /// column an innovation.
    fn taps(&self) -> DMatrix<f64> {
        let channels = self.whitener.nrows();
        let mut taps = DMatrix::zeros(channels * (self.order() + 1), channels);
        let own = self.order() * channels;
        taps.rows_mut(own, channels).copy_from(&self.whitener.transpose());
        for (k, lag) in self.lags.iter().enumerate() {
            taps.rows_mut(own - (k + 1) * channels, channels).copy_from(&-(&self.whitener * lag).transpose());
        }
        taps
    }
}

/// Second moments of the present and of the past of series, over the samples whose past is long enough.
struct Moments {
    /// Of the past with itself, the nearest instant first.
    gram: DMatrix<f64>,
    /// Of the past with the present.
    cross: DMatrix<f64>,
    /// Of the present with itself.
    power: DMatrix<f64>,
    /// How many samples they are summed over.
    count: usize,
}

impl Moments {
    fn of(series: &[DMatrix<f64>], lags: usize) -> Self {
        let channels = series[0].nrows();
        let width = lags * channels;
        let mut sum = DMatrix::zeros(width + channels, width + channels);
        let mut count = 0;
        for x in series.iter().filter(|x| x.ncols() > lags) {
            // The present first, then one instant further back every block of rows.
            let own = x.ncols() - lags;
            let mut past = DMatrix::zeros(width + channels, own);
            for lag in 0..=lags {
                past.rows_mut(lag * channels, channels).copy_from(&x.columns(lags - lag, own));
            }
            sum += &past * past.transpose();
            count += own;
        }
        let block = |from: usize, to: usize, rows, columns| sum.view((from, to), (rows, columns)).into_owned();
        let power = block(0, 0, channels, channels);
        let (gram, cross) = (block(channels, channels, width, width), block(channels, 0, width, channels));
        Self { gram, cross, power, count }
    }

    /// Of the series with independent white noise besides.
    fn above(mut self, floor: &[f64]) -> Self {
        let channels = self.power.nrows();
        for (channel, sd) in floor.iter().enumerate() {
            let power = self.count as f64 * sd * sd;
            self.power[(channel, channel)] += power;
            (channel..self.gram.nrows()).step_by(channels).for_each(|k| self.gram[(k, k)] += power);
        }
        self
    }
}

/// Returns the deviations of repeats from their mean, scaled to the noise of a single residual.
pub fn deviations(repeats: &[DMatrix<f64>]) -> Vec<DMatrix<f64>> {
    let n = repeats.len() as f64;
    if repeats.len() < 2 {
        return Vec::new();
    }
    let mean = mean(repeats);
    repeats.iter().map(|x| (x - &mean) * (n / (n - 1.0)).sqrt()).collect()
}

/// Returns the mean of residuals.
pub fn mean(repeats: &[DMatrix<f64>]) -> DMatrix<f64> {
    let sum = repeats.iter().skip(1).fold(repeats[0].clone(), |sum, x| sum + x);
    sum / repeats.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use softdock_kernels::philox;

    fn normal(stream: &str, i: u64) -> f64 {
        let u = philox::uniform(7, stream, i, 0).max(1e-12);
        let v = philox::uniform(7, stream, i, 1);
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    }

    /// Two channels, the second driven by the first.
    fn coloured(n: usize, stream: &str) -> DMatrix<f64> {
        let mut x = DMatrix::zeros(2, n);
        for t in 1..n {
            x[(0, t)] = 0.9 * x[(0, t - 1)] + normal(stream, 2 * t as u64);
            x[(1, t)] = 0.5 * x[(0, t - 1)] + 0.3 * x[(1, t - 1)] + 0.2 * normal(stream, 2 * t as u64 + 1);
        }
        x
    }

    #[test]
    fn whitened_noise_of_repeats_is_white_and_of_unit_size() {
        let systematic = DMatrix::from_fn(2, 4000, |c, t| ((t as f64) * 0.01 * (c + 1) as f64).sin() * 40.0);
        let repeats: Vec<_> = ["a", "b", "c"].iter().map(|s| coloured(4000, s) + &systematic).collect();
        let noise = Noise::fit(&deviations(&repeats)).expect("enough samples");
        let white: Vec<f64> = ["d", "e", "f", "g"].iter().flat_map(|s| noise.whiten(&coloured(4000, s), 1)).collect();
        let power = white.iter().map(|w| w * w).sum::<f64>() / white.len() as f64;
        assert!((power - 1.0).abs() < 0.05, "{power}");
        let lagged: f64 = white.windows(3).map(|w| w[0] * w[2]).sum::<f64>() / white.len() as f64;
        assert!(lagged.abs() < 0.04, "{lagged}");
        assert!((1..=4).contains(&noise.order()), "{}", noise.order());
    }

    #[test]
    fn single_samples_give_white_noise() {
        let series: Vec<_> = (0..400).map(|i| DMatrix::from_element(1, 1, 3.0 * normal("alone", i))).collect();
        let noise = Noise::fit(&series).expect("enough samples");
        let white: f64 = series.iter().flat_map(|x| noise.whiten(x, 1)).map(|w| w * w).sum::<f64>() / 400.0;
        assert!(noise.order() == 0 && (white - 1.0).abs() < 0.01, "{white}");
    }

    #[test]
    fn one_repeat_or_a_constant_channel_gives_no_noise() {
        assert!(deviations(&[coloured(100, "a")]).is_empty());
        assert!(Noise::fit(&[]).is_none());
        assert!(Noise::fit(&[DMatrix::zeros(1, 500)]).is_none(), "a channel without noise");
    }
}
