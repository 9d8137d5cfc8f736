//! One body against a plate.

pub mod block;
pub mod hypotheses;
