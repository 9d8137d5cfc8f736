//! Judges the diagnosis by recordings whose cause is known: plan, sealed answers, oracle, score.
//!
//! A [`plan`] lists cases: what the generator hides, how large, with which noise. The [`oracle`] says how large an effect
//! must be before anybody could see it in these data; sizes are multiples of that. A [`trial`] seals the truth, diagnoses
//! the recordings, and only then measures what the truth is needed for; its [`record`] is one line. The [`score`] opens
//! the seals and counts, with exact bounds.

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
pub mod record;
mod recordings_folder;
pub mod score;
pub mod seal;
pub mod summary_text;
pub mod trial;
mod true_gain;

pub use error::GauntletError;
pub(crate) use error::Result;
