//! Answers for blocks: verdict, causes, parameters, gain; withheld answers.

pub mod answer;
pub(crate) mod decide;
pub mod errors;
pub mod estimates;
pub mod free_run;
pub mod judged;
pub(crate) mod reconcile;
