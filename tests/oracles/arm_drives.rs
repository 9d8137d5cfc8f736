//! The arm in space with rotors, elastic gears, friction, limits, stops and brakes: closed forms and an independent
//! integrator.

use super::bench::{assert_close, assert_momentum_in_contact, at, closing, inertia, job};
use super::floating::Dense;
use super::lanes::six_joints;
use softdock_engine::RunInput;
use softdock_engine::cpu::replay;
use softdock_kernels::manipulator::{ArmDrive, Drive, Friction, Stops};
use softdock_kernels::model::{ArmControl, Brakes, Link, MAX_JOINTS, Model, Timing};
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use softdock_kernels::space::{Actuation, Bodies, Masses, Wrench, advance, kinematics, settle, space_masses};
use softdock_kernels::start::start;
use softdock_kernels::vector::{Quat, Vec3, vec3};
use std::f64::consts::{FRAC_PI_2, TAU};

const NONE: Wrench<f64> = Wrench { force: vec3(0.0, 0.0, 0.0), moment: vec3(0.0, 0.0, 0.0) };

/// A drive with a rotor and nothing else.
fn rotor(reflected: f64) -> ArmDrive {
    ArmDrive {
        drive: Drive { gear_ratio: 100.0, rotor_inertia: reflected / 1e4, ..Drive::ideal() },
        friction: Friction::none(),
        presliding_travel: 1e-4,
        speed_limit: f64::INFINITY,
        stops: None,
        brake: 0.0,
    }
}

/// The same with an elastic gear.
pub(super) fn elastic(reflected: f64, stiffness: f64, damping: f64) -> ArmDrive {
    let ArmDrive { drive, .. } = rotor(reflected);
    ArmDrive { drive: Drive { gear_stiffness: stiffness, gear_damping: damping, ..drive }, ..rotor(reflected) }
}

/// A rod of a metre that turns about z at its end.
pub(super) fn rod(at_x: f64) -> Link {
    Link { origin: at(at_x, 0.0, 0.0), mass: 12.0, com: vec3(0.5, 0.0, 0.0), inertia: inertia(0.1, 1.0, 1.0) }
}

/// A base with rods in the plane; the tool at the end of the last one stands `gap` before the plane of part B.
fn planar(base_inertia: f64, drives: Vec<ArmDrive>, angles: &[f64], gap: f64) -> Model {
    let timing = Timing { substep: 0.25e-3, substeps: 4, max_ticks: 2000 };
    let mut model = Model::two_bodies(timing, gap);
    model.base_inertia = inertia(base_inertia, base_inertia, base_inertia);
    model.links = (0..drives.len()).map(|i| rod(if i == 0 { 0.4 } else { 1.0 })).collect();
    (model.drives, model.start_angles, model.tool) = (drives, angles.to_vec(), at(1.0, 0.0, 0.0));
    model.base_pose.position = vec3(-gap, 0.0, 0.0) - Plant::new(model.clone()).tool_start.position;
    model
}

/// Frequencies \[Hz\] at which a signal crosses zero upwards.
pub(super) fn frequency(samples: &[f64], step: f64) -> f64 {
    let crossings = samples.windows(2).enumerate().filter(|(_, pair)| pair[0] < 0.0 && pair[1] >= 0.0);
    let times: Vec<f64> = crossings.map(|(at, pair)| (at as f64 - pair[0] / (pair[1] - pair[0])) * step).collect();
    (times.len() - 1) as f64 / (times[times.len() - 1] - times[0])
}

/// Free substeps of a heavy base's arm under joint torques, from deflected gears.
fn swing<const N: usize>(
    m: &Plant,
    steps: usize,
    begin: impl Fn(&mut Bodies<f64, N>),
    u: [f64; N],
    braked: f64,
) -> Vec<Bodies<f64, N>> {
    let params = Params { base_mass: 1e9, ..Params::null() };
    let masses = space_masses(&params);
    let mut s = start::<f64, N>(m, &params, &masses);
    begin(&mut s);
    let u = Actuation { thrust: Vec3::zero(), torque: Vec3::zero(), joint: u, braked };
    let step = |s: &mut Bodies<f64, N>| {
        *s = settle(advance(m, &masses, s, &kinematics(m, &masses, s), &u, NONE));
        *s
    };
    (0..steps).map(|_| step(&mut s)).collect()
}

#[test]
fn natural_frequencies_of_a_flexible_two_link_arm_are_those_of_the_closed_form() {
    let (k1, k2): (f64, f64) = (9000.0, 3000.0);
    for bend in [0.0, FRAC_PI_2, 2.0] {
        let drives = vec![elastic(1e9, k1, 0.0), elastic(1e9, k2, 0.0)];
        let m = Plant::new(planar(1e9, drives, &[0.3, bend], 1.0));
        // M of two rods (12 kg, 1 m, 1 kg m^2 about their middles) and K: w^2 of det(K - w^2 M) = 0.
        let (m22, cross) = (1.0 + 12.0 * 0.25, 12.0 * 0.5 * f64::cos(bend));
        let (m11, m12) = (m22 + m22 + 12.0 + 2.0 * cross, m22 + cross);
        let (a, b, c) = (m11 * m22 - m12 * m12, k1 * m22 + k2 * m11, k1 * k2);
        for sign in [-1.0, 1.0] {
            let w2 = (b + sign * (b * b - 4.0 * a * c).sqrt()) / (2.0 * a);
            let shape = [w2 * m12, k1 - w2 * m11].map(|e| e * 1e-4 / (w2 * m12).abs().max((k1 - w2 * m11).abs()));
            let begin = |s: &mut Bodies<f64, 2>| (s.arm.angle, s.drives.windup) = (shape, shape.map(|e| -e));
            let states = swing(&m, 24_000, begin, [0.0; 2], 0.0);
            let found = frequency(&states.iter().map(|s| s.arm.angle[0]).collect::<Vec<_>>(), 0.25e-3);
            assert_close(&format!("bend {bend}, branch {sign}"), found, w2.sqrt() / TAU, 5e-3);
        }
    }
}

#[test]
fn rotor_and_link_swing_against_each_other_and_rigid_gears_carry_both() {
    // About its end a rod has 4 kg m^2.
    let (rod, reflected, stiffness): (f64, f64, f64) = (4.0, 2.0, 5000.0);
    let m = Plant::new(planar(1e9, vec![elastic(reflected, stiffness, 0.0)], &[0.0], 1.0));
    let states = swing(&m, 12_000, |s: &mut Bodies<f64, 1>| s.drives.windup = [1e-3], [0.0], 0.0);
    let windup: Vec<f64> = states.iter().map(|s| s.drives.windup[0]).collect();
    assert_close(
        "free-free",
        frequency(&windup, 0.25e-3),
        (stiffness * (1.0 / rod + 1.0 / reflected)).sqrt() / TAU,
        2e-3,
    );
    let m = Plant::new(planar(1e9, vec![rotor(reflected)], &[0.0], 1.0));
    let states = swing(&m, 400, |_: &mut Bodies<f64, 1>| {}, [3.0], 0.0);
    assert_close("rigid", states[399].arm.rate[0], 3.0 / (rod + reflected) * 0.1, 2e-3);
    assert!((states[399].drives.motor_rate[0] - states[399].arm.rate[0]).abs() < 1e-6 * states[399].arm.rate[0]);
}

#[test]
fn torque_and_speed_limits_stops_and_brakes_hold() {
    let own = rotor(2.0);
    let limited = ArmDrive { drive: Drive { torque_limit: 3.0, ..own.drive }, speed_limit: 0.2, ..own };
    let m = Plant::new(planar(1e9, vec![limited], &[0.0], 1.0));
    let states = swing(&m, 8000, |_: &mut Bodies<f64, 1>| {}, [500.0], 0.0);
    assert_close("at the torque limit", states[399].arm.rate[0], 3.0 / 6.0 * 0.1, 2e-3);
    assert!((states[7999].arm.rate[0] - 0.2).abs() < 1e-3, "{}", states[7999].arm.rate[0]);

    let stops = Some(Stops { lower: -0.1, upper: 0.1, stiffness: 5e4, damping: 0.0 });
    let m = Plant::new(planar(1e9, vec![ArmDrive { stops, ..own }], &[0.0], 1.0));
    let moving = |s: &mut Bodies<f64, 1>| (s.arm.rate, s.drives.motor_rate) = ([0.3], [0.3]);
    let states = swing(&m, 12_000, moving, [0.0], 0.0);
    // 6 kg m^2 at 0.3 rad/s go 0.3 sqrt(6 / 5e4) beyond the stop, and come back as fast.
    let most = states.iter().fold(0.0_f64, |most, s| most.max(s.arm.angle[0].abs()));
    assert_close("depth of the stop", most - 0.1, 0.3 * (6.0_f64 / 5e4).sqrt(), 1e-2);
    assert_close("after several blows", states[11_999].arm.rate[0].abs(), 0.3, 1e-2);

    let m = Plant::new(planar(1e9, vec![ArmDrive { brake: 50.0, ..own }], &[0.0], 1.0));
    let states = swing(&m, 4000, moving, [40.0], 1.0);
    // 50 N m on 6 kg m^2: 36 ms and 5.4 mrad to rest, where the brake holds; the motor is off.
    assert_close("braking distance", states[1000].arm.angle[0], 0.3 * 0.3 * 6.0 / (2.0 * 50.0), 3e-2);
    let rest = (states[3999].arm.angle[0] - states[2000].arm.angle[0]).abs();
    assert!(rest < 1e-5, "it stands: {rest}");
    let states = swing(&m, 400, moving, [0.0], 0.0);
    assert!((states[399].arm.rate[0] - 0.3).abs() < 1e-9, "an open brake does nothing");
}

#[test]
fn friction_of_the_drives_takes_its_work_and_holds() {
    let friction = Friction { coulomb: 4.0, viscous: 3.0, ..Friction::none() };
    let m = Plant::new(planar(1e9, vec![ArmDrive { friction, ..rotor(2.0) }], &[0.0], 1.0));
    let moving = |s: &mut Bodies<f64, 1>| (s.arm.rate, s.drives.motor_rate) = ([0.5], [0.5]);
    let states = swing(&m, 8000, moving, [0.0], 0.0);
    // 6 w' = -4 - 3 w: w = (0.5 + 4/3) exp(-t/2) - 4/3.
    let at = |t: f64| (0.5 + 4.0 / 3.0) * f64::exp(-0.5 * t) - 4.0 / 3.0;
    assert_close("sliding", states[1199].arm.rate[0], at(0.3), 5e-3);
    // What is left swings within the travel before sliding.
    let left = (states[7999].arm.angle[0] - states[5000].arm.angle[0]).abs();
    assert!(left < 2e-5, "it stands: {left}");
    // A torque that begins at once swings up to twice as far.
    let states = swing(&m, 4000, |_: &mut Bodies<f64, 1>| {}, [1.9], 0.0);
    assert!(
        states[3999].arm.angle[0] < 1e-3,
        "below the Coulomb friction nothing slides: {}",
        states[3999].arm.angle[0]
    );
}

/// Joints, motors and bodies of the independent integrator.
#[derive(Clone, Copy)]
struct State {
    bodies: Bodies<f64, 2>,
    motor: [f64; 2],
    motor_rate: [f64; 2],
}

/// The system of the independent integrator: a dense mass matrix, springs between motors and joints, a spring wall at x = 0.
struct Reference<'a> {
    m: &'a Plant,
    masses: Masses<f64>,
    wall: f64,
}

impl Reference<'_> {
    /// Place of the tool and force of the wall on it.
    fn touch(&self, s: &State) -> (Vec3<f64>, Vec3<f64>) {
        let dense = Dense::new(self.m, self.masses, &s.bodies);
        let tool = s.bodies.chaser.com + dense.tool_from_com();
        (tool, vec3(-self.wall * tool.x.max(0.0), 0.0, 0.0))
    }

    /// `s + dt * (derivative at `at`)` under motor torques.
    fn moved(&self, s: &State, at: &State, torque: [f64; 2], dt: f64) -> State {
        let dense = Dense::new(self.m, self.masses, &at.bodies);
        let (_, force) = self.touch(at);
        let mut gear = [0.0; 2];
        for (i, gear) in gear.iter_mut().enumerate() {
            let drive = self.m.drives[i].drive;
            let (windup, unwinding) = (at.motor[i] - at.bodies.arm.angle[i], at.motor_rate[i] - at.bodies.arm.rate[i]);
            *gear = drive.gear_stiffness * windup + drive.gear_damping * unwinding;
        }
        let u = Actuation { thrust: Vec3::zero(), torque: Vec3::zero(), joint: gear, braked: 0.0 };
        let gain = dense.accelerations(&u, Wrench { force, moment: Vec3::zero() });
        let mut next = *s;
        for i in 0..2 {
            next.bodies.arm.angle[i] += dt * at.bodies.arm.rate[i];
            next.bodies.arm.rate[i] += dt * gain[6 + i];
            next.motor[i] += dt * at.motor_rate[i];
            next.motor_rate[i] += dt * (torque[i] - gear[i]) / self.m.drives[i].drive.reflected_inertia();
        }
        let (chaser, mass) = (&mut next.bodies.chaser, self.masses.base_mass + 24.0);
        chaser.com = at.bodies.chaser.momentum.scale_add(dt / mass, chaser.com);
        chaser.momentum = force.scale_add(dt, chaser.momentum);
        chaser.spin = dense.tool_from_com().cross(force).scale_add(dt, chaser.spin);
        let spin = Quat { w: 0.0, v: dense.base_rate() }.compose(at.bodies.chaser.attitude);
        chaser.attitude.w += 0.5 * dt * spin.w;
        chaser.attitude.v = spin.v.scale_add(0.5 * dt, chaser.attitude.v);
        next
    }

    /// A step of the classical Runge-Kutta method.
    fn step(&self, s: &State, torque: [f64; 2], dt: f64) -> State {
        let second = self.moved(s, s, torque, dt / 2.0);
        let third = self.moved(s, &second, torque, dt / 2.0);
        let fourth = self.moved(s, &third, torque, dt);
        let mut next = self.moved(s, s, torque, dt / 6.0);
        next = self.moved(&next, &second, torque, dt / 3.0);
        next = self.moved(&next, &third, torque, dt / 3.0);
        next = self.moved(&next, &fourth, torque, dt / 6.0);
        next.bodies.chaser.attitude = next.bodies.chaser.attitude.normalized();
        next
    }
}

#[test]
fn flexible_arm_in_contact_follows_an_independent_integrator() {
    let (wall, speed) = (2e4, 0.06);
    let drives = vec![elastic(2.0, 4000.0, 2.0), elastic(1.0, 2000.0, 1.0)];
    let mut model = planar(120.0, drives, &[0.7, -1.2], 5e-3);
    model.timing.max_ticks = 1000;
    let gains = |first: f64, second: f64| {
        let mut gains = [0.0; MAX_JOINTS];
        (gains[0], gains[1]) = (first, second);
        gains
    };
    model.guidance.arm = ArmControl::JointPd { stiffness: gains(400.0, 200.0), damping: gains(80.0, 40.0) };
    let params = Params { base_mass: 250.0, target_mass: 1e9, ..closing(1.0, speed, wall, 0.0) };
    let params = Params { target_inertia_scale: 1e9, ..params };
    let mut seen = Vec::new();
    replay(&job(model.clone(), &[params]), RunInput::new(0, params), &mut |signals| {
        seen.push((signals.parts[0].a.position, signals.contact[0].force));
    });

    let m = Plant::new(model);
    let masses = space_masses(&params);
    let reference = Reference { m: &m, masses, wall };
    let bodies = start::<f64, 2>(&m, &params, &masses);
    let mut s = State { bodies, motor: [0.0; 2], motor_rate: [0.0; 2] };
    let (first, _) = reference.touch(&s);
    let (mut way, mut most) = ([0.0_f64; 2], [0.0_f64; 2]);
    // A step of 20 us is far below what the figures show.
    for (position, force) in &seen {
        let torque = [(400.0, 80.0), (200.0, 40.0)];
        let torque = [0, 1].map(|i| -(torque[i].0 * s.motor[i] + torque[i].1 * s.motor_rate[i]));
        (0..50).for_each(|_| s = reference.step(&s, torque, 2e-5));
        let (tool, push) = reference.touch(&s);
        most = [most[0].max((*position - tool).norm()), most[1].max((*force - push).norm())];
        way = [way[0].max((tool - first).norm()), way[1].max(push.norm())];
    }
    assert!(way[0] > 5e-3 && way[1] > 20.0, "the tip touches: {way:?}");
    assert!(most[0] < 0.01 * way[0], "tip off by {} of {} m", most[0], way[0]);
    assert!(most[1] < 0.01 * way[1], "force off by {} of {} N", most[1], way[1]);
}

#[test]
fn momentum_holds_with_rotors_elastic_gears_and_contact() {
    let mut model = six_joints(2.5e-4, 20.0);
    model.timing.substeps = 4;
    model.timing.max_ticks = 20_000;
    let friction = Friction { coulomb: 1.0, viscous: 2.0, ..Friction::none() };
    model.drives = (0..6).map(|_| ArmDrive { friction, ..elastic(2.0, 8000.0, 5.0) }).collect();
    model.brakes = Brakes::Open;
    assert_momentum_in_contact(model);
}
