//! Effects of a robot's payload and limits against their closed forms, one robot in its place.

use super::cell::*;
use super::sample::{mount, reference_drives, robot, servo};
use super::tests::accelerations;
use super::*;
use crate::chain::driven::{PointMass, led};
use crate::chain::inertia::Force;
use crate::effects::EffectSet;
use crate::model::Timing;
use crate::space::{Motion, Wrench};
use crate::vector::{Sym3, Vec3};

const TIMING: Timing = Timing { substep: 0.25e-3, substeps: 4, max_ticks: 1 };
const NOTHING: Wrench<f64> = Wrench { force: Vec3 { x: 0.0, y: 0.0, z: 0.0 }, moment: Vec3 { x: 0.0, y: 0.0, z: 0.0 } };
/// The joint that is looked at: it swings the whole arm up and down.
const JOINT: usize = 1;

fn cell() -> Cell {
    let servo = servo(Feedforward::Gravity);
    Cell::new(&robot(), &mount(), &servo, None, Pose::identity(), &TIMING).expect("within reach")
}

/// Rigid gears without friction, no lag of the current.
fn plain() -> DriveParams<f64> {
    DriveParams {
        coulomb_error: -1.0,
        stribeck: 0.0,
        presliding: 0.0,
        gear_compliance: 0.0,
        backlash: 0.0,
        current_lag: 0.0,
        ..reference_drives()
    }
}

fn rest() -> Motion<f64> {
    Motion { position: Vec3::zero(), attitude: Quat::identity(), velocity: Vec3::zero(), omega: Vec3::zero() }
}

/// Drives with a constant reference, after some ticks.
fn standing(p: &DriveParams<f64>, ticks: usize) -> Drives<f64> {
    let cell = cell();
    let mut s = drives_at(&cell, p, &rest());
    let mut set = first_set_point(&s);
    for _ in 0..ticks {
        set = set_point(&cell, p, &s, &set, &rest());
        (0..TIMING.substeps).for_each(|_| s = drive(&cell, p, &s, &set, NOTHING));
    }
    s
}

#[track_caller]
fn assert_near(what: &str, found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance * expected.abs(), "{what}: {found} instead of {expected}");
}

#[test]
fn an_unknown_payload_is_carried_with_its_weight_times_its_lever() {
    let (mass, place) = (20.0, vec3(0.0, 0.0, 0.3));
    let p = DriveParams { payload_error: mass, payload_place: place, ..plain() };
    // The part's origin is the laboratory's at the start, its axes the laboratory's; joint 2 turns about y.
    let frames = {
        let cell = cell();
        let mut turned = robot();
        for (joint, angle) in turned.joints.iter_mut().zip(cell.start) {
            let turn = Quat { w: (0.5 * angle).cos(), v: vec3(0.0, 0.0, joint.sign * (0.5 * angle).sin()) };
            joint.link.origin.attitude = joint.link.origin.attitude.compose(turn);
        }
        link_frames(&turned, [0.0; 6])
    };
    let axis = mount().base.attitude.rotate(joint_axis(frames[JOINT], robot().joints[JOINT].sign));
    let lever = place - mount().base.compose(frames[JOINT]).position;
    let expected = axis.dot(lever.cross(vec3(0.0, 0.0, mass * GRAVITY)));
    assert!(expected.abs() > 200.0, "{expected}");
    for ticks in [0, 500] {
        let [with, without] = [p, plain()].map(|p| standing(&p, ticks).axis[JOINT].torque);
        assert_near("torque at rest", with - without, expected, 1e-3);
    }
}

#[test]
fn an_unknown_payload_is_felt_as_inertia_too() {
    let robot = robot();
    let (angle, rate) = ([0.3, -1.2, 1.1, 0.4, -0.7, 0.2], [0.5, -0.3, 0.4, -0.8, 0.6, 1.0]);
    let (mass, place) = (15.0, vec3(0.1, -0.2, 0.3));
    // The same as a robot whose last link is that much heavier.
    let mut heavier = robot.clone();
    let last = &mut heavier.joints[5].link;
    let both = last.mass + mass;
    let middle = (last.com * last.mass + place * mass) * (1.0 / both);
    last.inertia =
        last.inertia + Sym3::point_mass(last.mass, last.com - middle) + Sym3::point_mass(mass, place - middle);
    (last.mass, last.com) = (both, middle);
    let torque = [100.0, 200.0, -300.0, 40.0, 50.0, -60.0];
    // As the tool of the chain: its place in the last link's axes there.
    let arm = Arm::new(&robot, Pose { position: place, attitude: Quat::identity() });
    let (turns, unknown) = (arm.turns(angle), PointMass { mass, place: arm.chain.tool.position });
    let posture = arm.posture(&turns);
    let folded = posture.folded(&rate, &torque, &[0.0; 6], Force::zero(), led(arm.lifted), Some(unknown));
    let found = folded.accelerations(&posture, Vec3::zero(), Vec3::zero());
    let expected = accelerations(&Arm::new(&heavier, Pose::identity()), angle, rate, torque);
    found.iter().zip(expected).for_each(|(a, b)| assert!((a - b).abs() < 1e-9 * b.abs().max(1.0), "{a} {b}"));
}

#[test]
fn a_cut_of_the_limits_saturates_torque_and_speed() {
    let joint = robot().joints[JOINT];
    let p = DriveParams { torque_limit_cut: 0.6, speed_limit_cut: 0.7, ..plain() };
    let reference = Motion { position: vec3(0.0, 0.0, 0.5), ..rest() };
    let (cell, quick) = (cell(), DriveParams { position_gain: 100.0, ..p });
    let s = drives_at(&cell, &quick, &rest());
    let mut set = first_set_point(&s);
    (0..500).for_each(|_| set = set_point(&cell, &quick, &s, &set, &reference));
    let started = drive(&cell, &quick, &s, &set, NOTHING);
    let most = started.axis.iter().fold(0.0_f64, |most, axis| most.max(axis.torque.abs()));
    assert_near("greatest torque", most, 0.4 * joint.drive.torque_limit, 1e-12);
    let fastest = set.speed.iter().fold(0.0_f64, |most, speed| most.max(speed.abs()));
    assert_near("greatest speed", fastest, 0.3 * joint.limits.speed, 1e-12);
}

#[test]
fn terms_that_are_left_out_change_no_bit() {
    let reference = Motion { velocity: vec3(0.1, 0.0, 0.05), omega: vec3(0.1, 0.2, 0.0), ..rest() };
    let after = |cell: &Cell| {
        let p = reference_drives();
        let mut s = drives_at(cell, &p, &reference);
        let mut set = first_set_point(&s);
        for tick in 0..200 {
            let position = reference.velocity * (tick as f64 * TIMING.tick());
            set = set_point(cell, &p, &s, &set, &Motion { position, ..reference });
            (0..TIMING.substeps).for_each(|_| s = drive(cell, &p, &s, &set, NOTHING));
        }
        crate::fields::to_vec::<f64, _>(&s.axis.map(|axis| JointState { cable: 0.0, ..axis }))
    };
    let whole = cell();
    let mut none = whole.clone();
    none.effects = EffectSet::switched_by("no such parameter");
    assert_eq!(after(&whole), after(&none));
}
