//! Sign-off statistics, plots and the report.
//!
//! Sign-off is exact: one-sided Clopper-Pearson bounds and allowed failures, invalid runs counted as failures.
//! Early fail, never early pass. No share without its interval.

pub mod exact;
pub mod number;
pub mod plan;
