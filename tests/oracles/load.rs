//! Load of the sensor: weight, inertia force, drift and tare, against the expected fed-back wrench.

use super::bench::{closing, job, two_bodies};
use softdock_engine::RunInput;
use softdock_engine::cpu::replay;
use softdock_kernels::model::{Model, SensorLoad};
use softdock_kernels::params::Params;
use softdock_kernels::space::Wrench;
use softdock_kernels::vector::{Vec3, vec3};

const STEP: f64 = 1e-3;
const LOAD: SensorLoad = SensorLoad {
    mass: 20.0,
    centre: vec3(0.1, 0.02, -0.03),
    gravity: vec3(0.0, 0.0, -9.81),
    inertia_compensated: true,
};

/// Two bodies too far apart to meet, too heavy to be moved by newtons.
fn apart(load: Option<SensorLoad>, tared: bool) -> Model {
    let mut model = two_bodies(STEP, 0.5, 10.0);
    (model.facility.load, model.facility.tared) = (load, tared);
    model
}

fn quiet() -> Params<f64> {
    Params { base_inertia_scale: 1e9, target_inertia_scale: 1e9, ..closing(1e9, 0.01, 1e4, 0.0) }
}

/// The fed-back wrench (part A's axes) after each tick.
fn fed_back(model: Model, params: Params<f64>) -> Vec<Wrench<f64>> {
    let mut out = Vec::new();
    replay(&job(model, &[params]), RunInput::new(0, params), &mut |signals| out.push(signals.fed_back));
    out
}

fn last(model: Model, params: Params<f64>) -> Wrench<f64> {
    *fed_back(model, params).last().expect("a run of many ticks")
}

#[track_caller]
fn assert_near(what: &str, found: Vec3<f64>, expected: Vec3<f64>, tolerance: f64) {
    let off = (found - expected).norm();
    assert!(off <= tolerance, "{what}: {found:?} instead of {expected:?}, off by {off:.2e}");
}

#[test]
fn known_load_is_fully_compensated() {
    let turning = Params { chaser_rate: vec3(0.3, -0.4, 0.5), ..quiet() };
    for w in fed_back(apart(Some(LOAD), false), turning) {
        assert_near("force", w.force, Vec3::zero(), 1e-9);
        assert_near("moment", w.moment, Vec3::zero(), 1e-9);
    }
}

#[test]
fn uncompensated_inertia_force_is_measured() {
    // Part A's origin is the base's centre: the load's centre turns about it, -m w x (w x c).
    let rate = vec3(0.0, 0.0, 2.0);
    let blind = SensorLoad { inertia_compensated: false, ..LOAD };
    let w = last(apart(Some(blind), false), Params { chaser_rate: rate, ..quiet() });
    let force = rate.cross(rate.cross(LOAD.centre)) * -LOAD.mass;
    assert!(force.norm() > 8.0, "{force:?}");
    // A difference of velocities over one substep of 1 ms, in axes half a substep further: w dt = 0.2 %.
    assert_near("force", w.force, force, 2e-3 * force.norm());
    assert_near("moment", w.moment, LOAD.centre.cross(force), 2e-3 * force.norm());
}

#[test]
fn wrong_mass_is_measured_before_the_tare_and_with_attitude_after() {
    let (error, rate) = (0.03, 0.8);
    let wrong = Params { load_mass_error: error, chaser_rate: vec3(0.0, rate, 0.0), ..quiet() };
    let weight = LOAD.gravity * (-error * LOAD.mass);
    // The wrong mass is as wrong about the inertia force, m error w x (w x c), which no tare at rest can know.
    let turn = wrong.chaser_rate;
    let force = turn.cross(turn.cross(LOAD.centre)) * (error * LOAD.mass);
    let first = fed_back(apart(Some(LOAD), false), wrong)[0];
    assert_near("untared, at the start", first.force, weight + force, 1e-3 * weight.norm());
    let tared = fed_back(apart(Some(LOAD), true), wrong);
    assert_near("tared, at the start", tared[0].force, force, 1e-3 * weight.norm());
    let end = tared[tared.len() - 1].force.norm();
    // Turned by an angle, the error of the weight differs from the tare by twice the sine of its half.
    let angle = rate * STEP * tared.len() as f64;
    let turned = 2.0 * weight.norm() * (0.5 * angle).sin();
    assert!((end - turned).abs() <= force.norm() + 5e-3 * turned, "{end} N instead of {turned} N");
    assert!(turned > 2.0, "{turned} N");
}

#[test]
fn wrong_centre_is_measured_as_a_moment_only() {
    let error = vec3(0.004, 0.0, 0.0);
    let w = last(apart(Some(LOAD), false), Params { load_centre_error: error, ..quiet() });
    assert_near("force", w.force, Vec3::zero(), 1e-9);
    assert_near("moment", w.moment, error.cross(LOAD.gravity * -LOAD.mass), 1e-9);
}

#[test]
fn tare_removes_the_bias_up_to_its_error_and_not_the_drift() {
    let params = Params {
        sensor_bias_force: vec3(1.0, -2.0, 3.0),
        sensor_bias_moment: vec3(0.1, 0.2, -0.3),
        sensor_drift_force: vec3(0.5, 0.0, -0.2),
        sensor_drift_moment: vec3(0.0, 0.03, 0.0),
        tare_error_force: vec3(0.01, 0.02, 0.0),
        sensor_gain_force: vec3(0.02, 0.0, 0.01),
        ..quiet()
    };
    let all = fed_back(apart(Some(LOAD), true), params);
    // Gain errors make the weight wrong by what the tare takes off; the last sample was taken a tick before the end.
    let time = STEP * (all.len() - 1) as f64;
    let w = all[all.len() - 1];
    assert_near("force", w.force, params.sensor_drift_force * time - params.tare_error_force, 1e-9);
    assert_near("moment", w.moment, params.sensor_drift_moment * time, 1e-9);
    let untared = fed_back(apart(None, false), params)[0];
    assert_near("bias without a tare", untared.force, params.sensor_bias_force, 1e-9);
}
