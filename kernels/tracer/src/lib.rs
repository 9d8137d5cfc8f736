//! The GPU kernels: the physics of `softdock-kernels`, traced into WGSL, and the hand-written frame around it.
//!
//! A crate of its own, compiled without optimisation: a trace takes milliseconds, and optimised the tracing code takes
//! the compiler a minute.

pub mod block_kernel;
pub mod kernel;
pub mod stages;
pub mod trace;
pub mod wgsl;
