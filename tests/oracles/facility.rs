//! Robots of the reference facility joint by joint: sine test, equivalent lag, feedforward and gears.

use super::bench::{job, numbered};
use softdock_engine::Engine;
use softdock_engine::cpu::CpuEngine;
use softdock_kernels::manipulator::cell::Feedforward;
use softdock_kernels::metrics::Metrics;
use softdock_kernels::model::Model;
use softdock_kernels::params::Params;
use std::f64::consts::TAU;
use std::path::Path;

fn scenario(name: &str) -> Model {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("campaigns/scenarios").join(name);
    softdock_campaign::load_scenario(&path).expect("a shipped scenario loads").model
}

fn sine_test() -> Model {
    scenario("facility_sine.toml")
}

/// Returns the facility metrics of some parameters.
fn run(model: &Model, params: &[Params<f64>]) -> Vec<Metrics<f64>> {
    let rows = CpuEngine::new().run(&job(model.clone(), params), &numbered(params), &|_| true);
    rows.expect("nobody stops the batch").into_iter().map(|row| row.hil).collect()
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
    run(model, &params).iter().map(|hil| (hil.tracking_gain, hil.tracking_lag.to_degrees())).collect()
}

#[test]
fn sine_test_of_the_reference_facility_is_reproduced() {
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
fn lag_level_follows_like_the_joint_level() {
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

/// A trapezoid of speed that the robots follow at once: no overshoot, and no error but the delay's.
#[test]
fn an_ideal_robot_follows_the_trapezoid() {
    let mut ideal = scenario("facility_velocity.toml");
    ideal.facility.joint_level = None;
    let hil = run(&ideal, &[ideal.nominal])[0];
    let top = 2.0 * ideal.nominal.test_amplitude * ideal.nominal.test_frequency / 0.75;
    println!("overshoot {:e}, error {:e} m at {top} m/s", hil.tracking_overshoot, hil.tracking_error);
    assert!(hil.tracking_overshoot.abs() < 1e-6, "overshoot {}", hil.tracking_overshoot);
    assert!(hil.tracking_error < top * 2.0 * ideal.timing.tick(), "error {}", hil.tracking_error);
}

#[test]
fn feedforward_lowers_error_and_overshoot_of_the_velocity_response() {
    // With velocity loops of 1 and of 0.1 times the scenario's gain.
    for (gain, error_ratio, overshoot_ratio) in [(1.0, 0.85, 0.8), (0.1, 0.3, 0.4)] {
        let [off, gravity, full] = [Feedforward::Off, Feedforward::Gravity, Feedforward::Full].map(|feedforward| {
            let mut model = scenario("facility_velocity.toml");
            model.facility.joint_level.as_mut().expect("joints").servo.feedforward = feedforward;
            let mut params = model.nominal;
            params.robot1.velocity_gain = gain;
            let hil = run(&model, &[params])[0];
            println!(
                "gain {gain}, {feedforward:?}: error {:.4} mm, overshoot {:.2} %",
                1e3 * hil.tracking_error,
                100.0 * hil.tracking_overshoot
            );
            (hil.tracking_error, hil.tracking_overshoot)
        });
        assert!(full.0 < error_ratio * off.0 && full.1 < overshoot_ratio * off.1, "{full:?} for {off:?}");
        assert!(
            full.0 < gravity.0 && gravity.0 < off.0 && gravity.1 < off.1,
            "{gravity:?} between {full:?} and {off:?}"
        );
    }
}

/// Twice the gear ratio: more bandwidth while the acceleration limits the robot, less speed.
#[test]
fn higher_gear_ratio_trades_speed_for_bandwidth() {
    let model = sine_test();
    let gain = |ratio: f64, frequency: f64, amplitude: f64| {
        let mut p = Params { test_frequency: frequency, test_amplitude: amplitude, ..model.nominal };
        p.robot1.position_gain = 28.0;
        (p.robot1.gear_ratio, p.robot1.velocity_gain) = (ratio, ratio * ratio);
        run(&model, &[p])[0].tracking_gain
    };
    let [quick, slow] = [(4.0, 0.02), (0.5, 0.15)].map(|(f, a)| [1.0, 2.0, 8.0].map(|ratio| gain(ratio, f, a)));
    println!("4 Hz, 20 mm: {quick:?}; 0.5 Hz, 150 mm: {slow:?}, ratios 1, 2 and 8");
    assert!(quick[1] > 1.3 * quick[0], "acceleration: {quick:?}");
    assert!(slow[2] < 0.9 * slow[0], "speed: {slow:?}");
}
