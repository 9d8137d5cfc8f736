//! Damaged, oversized and special files as inputs, and a killed program: no crash, hang or wrong result.

mod kills;
mod limits;
mod mutated;
mod mutations;
mod watchdog;
mod workshop;
