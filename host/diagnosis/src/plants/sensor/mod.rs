//! Force/torque sensor under known loads.

pub mod block;
pub mod excess_noise;
pub mod hypotheses;
