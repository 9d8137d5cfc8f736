//! The reference facility's robots joint by joint: the sine test, and the lag that stands for it.

use super::bench::{job, numbered};
use softdock_engine::Engine;
use softdock_engine::cpu::CpuEngine;
use softdock_kernels::model::Model;
use softdock_kernels::params::Params;
use std::f64::consts::TAU;
use std::path::Path;

fn sine_test() -> Model {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("campaigns/scenarios/facility_sine.toml");
    softdock_campaign::load_scenario(&path).expect("a shipped scenario loads").model
}

/// Gain and lag \[deg\] of the robots at some frequencies \[Hz\].
fn response(model: &Model, frequencies: &[f64], change: impl Fn(&mut Params<f64>)) -> Vec<(f64, f64)> {
    let params: Vec<_> = frequencies
        .iter()
        .map(|frequency| {
            let mut p = Params { test_frequency: *frequency, ..model.nominal };
            change(&mut p);
            p
        })
        .collect();
    let rows = CpuEngine::new().run(&job(model.clone(), &params), &numbered(&params), &|_| true);
    let rows = rows.expect("nobody stops the batch");
    rows.iter().map(|row| (row.hil.tracking_gain, row.hil.tracking_lag.to_degrees())).collect()
}

#[test]
fn the_sine_test_of_the_reference_facility_comes_out() {
    let (gain, lag) = response(&sine_test(), &[1.0], |_| {})[0];
    println!("gain {gain:.4}, lag {lag:.2} degrees");
    assert!((gain - 0.8).abs() < 0.05, "gain {gain}");
    assert!((lag - 20.0).abs() < 3.0, "lag {lag}");
}

/// w^2 (1 + T_z s) / (s^2 + 2 z w s + w^2) fitted to the joints' response to 5 mm from 0.2 to 3 Hz: 1/w, z, T_z.
const LAG: f64 = 25.94e-3;
const DAMPING: f64 = 2.896;
const ZERO: f64 = 71.81e-3;

/// The lag level against the joints, over the band in which docking happens.
#[test]
fn the_lag_level_follows_as_the_joint_level_does() {
    let mut joints = sine_test();
    joints.timing.max_ticks = 13_000;
    let mut lagging = joints.clone();
    lagging.facility.joint_level = None;
    let frequencies = [0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 2.5, 3.0];
    // Far from the limits of speed and acceleration.
    let of_joints = response(&joints, &frequencies, |p| p.test_amplitude = 5e-3);
    let of_lag = response(&lagging, &frequencies, |p| {
        (p.robot1_lag, p.robot1_lag_damping, p.robot1_lag_zero) = (LAG, DAMPING, ZERO);
    });
    for ((frequency, a), b) in frequencies.iter().zip(&of_joints).zip(&of_lag) {
        println!("{frequency} Hz: joints {:.4} {:.2}, lag {:.4} {:.2}", a.0, a.1, b.0, b.1);
        let w = TAU * frequency * LAG;
        let exact = (1.0 + (TAU * frequency * ZERO).powi(2)).sqrt() / (1.0 - w * w).hypot(2.0 * DAMPING * w);
        assert!((b.0 / exact - 1.0).abs() < 0.01, "the lag level's own gain at {frequency} Hz: {} for {exact}", b.0);
    }
    for ((frequency, a), b) in frequencies.iter().zip(&of_joints).zip(&of_lag) {
        assert!((a.0 / b.0 - 1.0).abs() < 0.03, "{frequency} Hz: gain {} against {}", a.0, b.0);
        assert!((a.1 - b.1).abs() < 2.0, "{frequency} Hz: lag {} against {}", a.1, b.1);
    }
}
