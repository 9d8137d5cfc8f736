//! Diagnosis of model errors from recordings.

mod admissibility;
pub mod answer;
pub mod answer_text;
pub mod block;
mod combine;
pub mod command_line;
mod decide;
pub mod diagnosis;
pub mod diagnosis_page;
mod error;
pub mod experiment;
pub mod extend;
pub mod free_run;
pub mod hold_out;
pub mod inference;
pub mod isolability;
mod judge;
pub mod library;
mod next_drive;
mod packets;
mod quantisation;
pub mod recording;
pub mod result_files;
pub mod signals_text;
pub mod subject;
pub mod template;
mod timing;
pub mod torque_error;
mod unit_checks;
pub mod unmodelled;
pub mod variance;

pub use error::DiagnosisError;
pub(crate) use error::Result;
pub use judge::{BlockJudgement, Candidate, NoiseFrom, judge, threshold};
