//! Kinematics, dynamics and friction of a robot against hand values and energy.

use super::sample::robot;
use super::*;
use crate::chain::driven::led;
use crate::chain::inertia::Force;

/// Joint accelerations on a base at rest, without rotors.
pub(super) fn accelerations(arm: &Arm, angle: [f64; 6], rate: [f64; 6], torque: [f64; 6]) -> [f64; 6] {
    let turns = arm.turns(angle);
    let posture = arm.posture(&turns);
    let folded = posture.folded(&rate, &torque, &[0.0; 6], Force::zero(), led(arm.lifted), None);
    folded.accelerations(&posture, Vec3::zero(), Vec3::zero())
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

/// The next number in (0, 1) of a test's own stream.
fn uniform(count: &mut u64) -> f64 {
    *count += 1;
    crate::philox::uniform(0, "manipulator", *count, 0)
}

#[test]
fn inverse_and_forward_kinematics_round_trip_in_all_eight_branches() {
    let robot = robot();
    let wrist = SphericalWrist::of(&robot).expect("a spherical wrist");
    let (mut seed, mut seen, mut poses) = (7, [0; 8], 0);
    while poses < 10_000 {
        let angle: [f64; 6] = std::array::from_fn(|_| std::f64::consts::PI * (2.0 * uniform(&mut seed) - 1.0));
        let reference = link_frames(&robot, angle)[5];
        let own: Vec<_> = Branch::all()
            .map(|branch| {
                let posture = wrist.inverse(branch, reference);
                (posture.singular, wrist.angles(&posture))
            })
            .collect();
        // Reachable and away from the singular postures, where the angles are not determined.
        if own.iter().any(|(singular, own)| *singular > 0.0 || own.iter().any(|q| q.is_nan())) {
            continue;
        }
        poses += 1;
        let mut found = false;
        for (index, (_, posture)) in own.iter().enumerate() {
            let at = link_frames(&robot, *posture)[5];
            assert!((at.position - reference.position).norm() < 1e-9, "{angle:?} {posture:?}");
            let turn = at.attitude.compose(reference.attitude.conjugate()).v.norm();
            assert!(turn < 1e-9, "{angle:?} {posture:?}: {turn}");
            let same = (0..6).all(|i| (nearest_turn(posture[i], angle[i]) - angle[i]).abs() < 1e-9);
            (found, seen[index]) = (found || same, seen[index] + usize::from(same));
        }
        assert!(found, "no branch gives back {angle:?}");
    }
    assert!(seen.iter().all(|count| *count > 500), "every branch was the pose's own: {seen:?}");
}

#[test]
fn forward_and_inverse_dynamics_are_inverse() {
    let robot = robot();
    let arm = Arm::new(&robot, Pose::identity());
    let mut seed = 1_000_000;
    for _ in 0..1000 {
        let mut draw = |size: f64| -> [f64; 6] { std::array::from_fn(|_| size * (2.0 * uniform(&mut seed) - 1.0)) };
        let (angle, rate, acceleration) = (draw(3.0), draw(2.0), draw(10.0));
        let torque = rigid_torques(&robot, angle, rate, acceleration);
        let back = accelerations(&arm, angle, rate, torque);
        let turns = arm.turns(angle);
        let (again, _) = arm.posture(&turns).torques(&rate, &acceleration, arm.lifted);
        for (a, b) in torque.iter().zip(again) {
            assert!((a - b).abs() < 1e-9 * (1.0 + a.abs()), "{a} {b}");
        }
        for (a, b) in acceleration.iter().zip(back) {
            assert!((a - b).abs() < 1e-9, "{a} {b}");
        }
    }
}

/// Gravity along an upright axis 1 turns it in no posture: a rounding there would be the drive's whole torque at rest.
#[test]
fn joints_carry_the_weight_and_an_upright_one_exactly_none() {
    let robot = robot();
    let mut tilted = robot.clone();
    tilted.gravity = vec3(3.0, -4.0, -8.0);
    let mut seed = 2_000_000;
    for _ in 0..1000 {
        let angle: [f64; 6] = std::array::from_fn(|_| 3.0 * (2.0 * uniform(&mut seed) - 1.0));
        for robot in [&robot, &tilted] {
            let arm = Arm::new(robot, Pose::identity());
            let weight = arm.posture(&arm.turns(angle)).weight(arm.lifted);
            for (a, b) in rigid_torques(robot, angle, [0.0; 6], [0.0; 6]).iter().zip(weight) {
                assert!((a - b).abs() < 1e-9 * (1.0 + a.abs()), "{a} {b}");
            }
            assert_eq!(weight[0] == 0.0, robot.gravity.x == 0.0, "{angle:?}");
        }
    }
}

/// The same text on lanes gives each lane the bits of f64.
#[test]
fn lanes_are_the_scalar_to_the_bit() {
    use crate::lanes::{Lane, plain::PlainLanes};
    let robot = robot();
    let value = |joint: usize, lane: usize, part: f64| part * (joint as f64 - 2.5) + 0.37 * lane as f64;
    let lanes = |part: f64| {
        std::array::from_fn::<PlainLanes, 6, _>(|joint| PlainLanes::gather(|lane| value(joint, lane, part)))
    };
    let whole = inverse_dynamics(&robot, lanes(0.3), lanes(-0.2), lanes(0.7), lanes(0.1));
    for lane in 0..PlainLanes::WIDTH {
        let one = |part: f64| std::array::from_fn::<f64, 6, _>(|joint| value(joint, lane, part));
        let alone = inverse_dynamics(&robot, one(0.3), one(-0.2), one(0.7), one(0.1));
        for joint in 0..6 {
            assert_eq!(whole[joint].lane(lane), alone[joint], "lane {lane}, joint {joint}");
        }
    }
}

/// Kinetic and potential energy of the links \[J\].
fn energies(robot: &Manipulator, angle: [f64; 6], rate: [f64; 6]) -> (f64, f64) {
    let frames = link_frames(robot, angle);
    let weight: f64 = frames
        .iter()
        .zip(&robot.joints)
        .map(|(frame, joint)| {
            -joint.link.mass * robot.gravity.dot(frame.position + frame.attitude.rotate(joint.link.com))
        })
        .sum();
    // The inertial torques are linear in the acceleration: M q' from them, without gravity and velocity.
    let mut weightless = robot.clone();
    weightless.gravity = Vec3::zero();
    let momentum = rigid_torques(&weightless, angle, [0.0; 6], rate);
    let kinetic: f64 = momentum.iter().zip(rate).map(|(m, r)| 0.5 * m * r).sum();
    (kinetic, weight)
}

/// A robot that falls freely from a bent posture, no friction, no torque, for ten seconds: largest error of the energy
/// over the peak of the kinetic one, in the first half and in the second.
fn fall(robot: &Manipulator, step: f64, advance: impl Fn([f64; 6], [f64; 6]) -> ([f64; 6], [f64; 6])) -> [f64; 2] {
    let (mut angle, mut rate) = ([0.2, -1.2, 1.0, 0.5, 0.7, -0.3], [0.0; 6]);
    let start = energies(robot, angle, rate).1;
    let (mut error, mut peak) = ([0.0_f64; 2], 0.0_f64);
    let steps = (10.0 / step).round() as usize;
    for done in 0..steps {
        (angle, rate) = advance(angle, rate);
        let (kinetic, potential) = energies(robot, angle, rate);
        let half = &mut error[2 * done / steps];
        (*half, peak) = (half.max((kinetic + potential - start).abs()), peak.max(kinetic));
    }
    error.map(|error| error / peak)
}

#[test]
fn a_falling_robot_keeps_its_energy() {
    let (robot, step) = (robot(), 1e-4);
    let arm = Arm::new(&robot, Pose::identity());
    let slope = |angle: [f64; 6], rate: [f64; 6]| (rate, accelerations(&arm, angle, rate, [0.0; 6]));
    let plus = |a: [f64; 6], b: [f64; 6], h: f64| -> [f64; 6] { std::array::from_fn(|i| b[i].mul_add(h, a[i])) };
    let exact = fall(&robot, step, |angle, rate| {
        let k1 = slope(angle, rate);
        let k2 = slope(plus(angle, k1.0, 0.5 * step), plus(rate, k1.1, 0.5 * step));
        let k3 = slope(plus(angle, k2.0, 0.5 * step), plus(rate, k2.1, 0.5 * step));
        let k4 = slope(plus(angle, k3.0, step), plus(rate, k3.1, step));
        let mean = |slopes: [[f64; 6]; 4]| -> [f64; 6] {
            let [a, b, c, d] = slopes;
            std::array::from_fn(|i| (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]) / 6.0)
        };
        let (rates, accelerations) = ([k1.0, k2.0, k3.0, k4.0], [k1.1, k2.1, k3.1, k4.1]);
        (plus(angle, mean(rates), step), plus(rate, mean(accelerations), step))
    });
    assert!(exact.iter().all(|error| *error < 1e-8), "RK4: {exact:?}");
    // The farm's own step: an error that comes and goes with the motion, and does not grow.
    let farm = 0.25e-3;
    let own = fall(&robot, farm, |angle, rate| {
        let rate = plus(rate, slope(angle, rate).1, farm);
        (plus(angle, rate, farm), rate)
    });
    println!("RK4 {exact:?}, semi-implicit {own:?}");
    assert!(own[0] < 2e-2 && own[1] < 1.5 * own[0], "semi-implicit: {own:?}");
}
