//! Runs of the small scenarios of the oracles.

pub(super) use super::scenes::*;
use softdock_engine::cpu::CpuEngine;
use softdock_engine::{Engine, Job, RunInput, is_noisy};
use softdock_kernels::model::*;
use softdock_kernels::outcome::Finished;
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;

/// A job over a model; the seed is fixed.
pub(super) fn job(model: Model, params: &[Params<f64>]) -> Job {
    Job::new(Plant::new(model), 7, params.iter().any(is_noisy))
}

/// Numbers parameter sets as runs 0, 1, ...
pub(super) fn numbered(params: &[Params<f64>]) -> Vec<RunInput> {
    params.iter().zip(0..).map(|(params, run)| RunInput::new(run, *params)).collect()
}

/// Makes all runs on the widest lanes of this machine.
pub(super) fn run(model: Model, params: &[Params<f64>]) -> Vec<Finished> {
    let job = job(model, params);
    CpuEngine::new().run(&job, &numbered(params), &|_| true).expect("nobody stops the batch")
}

/// Asserts |value / expected - 1| <= tolerance and reports the comparison.
#[track_caller]
pub(super) fn assert_close(what: &str, value: f64, expected: f64, tolerance: f64) {
    let error = value / expected - 1.0;
    assert!(error.abs() <= tolerance, "{what}: {value} instead of {expected}, off by {error:.2e} of {tolerance:.0e}");
}
