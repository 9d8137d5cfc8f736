//! Trends over a session in the differences of repeats, which are not noise.

use crate::inference::adequacy::tolerated;
use crate::inference::autocorrelation::{CorrelationTime, power};
use nalgebra::{DMatrix, DVector};

/// Repeats of one command on a session's clock.
pub(super) struct Aged {
    /// What they differ by: deviations from their mean, as large as a single residual's noise.
    pub(super) deviations: Vec<DMatrix<f64>>,
    /// When each began \[s\], from the mean of all on.
    pub(super) ages: Vec<f64>,
}

/// What repeats differ by, without trends.
pub(super) struct Detrended {
    /// The noise.
    pub(super) noise: Vec<DMatrix<f64>>,
    /// Power, beyond noise, of a trend over the session that is not common to all experiments, for example of a drifting
    /// gain, whose trend follows its signal: channel by channel, empty without such a trend.
    pub(super) trend: Vec<f64>,
}

impl Detrended {
    /// Repeats without a trend of their own.
    pub(super) fn without_trend(repeats: Vec<Aged>) -> Self {
        Self { noise: repeats.into_iter().flat_map(|own| own.deviations).collect(), trend: Vec::new() }
    }
}

/// Removes trends from the differences of repeats, which would otherwise count as low-frequency noise and mask their
/// cause. `rounding` returns the variance of each channel's quantisation: a common trend is then read as steps at
/// different times.
pub(super) fn detrended(mut repeats: Vec<Aged>, rounding: &dyn Fn() -> Vec<f64>) -> Detrended {
    remove_common(&mut repeats);
    let apart: Vec<Apart> = repeats.iter().filter_map(Aged::apart).collect();
    match grew(&apart, &[]) && grew(&apart, &rounding()) {
        true => Detrended { trend: powers(&apart), noise: apart.into_iter().flat_map(|own| own.rest).collect() },
        false => Detrended::without_trend(repeats),
    }
}

/// Takes a growth that all share off them, channel by channel: least squares on each repeat's age.
fn remove_common(repeats: &mut [Aged]) {
    let each = || repeats.iter().flat_map(|own| own.deviations.iter().zip(&own.ages));
    let weight: f64 = each().map(|(x, age)| x.ncols() as f64 * age * age).sum();
    let Some(channels) = each().next().map(|(x, _)| x.nrows()).filter(|_| weight > 0.0) else {
        return;
    };
    let growth = each().fold(DVector::zeros(channels), |sum, (x, age)| sum + x.column_sum() * (age / weight));
    for own in repeats {
        for (x, age) in own.deviations.iter_mut().zip(&own.ages) {
            x.column_iter_mut().for_each(|mut column| column -= &growth * *age);
        }
    }
}

/// What repeats of one command differ by, apart.
struct Apart {
    /// What grows with their age, sample by sample, as large as a single residual's noise if it is nothing but noise.
    grown: DMatrix<f64>,
    /// The rest, as large as a single residual's noise.
    rest: Vec<DMatrix<f64>>,
}

impl Aged {
    /// `None` for fewer than three, of which nothing would be left.
    fn apart(&self) -> Option<Apart> {
        let length = self.ages.iter().map(|age| age * age).sum::<f64>().sqrt();
        if self.deviations.len() < 3 || length == 0.0 {
            return None;
        }
        let each = || self.deviations.iter().zip(self.ages.iter().map(|age| age / length));
        let along = each().fold(self.deviations[0].clone() * 0.0, |sum, (x, share)| sum + x * share);
        // Of R deviations from a mean R - 1 are independent; R - 2 without what grows.
        let count = self.deviations.len() as f64;
        let scale = ((count - 1.0) / (count - 2.0)).sqrt();
        let rest = each().map(|(x, share)| (x - &along * share) * scale).collect();
        Some(Apart { grown: along * ((count - 1.0) / count).sqrt(), rest })
    }
}

/// Power of what grows in each channel, beyond that of the rest.
fn powers(apart: &[Apart]) -> Vec<f64> {
    let grown: Vec<DMatrix<f64>> = apart.iter().map(|own| own.grown.clone()).collect();
    let rest: Vec<DMatrix<f64>> = apart.iter().flat_map(|own| own.rest.clone()).collect();
    (0..grown[0].nrows()).map(|c| (power(&grown, c) - power(&rest, c)).max(0.0)).collect()
}

/// Whether what grows is more than what noise, and rounding of such variances, does not explain, and not by chance.
fn grew(apart: &[Apart], rounding: &[f64]) -> bool {
    let (grown, rest): (Vec<DMatrix<f64>>, Vec<Vec<DMatrix<f64>>>) =
        apart.iter().map(|own| (own.grown.clone(), own.rest.clone())).unzip();
    // Of all the rest's series two in each experiment follow from the others.
    let degrees: usize = rest.iter().map(|own| (own.len() - 2) * own[0].ncols()).sum();
    let rest = rest.concat();
    if rest.is_empty() {
        return false;
    }
    let channels = rest[0].nrows();
    let beyond = |c: usize| (power(&grown, c) - rounding.get(c).unwrap_or(&0.0)).max(0.0);
    let ratio = (0..channels).map(|c| beyond(c) / power(&rest, c)).sum::<f64>() / channels as f64;
    let samples: usize = grown.iter().map(DMatrix::ncols).sum();
    let independent = channels as f64 * CorrelationTime::of(&rest).independent;
    ratio > tolerated([samples, degrees].map(|count| independent * count as f64))
}

#[cfg(test)]
mod tests {
    use super::*;
    use softdock_kernels::philox;

    const AGES: [f64; 3] = [-40.0, 3.0, 37.0];

    fn normal(stream: &str, i: u64) -> f64 {
        let u = philox::uniform(3, stream, i, 0).max(1e-12);
        let v = philox::uniform(3, stream, i, 1);
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    }

    /// Three repeats with noise of deviation 1 that remembers, and what each age adds at each sample.
    fn repeats(stream: &str, added: impl Fn(f64, usize) -> f64) -> Aged {
        let of = |(number, age): (usize, &f64)| {
            let (own, mut last) = (format!("{stream} {number}"), [0.0; 2]);
            let noise = |t: usize, c: usize| normal(&own, (2 * t + c) as u64) * (1.0_f64 - 0.49).sqrt();
            let columns: Vec<f64> = (0..900)
                .flat_map(|t| {
                    last = std::array::from_fn(|c| 0.7 * last[c] + noise(t, c));
                    last.map(|x| x + added(*age, t))
                })
                .collect();
            DMatrix::from_vec(2, 900, columns)
        };
        let all: Vec<DMatrix<f64>> = AGES.iter().enumerate().map(of).collect();
        Aged { deviations: crate::inference::noise::deviations(&all), ages: AGES.to_vec() }
    }

    fn wave(t: usize) -> f64 {
        (0.02 * t as f64).sin()
    }

    fn power_of(series: &[DMatrix<f64>]) -> f64 {
        0.5 * (power(series, 0) + power(series, 1))
    }

    #[test]
    fn detrending_keeps_noise() {
        let all = detrended(["a", "b", "c"].map(|stream| repeats(stream, |_, t| wave(t))).into(), &Vec::new);
        assert!(all.trend.is_empty() && all.noise.len() == 9);
        assert!((power_of(&all.noise) - 1.0).abs() < 0.1, "{}", power_of(&all.noise));
    }

    #[test]
    fn common_trend_is_removed_and_not_reported() {
        let all = detrended(["a", "b", "c"].map(|stream| repeats(stream, |age, _| 0.5 * age)).into(), &Vec::new);
        assert!(all.trend.is_empty(), "it is known what grows");
        assert!((power_of(&all.noise) - 1.0).abs() < 0.1, "{}", power_of(&all.noise));
    }

    #[test]
    fn trend_proportional_to_the_signal_is_reported_and_not_noise() {
        let grown = |size: f64| ["a", "b", "c"].map(|stream| repeats(stream, |age, t| size * age * wave(t)));
        assert!(detrended(grown(0.001).into(), &Vec::new).trend.is_empty());
        let all = detrended(grown(0.05).into(), &Vec::new);
        assert!(all.trend.len() == 2 && all.noise.len() == 9);
        let power = AGES.iter().map(|age| (0.05 * age).powi(2)).sum::<f64>() * 0.5;
        assert!((all.trend[0] / power - 1.0).abs() < 0.1, "{} of {power}", all.trend[0]);
        assert!((power_of(&all.noise) - 1.0).abs() < 0.1, "{}", power_of(&all.noise));
        assert!(detrended(grown(0.05).into(), &|| vec![20.0; 2]).trend.is_empty(), "steps may do as much");
    }

    #[test]
    fn two_repeats_are_not_detrended() {
        let two = |stream: &str| {
            let Aged { mut deviations, mut ages } = repeats(stream, |age, t| 0.05 * age * wave(t));
            deviations.truncate(2);
            ages.truncate(2);
            Aged { deviations, ages }
        };
        assert!(detrended(vec![two("a"), two("b")], &Vec::new).trend.is_empty());
    }
}
