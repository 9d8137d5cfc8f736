//! Joints that slide: a cart with a pendulum by Lagrange's equations, energy and momenta on a free base.

use super::bench::{assert_momentum_in_contact, at, inertia, runge_kutta, two_bodies};
use super::floating::Dense;
use super::lanes::six_joints;
use softdock_kernels::model::{Held, Link, Model};
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use softdock_kernels::space::{Actuation, Bodies, Wrench, advance, kinematics, settle, space_masses};
use softdock_kernels::start::start;
use softdock_kernels::vector::{Pose, Quat, Vec3, vec3};
use std::f64::consts::FRAC_PI_2;

const NONE: Wrench<f64> = Wrench { force: vec3(0.0, 0.0, 0.0), moment: vec3(0.0, 0.0, 0.0) };

/// Mass of the cart, of the pendulum, length to its centre and its inertia about that.
const SIZES: [f64; 4] = [3.0, 2.0, 0.4, 0.15];
const GRAVITY: f64 = 9.81;

/// A cart that slides along x on a held base, with a pendulum about y that hangs along -z.
fn cart() -> Model {
    let [cart, bob, length, turning] = SIZES;
    let mut model = two_bodies(1e-3, 2.0, 5.0);
    let about = |axis: Vec3<f64>| Quat::from_rotation_vector(axis);
    // z along x of the base; then z along y of the base.
    let slider = about(vec3(0.0, FRAC_PI_2, 0.0));
    let hinge = slider.conjugate().compose(about(vec3(-FRAC_PI_2, 0.0, 0.0)));
    let body = |attitude: Quat<f64>, mass: f64, com: Vec3<f64>, moment: f64| Link {
        origin: Pose { position: Vec3::zero(), attitude },
        mass,
        com,
        inertia: inertia(moment, moment, moment),
    };
    // The hinge's y axis is -z of the base.
    model.links = vec![body(slider, cart, vec3(0.1, 0.2, 0.3), 0.2), body(hinge, bob, vec3(0.0, length, 0.0), turning)];
    (model.slides, model.start_angles) = (vec![true, false], vec![0.25, 0.0]);
    model.tool = at(0.0, 0.5, 0.0);
    model.held = Held { base: true, target: true };
    model.field = vec3(0.0, 0.0, -GRAVITY);
    model
}

/// Force on the cart and torque at the hinge.
fn push(place: [f64; 2], rate: [f64; 2]) -> [f64; 2] {
    [-40.0 * place[0] - 3.0 * rate[0], -0.5 * rate[1]]
}

const FIRST: [f64; 4] = [0.1, 1.2, 0.3, -0.5];

/// Places and rates after two seconds of semi-implicit steps.
fn stepped(substep: f64) -> [f64; 4] {
    let mut model = cart();
    model.timing.substep = substep;
    let m = Plant::new(model);
    let params = Params::null();
    let masses = space_masses(&params);
    let mut s = start::<f64, 2>(&m, &params, &masses);
    (s.arm.angle, s.arm.rate) = ([FIRST[0], FIRST[1]], [FIRST[2], FIRST[3]]);
    for _ in 0..(2.0 / substep).round() as u32 {
        let joint = push(s.arm.angle, s.arm.rate);
        let u = Actuation { braked: 0.0, thrust: Vec3::zero(), torque: Vec3::zero(), joint };
        s = settle(advance(&m, &masses, &s, &kinematics(&m, &masses, &s), &u, NONE));
    }
    [s.arm.angle[0], s.arm.angle[1], s.arm.rate[0], s.arm.rate[1]]
}

/// The same by the classical Runge-Kutta method on Lagrange's equations of a cart at x with a pendulum at q:
/// (M + m) x'' - m l (q'' cos q - q'^2 sin q) = F and (I + m l^2) q'' - m l x'' cos q = T - m g l sin q.
fn integrated(step: f64) -> [f64; 4] {
    let [cart, bob, length, turning] = SIZES;
    let slope = |y: [f64; 4]| {
        let ([force, torque], (sin, cos)) = (push([y[0], y[1]], [y[2], y[3]]), y[1].sin_cos());
        let (a, b, c) = (cart + bob, -bob * length * cos, turning + bob * length * length);
        let right = [force - bob * length * y[3] * y[3] * sin, torque - bob * GRAVITY * length * sin];
        let det = a * c - b * b;
        [y[2], y[3], (right[0] * c - b * right[1]) / det, (a * right[1] - b * right[0]) / det]
    };
    runge_kutta(FIRST, (step, 2.0), slope)
}

#[test]
fn a_cart_with_a_pendulum_moves_by_lagranges_equations() {
    let exact = integrated(1e-4);
    let (coarse, fine) = (stepped(2e-5), stepped(1e-5));
    let size = exact.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    for i in 0..4 {
        let found = 2.0 * fine[i] - coarse[i];
        assert!((found - exact[i]).abs() < 1e-6 * size, "{i}: {found} instead of {} of {size}", exact[i]);
    }
}

/// Energy of a free arm with a slider after two seconds over that at the start, less one.
fn energy_error(substep: f64) -> f64 {
    let mut model = two_bodies(substep, 2.0, 5.0);
    let link = |x: f64, turn: Vec3<f64>| Link {
        origin: Pose { position: vec3(x, 0.1, -0.05), attitude: Quat::from_rotation_vector(turn) },
        mass: 15.0,
        com: vec3(0.1, -0.05, 0.2),
        inertia: inertia(0.4, 0.5, 0.7),
    };
    model.links =
        vec![link(0.4, vec3(0.3, 0.2, -0.4)), link(0.5, vec3(1.2, 0.1, 0.4)), link(0.2, vec3(-0.5, 1.0, 0.3))];
    (model.slides, model.start_angles) = (vec![false, true, false], vec![0.4, 0.3, -0.2]);
    model.base_inertia = inertia(30.0, 40.0, 35.0);
    let m = Plant::new(model);
    let params = Params { base_mass: 100.0, chaser_rate: vec3(0.05, -0.1, 0.2), ..Params::null() };
    let masses = space_masses(&params);
    let mut s: Bodies<f64, 3> = start(&m, &params, &masses);
    s.arm.rate = [0.4, 0.3, -0.5];
    let energy = |s: &Bodies<f64, 3>| Dense::new(&m, masses, s).kinetic_energy();
    let first = energy(&s);
    for _ in 0..(2.0 / substep).round() as u32 {
        s = settle(advance(&m, &masses, &s, &kinematics(&m, &masses, &s), &still(), NONE));
    }
    energy(&s) / first - 1.0
}

#[test]
fn a_slider_on_a_free_base_keeps_its_energy() {
    let (coarse, fine) = (energy_error(5e-4), energy_error(2.5e-4));
    // Of first order: wrong accelerations would leave a rest at step zero.
    let rest = 2.0 * fine - coarse;
    assert!(fine.abs() < 2e-3 && rest.abs() < 1e-5, "energy off by {fine} at 0.25 ms, by {rest} at step zero");
}

#[test]
fn momentum_holds_with_joints_that_slide_in_contact() {
    let mut model = six_joints(2.5e-4, 2.0);
    (model.timing.substeps, model.timing.max_ticks) = (4, 2000);
    let before = model.base_pose.compose(Plant::new(model.clone()).tool_start);
    model.slides = vec![false, true, false, false, true, false];
    (model.start_angles[1], model.start_angles[4]) = (0.2, -0.1);
    model.base_pose = before.compose(Plant::new(model.clone()).tool_start.inverse());
    assert_momentum_in_contact(model);
}

fn still<const N: usize>() -> Actuation<f64, N> {
    Actuation { braked: 0.0, thrust: Vec3::zero(), torque: Vec3::zero(), joint: [0.0; N] }
}
