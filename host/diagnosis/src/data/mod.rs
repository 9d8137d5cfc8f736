//! Measured recordings: read through a model's `[log]`, resampled to an even grid, with findings; held-out data.

pub(crate) mod bandwidth;
pub(crate) mod dialect;
pub(crate) mod drive_log;
pub mod grid;
pub mod hold_out;
pub(crate) mod recordings;
pub(crate) mod repeats;
pub mod smooth;
pub mod state;
pub mod table;
