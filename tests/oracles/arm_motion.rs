//! Motion of the arm: moves against closed forms, guards, camera, compliance and force control.

use super::bench::{assert_close, at, closing, job};
use super::lanes::six_joints;
use softdock_engine::RunInput;
use softdock_engine::cpu::replay;
use softdock_kernels::arm_motion::{ArmMotion, feel, follow, no_motion};
use softdock_kernels::arm_plan::{ArmGuard, ArmPhase, ArmPlan, Camera, Compliance, Goal, Pace};
use softdock_kernels::fields::filled;
use softdock_kernels::guidance::guide;
use softdock_kernels::large_rotation::{from_turn, rotation_vector};
use softdock_kernels::model::{ArmControl, MAX_JOINTS, Model};
use softdock_kernels::outcome::Signals;
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use softdock_kernels::space::{Bodies, Kinematics, Parts, Wrench, advance, kinematics, settle, space_masses};
use softdock_kernels::start::start;
use softdock_kernels::thrusters::no_firing;
use softdock_kernels::vector::{Pose, Vec3, vec3};

const NONE: Wrench<f64> = Wrench { force: vec3(0.0, 0.0, 0.0), moment: vec3(0.0, 0.0, 0.0) };

const TORQUE: ArmControl = ArmControl::ComputedTorque { bandwidth: 20.0, damping_ratio: 1.0 };

const IMPEDANCE: ArmControl = ArmControl::CartesianImpedance {
    stiffness: 4000.0,
    damping: 1200.0,
    rotation_stiffness: 800.0,
    rotation_damping: 250.0,
    joint_damping: 2.0,
};

fn pace(speed: f64, acceleration: f64, jerk: f64) -> Pace {
    Pace { speed, acceleration, jerk, turn_speed: 0.5 }
}

fn phase(control: ArmControl, goal: Goal, pace: Pace, guards: Vec<ArmGuard>) -> ArmPhase {
    ArmPhase { name: "phase".to_owned(), control, goal, pace, compliance: None, closes: None, guards }
}

fn planned(phases: Vec<ArmPhase>) -> Model {
    let mut model = six_joints(2.5e-4, 20.0);
    model.timing.substeps = 4;
    // Part A's axes are those of part B at the start.
    model.tool.attitude = Plant::new(model.clone()).tool_start.attitude.conjugate();
    model.guidance.plan = Some(ArmPlan { phases, camera: None, grip_time: 0.0, sensor_lag: 0.0 });
    model
}

/// Joint angles from the start posture, the same sign and size for each.
fn joints(angles: &[f64]) -> Goal {
    let mut all = [0.0; MAX_JOINTS];
    all[..angles.len()].copy_from_slice(angles);
    Goal::Joints(all)
}

fn params() -> Params<f64> {
    Params { base_mass: 400.0, target_mass: 300.0, offset: vec3(-0.5, 0.1, 0.05), ..Params::null() }
}

/// Ticks without contact: what is wanted, and the bodies, after each.
fn led(
    model: Model,
    p: Params<f64>,
    ticks: u32,
    mut see: impl FnMut(&ArmMotion<f64, 6>, &Bodies<f64, 6>, &Kinematics<f64, 6>),
) {
    let m = Plant::new(model);
    let masses = space_masses(&p);
    let mut s = start::<f64, 6>(&m, &p, &masses);
    let mut motion = no_motion();
    for _ in 0..ticks {
        let k = kinematics(&m, &masses, &s);
        motion = follow(&m, &p, &motion, &s.arm, &s.drives, s.chaser.attitude, &k, &NONE, 0.0, &NONE);
        see(&motion, &s, &k);
        let u = guide(&m, &p, &masses, &s.arm, &s.drives, s.chaser.attitude, &k, 0.0, &motion, &no_firing());
        for _ in 0..4 {
            s = advance(&m, &masses, &s, &kinematics(&m, &masses, &s), &u, NONE);
        }
        s = settle(s);
    }
}

#[test]
fn moves_keep_their_limits_and_take_the_least_time() {
    let (speed, acceleration, jerk): (f64, f64, f64) = (0.2, 0.5, 4.0);
    // With the greatest speed; with the greatest acceleration alone; with the jerk alone.
    let ways = [0.3, 0.06, 0.01];
    let times = [
        0.3 / speed + speed / acceleration + acceleration / jerk,
        acceleration / jerk + ((acceleration / jerk).powi(2) + 4.0 * 0.06 / acceleration).sqrt(),
        4.0 * (0.01 / (2.0 * jerk)).cbrt(),
    ];
    for (way, time) in ways.into_iter().zip(times) {
        let goal = joints(&[way, -0.5 * way]);
        let model = planned(vec![phase(TORQUE, goal, pace(speed, acceleration, jerk), vec![])]);
        let mut seen = Vec::new();
        led(model, params(), 2500, |motion, _, _| {
            assert_close("time of the move", motion.duration, time, 1e-9);
            assert!((motion.angle[1] + 0.5 * motion.angle[0]).abs() < 1e-15, "joints arrive together");
            seen.push([motion.angle[0], motion.rate[0], motion.gain[0]]);
        });
        let tick = 1e-3;
        let most = |index: usize| seen.iter().fold(0.0_f64, |most, row| most.max(row[index].abs()));
        assert!(most(1) < speed * (1.0 + 1e-9) && most(2) < acceleration * (1.0 + 1e-9));
        assert!((seen[2499][0] - way).abs() < 1e-12 && seen[2499][1] == 0.0, "it arrives: {:?}", seen[2499]);
        for pair in seen.windows(2) {
            let [then, now] = [pair[0], pair[1]];
            // Rates and accelerations are the derivatives; the jerk is never exceeded.
            assert!(((now[0] - then[0]) / tick - 0.5 * (now[1] + then[1])).abs() < jerk * tick * tick);
            assert!(((now[1] - then[1]) / tick - 0.5 * (now[2] + then[2])).abs() < jerk * tick);
            assert!((now[2] - then[2]).abs() < jerk * tick * (1.0 + 1e-6));
        }
    }
}

#[test]
fn free_floating_arm_follows_a_path_and_keeps_the_momentum() {
    let there = joints(&[0.4, -0.3, 0.5, 0.2, -0.4, 0.3]);
    let arrived = ArmGuard { arrived: true, ..ArmGuard::to(1) };
    let back = phase(TORQUE, joints(&[0.0; 6]), pace(0.3, 0.5, 2.0), vec![]);
    let model = planned(vec![phase(TORQUE, there, pace(0.3, 0.5, 2.0), vec![arrived]), back]);
    let (mut off, mut turned, mut spin, mut last) = (0.0_f64, 0.0_f64, 0.0_f64, [1.0; 6]);
    led(model, params(), 6000, |motion, s, _| {
        (0..6).for_each(|i| off = off.max((motion.angle[i] - s.arm.angle[i]).abs()));
        turned = turned.max(s.arm.angle[2]);
        spin = spin.max(s.chaser.spin.norm()).max(s.chaser.momentum.norm());
        last = s.arm.angle;
    });
    assert!(turned > 0.499 && off < 2e-4, "the third joint comes to {turned} rad, joints are off by {off} rad");
    assert!(last.into_iter().all(|angle| angle.abs() < 1e-5), "back again: {last:?}");
    assert!(spin < 1e-12, "nothing pushes, no momentum comes: {spin}");
}

#[test]
fn part_goes_along_a_straight_line_and_turns_about_one_axis() {
    let start_pose = Plant::new(planned(vec![phase(IMPEDANCE, Goal::Hold, pace(1.0, 1.0, 1.0), vec![])])).tool_start;
    let turn = vec3(0.04, -0.02, 0.06);
    let attitude = start_pose.attitude.compose(from_turn(turn));
    let shift = vec3(-0.02, 0.016, 0.01);
    let goal = Pose { position: start_pose.position + shift, attitude };
    let model = planned(vec![phase(IMPEDANCE, Goal::Base(goal), pace(0.05, 0.1, 0.5), vec![])]);
    let mut last = (f64::INFINITY, f64::INFINITY);
    led(model, params(), 8000, |motion, s, k| {
        let way = motion.place.position - start_pose.position;
        assert!(way.cross(shift).norm() < 1e-12, "on the line");
        let own = rotation_vector(start_pose.attitude.conjugate().compose(motion.place.attitude));
        assert!(own.cross(turn).norm() < 1e-12, "about one axis");
        let base = s.chaser.attitude;
        let is = base.conjugate().compose(k.parts.a.attitude);
        let left = base.rotate_back(k.axes.times(k.reach.position)) - goal.position;
        last = (left.norm(), rotation_vector(is.conjugate().compose(attitude)).norm());
    });
    assert!(last.0 < 1e-4 && last.1 < 1e-3, "it arrives: {last:?}");
}

/// The tool before a plane, led by phases; what happens, tick by tick.
fn pressing(phases: Vec<ArmPhase>, camera: Option<Camera>, p: Params<f64>, time: f64) -> Vec<Signals> {
    let mut model = planned(phases);
    model.timing.max_ticks = (time * 1e3) as u32;
    model.guidance.plan.as_mut().expect("a plan").camera = camera;
    let mut seen = Vec::new();
    replay(&job(model, &[p]), RunInput::new(0, p), &mut |signals| seen.push(*signals));
    seen
}

/// Part A's frame before part B's, as the approach axis has it.
fn before(x: f64) -> Goal {
    Goal::PartB(at(x, 0.0, 0.0))
}

fn camera() -> Camera {
    Camera { period: 100, delay: 150, noise_position: 0.0, noise_rotation: 0.0, smoothing: 0.0 }
}

#[test]
fn visual_servo_lags_by_the_age_of_its_images_and_keeps_the_error_of_its_camera() {
    // The target drifts away from a heavy chaser and turns.
    let error = vec3(0.0, 2e-3, -1e-3);
    let drift = 0.01;
    let p = Params { base_mass: 1e6, target_rate: vec3(0.02, 0.0, 0.01), ..closing(300.0, -drift, 1e4, 10.0) };
    let p = Params { offset: vec3(-0.1, 0.0, 0.0), camera_offset: error, ..p };
    let place = at(-0.2, 0.03, 0.0);
    let mut model = planned(vec![phase(IMPEDANCE, Goal::PartB(place), pace(0.2, 0.5, 5.0), vec![])]);
    model.guidance.plan.as_mut().expect("a plan").camera = Some(camera());
    let mut was = Vec::new();
    led(model, p, 6000, |motion, s, k| {
        let to_base = s.chaser.attitude.conjugate();
        let lever = k.parts.b.position - k.parts.a.position + k.axes.times(k.reach.position);
        let seen = to_base.rotate(lever + k.parts.a.attitude.rotate(error));
        was.push((seen, to_base.compose(k.parts.b.attitude)));
        if motion.since > motion.duration {
            // An image each 0.1 s, which arrives 0.15 s later.
            let tick = was.len() - 1;
            let newest = (tick - 150) / 100 * 100;
            let (position, attitude) = was[newest];
            let wanted = position + attitude.rotate(place.position);
            assert!((motion.place.position - wanted).norm() < 1e-12, "tick {tick}: {:?}", motion.place.position);
        }
    });
}

#[test]
fn guards_end_phases_in_the_first_tick_in_which_they_hold() {
    let after = ArmGuard { after: Some(0.25), ..ArmGuard::to(1) };
    let arrived = ArmGuard { arrived: true, ..ArmGuard::to(0) };
    let move_on = phase(TORQUE, joints(&[0.01]), pace(0.2, 0.5, 4.0), vec![arrived]);
    let model = planned(vec![phase(TORQUE, Goal::Hold, pace(1.0, 1.0, 1.0), vec![after]), move_on]);
    let duration = 4.0 * (0.01_f64 / 8.0).cbrt();
    let mut changes = Vec::new();
    let (mut tick, mut last) = (0, 0.0);
    led(model, params(), 1200, |motion, _, _| {
        if motion.phase != last {
            changes.push(f64::from(tick) * 1e-3);
            last = motion.phase;
        }
        tick += 1;
    });
    let round = |time: f64| (time * 1e3).ceil() * 1e-3;
    // The second move has nowhere to go: it has ended when its phase begins.
    let expected = [0.25, 0.25 + round(duration), 0.5 + round(duration)];
    for (found, expected) in changes.iter().zip(expected) {
        assert!((found - expected).abs() < 1.5e-3, "{changes:?}, expected {expected:?}");
    }
    assert!(changes.len() >= 3, "{changes:?}");
}

#[test]
fn pose_gives_way_as_mass_damper_and_spring() {
    let axes = |inverse_mass: f64, damping: f64, stiffness: f64| Compliance {
        inverse_mass: [inverse_mass, 0.0, 0.0, 0.0, 0.0, 0.0],
        damping: [damping, 0.0, 0.0, 0.0, 0.0, 0.0],
        stiffness: [stiffness, 0.0, 0.0, 0.0, 0.0, 0.0],
        press: [2.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    };
    let (mass, damping, stiffness) = (20.0, 40.0, 500.0);
    let mut own = phase(IMPEDANCE, Goal::Hold, pace(1.0, 1.0, 1.0), vec![]);
    own.compliance = Some(axes(1.0 / mass, damping, stiffness));
    let mut seen = Vec::new();
    led(planned(vec![own.clone()]), params(), 4000, |motion, _, _| seen.push(motion.shift.x));
    // 2 N on a damped oscillator from rest.
    let (decay, w2): (f64, f64) = (damping / (2.0 * mass), stiffness / mass);
    let w = (w2 - decay * decay).sqrt();
    for (tick, shift) in seen.iter().enumerate() {
        let t = (tick as f64 + 1.0) * 1e-3;
        let exact = 2.0 / stiffness * (1.0 - (-decay * t).exp() * ((w * t).cos() + decay / w * (w * t).sin()));
        assert!((shift - exact).abs() < 0.01 * 2.0 / stiffness, "at {t} s {shift} instead of {exact}");
    }
    own.compliance = Some(axes(1.0 / mass, damping, 0.0));
    let mut last = Vec3::zero();
    led(planned(vec![own]), params(), 5000, |motion, _, _| last = motion.shift_rate);
    assert_close("speed without a spring", last.x, 2.0 / damping, 1e-3);
}

#[test]
fn force_control_presses_with_its_force_and_an_impedance_with_its_spring() {
    let press = 12.0;
    let arrived = ArmGuard { arrived: true, after: Some(3.0), ..ArmGuard::to(1) };
    let turn = phase(IMPEDANCE, before(-0.02), pace(0.05, 0.2, 1.0), vec![arrived]);
    let touching = ArmGuard { force: Some(3.0), ..ArmGuard::to(2) };
    let approach = phase(IMPEDANCE, before(0.05), pace(0.03, 0.1, 1.0), vec![touching]);
    let mut push = phase(IMPEDANCE, Goal::Hold, pace(1.0, 1.0, 1.0), vec![]);
    push.compliance = Some(Compliance {
        inverse_mass: [1.0 / 30.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        damping: [1500.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        stiffness: [0.0; 6],
        press: [press, 0.0, 0.0, 0.0, 0.0, 0.0],
    });
    let heavy = Params { base_mass: 1e7, target_mass: 1e7, ..closing(1.0, 0.0, 2e4, 200.0) };
    let p = Params { base_inertia_scale: 1e7, target_inertia_scale: 1e7, loop_delay: 2e-3, ..heavy };
    let seen = pressing(vec![turn, approach, push], Some(camera()), p, 18.0);
    let last = seen[seen.len() - 1];
    for (side, name) in ["in space", "on the facility"].into_iter().enumerate() {
        assert_eq!(last.phase[side], 3.0, "{name}: it presses");
        assert_close(name, -last.contact[side].force.x, press, 1e-2);
    }
}

#[test]
fn arms_sensor_is_a_low_pass_in_the_axes_of_part_a() {
    let mut model = planned(vec![phase(IMPEDANCE, Goal::Hold, pace(1.0, 1.0, 1.0), vec![])]);
    model.guidance.plan.as_mut().expect("a plan").sensor_lag = 0.01;
    let m = Plant::new(model);
    let mut a = filled::<f64, Parts<f64>>(0.0).a;
    a.attitude = from_turn(vec3(0.0, 0.0, std::f64::consts::FRAC_PI_2));
    let push = Wrench { force: vec3(0.0, 10.0, 0.0), moment: vec3(0.0, 0.0, 1.0) };
    let mut felt = NONE;
    for _ in 0..40 {
        felt = feel(&m, &felt, a, push);
    }
    // 10 ms are one time constant.
    let share = 1.0 - (-1.0_f64).exp();
    assert_close("force", felt.force.x, 10.0 * share, 1e-9);
    assert!(felt.force.y.abs() < 1e-12);
    assert_close("moment", felt.moment.z, share, 1e-9);
}
