//! Errors of a request for recordings.

use crate::catalogue::EffectCase;
use std::fmt;

/// Error of a request for recordings.
#[derive(Clone, Debug, PartialEq)]
pub enum Error {
    /// The rig cannot hide this effect.
    UnknownEffect {
        /// The id asked for.
        id: String,
        /// Ids of the rig.
        known: Vec<&'static str>,
    },
    /// An effect is named twice.
    Repeated {
        /// Its id.
        id: &'static str,
    },
    /// A size is not a positive number, or out of the range of the rig.
    Size {
        /// The size asked for, in the effect's unit.
        size: f64,
        /// The effect with its range.
        case: EffectCase,
    },
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UnknownEffect { id, known } => {
                write!(f, "the rig has no effect `{id}`; it can hide {}", known.join(", "))
            }
            Self::Repeated { id } => write!(f, "effect `{id}` is hidden twice; give it one size"),
            Self::Size { size, case: EffectCase { id, unit, smallest, largest, .. } } => {
                write!(
                    f,
                    "effect `{id}` of size {size} {unit}: give a number above 0, from {smallest:e} to {largest:e} {unit}"
                )
            }
        }
    }
}

impl std::error::Error for Error {}
