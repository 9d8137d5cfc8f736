//! Free body under known wrenches.

pub mod block;
pub mod hypotheses;
