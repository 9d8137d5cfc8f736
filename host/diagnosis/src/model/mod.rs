//! Types that plants build and inference consumes: measured blocks, parameters with priors, hypotheses.

pub mod block;
pub mod hypothesis;
pub mod isolability;
pub mod place;
pub mod unknown;
