//! Distributions, each by its inverse: one uniform number in, one value out.

use statrs::function::beta::{beta_reg, ln_beta};
use statrs::function::erf::{erf, erfc, erfc_inv};
use std::f64::consts::{FRAC_PI_2, SQRT_2};

/// A draw of 53 bits reaches at most this many standard deviations: the quantile of 2^-54 is -8.293.
const REACH: f64 = 8.3;

/// The greatest number below 1: no draw is beyond its quantile.
const LAST: f64 = 1.0 - f64::EPSILON / 2.0;

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
    /// Given values, each with its probability.
    Discrete {
        /// The values, ascending, no two equal.
        values: Vec<f64>,
        /// Probability of each value or a smaller one, ascending; the last is 1.
        cumulative: Vec<f64>,
    },
    /// Density that rises from `min` to `mode` and falls to `max` on straight lines.
    Triangular {
        /// Lower bound.
        min: f64,
        /// Most probable value, from `min` to `max`.
        mode: f64,
        /// Upper bound.
        max: f64,
    },
    /// Beta distribution, scaled from 0..1 to `min`..`max`.
    Beta {
        /// Shape at the lower bound: the density is proportional to `(x - min)^(a - 1)` there.
        a: f64,
        /// Shape at the upper bound.
        b: f64,
        /// Lower bound.
        min: f64,
        /// Upper bound.
        max: f64,
    },
    /// Weibull distribution above `min`.
    Weibull {
        /// Distance from `min` that 63 % of the draws do not exceed.
        scale: f64,
        /// Shape: 1 is exponential, 2 Rayleigh.
        shape: f64,
        /// Lower bound.
        min: f64,
    },
    /// Position of a harmonic oscillation at a random time: most draws are near the bounds.
    Arcsine {
        /// Lower bound.
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
            Self::Discrete { values, cumulative } => {
                values[cumulative.partition_point(|share| *share <= u).min(values.len() - 1)]
            }
            Self::Triangular { min, mode, max } => triangular_quantile(*min, *mode, *max, u),
            Self::Beta { a, b, min, max } => scaled(*min, *max, beta_quantile(*a, *b, u)),
            Self::Weibull { scale, shape, min } => min + scale * (-(-u.min(LAST)).ln_1p()).powf(1.0 / shape),
            Self::Arcsine { min, max } => {
                let share = |u: f64| (FRAC_PI_2 * u).sin().powi(2);
                scaled(
                    *min,
                    *max,
                    if u <= 0.5 { [share(u), 1.0 - share(u)] } else { [1.0 - share(1.0 - u), share(1.0 - u)] },
                )
            }
            Self::Table { values } => values[((u * values.len() as f64) as usize).min(values.len() - 1)],
        }
    }

    /// Least and greatest value that a draw can have.
    pub fn reach(&self) -> (f64, f64) {
        match self {
            Self::Constant { value } => (*value, *value),
            Self::Normal { mean, sigma } => (mean - REACH * sigma, mean + REACH * sigma),
            Self::Uniform { min, max }
            | Self::TruncatedNormal { min, max, .. }
            | Self::LogUniform { min, max }
            | Self::Triangular { min, max, .. }
            | Self::Beta { min, max, .. }
            | Self::Arcsine { min, max } => (*min, *max),
            Self::Weibull { min, .. } => (*min, self.quantile(LAST)),
            Self::Table { values } | Self::Discrete { values, .. } => (values[0], values[values.len() - 1]),
        }
    }

    /// Given values with weights above zero of any sum, in any order.
    pub(crate) fn discrete(mut weighted: Vec<(f64, f64)>) -> Self {
        weighted.sort_by(|one, other| one.0.total_cmp(&other.0));
        let sum: f64 = weighted.iter().map(|(_, weight)| weight).sum();
        let mut below = 0.0;
        let mut cumulative: Vec<f64> = weighted
            .iter()
            .map(|(_, weight)| {
                below += weight;
                below / sum
            })
            .collect();
        cumulative.iter_mut().next_back().into_iter().for_each(|last| *last = 1.0);
        Self::Discrete { values: weighted.into_iter().map(|(value, _)| value).collect(), cumulative }
    }

    /// The probability of each value of a discrete distribution; empty of any other.
    pub fn weights(&self) -> Vec<(f64, f64)> {
        let Self::Discrete { values, cumulative } = self else { return Vec::new() };
        let below = std::iter::once(&0.0).chain(cumulative);
        values.iter().zip(cumulative.iter().zip(below)).map(|(value, (to, from))| (*value, to - from)).collect()
    }

    /// The word in the campaign file.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Constant { .. } => "constant",
            Self::Normal { .. } => "normal",
            Self::Uniform { .. } => "uniform",
            Self::TruncatedNormal { .. } => "truncnormal",
            Self::LogUniform { .. } => "loguniform",
            Self::Discrete { .. } => "discrete",
            Self::Triangular { .. } => "triangular",
            Self::Beta { .. } => "beta",
            Self::Weibull { .. } => "weibull",
            Self::Arcsine { .. } => "arcsine",
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

/// A value from its distances to both bounds, as shares of the whole: near each bound the small one keeps its digits.
fn scaled(min: f64, max: f64, [above, below]: [f64; 2]) -> f64 {
    let width = max - min;
    (if above <= below { min + width * above } else { max - width * below }).clamp(min, max)
}

/// Quantile of a triangular distribution, each side from its own end.
fn triangular_quantile(min: f64, mode: f64, max: f64, u: f64) -> f64 {
    let (width, rise) = (max - min, mode - min);
    let value = if u * width <= rise {
        min + (u * width * rise).sqrt()
    } else {
        max - ((1.0 - u) * width * (max - mode)).sqrt()
    };
    value.clamp(min, max)
}

/// Quantile of the beta distribution on 0..1 and its distance from 1; the smaller of both keeps its digits.
fn beta_quantile(a: f64, b: f64, u: f64) -> [f64; 2] {
    if u <= beta_reg(a, b, 0.5) {
        let lower = beta_lower_half(a, b, u);
        [lower, 1.0 - lower]
    } else {
        let upper = beta_lower_half(b, a, 1.0 - u);
        [1.0 - upper, upper]
    }
}

/// The `x` in 0..1/2 at which the beta distribution function is `u`: Newton's method for its logarithm over `ln x`,
/// within a bracket that every step narrows.
fn beta_lower_half(a: f64, b: f64, u: f64) -> f64 {
    let ln_beta = ln_beta(a, b);
    // The distribution function is at least x^a (1/2)^max(b - 1, 0) / (a B) and at most x^a 2^max(1 - b, 0) / (a B) here.
    let power =
        |slack: f64| (((u * a).ln() + ln_beta + slack * std::f64::consts::LN_2) / a).min(-std::f64::consts::LN_2);
    let (mut low, mut high) = (power((b - 1.0).min(0.0)), power((b - 1.0).max(0.0)));
    let mut at = 0.5 * (low + high);
    for _ in 0..200 {
        let share = beta_reg(a, b, at.exp());
        let miss = share.ln() - u.ln();
        *(if miss > 0.0 { &mut high } else { &mut low }) = at;
        let density = (a * at + (b - 1.0) * (-at.exp()).ln_1p() - ln_beta).exp();
        let newton = at - miss * share / density;
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        if (next - at).abs() <= 1e-14 * at.abs().max(1.0) || high - low <= 1e-15 * high.abs() {
            return next.exp();
        }
        at = next;
    }
    at.exp()
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
            (Distribution::discrete(vec![(7.0, 1.0), (1.0, 1.0), (2.0, 2.0)]), 3.0, 5.5_f64.sqrt()),
            (Distribution::Triangular { min: 1.0, mode: 2.0, max: 6.0 }, 3.0, (21.0_f64 / 18.0).sqrt()),
            (Distribution::Triangular { min: 1.0, mode: 1.0, max: 4.0 }, 2.0, 0.5_f64.sqrt()),
            (Distribution::Beta { a: 2.0, b: 3.0, min: 1.0, max: 6.0 }, 3.0, 1.0),
            // The mean of a Rayleigh distribution is scale sqrt(pi) / 2.
            (
                Distribution::Weibull { scale: 2.0, shape: 2.0, min: 1.0 },
                1.0 + std::f64::consts::PI.sqrt(),
                (4.0 - std::f64::consts::PI).sqrt(),
            ),
            (Distribution::Arcsine { min: -1.0, max: 3.0 }, 1.0, 2.0_f64.sqrt()),
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

    /// Greatest distance of the empirical from the true distribution function (Kolmogorov-Smirnov) of 20,000 draws.
    fn distance(distribution: &Distribution, share: impl Fn(f64) -> f64) -> f64 {
        let count = 20_000_u64;
        let mut draws: Vec<f64> = (0..count).map(|run| distribution.quantile(uniform(11, "ks", run, 0))).collect();
        draws.sort_by(f64::total_cmp);
        let gaps = draws.iter().enumerate().map(|(rank, draw)| {
            let (share, count) = (share(*draw), count as f64);
            (share - rank as f64 / count).abs().max(((rank + 1) as f64 / count - share).abs())
        });
        gaps.fold(0.0, f64::max)
    }

    /// The distance exceeds 1.95 / sqrt(n) with a probability of 0.1 %; a shape that is 5 % off exceeds it.
    #[test]
    fn draws_have_their_distribution() {
        let limit = 1.95 / 20_000_f64.sqrt();
        let triangle = |x: f64| if x <= 2.0 { (x - 1.0).powi(2) / 5.0 } else { 1.0 - (6.0 - x).powi(2) / 20.0 };
        let found = distance(&Distribution::Triangular { min: 1.0, mode: 2.0, max: 6.0 }, triangle);
        assert!(found < limit, "triangular: {found}");
        let arcsine = |x: f64| (x / 3.0).sqrt().asin() / FRAC_PI_2;
        let found = distance(&Distribution::Arcsine { min: 0.0, max: 3.0 }, arcsine);
        assert!(found < limit, "arcsine: {found}");
        let weibull = |shape: f64| move |x: f64| 1.0 - (-((x - 1.0) / 2.0).powf(shape)).exp();
        let drawn = Distribution::Weibull { scale: 2.0, shape: 1.5, min: 1.0 };
        assert!(distance(&drawn, weibull(1.5)) < limit);
        assert!(distance(&drawn, weibull(1.6)) > limit, "another shape is seen");
        // Beta distribution functions in closed form.
        let rising = distance(&Distribution::Beta { a: 3.0, b: 1.0, min: 0.0, max: 1.0 }, |x| x.powi(3));
        let mixed = distance(&Distribution::Beta { a: 2.0, b: 2.0, min: 0.0, max: 1.0 }, |x| x * x * (3.0 - 2.0 * x));
        let edges = distance(&Distribution::Beta { a: 0.5, b: 0.5, min: 0.0, max: 3.0 }, arcsine);
        assert!(rising < limit && mixed < limit && edges < limit, "{rising} {mixed} {edges}");
    }

    /// The quantile's distribution function is the share again, down to the least and up to the greatest share of a draw.
    #[test]
    fn beta_quantiles_invert_the_distribution_function() {
        for (a, b) in [(0.1, 0.1), (0.1, 50.0), (0.5, 3.0), (1.0, 1.0), (2.0, 0.3), (7.0, 900.0), (1000.0, 1000.0)] {
            for u in [2.0_f64.powi(-54), 1e-9, 0.003, 0.25, 0.5, 0.75, 0.999, 1.0 - 1e-9, LAST] {
                let [above, below] = beta_quantile(a, b, u);
                // The smaller side is compared, so that its digits count.
                let (share, of) =
                    if u <= 0.5 { (u, beta_of(a, b, above, below)) } else { (1.0 - u, beta_of(b, a, below, above)) };
                let rounding = 4.0 * f64::EPSILON / share;
                assert!((of / share - 1.0).abs() < 1e-9 + rounding, "a {a} b {b} u {u}: {above:e} {below:e} {of:e}");
            }
        }
    }

    /// The distribution function from both distances.
    fn beta_of(a: f64, b: f64, above: f64, below: f64) -> f64 {
        if above <= below { beta_reg(a, b, above) } else { 1.0 - beta_reg(b, a, below) }
    }

    #[test]
    fn quantiles_in_closed_form() {
        let near = |distribution: &Distribution, u: f64, expected: f64| {
            let found = distribution.quantile(u);
            assert!((found - expected).abs() <= 1e-12 * expected.abs().max(1.0), "{distribution:?} {u}: {found}");
        };
        let triangle = Distribution::Triangular { min: 0.0, mode: 1.0, max: 4.0 };
        [(0.25, 1.0), (0.0625, 0.5), (1.0 - 1.0 / 12.0, 3.0)].iter().for_each(|(u, x)| near(&triangle, *u, *x));
        let weibull = Distribution::Weibull { scale: 3.0, shape: 2.0, min: -1.0 };
        near(&weibull, 1.0 - (-1.0_f64).exp(), 2.0);
        near(&weibull, 1.0 - (-4.0_f64).exp(), 5.0);
        let arcsine = Distribution::Arcsine { min: -2.0, max: 2.0 };
        [(0.5, 0.0), (1.0 / 3.0, -1.0), (2.0 / 3.0, 1.0)].iter().for_each(|(u, x)| near(&arcsine, *u, *x));
        near(&Distribution::Beta { a: 2.0, b: 1.0, min: 0.0, max: 10.0 }, 0.49, 7.0);
        near(&Distribution::Beta { a: 1.0, b: 3.0, min: 0.0, max: 10.0 }, 1.0 - 0.027, 7.0);
    }

    /// Each value has the interval of its weight: nothing is lost between two values, and none is met beyond its end.
    #[test]
    fn discrete_values_have_their_weights() {
        let discrete = Distribution::discrete(vec![(5.0, 1.0), (-1.0, 2.0), (2.0, 5.0)]);
        for (u, value) in
            [(1e-17, -1.0), (0.249, -1.0), (0.25, 2.0), (0.874, 2.0), (0.875, 5.0), (LAST, 5.0), (1.0, 5.0)]
        {
            assert_eq!(discrete.quantile(u), value, "{u}");
        }
        assert_eq!(discrete.reach(), (-1.0, 5.0));
        assert_eq!(discrete.weights(), [(-1.0, 0.25), (2.0, 0.625), (5.0, 0.125)]);
    }
}
