//! What can be wrong with a request for recordings.

use std::fmt;

/// Why no recordings were made.
#[derive(Clone, Debug, PartialEq)]
pub enum Error {
    /// The rig cannot hide this effect.
    UnknownEffect {
        /// The id asked for.
        id: String,
        /// Ids that the rig knows.
        known: Vec<&'static str>,
    },
    /// An effect is named twice.
    Repeated {
        /// Its id.
        id: &'static str,
    },
    /// A size is not a positive number, or beyond what the plant bears.
    Size {
        /// The effect.
        id: &'static str,
        /// The size asked for, in the effect's unit.
        size: f64,
        /// The largest size that the rig can show, in the same unit.
        largest: f64,
        /// The unit.
        unit: &'static str,
    },
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UnknownEffect { id, known } => {
                write!(f, "the rig has no effect `{id}`; it can hide {}", known.join(", "))
            }
            Self::Repeated { id } => write!(f, "effect `{id}` is hidden twice; give it one size"),
            Self::Size { id, size, largest, unit } => {
                write!(f, "effect `{id}` of size {size} {unit}: give a number above 0 and up to {largest} {unit}")
            }
        }
    }
}

impl std::error::Error for Error {}
