//! Generator of recordings with hidden effects, for the score of the diagnosis.
//!
//! A [`Rig`] is a simulated test rig: a plant with its controller, its instruments and their faults, integrated ten
//! times finer than the command period, by laws that differ from those of the diagnosis. [`generate`] returns the
//! nominal model, recordings with repeats, a held-out motion and, separately, the truth. Every data set draws its own
//! nuisance parameters from a seed; the same call returns the same bytes.
//!
//! The crate depends on no crate of softdock: code shared with the diagnosis would bias the score.

mod body;
mod catalogue;
mod command;
mod commanded_path;
mod contact;
mod drive;
mod error;
mod facility;
mod instrument;
mod motion;
mod ode;
mod perturbation;
mod random;
mod robot;
mod sensor;
mod session;
mod space;
mod table;
mod toss;

pub use catalogue::{EffectCase, Hidden, Parameter, Rig, Stronger, effects, outside};
pub use commanded_path::CommandedPath;
pub use error::Error;
pub use perturbation::{PERTURBATIONS, Perturbation, SHARES, perturbations};
pub use random::NoiseColour;
pub use session::{Fresh, Further, HiddenTruth, Set, Truth, exact, follow, fresh, further, generate, unmoved};
pub use toss::{Tosses, tosses};
