//! Whole facility: command to motion, and motion to wrench.

pub mod block;
pub mod hypotheses;
