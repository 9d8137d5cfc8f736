//! Body tossed onto a plane.

pub mod block;
mod free_run;
pub mod hypotheses;
