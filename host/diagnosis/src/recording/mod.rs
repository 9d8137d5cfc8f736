//! Measured recordings: read through a model's `[log]`, resampled to an even grid, with findings.

pub(crate) mod drive_log;
pub mod grid;
pub mod smooth;
pub mod state;
pub mod table;
