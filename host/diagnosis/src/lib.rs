//! Diagnosis of model errors from recordings: a pipeline from recordings to an answer.
//!
//! Imports point one way: [`data`], [`model`], [`inference`], [`verdict`], [`plants`], [`propose`], [`diagnosis`],
//! [`report`], [`subject`].

pub mod data;
pub mod diagnosis;
mod error;
pub mod inference;
pub mod model;
pub mod plants;
pub mod propose;
pub mod report;
pub mod subject;
pub mod verdict;

pub use error::DiagnosisError;
pub(crate) use error::Result;
pub use inference::judge::{BlockJudgement, Candidate, NoiseFrom, judge, threshold};
