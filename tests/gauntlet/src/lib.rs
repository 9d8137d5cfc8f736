//! Measured recordings with a hidden effect, to judge the diagnosis by.
//!
//! A [`Rig`] is a test bench in software: a plant with its controller, its instruments and their faults, integrated ten
//! times finer than the command period, by other laws than a fitter is likely to assume. [`generate`] makes what its
//! owner would hand over (the nominal model, recordings with repeats, a held-out motion) and, apart from it, the truth.
//! Every data set draws its own nuisances from a seed; the same call gives the same bytes.
//!
//! The crate knows nothing of softdock: what it shared with the fitter would flatter the fitter's score.

mod body;
mod catalogue;
mod command;
mod contact;
mod drive;
mod error;
mod facility;
mod instrument;
mod motion;
mod ode;
mod random;
mod robot;
mod sensor;
mod session;
mod space;
mod table;
mod told;
mod toss;

pub use catalogue::{EffectCase, Hidden, Parameter, Rig, Stronger, effects, outside};
pub use error::Error;
pub use random::NoiseColour;
pub use session::{Fresh, Further, HiddenTruth, Set, Truth, exact, follow, fresh, further, generate, unmoved};
pub use told::Told;
pub use toss::{Tosses, tosses};
