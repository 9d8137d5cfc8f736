//! Distributions, each by its inverse: one uniform number in, one value out.

use statrs::function::erf::{erf, erfc, erfc_inv};
use std::f64::consts::SQRT_2;

/// A draw of 53 bits reaches at most this many standard deviations: the quantile of 2^-54 is -8.293.
const REACH: f64 = 8.3;

/// A checked distribution of one number, SI.
#[derive(Clone, Debug, PartialEq)]
pub enum Distribution {
    /// Always the same.
    Constant {
        /// The value.
        value: f64,
    },
    /// Normal.
    Normal {
        /// Mean.
        mean: f64,
        /// Standard deviation.
        sigma: f64,
    },
    /// Uniform.
    Uniform {
        /// Lower bound.
        min: f64,
        /// Upper bound.
        max: f64,
    },
    /// Normal, cut at two bounds.
    TruncatedNormal {
        /// Mean of the normal before the cut.
        mean: f64,
        /// Standard deviation of the normal before the cut.
        sigma: f64,
        /// Lower bound.
        min: f64,
        /// Upper bound.
        max: f64,
    },
    /// Uniform in the logarithm.
    LogUniform {
        /// Lower bound, above zero.
        min: f64,
        /// Upper bound.
        max: f64,
    },
    /// The empirical distribution of measured values: each is as likely as the others.
    Table {
        /// The values, ascending.
        values: Vec<f64>,
    },
}

impl Distribution {
    /// The value below which the share `u` of the draws lies, 0 < u < 1.
    pub fn quantile(&self, u: f64) -> f64 {
        match self {
            Self::Constant { value } => *value,
            Self::Normal { mean, sigma } => mean + sigma * normal_quantile(u),
            Self::Uniform { min, max } => (min + u * (max - min)).clamp(*min, *max),
            Self::TruncatedNormal { mean, sigma, min, max } => {
                let z = truncated_quantile((min - mean) / sigma, (max - mean) / sigma, u);
                (mean + sigma * z).clamp(*min, *max)
            }
            Self::LogUniform { min, max } => (min.ln() + u * (max.ln() - min.ln())).exp().clamp(*min, *max),
            Self::Table { values } => values[((u * values.len() as f64) as usize).min(values.len() - 1)],
        }
    }

    /// Least and greatest value that a draw can have.
    pub fn reach(&self) -> (f64, f64) {
        match self {
            Self::Constant { value } => (*value, *value),
            Self::Normal { mean, sigma } => (mean - REACH * sigma, mean + REACH * sigma),
            Self::Uniform { min, max } | Self::TruncatedNormal { min, max, .. } | Self::LogUniform { min, max } => {
                (*min, *max)
            }
            Self::Table { values } => (values[0], values[values.len() - 1]),
        }
    }

    /// The word in the campaign file.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Constant { .. } => "constant",
            Self::Normal { .. } => "normal",
            Self::Uniform { .. } => "uniform",
            Self::TruncatedNormal { .. } => "truncnormal",
            Self::LogUniform { .. } => "loguniform",
            Self::Table { .. } => "table",
        }
    }
}

/// Quantile of the standard normal distribution.
pub(crate) fn normal_quantile(u: f64) -> f64 {
    -SQRT_2 * erfc_inv(2.0 * u)
}

/// Share of the standard normal distribution below `z`.
pub(crate) fn normal_share(z: f64) -> f64 {
    0.5 * erfc(-z / SQRT_2)
}

/// Quantile of a standard normal between `a` and `b`; an upper tail is mirrored, where shares keep their digits.
fn truncated_quantile(a: f64, b: f64, u: f64) -> f64 {
    if a > 0.0 {
        return -truncated_quantile(-b, -a, 1.0 - u);
    }
    let (below_a, below_b) = (normal_share(a), normal_share(b));
    normal_quantile(below_a + u * (below_b - below_a)).clamp(a, b)
}

/// Share of a normal distribution that a cut keeps.
pub(crate) fn kept_share(mean: f64, sigma: f64, min: f64, max: f64) -> f64 {
    let scaled = |value: f64| (value - mean) / (sigma * SQRT_2);
    0.5 * (erf(scaled(max)) - erf(scaled(min)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use softdock_kernels::philox::uniform;

    /// Mean and standard deviation of 200,000 draws.
    fn moments(distribution: &Distribution) -> (f64, f64) {
        let count = 200_000;
        let draws: Vec<f64> = (0..count).map(|run| distribution.quantile(uniform(7, "test", run, 0))).collect();
        let (least, greatest) = distribution.reach();
        assert!(draws.iter().all(|draw| (least..=greatest).contains(draw)), "{distribution:?} keeps its reach");
        let mean = draws.iter().sum::<f64>() / count as f64;
        let variance = draws.iter().map(|draw| (draw - mean).powi(2)).sum::<f64>() / count as f64;
        (mean, variance.sqrt())
    }

    /// Within five standard errors of the analytic mean and deviation.
    #[test]
    fn moments_are_those_of_theory() {
        let log_range = 100.0_f64.ln();
        let log_mean = 99.0 / log_range;
        let log_variance = (100.0_f64.powi(2) - 1.0) / (2.0 * log_range) - log_mean * log_mean;
        // Normal cut at -1 and +2 sigma: phi(-1) = 0.24197, phi(2) = 0.05399, share 0.81859.
        let (low, high, share) = (0.241_970_72, 0.053_990_97, 0.818_594_6);
        let cut_mean = (low - high) / share;
        let cut_variance = 1.0 + (-low - 2.0 * high) / share - cut_mean * cut_mean;
        let cases = [
            (Distribution::Constant { value: 3.0 }, 3.0, 0.0),
            (Distribution::Normal { mean: 5.0, sigma: 2.0 }, 5.0, 2.0),
            (Distribution::Uniform { min: -1.0, max: 3.0 }, 1.0, 4.0 / 12.0_f64.sqrt()),
            (Distribution::LogUniform { min: 1.0, max: 100.0 }, log_mean, log_variance.sqrt()),
            (
                Distribution::TruncatedNormal { mean: 0.0, sigma: 1.0, min: -1.0, max: 2.0 },
                cut_mean,
                cut_variance.sqrt(),
            ),
            (Distribution::Table { values: vec![1.0, 2.0, 2.0, 7.0] }, 3.0, 5.5_f64.sqrt()),
        ];
        for (distribution, mean, deviation) in cases {
            let (got_mean, got_deviation) = moments(&distribution);
            let error = 5.0 * deviation / 200_000_f64.sqrt();
            assert!((got_mean - mean).abs() <= error + 1e-12, "{distribution:?}: mean {got_mean}, theory {mean}");
            assert!(
                (got_deviation - deviation).abs() <= 2.0 * error + 1e-12,
                "{distribution:?}: {got_deviation}, {deviation}"
            );
        }
    }

    /// Known answers of the standard normal quantile.
    #[test]
    fn normal_quantiles_are_exact() {
        for (u, z) in [
            (0.5, 0.0),
            (0.975, 1.959_963_984_540_054),
            (0.001, -3.090_232_306_167_813_5),
            (1e-10, -6.361_340_902_404_056),
        ] {
            assert!((normal_quantile(u) - z).abs() < 1e-9, "{u}: {}", normal_quantile(u));
        }
        let edge = normal_quantile(0.5 / (1_u64 << 53) as f64);
        assert!(edge.is_finite() && edge > -REACH, "{edge}");
    }

    #[test]
    fn a_cut_far_in_the_tail_keeps_its_digits() {
        let tail = Distribution::TruncatedNormal { mean: 0.0, sigma: 1.0, min: 6.0, max: 9.0 };
        let (low, high) = (tail.quantile(0.01), tail.quantile(0.99));
        assert!((6.0..6.01).contains(&low) && (6.5..7.0).contains(&high), "{low} {high}");
    }
}
