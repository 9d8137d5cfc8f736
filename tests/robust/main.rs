//! Inputs that are damaged, oversized or no files, and a program that is killed: nothing crashes, hangs or misleads.

mod kills;
mod limits;
mod mutated;
mod mutations;
mod watchdog;
mod workshop;
