//! What measured data say of the models: identification of the robots, and diagnosis of what a simulation gets wrong.

pub mod answer;
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
pub mod identify;
pub mod inference;
pub mod isolability;
mod judge;
pub mod library;
mod next_drive;
pub mod outside;
mod packets;
pub mod recording;
pub mod result_files;
pub mod signals_text;
mod soundness;
mod steps;
pub mod subject;
mod suspects;
pub mod template;
mod timing;
pub mod torque_error;
pub mod variance;
pub mod words;

pub use error::{Error, Result};
pub use judge::{Candidate, Judgement, NoiseFrom, judge, threshold};
