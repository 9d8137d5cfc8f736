//! Axial transforms against what rotations and levers say of any body, with constants that are zero or one and others.

use super::dynamics::turning_moment;
use super::inertia::{Articulated, Force, Rigid};
use super::*;
use crate::philox;

fn number(index: u32) -> f64 {
    2.0 * philox::uniform(7, "chain", 0, index) - 1.0
}

fn vector(first: u32) -> Vec3<f64> {
    vec3(number(first), number(first + 1), number(first + 2))
}

/// A positive definite tensor without any symmetry.
fn tensor(first: u32) -> Sym3<f64> {
    let v = vector(first);
    Sym3::diagonal(vec3(3.0, 4.0, 5.0)).plus_outer(v, v)
}

/// Links of every kind: no turn, quarter turns, a half turn and another one, with shifts along any axes.
fn links() -> Vec<ChainLink> {
    let quarter = std::f64::consts::FRAC_PI_2;
    let shifts = [[0.0; 3], [0.3, 0.0, 0.0], [0.0, -0.2, 0.0], [0.0, 0.0, 0.7], [0.4, 0.0, -0.1], [0.3, -0.2, 0.5]];
    let link = |angle: f64, [x, y, z]: [f64; 3]| ChainLink {
        slides: false,
        origin: vec3(x, y, z),
        tilt: Turn::of_angle(angle),
        half_tilt: Turn::of_angle(0.5 * angle),
        start_angle: 0.0,
        start_turn: Turn::of_angle(0.0),
        mass: 2.0,
        com: Vec3::zero(),
        moments: tensor(0),
        inertia: tensor(0),
    };
    let angles = [0.0, quarter, -quarter, 2.0 * quarter, 0.6];
    angles.into_iter().flat_map(|angle| shifts.map(|shift| link(angle, shift))).collect()
}

/// The motion of a link's origin and axes, in them, when the inner link moves so.
fn carried(link: &ChainLink, turn: Turn<f64>, rate: Vec3<f64>, velocity: Vec3<f64>) -> (Vec3<f64>, Vec3<f64>) {
    let (c, s) = (link.tilt.cos, link.tilt.sin);
    let tilt = Mat3 { x: vec3(1.0, 0.0, 0.0), y: vec3(0.0, c, s), z: vec3(0.0, -s, c) };
    let (c, s) = (turn.cos, turn.sin);
    let spin = Mat3 { x: vec3(c, s, 0.0), y: vec3(-s, c, 0.0), z: vec3(0.0, 0.0, 1.0) };
    let axes = tilt.compose(spin);
    (axes.transposed_times(rate), axes.transposed_times(velocity + rate.cross(link.origin)))
}

fn near(a: f64, b: f64) {
    assert!((a - b).abs() < 1e-12 * (1.0 + a.abs()), "{a} and {b}");
}

#[test]
fn vectors_turn_by_the_rotation_between_the_links() {
    let turn = Turn::of_angle(0.8);
    for link in links() {
        let v = vector(3);
        let (outer, _) = carried(&link, turn, v, Vec3::zero());
        near((link.outwards(turn, v) - outer).norm(), 0.0);
        near((link.inwards(turn, outer) - v).norm(), 0.0);
    }
}

#[test]
fn inertias_have_the_same_energy_seen_from_either_link() {
    let turn = Turn::of_angle(-1.1);
    let (rate, velocity) = (vector(10), vector(13));
    let energy = |body: &Articulated<f64>, w: Vec3<f64>, v: Vec3<f64>| {
        0.5 * (body.rotation.times(w).dot(w) + body.translation.times(v).dot(v)) + body.coupling.times(w).dot(v)
    };
    let rigid = |mass: f64, body: &Rigid<f64>, w: Vec3<f64>, v: Vec3<f64>| {
        0.5 * (body.inertia.times(w).dot(w) + mass * v.dot(v)) + w.cross(body.first).dot(v)
    };
    let coupling = Mat3 { x: vector(20), y: vector(23), z: vector(26) };
    let body = Articulated { rotation: tensor(30), coupling, translation: tensor(33) };
    let (mass, piece) = (2.5, Rigid { first: vector(36), inertia: tensor(39) });
    for link in links() {
        let (w, v) = carried(&link, turn, rate, velocity);
        near(energy(&body.inwards_geared(Force::zero(), &link, turn), rate, velocity), energy(&body, w, v));
        near(rigid(mass, &piece.inwards(&link, turn, mass), rate, velocity), rigid(mass, &piece, w, v));
    }
}

#[test]
fn a_free_joint_passes_nothing_on_about_its_axis() {
    let turn = Turn::of_angle(0.4);
    let coupling = Mat3 { x: vector(50), y: vector(53), z: vector(56) };
    let body = Articulated { rotation: tensor(60), coupling, translation: tensor(63) };
    let resistance = body.about_z();
    let inverse = -1.0 / resistance.moment.z;
    let give = Force { moment: resistance.moment * inverse, force: resistance.force * inverse };
    for link in links() {
        // Two ways to the same inertia: the one that knows that nothing resists about z, and the one that does not.
        let (free, geared) = (body.inwards(give, &link, turn), body.inwards_geared(give, &link, turn));
        let (w, v) = (vector(70), vector(73));
        near((free.rotation.times(w) - geared.rotation.times(w)).norm(), 0.0);
        near((free.coupling.times(w) - geared.coupling.times(w)).norm(), 0.0);
        near((free.translation.times(v) - geared.translation.times(v)).norm(), 0.0);
    }
}

#[test]
fn a_turning_body_resists_by_eulers_equation() {
    let (rate, gain) = (vector(80), vector(83));
    let course = dynamics::Course { rate, turning: gain, acceleration: Vec3::zero() };
    let diagonal = Sym3::diagonal(vec3(0.3, 0.5, 0.9));
    for moments in [diagonal, tensor(86)] {
        // Inertia from second moments: trace less the moments.
        let trace = moments.xx + moments.yy + moments.zz;
        let inertia = Sym3::diagonal(Vec3::splat(trace)).zip(moments, |a, b| a - b);
        let expected = inertia.times(gain) + rate.cross(inertia.times(rate));
        near((turning_moment(&course.field(), moments) - expected).norm(), 0.0);
    }
}
