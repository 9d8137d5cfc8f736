//! Postures of an arm without a spherical wrist, there and back.

use super::*;
use softdock_kernels::manipulator::{DhRow, Drive, Friction, Joint, JointLimits, RobotRating, SphericalWrist, flange};
use softdock_kernels::model::Link;
use softdock_kernels::vector::{Sym3, vec3};
use std::f64::consts::{FRAC_PI_2, PI};

/// UR10e: the table that Universal Robots publishes, as modified rows. `limit` holds for every joint.
fn ur10e(limit: f64) -> Manipulator {
    let rows = [
        (0.0, 0.0, 0.1807),
        (0.0, FRAC_PI_2, 0.0),
        (-0.6127, 0.0, 0.0),
        (-0.57155, 0.0, 0.17415),
        (0.0, FRAC_PI_2, 0.11985),
        (0.0, -FRAC_PI_2, 0.11655),
    ];
    let drive = Drive { gear_stiffness: 1e6, torque_limit: 100.0, ..Drive::ideal() };
    let friction = Friction::none();
    let limits = JointLimits { lower: -limit, upper: limit, speed: 2.0, acceleration: 10.0 };
    let joints = rows.map(|(a, alpha, d)| {
        let row = DhRow { a, alpha, d, offset: 0.0, sign: 1.0 };
        let link = Link { origin: row.origin(), mass: 1.0, com: Vec3::zero(), inertia: Sym3::splat(0.0) };
        Joint { link, sign: 1.0, drive, friction, counterweight: None, limits }
    });
    Manipulator {
        joints: joints.to_vec(),
        flange: Pose::identity(),
        gravity: vec3(0.0, 0.0, -9.81),
        workspace: RobotRating { reach: 1.3, payload: 12.5, repeatability: 5e-5 },
        capsules: Vec::new(),
    }
}

fn distance(robot: &Manipulator, angles: &[f64], pose: Pose<f64>) -> f64 {
    let at = flange::<f64, 6>(robot, std::array::from_fn(|i| angles[i]));
    let turn = rotation_vector(pose.attitude.compose(at.attitude.conjugate()));
    (at.position - pose.position).norm().max(turn.norm())
}

/// Random numbers from -1 to 1.
fn random() -> impl FnMut() -> f64 {
    let mut seed = 11_u64;
    move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (seed >> 33) as f64 / f64::from(1 << 30) - 1.0
    }
}

#[test]
fn forward_of_inverse_is_the_pose_from_any_seed() {
    let robot = ur10e(2.0 * PI);
    assert!(SphericalWrist::of(&robot).is_none(), "the closed form does not cover it");
    let mut random = random();
    for _ in 0..80 {
        let angles: [f64; 6] = std::array::from_fn(|_| PI * random());
        let pose = flange(&robot, angles);
        let seed: Vec<f64> = (0..6).map(|_| PI * random()).collect();
        let found = inverse(&robot, pose, &seed).expect("the pose was made by a posture");
        assert!(distance(&robot, &found, pose) < 1e-9, "{angles:?}: {}", distance(&robot, &found, pose));
    }
}

#[test]
fn near_seed_gives_the_posture_itself_and_a_path_has_no_jump() {
    let robot = ur10e(2.0 * PI);
    let path =
        |s: f64| -> [f64; 6] { [0.4 + s, -1.2 + 0.3 * s, 1.1 - 0.5 * s, -0.7 + 0.4 * s, 1.3 + 0.2 * s, 5.9 - s] };
    let mut angles = path(0.0).to_vec();
    for step in 1..=200 {
        let s = f64::from(step) / 200.0;
        let found = inverse(&robot, flange(&robot, path(s)), &angles).expect("on the path");
        for (joint, (a, b)) in found.iter().zip(path(s)).enumerate() {
            assert!((a - b).abs() < 1e-7, "step {step}, joint {}: {a} is not {b}", joint + 1);
        }
        angles = found;
    }
}

#[test]
fn angles_stay_inside_the_limits() {
    let robot = ur10e(1.5);
    let mut random = random();
    for _ in 0..50 {
        let angles: [f64; 6] = std::array::from_fn(|_| 1.5 * random());
        let found = inverse(&robot, flange(&robot, angles), &[0.1; 6]).expect("a posture inside the limits exists");
        assert!(found.iter().all(|angle| angle.abs() <= 1.5), "{found:?}");
    }
}

#[test]
fn pose_out_of_reach_is_an_error_with_the_rest() {
    let robot = ur10e(2.0 * PI);
    let far = Pose { position: vec3(2.0, 0.0, 0.4), attitude: Quat { w: 1.0, v: Vec3::zero() } };
    let missed = inverse(&robot, far, &[0.3, -1.0, 1.0, 0.2, 0.4, 0.1]).expect_err("2 m away");
    assert!(missed.distance + missed.angle > 0.3, "{missed:?}");
    assert!(missed.to_string().starts_with("no posture inside the joint limits reaches the pose"), "{missed}");
}
