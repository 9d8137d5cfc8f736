//! Integration tests of the workspace, one module per subject, in one binary.

mod bad_input;
mod bench;
mod cli;
mod contact_events;
mod diagnose;
mod discovery;
mod docs;
mod drive;
mod engine_loss;
mod examples;
mod facility;
mod gpu;
mod identify;
mod kernel;
#[cfg(target_os = "linux")]
mod million;
mod one_facility;
mod operator_page;
mod oracles;
mod parity;
mod readme;
mod resume;
mod rig_init;
mod serve;
mod slurm;
mod step;
mod two_writers;
mod verify;
mod workspace_rules;
