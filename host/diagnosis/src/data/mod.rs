//! Measured recordings: read through a model's `[log]`, resampled to an even grid, with findings; held-out data.

pub(crate) mod bandwidth;
pub mod clock;
pub(crate) mod dialect;
pub(crate) mod drive_log;
pub mod grid;
pub mod hold_out;
pub(crate) mod outliers;
pub(crate) mod plausibility;
pub mod quality;
pub(crate) mod recordings;
pub(crate) mod repeats;
pub(crate) mod segments;
pub mod smooth;
pub(crate) mod stamps;
pub mod state;
pub mod table;
