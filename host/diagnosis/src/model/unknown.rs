//! Free parameters of a hypothesis with their priors.

use softdock_engine::section::Section;

/// Prior of a parameter in terms of `z`, which is standard normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ParameterPrior {
    /// Either sign: `mean + sd z`.
    Normal {
        /// Prior median.
        mean: f64,
        /// Standard deviation.
        sd: f64,
    },
    /// Never negative: `scale z` with z >= 0.
    Positive {
        /// Plausible size.
        scale: f64,
    },
    /// At most `top`: `top exp(-share z)` with z >= 0.
    Below {
        /// Value above which the parameter has no effect.
        top: f64,
        /// Natural logarithm of the factor that is a plausible size.
        share: f64,
    },
    /// Positive, known to a factor: `centre exp(spread z)`.
    LogNormal {
        /// Prior median.
        centre: f64,
        /// Natural logarithm of the factor that is one standard deviation.
        spread: f64,
    },
}

impl ParameterPrior {
    /// Returns the value at `z`.
    pub fn value(&self, z: f64) -> f64 {
        match *self {
            Self::Normal { mean, sd } => mean + sd * z,
            Self::Positive { scale } => scale * z,
            Self::Below { top, share } => top * (-share * z).exp(),
            Self::LogNormal { centre, spread } => centre * (spread * z).exp(),
        }
    }

    /// Returns the derivative of the value with respect to `z`.
    pub fn slope(&self, z: f64) -> f64 {
        match *self {
            Self::Normal { sd, .. } => sd,
            Self::Positive { scale } => scale,
            Self::Below { share, .. } => -share * self.value(z),
            Self::LogNormal { spread, .. } => spread * self.value(z),
        }
    }

    /// Returns the `z` of a value.
    pub fn place(&self, value: f64) -> f64 {
        match *self {
            Self::Normal { mean, sd } => (value - mean) / sd,
            Self::Positive { scale } => value / scale,
            Self::Below { top, share } => (top / value).ln().max(0.0) / share,
            Self::LogNormal { centre, spread } => (value / centre).ln() / spread,
        }
    }

    /// Returns the nearest admissible `z`.
    pub fn allowed(&self, z: f64) -> f64 {
        if self.is_one_sided() { z.max(0.0) } else { z }
    }

    /// Returns whether only z >= 0 is admissible.
    pub fn is_one_sided(&self) -> bool {
        matches!(self, Self::Positive { .. } | Self::Below { .. })
    }
}

/// Role of a free parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Nuisance parameter, free within its tolerance under every hypothesis.
    Nuisance,
    /// Size of the effect; zero for no effect.
    Size,
    /// Form of the effect, independent of its size (a frequency, a speed, a time constant).
    Form,
}

/// Free parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Unknown {
    /// Field of the block's parameters.
    pub name: String,
    /// Index in the block's field table.
    pub field: usize,
    /// SI unit.
    pub unit: &'static str,
    /// Prior.
    pub prior: ParameterPrior,
    /// Role.
    pub role: Role,
    /// Physical limits of the value, SI; a fit beyond them is no explanation.
    pub limits: [f64; 2],
}

/// Limits of a value that physics does not limit.
pub const NO_LIMITS: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

impl Unknown {
    /// Builds a parameter without physical limits.
    pub fn new(name: impl Into<String>, field: usize, unit: &'static str, prior: ParameterPrior, role: Role) -> Self {
        Self { name: name.into(), field, unit, prior, role, limits: NO_LIMITS }
    }

    /// A free number of a block, by the name of the parameter.
    ///
    /// # Panics
    /// If the block has no such parameter.
    pub(crate) fn of(section: &Section, name: &str, prior: ParameterPrior, role: Role) -> Self {
        let fields = section.parameters();
        let field = fields.iter().position(|field| field.name == name).expect("the name of a block's parameter");
        Self::new(name, field, fields[field].unit, prior, role)
    }
}

/// Returns a block's parameters with the free ones replaced; `z` in the order of the unknowns.
pub fn applied(base: &[f64], unknowns: &[Unknown], z: &[f64]) -> Vec<f64> {
    let mut values = base.to_vec();
    for (unknown, z) in unknowns.iter().zip(z) {
        values[unknown.field] = unknown.prior.value(*z);
    }
    values
}
