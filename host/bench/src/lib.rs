//! Gauntlet: the scored test set of the diagnosis, from recordings with known causes.
//!
//! A [`plan`] lists cases: hidden effect, size, and noise. The [`oracle`] determines the detection limit of an effect
//! in these data; sizes are multiples of it. A [`trial`] seals the truth, diagnoses the recordings, and only then
//! computes what requires the truth; its [`record`] is one line. The [`score`] opens the seals and counts, with exact
//! bounds.

mod baseline;
pub mod calibration;
pub mod cases;
mod error;
pub mod oracle;
pub mod outcome;
pub mod page;
pub mod parameters;
pub mod plan;
pub mod plant;
pub mod real;
pub mod record;
mod recordings_folder;
pub mod score;
pub mod seal;
pub mod sizing;
pub mod summary_text;
pub mod trial;
mod true_gain;

pub use error::GauntletError;
pub(crate) use error::Result;
