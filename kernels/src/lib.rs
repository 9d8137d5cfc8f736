//! The physics of the HIL loop, written once.
//!
//! One Rust text per stage, generic over the scalar ([`real::Real`]): f64 is the truth, [`lanes`] are the CPU farm,
//! and the symbols of `softdock-tracer` print the same text as straight-line WGSL. The frame around the stages (ticks,
//! substeps, delay lines, random numbers) stands twice: in `wgsl/` and in [`frame`]. SI units throughout.

pub mod arm_motion;
pub mod arm_plan;
pub mod block;
pub mod capture_ring;
pub mod chain;
pub mod compensator;
pub mod contact;
pub mod contact_parts;
pub mod delay_line;
pub mod effects;
pub mod fields;
pub mod fixture;
pub mod frame;
pub mod grip;
pub mod guidance;
pub mod impedance;
pub mod joint_level;
pub mod lanes;
pub mod large_rotation;
pub mod load;
pub mod lookup;
pub mod manipulator;
pub mod material;
pub mod math;
pub mod mesh;
pub mod metrics;
pub mod model;
pub mod modes;
pub mod monitor;
pub mod noise;
pub mod outcome;
pub mod params;
pub mod philox;
pub mod plant;
pub mod quads;
pub mod range;
pub mod real;
pub mod robot;
pub mod segment;
pub mod sensor;
pub mod session;
pub mod space;
mod spatial;
pub mod staged;
pub mod stages;
pub mod start;
pub mod stewart;
pub mod test_motion;
pub mod thrusters;
pub mod timing;
pub mod vector;
