//! Measured recordings: read through a model's `[log]`, put on an even grid, and what was found wrong with them.

pub(crate) mod drive_log;
pub mod grid;
pub mod smooth;
pub mod state;
pub(crate) mod table;
