//! Kinematics, dynamics and friction of a robot against hand values and energy.

use super::*;
use crate::vector::Sym3;

/// Geometry of a KUKA KR 300 R2500 ultra with plain bodies.
pub(super) fn robot() -> Manipulator {
    let rows: [(f64, f64, f64, f64, f64); 6] = [
        (0.0, 0.0, 0.675, 0.0, -1.0),
        (0.35, -90.0, 0.0, 0.0, 1.0),
        (1.15, 0.0, 0.0, -90.0, 1.0),
        (-0.041, -90.0, 1.0, 0.0, -1.0),
        (0.0, 90.0, 0.0, 0.0, 1.0),
        (0.0, -90.0, 0.24, 180.0, -1.0),
    ];
    let joint = |(a, alpha, d, offset, sign): (f64, f64, f64, f64, f64)| {
        let row = DhRow { a, alpha: alpha.to_radians(), d, offset: offset.to_radians(), sign };
        Joint {
            link: Link {
                origin: row.origin(),
                mass: 100.0 + 50.0 * a,
                com: vec3(0.1, 0.2 * a, -0.1),
                inertia: Sym3 { xx: 5.0, yy: 6.0, zz: 7.0, xy: 0.3, xz: -0.2, yz: 0.1 },
            },
            sign,
            drive: Drive {
                gear_ratio: 200.0,
                rotor_inertia: 0.01,
                gear_stiffness: 1e6,
                gear_damping: 1e3,
                backlash: 0.0,
                torque_offset: 3.0,
                torque_limit: 1e4,
                static_torque: 5e3,
            },
            friction: Friction {
                coulomb: 100.0,
                viscous: 500.0,
                stribeck: 40.0,
                stribeck_speed: 0.02,
                presliding_stiffness: 1.4e6,
                load_coefficient: 0.0,
            },
            counterweight: None,
            limits: Limits { lower: -3.0, upper: 3.0, speed: 1.0, acceleration: 5.0 },
        }
    };
    Manipulator { joints: rows.map(joint).into(), flange: Pose::identity(), gravity: vec3(0.0, 0.0, -GRAVITY) }
}

#[test]
fn check_points_of_the_kr_300() {
    let robot = robot();
    let near = |found: Vec3<f64>, x: f64, y: f64, z: f64| assert!((found - vec3(x, y, z)).norm() < 1e-4, "{found:?}");
    let frames = link_frames(&robot, [0.0; 6]);
    near(frames[5].position, 2.74, 0.0, 0.634);
    near(frames[4].position, 2.5, 0.0, 0.634);
    // Upright (q2 = -90, q3 = 90 deg): the upper arm stands, the forearm lies.
    let home = [0.0, -90.0, 90.0, 0.0, 0.0, 0.0].map(f64::to_radians);
    near(flange(&robot, home).position, 0.35 + 1.0 + 0.24, 0.0, 0.675 + 1.15 - 0.041);
    // Signs: +q1 turns to the right (towards -y), +q2 leans forwards and down, +q3 lowers the forearm.
    let moved = |joint: usize| {
        let mut angle = home;
        angle[joint] += 0.3;
        flange(&robot, angle).position - flange(&robot, home).position
    };
    assert!(moved(0).y < -0.1 && moved(1).z < -0.1 && moved(1).x > 0.1 && moved(2).z < -0.1);
    assert!(moved(4).z < -0.05, "+q5 bends the hand down");
}

/// Power of the torques = change of kinetic and potential energy, by central differences along a motion.
#[test]
fn torques_do_the_work_of_the_motion() {
    let robot = robot();
    let motion = |t: f64| -> ([f64; 6], [f64; 6], [f64; 6]) {
        let wave = |i: usize| (0.3 + 0.1 * i as f64, 1.0 + 0.3 * i as f64, 0.4 * i as f64);
        (
            std::array::from_fn(|i| wave(i).0 * (wave(i).1 * t + wave(i).2).sin()),
            std::array::from_fn(|i| wave(i).0 * wave(i).1 * (wave(i).1 * t + wave(i).2).cos()),
            std::array::from_fn(|i| -wave(i).0 * wave(i).1 * wave(i).1 * (wave(i).1 * t + wave(i).2).sin()),
        )
    };
    let energy = |t: f64| -> f64 {
        let (angle, rate, _) = motion(t);
        let frames = link_frames(&robot, angle);
        let (mut omega, mut velocity, mut at, mut sum) = (Vec3::zero(), Vec3::zero(), Vec3::zero(), 0.0);
        for (i, frame) in frames.iter().enumerate() {
            velocity = velocity + omega.cross(frame.position - at);
            omega = omega + joint_axis(*frame, robot.joints[i].sign) * rate[i];
            at = frame.position;
            let link = &robot.joints[i].link;
            let arm = frame.attitude.rotate(link.com);
            let speed = velocity + omega.cross(arm);
            let local = frame.attitude.rotate_back(omega);
            sum += 0.5 * link.mass * speed.dot(speed) + 0.5 * local.dot(link.inertia.times(local));
            sum -= link.mass * robot.gravity.dot(frame.position + arm);
        }
        sum
    };
    for t in [0.0, 0.7, 1.9, 3.1] {
        let (angle, rate, acceleration) = motion(t);
        let torques = rigid_torques(&robot, angle, rate, acceleration);
        let power: f64 = torques.iter().zip(rate).map(|(torque, rate)| torque * rate).sum();
        let step = 1e-4;
        let change = (energy(t + step) - energy(t - step)) / (2.0 * step);
        assert!((power - change).abs() < 1e-5 * power.abs().max(100.0), "{t}: {power} {change}");
    }
}

#[test]
fn drives_add_rotor_friction_offset_and_counterweight() {
    let mut robot = robot();
    robot.joints[1].counterweight = Some(Counterweight { torque: 2000.0, angle: -1.5 });
    robot.joints[2].friction.load_coefficient = 0.05;
    let (angle, rate, acceleration) = ([0.1; 6], [0.2; 6], [1.0; 6]);
    let rigid = rigid_torques(&robot, angle, rate, acceleration);
    let whole = inverse_dynamics(&robot, angle, rate, acceleration, [1.0; 6]);
    let own = 400.0 + 3.0 + 100.0 + 40.0 * f64::exp(-10.0) + 500.0 * 0.2;
    assert!((whole[0] - rigid[0] - own).abs() < 1e-9, "{}", whole[0] - rigid[0]);
    assert!((whole[1] - rigid[1] - own - 2000.0 * f64::sin(1.6)).abs() < 1e-9);
    assert!((whole[2] - rigid[2] - own - 0.05 * rigid[2].abs()).abs() < 1e-9);
}

#[test]
fn a_joint_that_stops_keeps_its_friction() {
    let travel = 1e-4;
    let mut state = 0.0;
    (0..100).for_each(|_| state = bristle(state, 1e-5, travel));
    assert!((state - (1.0 - f64::exp(-10.0))).abs() < 1e-12, "ten travels, however cut: {state}");
    assert_eq!(bristle(state, 0.0, travel), state, "rest changes nothing");
    assert!((bristle(0.5, -1e-4, travel) - (1.5 * f64::exp(-1.0) - 1.0)).abs() < 1e-12);
}

/// The same text on lanes gives each lane the bits of f64.
#[test]
fn lanes_are_the_scalar_to_the_bit() {
    use crate::lanes::{Lane, plain::Lanes};
    let robot = robot();
    let value = |joint: usize, lane: usize, part: f64| part * (joint as f64 - 2.5) + 0.37 * lane as f64;
    let lanes = |part: f64| std::array::from_fn::<Lanes, 6, _>(|joint| Lanes::gather(|lane| value(joint, lane, part)));
    let whole = inverse_dynamics(&robot, lanes(0.3), lanes(-0.2), lanes(0.7), lanes(0.1));
    for lane in 0..Lanes::WIDTH {
        let one = |part: f64| std::array::from_fn::<f64, 6, _>(|joint| value(joint, lane, part));
        let alone = inverse_dynamics(&robot, one(0.3), one(-0.2), one(0.7), one(0.1));
        for joint in 0..6 {
            assert_eq!(whole[joint].lane(lane), alone[joint], "lane {lane}, joint {joint}");
        }
    }
}
