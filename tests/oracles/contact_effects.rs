//! Effects of the mounted parts against the laws that they must follow.

use super::bench::{assert_close, closing, run, two_bodies};
use softdock_kernels::contact::{Point, PointContact, PointState, contact_point, hil_pair, space_pair};
use softdock_kernels::fields::filled;
use softdock_kernels::material::Pair;
use softdock_kernels::model::NormalLaw;
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use softdock_kernels::space::{Motion, Parts};
use softdock_kernels::vector::{Quat, Vec3, vec3};
use std::f64::consts::PI;

const STIFFNESS: f64 = 2e5;

fn plant(law: NormalLaw) -> Plant {
    let mut model = two_bodies(1e-4, 1.0, 0.0);
    model.contact.law = law;
    Plant::new(model)
}

fn params() -> Params<f64> {
    Params {
        contact_stiffness: STIFFNESS,
        contact_friction: 0.2,
        bristle_stiffness: 1e5,
        bristle_damping: 50.0,
        ..Params::null()
    }
}

/// A point of part A at a depth in the plane, moving along it.
fn parts(depth: f64, velocity: Vec3<f64>) -> Parts<f64> {
    let at = |position, velocity| Motion { position, velocity, attitude: Quat::identity(), omega: Vec3::zero() };
    Parts { a: at(vec3(depth, 0.0, 0.0), velocity), b: at(Vec3::zero(), Vec3::zero()) }
}

const POINT: Point<f64> = Point { position: Vec3 { x: 0.0, y: 0.0, z: 0.0 }, radius: 0.0, share: 1.0 };

fn touched(m: &Plant, pair: &Pair<f64>, parts: &Parts<f64>, state: PointState<f64>) -> PointContact<f64> {
    contact_point(m, &m.pairs[0], pair, parts, POINT, state)
}

/// Normal force of the mounted parts at rest, and of those in space.
fn pressed(m: &Plant, p: &Params<f64>, depth: f64) -> [f64; 2] {
    let of = &m.pairs[0];
    [hil_pair(of, p), space_pair(of, p)].map(|pair| touched(m, &pair, &parts(depth, Vec3::zero()), filled(0.0)).force)
}

/// The contact after sliding on at a velocity until the bristle is complete.
fn slid(p: &Params<f64>, velocity: Vec3<f64>) -> PointContact<f64> {
    let (m, parts) = (plant(NormalLaw::Linear), parts(1e-3, velocity));
    let pair = hil_pair(&m.pairs[0], p);
    let mut contact = touched(&m, &pair, &parts, filled(0.0));
    (0..20_000).for_each(|_| contact = touched(&m, &pair, &parts, contact.state));
    contact
}

#[test]
fn an_error_of_the_exponent_bends_the_force_about_a_depth_of_a_millimetre() {
    for (law, n) in [(NormalLaw::Linear, 1.0), (NormalLaw::Power { exponent: 1.5 }, 1.5)] {
        let (m, p) = (plant(law), Params { contact_exponent_error: 0.3, ..params() });
        for depth in [1e-5, 4e-4, 1e-3, 3e-3] {
            let right = STIFFNESS * f64::powf(depth, n);
            let [hil, space] = pressed(&m, &p, depth);
            assert_close("on the facility", hil, right * (depth / 1e-3).powf(0.3), 1e-12);
            assert_close("in space", space, right, 1e-12);
        }
    }
}

#[test]
fn friction_of_the_mounted_parts_falls_with_the_sliding_speed() {
    let (share, scale) = (0.5, 0.02);
    let p = Params { contact_stribeck: share, contact_stribeck_speed: scale, ..params() };
    for speed in [1e-3, 0.02, 0.1] {
        let contact = slid(&p, vec3(0.0, 0.6, -0.8) * speed);
        let expected = 0.2 * (1.0 + share * f64::exp(-speed / scale)) * contact.force;
        let Vec3 { y, z, .. } = contact.wrench.force;
        assert_close("friction", y.hypot(z), expected, 1e-9);
        assert!(y < 0.0 && z > 0.0, "against the slip: {y} {z}");
    }
}

#[test]
fn friction_of_the_mounted_parts_goes_with_twice_the_angle_from_part_bs_y_axis() {
    let p = Params { contact_anisotropy: 0.25, ..params() };
    for angle in [0.0, PI / 6.0, PI / 4.0, PI / 2.0, PI] {
        let contact = slid(&p, vec3(0.0, angle.cos(), angle.sin()) * 0.05);
        let force = contact.wrench.force;
        let expected = 0.2 * (1.0 + 0.25 * (2.0 * angle).cos()) * contact.force;
        assert_close("friction", force.y.hypot(force.z), expected, 1e-9);
    }
}

#[test]
fn adhesive_parts_separate_at_the_stated_force() {
    for (law, n) in [(NormalLaw::Linear, 1.0), (NormalLaw::Power { exponent: 1.5 }, 1.5)] {
        let (m, p) = (plant(law), Params { contact_adhesion: 4.0, ..params() });
        let reach = f64::powf(4.0 / STIFFNESS, 1.0 / n);
        for (share, pulls) in [(0.2, true), (0.999, true), (1.001, false), (10.0, false)] {
            let [hil, space] = pressed(&m, &p, -share * reach);
            let expected = if pulls { -4.0 * f64::powf(share, n) } else { 0.0 };
            assert!((hil - expected).abs() < 1e-9, "{hil} N at {share} of the reach instead of {expected} N");
            assert_eq!(space, 0.0, "the true parts do not adhere");
        }
    }
}

/// A spring and damper that adheres: half a period of damped oscillation between two steps of a potential.
#[test]
fn adhesive_bounce_loses_the_separation_energy_or_sticks() {
    let (mass, speed, stiffness, zeta): (f64, f64, f64, f64) = (50.0, 0.1, 5e4, 0.2);
    let damping = 2.0 * zeta * (mass * stiffness).sqrt();
    let e = (-PI * zeta / (1.0 - zeta * zeta).sqrt()).exp();
    let mut model = two_bodies(1e-5, 0.5, 3e-3);
    model.task.end_after_separation = 2e-2;
    let hil = |share: f64| {
        let contact_adhesion = share * speed * (mass * stiffness).sqrt();
        let params = Params { contact_adhesion, ..closing(mass, speed, stiffness, damping) };
        run(model.clone(), &[params])[0].hil
    };
    // The step of the potential is A^2 / 2k; it speeds the approach up and slows the parting down.
    for share in [0.25, 0.4] {
        let expected = (e * e * (1.0 + share * share) - share * share).sqrt() * speed;
        assert_close("speed of parting", hil(share).separation_speed, expected, 5e-3);
    }
    let stuck = hil(0.8);
    assert!(stuck.separation_speed.abs() < 0.3 * speed, "{}", stuck.separation_speed);
    assert!(stuck.contact_duration > 0.4, "parted after {} s", stuck.contact_duration);
}
