//! The free numbers of a hypothesis, each with what is plausible before the data are seen.

use softdock_engine::section::Section;

/// What is plausible of a number; `z` counts in its own spread and is standard normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Prior {
    /// Either sign: `mean + sd z`.
    Normal {
        /// Most plausible value.
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
        /// Value from which on nothing changes.
        top: f64,
        /// Natural logarithm of the factor that is a plausible size.
        share: f64,
    },
    /// Positive, known to a factor: `centre exp(spread z)`.
    LogNormal {
        /// Most plausible value.
        centre: f64,
        /// Natural logarithm of the factor that is one standard deviation.
        spread: f64,
    },
}

impl Prior {
    /// The value that belongs to a `z`.
    pub fn value(&self, z: f64) -> f64 {
        match *self {
            Self::Normal { mean, sd } => mean + sd * z,
            Self::Positive { scale } => scale * z,
            Self::Below { top, share } => top * (-share * z).exp(),
            Self::LogNormal { centre, spread } => centre * (spread * z).exp(),
        }
    }

    /// By how much the value grows with `z`.
    pub fn slope(&self, z: f64) -> f64 {
        match *self {
            Self::Normal { sd, .. } => sd,
            Self::Positive { scale } => scale,
            Self::Below { share, .. } => -share * self.value(z),
            Self::LogNormal { spread, .. } => spread * self.value(z),
        }
    }

    /// The `z` that belongs to a value.
    pub fn place(&self, value: f64) -> f64 {
        match *self {
            Self::Normal { mean, sd } => (value - mean) / sd,
            Self::Positive { scale } => value / scale,
            Self::Below { top, share } => (top / value).ln().max(0.0) / share,
            Self::LogNormal { centre, spread } => (value / centre).ln() / spread,
        }
    }

    /// The nearest `z` that is allowed.
    pub fn allowed(&self, z: f64) -> f64 {
        if self.is_one_sided() { z.max(0.0) } else { z }
    }

    /// Whether only z >= 0 is allowed.
    pub fn is_one_sided(&self) -> bool {
        matches!(self, Self::Positive { .. } | Self::Below { .. })
    }
}

/// What a free number is to its hypothesis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// It may differ within its tolerance unnoticed, whatever the hypothesis.
    Nuisance,
    /// How large the effect is; at zero there is no effect.
    Size,
    /// How the effect looks, whatever its size (a frequency, a speed, a time constant).
    Form,
}

/// A free number.
#[derive(Clone, Debug, PartialEq)]
pub struct Unknown {
    /// Field of the block's parameters.
    pub name: String,
    /// Its place in the block's field table.
    pub field: usize,
    /// Its SI unit.
    pub unit: &'static str,
    /// What is plausible.
    pub prior: Prior,
    /// What it is to the hypothesis.
    pub role: Role,
}

impl Unknown {
    /// A free number of a block, by the name of the parameter.
    ///
    /// # Panics
    /// If the block has no such parameter.
    pub(crate) fn of(section: &Section, name: &str, prior: Prior, role: Role) -> Self {
        let fields = section.parameters();
        let field = fields.iter().position(|field| field.name == name).expect("the name of a block's parameter");
        Self { name: name.to_owned(), field, unit: fields[field].unit, prior, role }
    }
}

/// A block's parameters with some of them replaced; `z` in the order of the unknowns.
pub fn applied(base: &[f64], unknowns: &[Unknown], z: &[f64]) -> Vec<f64> {
    let mut values = base.to_vec();
    for (unknown, z) in unknowns.iter().zip(z) {
        values[unknown.field] = unknown.prior.value(*z);
    }
    values
}
