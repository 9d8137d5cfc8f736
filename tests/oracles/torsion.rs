//! Friction of a contact patch against spinning: M = 2/3 mu F a, stiction, and its share of the friction of sliding.

use super::bench::{assert_close, inertia, job, numbered, run, two_bodies};
use crate::gpu::gpu;
use softdock_engine::Engine;
use softdock_kernels::contact::space_pairs;
use softdock_kernels::fields::filled;
use softdock_kernels::frame::touch_points;
use softdock_kernels::model::Model;
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use softdock_kernels::space::{Motion, Parts, Wrench};
use softdock_kernels::vector::{Quat, Vec3, vec3};

/// Radius of the ball and of its patch \[m\], its mass \[kg\] and inertia \[kg m^2\].
const RADIUS: f64 = 0.05;
const PATCH: f64 = 6e-3;
const MASS: f64 = 2.0;
const INERTIA: f64 = 0.4 * MASS * RADIUS * RADIUS;

/// Load \[N\], friction, stiffness \[N/m\], greatest moment against spinning \[N m\].
const LOAD: f64 = 20.0;
const FRICTION: f64 = 0.3;
const STIFFNESS: f64 = 1e5;
const MOST: f64 = 2.0 / 3.0 * FRICTION * LOAD * PATCH;

const STEP: f64 = 1e-4;

/// A ball that the field presses on a plane, as deep as its spring holds it.
fn ball(time: f64) -> (Model, Params<f64>) {
    let mut model = two_bodies(STEP, time, RADIUS - LOAD / STIFFNESS);
    model.contact.a.points[0].radius = RADIUS;
    (model.contact.patch_radius, model.field) = (PATCH, vec3(LOAD / MASS, 0.0, 0.0));
    model.base_inertia = inertia(INERTIA, INERTIA, INERTIA);
    let params = Params {
        base_mass: MASS,
        target_mass: 5e3,
        contact_stiffness: STIFFNESS,
        contact_damping: 200.0,
        contact_friction: FRICTION,
        bristle_stiffness: 1e6,
        bristle_damping: 1e4,
        ..Params::null()
    };
    (model, params)
}

/// Wrenches on the ball at a constant depth, while a function moves it on from its velocity and rate.
fn pressed(steps: usize, mut motion: impl FnMut(&Wrench<f64>) -> (Vec3<f64>, Vec3<f64>)) -> Wrench<f64> {
    let (model, params) = ball(1.0);
    let m = Plant::new(model);
    let (pairs, mut states) = (space_pairs(&m, &params), vec![filled(0.0); m.contact_states()]);
    let still =
        Motion { position: Vec3::zero(), velocity: Vec3::zero(), attitude: Quat::identity(), omega: Vec3::zero() };
    let place = vec3(LOAD / STIFFNESS - RADIUS, 0.0, 0.0);
    let mut wrench = Wrench::zero();
    for _ in 0..steps {
        let (velocity, omega) = motion(&wrench);
        let a = Motion { position: place, velocity, omega, ..still };
        wrench = touch_points(&m, &pairs, &Parts { a, b: still }, &mut states, true).wrench;
    }
    wrench
}

#[test]
fn ball_that_spins_on_a_plane_stops_after_the_time_of_the_closed_form() {
    let first = 3.0;
    let (mut omega, mut lost, mut stopped) = (first, 0.0, None);
    let mut step = 0;
    pressed(40_000, |wrench| {
        let before = omega;
        omega += STEP * wrench.moment.x / INERTIA;
        lost -= STEP * wrench.moment.x * 0.5 * (before + omega);
        if omega <= 0.0 && stopped.is_none() {
            stopped = Some(STEP * f64::from(step));
        }
        step += 1;
        (Vec3::zero(), vec3(omega, 0.0, 0.0))
    });
    assert_close("time", stopped.expect("it stops"), INERTIA * first / MOST, 5e-3);
    // All its energy is dissipated, and it stands.
    assert_close("energy", lost, 0.5 * INERTIA * first * first, 1e-6);
    assert!(omega.abs() < 1e-9, "{omega} rad/s");
}

#[test]
fn patch_holds_a_moment_below_its_bound_and_no_larger_one() {
    let turned = |share: f64| {
        let (mut angle, mut omega, mut held, mut step) = (0.0, 0.0, 0.0, 0);
        // The moment rises slowly, then stays.
        pressed(40_000, |wrench| {
            let rising = (f64::from(step) / 20_000.0).min(1.0);
            omega += STEP * (wrench.moment.x + share * MOST * rising) / INERTIA;
            angle += STEP * omega;
            if step == 25_000 {
                held = angle;
            }
            step += 1;
            (Vec3::zero(), vec3(omega, 0.0, 0.0))
        });
        angle - held
    };
    let (below, above) = (turned(0.98), turned(1.02));
    assert!(below.abs() < 1e-9, "below the bound it turns by {below} rad");
    // 2 % too much for 1.5 s.
    let free = 0.5 * 0.02 * MOST / INERTIA * 1.5 * 1.5;
    assert!(above > free, "above the bound it turns by {above} rad, {free} rad from rest");
}

#[test]
fn sliding_and_spinning_share_the_friction_of_an_ellipsoid() {
    let lever = 2.0 / 3.0 * PATCH;
    for (slide, spin) in [(0.01, 0.0), (0.0, 2.0), (0.01, 2.0), (0.003, -2.0)] {
        // The contact point slides along y at this speed, without the ball rolling.
        let wrench = pressed(20_000, |_| (vec3(0.0, slide, 0.0), vec3(spin, 0.0, 0.0)));
        let (force, moment) = (wrench.force.y / (FRICTION * LOAD), wrench.moment.x / MOST);
        assert_close(&format!("{slide} m/s, {spin} rad/s"), force.hypot(moment), 1.0, 1e-9);
        let speed = f64::hypot(slide, lever * spin);
        assert!((force + slide / speed).abs() < 1e-6, "{slide} m/s, {spin} rad/s: {force}");
        assert!((moment + lever * spin / speed).abs() < 1e-6, "{slide} m/s, {spin} rad/s: {moment}");
    }
}

/// Whole runs, both bodies free: the moment of the closed form, in f64 and on a GPU; momenta and energy as they should be.
#[test]
fn spinning_ball_keeps_the_momenta_of_a_run_on_lanes_and_on_a_gpu() {
    let (model, params) = ball(0.5);
    let runs =
        [0.0, 0.5].map(|slide| Params { chaser_rate: vec3(5.0, 0.0, 0.0), drift: vec3(0.0, slide, 0.0), ..params });
    let single = gpu().run(&job(model.clone(), &runs), &numbered(&runs), &|_| true).expect("the batch ends");
    let double = run(model.clone(), &runs);
    for rows in [&double, &single] {
        assert!(rows.iter().all(|row| row.flags == 0), "{:?}", rows.iter().map(|row| row.flags).collect::<Vec<_>>());
        assert_close("moment", rows[0].space.peak_contact_moment, MOST, 1e-2);
    }
    for row in &double {
        assert!(row.space.angular_momentum_error < 1e-9, "{}", row.space.angular_momentum_error);
        assert!(row.space.linear_momentum_error < 1e-9, "{}", row.space.linear_momentum_error);
    }
    // Without a patch a ball has no such moment.
    let mut point = model;
    point.contact.patch_radius = 0.0;
    assert!(run(point, &runs)[0].space.peak_contact_moment < 1e-12);
}
