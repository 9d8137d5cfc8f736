//! A robot in its place: it stands still, follows a sine as its loops say, and its parts are where the joints say.

use super::cell::*;
use super::sample::{carriage, mount, reference_drives, robot, servo};
use super::*;
use crate::chain::driven::led;
use crate::chain::inertia::Force;
use crate::model::{Rail, Timing};
use crate::space::{Motion, Wrench};
use crate::vector::Vec3;
use std::f64::consts::TAU;

const TIMING: Timing = Timing { substep: 0.25e-3, substeps: 4, max_ticks: 1 };

fn cell(feedforward: Feedforward) -> Cell {
    cell_on(None, feedforward)
}

/// The robot on a rail along x that makes a share of its motion.
fn cell_on(share: Option<f64>, feedforward: Feedforward) -> Cell {
    let rail = share.map(|share| (Rail { axis: vec3(1.0, 0.0, 0.0), share }, carriage()));
    Cell::new(&robot(), &mount(), &servo(feedforward), rail, Pose::identity(), &TIMING).expect("within reach")
}

fn params() -> DriveParams<f64> {
    reference_drives()
}

fn rest() -> Motion<f64> {
    Motion { position: Vec3::zero(), attitude: Quat::identity(), velocity: Vec3::zero(), omega: Vec3::zero() }
}

const NOTHING: Wrench<f64> = Wrench { force: Vec3 { x: 0.0, y: 0.0, z: 0.0 }, moment: Vec3 { x: 0.0, y: 0.0, z: 0.0 } };

/// Follows a motion for some ticks; gives the part's motion at the end of each.
fn follow(cell: &Cell, p: &DriveParams<f64>, ticks: usize, reference: impl Fn(f64) -> Motion<f64>) -> Vec<Motion<f64>> {
    let mut s = drives_at(cell, p, &reference(0.0));
    let mut set = first_set_point(&s);
    (0..ticks)
        .map(|tick| {
            set = set_point(cell, p, &s, &set, &reference(tick as f64 * TIMING.tick()));
            (0..TIMING.substeps).for_each(|_| s = drive(cell, p, &s, &set, NOTHING));
            let (part, [place, speed]) = held_part(cell, &s);
            let along = |v: Vec3<f64>, by: f64| vec3(v.x + by, v.y, v.z);
            Motion { position: along(part.position, place), velocity: along(part.velocity, speed), ..part }
        })
        .collect()
}

#[test]
fn the_part_is_where_the_command_is_and_stands_still() {
    for feedforward in [Feedforward::Off, Feedforward::Gravity, Feedforward::Full] {
        let cell = cell(feedforward);
        let turned = Quat::from_rotation_vector(vec3(0.02, -0.03, 0.01));
        let reference = Motion { position: vec3(0.05, -0.02, 0.03), attitude: turned, ..rest() };
        let at = follow(&cell, &params(), 1000, |_| reference);
        for motion in [at.first(), at.last()].into_iter().flatten() {
            let gap = (motion.position - reference.position).norm();
            // The gears give way under the weight; the loops hold the motors.
            assert!(gap < 2e-3, "{feedforward:?}: {gap}");
        }
        let drift = (at.last().expect("ticks").position - at[0].position).norm();
        assert!(drift < 2e-6, "{feedforward:?} {drift}");
    }
}

/// Gain and lag \[deg\] of the part's motion along x for 20 mm at 1 Hz.
fn sine(cell: &Cell) -> (f64, f64) {
    let frequency = 1.0;
    let reference = |t: f64| {
        let phase = TAU * frequency * t;
        let position = vec3(0.02 * phase.sin(), 0.0, 0.0);
        Motion { position, velocity: vec3(0.02 * TAU * frequency * phase.cos(), 0.0, 0.0), ..rest() }
    };
    let at = follow(cell, &params(), 5000, reference);
    let (mut sine, mut cosine) = (0.0, 0.0);
    for (tick, motion) in at.iter().enumerate().skip(2000) {
        let phase = TAU * frequency * (tick + 1) as f64 * TIMING.tick();
        sine += motion.position.x * phase.sin() / 1500.0;
        cosine += motion.position.x * phase.cos() / 1500.0;
    }
    (sine.hypot(cosine) / 0.02, -cosine.atan2(sine).to_degrees())
}

#[test]
fn a_sine_comes_out_with_the_gain_and_lag_of_the_loops() {
    for (who, share) in [("joints", None), ("rail", Some(1.0)), ("both", Some(0.5))] {
        let (gain, lag) = sine(&cell_on(share, Feedforward::Off));
        println!("{who}: gain {gain:.4} lag {lag:.2}");
        assert!((gain - 0.8).abs() < 0.05 && (lag - 20.0).abs() < 3.0, "{who}: {gain} {lag}");
    }
}

/// A chain on a carriage: forces and torques of an inverse dynamics give back its accelerations.
#[test]
fn the_chain_on_a_carriage_moves_as_its_inverse_dynamics_says() {
    let robot = robot();
    let (angle, rate) = ([0.3, -1.2, 1.1, 0.4, -0.7, 0.2], [0.5, -0.3, 0.4, -0.8, 0.6, 1.0]);
    let (joints, along, mass) = ([1.0, -2.0, 0.7, 3.0, -1.5, 2.5], vec3(0.6, 0.8, 0.0), 2000.0);
    let arm = Arm::new(&robot, Pose::identity());
    for base in [0.0, 1.7, -0.4] {
        let (torque, push) = inverse_dynamics::chain_torques(&robot, angle, rate, joints, along * base);
        let force = push.dot(along) + mass * base;
        let turns = arm.turns(angle);
        let posture = arm.posture(&turns);
        let chain = posture.folded(&rate, &torque, &[0.0; 6], Force::zero(), led(arm.lifted), None);
        let along = arm.from_base.rotate(along);
        let slid = chain.slide(along, mass, force);
        assert!((slid - base).abs() < 1e-9, "{slid} for {base}");
        let found = chain.accelerations(&posture, Vec3::zero(), along * slid);
        found.iter().zip(joints).for_each(|(found, joint)| assert!((found - joint).abs() < 1e-9, "{found} {joint}"));
    }
}

/// Without friction, a push on the part along the rail ends in its drive, through the arm.
#[test]
fn a_push_on_the_part_ends_in_the_drive_of_the_rail() {
    let held = cell_on(Some(1.0), Feedforward::Off);
    let p = DriveParams { coulomb_error: -1.0, viscous_error: -1.0, stribeck: 0.0, backlash: 0.0, ..params() };
    let push = Wrench { force: vec3(500.0, 0.0, 0.0), ..NOTHING };
    let mut s = drives_at(&held, &p, &rest());
    let set = SetPoint { speed: [0.0; AXES], ..first_set_point(&s) };
    (0..20_000).for_each(|_| s = drive(&held, &p, &s, &set, push));
    // The velocity loop's integral part carries the whole force in the end: the motor is at rest, the gear deflects.
    let rail = s.axis[AXES - 1];
    assert!((rail.torque + 500.0).abs() < 5.0, "the drive holds the push: {}", rail.torque);
    assert!((rail.windup + 500.0 / 1e8).abs() < 5e-8, "deflection of the rack: {}", rail.windup);
}

/// Beyond the workspace a command is followed as far as the joints go, and said to be beyond.
#[test]
fn a_command_beyond_the_workspace_is_flagged() {
    let cell = cell(Feedforward::Off);
    let s = drives_at(&cell, &params(), &rest());
    let reference = |x: f64| Motion { position: vec3(x, 0.0, 0.0), ..rest() };
    let limited = |x: f64| set_point(&cell, &params(), &s, &first_set_point(&s), &reference(x)).limited;
    // The tool is 2 m from axis 1 and may be 2.3 m away; speed and acceleration bite far below a jump of 0.1 mm.
    assert_eq!((limited(1e-4), drives_at(&cell, &params(), &reference(0.29)).limited), (0.0, 0.0));
    assert_eq!(drives_at(&cell, &params(), &reference(0.31)).limited, 1.0);
}
