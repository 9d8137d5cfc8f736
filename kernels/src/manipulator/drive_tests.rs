//! Terms of a joint's drive against their closed forms, the joint's motion prescribed.

use super::*;
use crate::manipulator::Friction;
use crate::manipulator::sample::{reference_drives, robot};

const STEP: f64 = 0.25e-3;
const SPEED: f64 = 0.1;

/// What a check of one term needs: a joint and its velocity loop.
struct Bench {
    joint: Joint,
    servo: VelocityLoop,
}

impl Bench {
    fn new() -> Self {
        Self { joint: robot().joints[1], servo: VelocityLoop { gain: 3e5, integral_time: 0.05 } }
    }

    fn axis(&self) -> Axis<'_> {
        Axis { joint: &self.joint, servo: &self.servo, start: 0.3, substep: STEP, effects: EffectSet::ALL }
    }

    /// Friction at a rate, the bristle long complete.
    fn friction(&self, p: &DriveParams<f64>, rate: f64, cold: f64) -> f64 {
        let s = JointState { motor_rate: rate, slip: rate.signum(), ..still() };
        friction(self.axis().train(), p, &s, cold, 0.0, None).0
    }
}

fn still() -> JointState<f64> {
    crate::fields::filled(0.0)
}

/// Friction of Coulomb and viscous kind alone.
fn plain() -> DriveParams<f64> {
    DriveParams { stribeck: 0.0, ..reference_drives() }
}

#[track_caller]
fn assert_near(what: &str, found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-9 * expected.abs(), "{what}: {found} instead of {expected}");
}

#[test]
fn friction_forwards_and_backwards_differs_by_the_asymmetry() {
    let bench = Bench::new();
    let Friction { coulomb, viscous, .. } = bench.joint.friction;
    let p = DriveParams { coulomb_asymmetry: 0.3, ..plain() };
    assert_near("forwards", bench.friction(&p, SPEED, 0.0), 1.3 * coulomb + viscous * SPEED);
    assert_near("backwards", bench.friction(&p, -SPEED, 0.0), -0.7 * coulomb - viscous * SPEED);
}

#[test]
fn cold_friction_is_higher_by_a_share_that_decays_with_the_time_of_warming_up() {
    let bench = Bench::new();
    let p = DriveParams { cold_friction: 0.8, warm_up: 600.0, ..plain() };
    let warm = bench.friction(&plain(), SPEED, 0.0);
    for age in [0.0, 300.0, 1800.0] {
        let (_, left) = cold(EffectSet::ALL, &p, age, STEP);
        assert_near("cold friction", bench.friction(&p, SPEED, left), warm * (1.0 + 0.8 * (-age / 600.0).exp()));
    }
}

#[test]
fn cables_pull_as_their_spring_over_the_angle_and_their_hysteresis_over_the_travel() {
    let bench = Bench::new();
    let p = DriveParams { cable_stiffness: 0.4, cable_hysteresis: 0.2, ..plain() };
    let coulomb = bench.joint.friction.coulomb;
    let mut s = still();
    // Out to 0.1 rad and back: the angle has its torque twice, the hysteresis apart.
    for (direction, turns) in [(1.0, 4000), (-1.0, 8000)] {
        let (from, state) = (s.angle, s.cable);
        s.rate = direction * SPEED;
        let mut pull = 0.0;
        for _ in 0..turns {
            s.angle += s.rate * STEP;
            (pull, s.cable) = cable(bench.axis(), &p, &s);
        }
        let left = (-(s.angle - from).abs() / CABLE_TRAVEL).exp();
        let hysteresis = direction + (state - direction) * left;
        assert_near("cable torque", pull, -coulomb * (0.4 * s.angle + 0.2 * hysteresis));
    }
}

#[test]
fn an_offset_adds_its_share_of_the_greatest_torque() {
    let bench = Bench::new();
    let reference = Reference { speed: 0.0, torque: 50.0, cold: 0.0 };
    let impulse = |p: &DriveParams<f64>| motor(bench.axis(), p, &still(), reference).1.impulse;
    let p = DriveParams { torque_offset: 0.02, ..plain() };
    let added = (impulse(&p) - impulse(&plain())) / STEP;
    assert!((added - 0.02 * bench.joint.drive.torque_limit).abs() < 1e-6, "{added}");
}
