//! The physics of the HIL loop, written once.
//!
//! One Rust text per stage, generic over the scalar ([`real::Real`]): f64 is the truth, [`lanes`] are the CPU farm,
//! and the symbols of [`trace`] print the same text as straight-line WGSL. The frame around the stages (ticks,
//! substeps, delay lines, random numbers) stands twice: in `wgsl/` and in [`frame`]. SI units throughout.

pub mod effects;
pub mod fields;
pub mod metrics;
pub mod model;
pub mod params;
pub mod philox;
pub mod real;
pub mod vector;
