//! Runs of the small scenarios of the oracles.

pub(super) use super::scenes::*;
use softdock_engine::cpu::CpuEngine;
use softdock_engine::{Engine, Job, RunInput, is_noisy};
use softdock_kernels::model::*;
use softdock_kernels::outcome::Finished;
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use softdock_kernels::vector::vec3;

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

/// The state after a time \[s\] by the classical Runge-Kutta method.
pub(super) fn runge_kutta<const N: usize>(
    first: [f64; N],
    (step, time): (f64, f64),
    slope: impl Fn([f64; N]) -> [f64; N],
) -> [f64; N] {
    let moved = |y: [f64; N], slope: [f64; N], dt: f64| std::array::from_fn(|i| y[i] + dt * slope[i]);
    let mut y = first;
    for _ in 0..(time / step).round() as u32 {
        let a = slope(y);
        let b = slope(moved(y, a, step / 2.0));
        let c = slope(moved(y, b, step / 2.0));
        let d = slope(moved(y, c, step));
        y = std::array::from_fn(|i| y[i] + step / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]));
    }
    y
}

/// An arm in contact in both loops: all momenta follow their impulses.
#[track_caller]
pub(super) fn assert_momentum_in_contact(model: Model) {
    let params = Params {
        base_mass: 400.0,
        target_mass: 300.0,
        loop_delay: 5e-3,
        target_rate: vec3(0.0, 0.02, -0.01),
        contact_friction: 0.2,
        bristle_stiffness: 5e3,
        ..closing(1.0, 0.06, 1e4, 30.0)
    };
    for row in run(model, &[params]) {
        for side in [row.space, row.hil] {
            assert!(side.touch_time > 0.0);
            // Of 24 kg m/s and some 10 kg m^2/s.
            assert!(side.linear_momentum_error < 24e-10, "linear {}", side.linear_momentum_error);
            assert!(side.angular_momentum_error < 10e-10, "angular {}", side.angular_momentum_error);
        }
    }
}
