//! A robot in its place: it stands still, follows a sine as its loops say, and its parts are where the joints say.

use super::cell::*;
use super::tests::robot;
use super::*;
use crate::model::Timing;
use crate::space::{Motion, Wrench};
use crate::vector::{Sym3, Vec3};
use std::f64::consts::TAU;

const TIMING: Timing = Timing { substep: 0.25e-3, substeps: 4, max_ticks: 1 };

/// The robot 2 m behind the laboratory's origin, its flange looking along +x.
fn cell(feedforward: Feedforward) -> Cell {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    // The part's x axis is the last link's z axis.
    let tool = Pose { position: vec3(0.0, 0.0, 0.1), attitude: Quat { w: half, v: vec3(0.0, -half, 0.0) } };
    let payload = Payload { mass: 200.0, com: Vec3::zero(), inertia: Sym3::diagonal(vec3(5.0, 5.0, 5.0)) };
    let base = Pose { position: vec3(-2.0, 0.0, -1.8), attitude: Quat::identity() };
    let velocity = |gain: f64| VelocityLoop { gain, integral_time: 0.05 };
    let servo = Servo {
        velocity: [300_000.0, 300_000.0, 300_000.0, 100_000.0, 100_000.0, 100_000.0].map(velocity),
        feedforward,
    };
    let mount = Mount { base, tool, payload };
    Cell::new(&robot(), &mount, &servo, Pose::identity(), &TIMING).expect("within reach")
}

fn params() -> DriveParams<f64> {
    DriveParams {
        position_gain: 7.0,
        velocity_feedforward: 0.45,
        stribeck: 1.0,
        presliding: 1.0,
        gear_compliance: 1.0,
        backlash: 1.0,
        current_lag: 1.0 / (TAU * 600.0),
        ..crate::params::Params::null().robot1
    }
}

fn rest() -> Motion<f64> {
    Motion { position: Vec3::zero(), attitude: Quat::identity(), velocity: Vec3::zero(), omega: Vec3::zero() }
}

const NOTHING: Wrench<f64> = Wrench { force: Vec3 { x: 0.0, y: 0.0, z: 0.0 }, moment: Vec3 { x: 0.0, y: 0.0, z: 0.0 } };

/// Follows a motion for some ticks; gives the part's motion at the end of each.
fn follow(cell: &Cell, p: &DriveParams<f64>, ticks: usize, told: impl Fn(f64) -> Motion<f64>) -> Vec<Motion<f64>> {
    let mut s = drives_at(cell, p, &told(0.0));
    let mut set = first_set_point(&s);
    (0..ticks)
        .map(|tick| {
            set = set_point(cell, p, &s, &set, &told(tick as f64 * TIMING.tick()));
            (0..TIMING.substeps).for_each(|_| s = drive(cell, p, &s, &set, NOTHING, Vec3::zero()));
            held_part(cell, &s)
        })
        .collect()
}

#[test]
fn the_part_is_where_the_command_is_and_stands_still() {
    for feedforward in [Feedforward::Off, Feedforward::Gravity, Feedforward::Full] {
        let cell = cell(feedforward);
        let turned = Quat::from_rotation_vector(vec3(0.02, -0.03, 0.01));
        let told = Motion { position: vec3(0.05, -0.02, 0.03), attitude: turned, ..rest() };
        let at = follow(&cell, &params(), 1000, |_| told);
        for motion in [at.first(), at.last()].into_iter().flatten() {
            let gap = (motion.position - told.position).norm();
            // The gears give way under the weight; the loops hold the motors.
            assert!(gap < 2e-3, "{feedforward:?}: {gap}");
        }
        let drift = (at.last().expect("ticks").position - at[0].position).norm();
        assert!(drift < 2e-6, "{feedforward:?} {drift}");
    }
}

#[test]
fn a_sine_comes_out_with_the_gain_and_lag_of_the_loops() {
    let cell = cell(Feedforward::Off);
    let frequency = 1.0;
    let told = |t: f64| {
        let phase = TAU * frequency * t;
        let position = vec3(0.02 * phase.sin(), 0.0, 0.0);
        Motion { position, velocity: vec3(0.02 * TAU * frequency * phase.cos(), 0.0, 0.0), ..rest() }
    };
    let at = follow(&cell, &params(), 5000, told);
    let (mut sine, mut cosine) = (0.0, 0.0);
    for (tick, motion) in at.iter().enumerate().skip(2000) {
        let phase = TAU * frequency * (tick + 1) as f64 * TIMING.tick();
        sine += motion.position.x * phase.sin() / 1500.0;
        cosine += motion.position.x * phase.cos() / 1500.0;
    }
    let (gain, lag) = (sine.hypot(cosine) / 0.02, -cosine.atan2(sine).to_degrees());
    println!("gain {gain:.4} lag {lag:.2}");
    assert!((gain - 0.8).abs() < 0.05 && (lag - 20.0).abs() < 3.0, "{gain} {lag}");
}
