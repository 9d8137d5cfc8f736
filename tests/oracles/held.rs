//! A held base and a held target: closed forms, heavy free bodies, and an independent integrator.

use super::arm_drives::{elastic, frequency, rod};
use super::bench::{assert_close, at, closing, inertia, run, runge_kutta, two_bodies};
use super::floating::Dense;
use super::lanes::six_joints;
use softdock_kernels::arm_motion::no_motion;
use softdock_kernels::model::{ArmControl, Held, Link, Model};
use softdock_kernels::outcome::Finished;
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use softdock_kernels::space::{Actuation, Bodies, Masses, Wrench, advance, kinematics, settle, space_masses};
use softdock_kernels::start::start;
use softdock_kernels::thrusters::no_firing;
use softdock_kernels::vector::{Quat, Vec3, vec3};
use std::f64::consts::{FRAC_PI_2, TAU};

const BASE: Held = Held { base: true, target: false };
const TARGET: Held = Held { base: false, target: true };
const BOTH: Held = Held { base: true, target: true };

/// A mass that closes on a plane at 0.1 m/s.
fn bounce(held: Held, params: Params<f64>) -> Finished {
    let mut model = two_bodies(1e-4, 0.5, 1e-3);
    model.held = held;
    run(model, &[params]).remove(0)
}

#[test]
fn a_mass_bounces_off_a_held_body_as_the_closed_form() {
    let (mass, speed, stiffness) = (100.0, 0.1, 1e4);
    let free = Params { base_mass: mass, target_mass: mass, ..closing(1.0, speed, stiffness, 0.0) };
    for (what, held) in [("target", TARGET), ("base", BASE)] {
        let row = bounce(held, free);
        for side in [row.space, row.hil] {
            // w dt = 1e-3: entry and exit between substeps are worth (w dt)^2 / 2 of the energy.
            assert!(side.linear_momentum_error < 1e-13, "held {what}: {}", side.linear_momentum_error);
            assert!(side.angular_momentum_error < 1e-13, "held {what}: {}", side.angular_momentum_error);
        }
        let space = row.space;
        assert_close(&format!("rebound off a held {what}"), space.rebound_speed, speed, 1e-6);
        assert_close(&format!("impulse on a held {what}"), space.impulse, 2.0 * mass * speed, 1e-6);
        let force = speed * (stiffness * mass).sqrt();
        assert_close(&format!("force on a held {what}"), space.peak_contact_force, force, 1e-6);
        assert!(row.flags == 0, "held {what}: flags {}", row.flags);
    }
}

/// The metrics of a contact.
fn compare(what: &str, held: &Finished, heavy: &Finished, tolerance: f64) {
    for (side, held, heavy) in [("space", held.space, heavy.space), ("hil", held.hil, heavy.hil)] {
        let pairs = [
            ("touch time", held.touch_time, heavy.touch_time),
            ("approach speed", held.approach_speed, heavy.approach_speed),
            ("impulse", held.impulse, heavy.impulse),
            ("peak force", held.peak_contact_force, heavy.peak_contact_force),
            ("depth", held.peak_depth, heavy.peak_depth),
        ];
        for (metric, value, expected) in pairs {
            assert!(expected > 0.0, "{what}, {side}: no {metric}");
            assert_close(&format!("{what}, {side}: {metric}"), value, expected, tolerance);
        }
    }
}

/// An arm of six joints that meets the plane of part B, under delay, friction and, for a free base, thrust of its start.
fn berthing(held: Held, change: impl Fn(&mut Params<f64>)) -> Finished {
    let mut model = six_joints(2.5e-4, 0.5);
    (model.timing.substeps, model.timing.max_ticks, model.held) = (4, 500, held);
    let mut params = Params {
        base_mass: 400.0,
        target_mass: 300.0,
        loop_delay: 4e-3,
        contact_friction: 0.2,
        bristle_stiffness: 5e3,
        tilt: vec3(0.01, 0.02, -0.01),
        ..closing(1.0, 0.06, 1e4, 30.0)
    };
    change(&mut params);
    run(model, &[params]).remove(0)
}

#[test]
fn a_held_body_acts_as_a_free_one_of_1e12_times_the_mass() {
    let heavy = berthing(Held::NONE, |p| {
        (p.target_mass, p.target_inertia_scale) = (300.0e12, 1e12);
    });
    compare("target", &berthing(TARGET, |_| {}), &heavy, 1e-6);
    let heavy = berthing(Held::NONE, |p| {
        (p.base_mass, p.base_inertia_scale) = (400.0e12, 1e12);
    });
    compare("base", &berthing(BASE, |_| {}), &heavy, 1e-6);
}

#[test]
fn momentum_of_what_is_free_holds_beside_a_held_body() {
    for held in [BASE, TARGET] {
        let row = berthing(held, |p| p.target_rate = vec3(0.0, 0.02, -0.01));
        for side in [row.space, row.hil] {
            assert!(side.touch_time > 0.0, "{held:?}: no touch");
            // Of 24 kg m/s and some 10 kg m^2/s.
            assert!(side.linear_momentum_error < 24e-12, "{held:?}: linear {}", side.linear_momentum_error);
            assert!(side.angular_momentum_error < 10e-12, "{held:?}: angular {}", side.angular_momentum_error);
        }
    }
}

/// Two links whose axes are at right angles, on a held base in a field.
fn two_links() -> Model {
    let mut model = two_bodies(1e-3, 2.0, 1.0);
    let link = |x: f64, attitude: Vec3<f64>| Link {
        origin: softdock_kernels::vector::Pose {
            position: vec3(x, 0.1, 0.0),
            attitude: Quat::from_rotation_vector(attitude),
        },
        mass: 12.0,
        com: vec3(0.4, 0.05, -0.03),
        inertia: inertia(0.1, 1.0, 1.2),
    };
    model.links = vec![link(0.3, vec3(0.2, 0.1, 0.3)), link(0.9, vec3(FRAC_PI_2, 0.0, 0.0))];
    model.start_angles = vec![0.4, -0.7];
    model.tool = at(0.8, 0.1, 0.0);
    model.held = BOTH;
    model.field = vec3(0.3, -1.1, -2.0);
    model.base_pose.attitude = Quat::from_rotation_vector(vec3(0.3, -0.5, 0.2));
    model
}

/// Torques of springs and dampers at the joints.
fn springs(angle: [f64; 2], rate: [f64; 2]) -> [f64; 2] {
    [-60.0 * angle[0] - 2.0 * rate[0], -20.0 * angle[1] - rate[1]]
}

/// A wrench that the tool would feel from a spring to a place.
fn pulled(tool: Vec3<f64>) -> Wrench<f64> {
    Wrench { force: (vec3(-1.0, 0.5, 0.2) - tool) * 15.0, moment: vec3(0.4, -0.2, 0.1) }
}

const IDLE: Actuation<f64, 2> =
    Actuation { braked: 0.0, thrust: vec3(0.0, 0.0, 0.0), torque: vec3(0.0, 0.0, 0.0), joint: [0.0; 2] };

/// Angles and rates after two seconds of semi-implicit steps.
fn stepped(substep: f64) -> [f64; 4] {
    let mut model = two_links();
    model.timing.substep = substep;
    let m = Plant::new(model);
    let params = Params::null();
    let masses = space_masses(&params);
    let mut s = start::<f64, 2>(&m, &params, &masses);
    s.arm.rate = [0.5, -0.8];
    for _ in 0..(2.0 / substep).round() as u32 {
        let k = kinematics(&m, &masses, &s);
        let u = Actuation { joint: springs(s.arm.angle, s.arm.rate), ..IDLE };
        s = settle(advance(&m, &masses, &s, &k, &u, pulled(k.parts.a.position)));
    }
    [s.arm.angle[0], s.arm.angle[1], s.arm.rate[0], s.arm.rate[1]]
}

/// The same by the classical Runge-Kutta method on the dense mass matrix.
fn integrated(step: f64) -> [f64; 4] {
    let m = Plant::new(two_links());
    let params = Params::null();
    let masses: Masses<f64> = space_masses(&params);
    let first = start::<f64, 2>(&m, &params, &masses);
    let slope = |y: [f64; 4]| {
        let mut s: Bodies<f64, 2> = first;
        (s.arm.angle, s.arm.rate) = ([y[0], y[1]], [y[2], y[3]]);
        let dense = Dense::new(&m, masses, &s);
        let u = Actuation { joint: springs(s.arm.angle, s.arm.rate), ..IDLE };
        let gain = dense.accelerations(&u, pulled(m.base_pose.position + dense.tool()));
        [y[2], y[3], gain[6], gain[7]]
    };
    runge_kutta([0.0, 0.0, 0.5, -0.8], (step, 2.0), slope)
}

#[test]
fn an_arm_on_a_held_base_follows_an_independent_integrator() {
    let exact = integrated(1e-3);
    let (coarse, fine) = (stepped(2e-5), stepped(1e-5));
    let size = exact.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    for i in 0..4 {
        // The steps are of first order: what is left at step zero is of the second.
        let found = 2.0 * fine[i] - coarse[i];
        assert!((found - exact[i]).abs() < 1e-6 * size, "{i}: {found} instead of {} of {size}", exact[i]);
        assert!((fine[i] - exact[i]).abs() < 1e-3 * size, "{i}: {} instead of {} of {size}", fine[i], exact[i]);
    }
}

#[test]
fn natural_frequencies_on_a_held_base_are_those_of_the_closed_form() {
    let (k1, k2, bend): (f64, f64, f64) = (9000.0, 3000.0, 1.1);
    let mut model = two_bodies(1e-4, 3.0, 5.0);
    model.links = vec![rod(0.4), rod(1.0)];
    (model.start_angles, model.held) = (vec![0.3, bend], BASE);
    model.drives = vec![elastic(1e9, k1, 0.0), elastic(1e9, k2, 0.0)];
    let m = Plant::new(model);
    // M of two rods (12 kg, 1 m, 1 kg m^2 about their middles) and K: w^2 of det(K - w^2 M) = 0.
    let (m22, cross) = (1.0 + 12.0 * 0.25, 12.0 * 0.5 * f64::cos(bend));
    let (m11, m12) = (m22 + m22 + 12.0 + 2.0 * cross, m22 + cross);
    let (a, b, c) = (m11 * m22 - m12 * m12, k1 * m22 + k2 * m11, k1 * k2);
    for sign in [-1.0, 1.0] {
        let w2 = (b + sign * (b * b - 4.0 * a * c).sqrt()) / (2.0 * a);
        let shape = [w2 * m12, k1 - w2 * m11].map(|e| e * 1e-5 / (w2 * m12).abs().max((k1 - w2 * m11).abs()));
        let params = Params::null();
        let masses = space_masses(&params);
        let mut s = start::<f64, 2>(&m, &params, &masses);
        (s.arm.angle, s.drives.windup) = (shape, shape.map(|e| -e));
        let none = Wrench { force: Vec3::zero(), moment: Vec3::zero() };
        let step = |s: &mut Bodies<f64, 2>| {
            *s = settle(advance(&m, &masses, s, &kinematics(&m, &masses, s), &IDLE, none));
            s.arm.angle[0]
        };
        let angles: Vec<f64> = (0..30_000).map(|_| step(&mut s)).collect();
        assert_close(&format!("branch {sign}"), frequency(&angles, 1e-4), w2.sqrt() / TAU, 1e-5);
    }
}

#[test]
fn computed_torque_on_a_held_base_gives_the_wanted_acceleration_in_a_field() {
    let mut model = six_joints(1e-4, 1.0);
    (model.held, model.field) = (BOTH, vec3(0.5, -0.3, -9.81));
    let (w, z) = (3.0, 0.7);
    model.guidance.arm = ArmControl::ComputedTorque { bandwidth: w, damping_ratio: z };
    let m = Plant::new(model);
    let params = Params::null();
    let masses = space_masses(&params);
    let mut s = start::<f64, 6>(&m, &params, &masses);
    s.arm.angle = [0.2, -0.1, 0.3, -0.2, 0.1, 0.4];
    s.arm.rate = [0.3, -0.2, 0.4, 0.5, -0.6, 0.7];
    let k = kinematics(&m, &masses, &s);
    let u = softdock_kernels::guidance::guide(
        &m,
        &params,
        &masses,
        &s.arm,
        &s.drives,
        s.chaser.attitude,
        &k,
        0.0,
        &no_motion(),
        &no_firing(),
    );
    let none = Wrench { force: Vec3::zero(), moment: Vec3::zero() };
    let next = advance(&m, &masses, &s, &k, &u, none);
    for i in 0..6 {
        let found = (next.arm.rate[i] - s.arm.rate[i]) / m.timing.substep;
        let wanted = -w * w * s.arm.angle[i] - 2.0 * z * w * s.arm.rate[i];
        assert!((found - wanted).abs() < 1e-9, "joint {i}: {found} rad/s^2 instead of {wanted}");
    }
}
