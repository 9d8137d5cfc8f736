//! A peg in a bore: where it jams under force and moment, and where it wedges without any.
//!
//! Peg of radius r and diameter d at depth l in a bore of diameter D, friction mu, lambda = l / (2 r mu); lateral force
//! and moment at the centre of the peg's tip. Whitney, ASME J. Dynamic Systems, Measurement and Control 104 (1982) 65.

use super::bench::{at, inertia, two_bodies};
use softdock_kernels::contact::distance::union_distance;
use softdock_kernels::contact::{PointState, space_pairs};
use softdock_kernels::fields::filled;
use softdock_kernels::frame::touch_points;
use softdock_kernels::model::{ContactPoint, Shape};
use softdock_kernels::monitor::Touch;
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use softdock_kernels::space::{Actuation, Bodies, advance, kinematics, settle, space_masses};
use softdock_kernels::start::start;
use softdock_kernels::vector::{Vec3, vec3};

/// Radius of the peg \[m\] and friction coefficient.
const RADIUS: f64 = 0.02;
const FRICTION: f64 = 0.2;

/// A peg of 1 kg with the given contact points in a bore that cannot move.
struct Peg {
    plant: Plant,
    params: Params<f64>,
    bodies: Bodies<f64, 0>,
    states: Vec<PointState<f64>>,
}

impl Peg {
    /// The tip's centre 50 mm deep; contact points by distance behind the tip and by side.
    fn new(bore: f64, places: &[(f64, f64)]) -> Self {
        let mut model = two_bodies(2.5e-5, 1.0, 0.0);
        model.base_pose = at(0.05, 0.0, 0.0);
        model.base_inertia = inertia(1e-3, 1e-3, 1e-3);
        model.contact.b.solids[0].shape = Shape::Bore { radius: bore, depth: 10.0, chamfer: 0.0, points: 0 };
        model.contact.a.points =
            places.iter().map(|(x, y)| ContactPoint { position: vec3(-x, *y, 0.0), radius: 0.0 }).collect();
        let params = Params {
            target_mass: 1e9,
            target_inertia_scale: 1e9,
            contact_stiffness: 1e6,
            contact_damping: 500.0,
            contact_friction: FRICTION,
            bristle_stiffness: 1e6,
            bristle_damping: 500.0,
            ..Params::null()
        };
        let plant = Plant::new(model);
        let bodies = start::<f64, 0>(&plant, &params, &space_masses(&params));
        Self { states: vec![filled(0.0); places.len()], plant, params, bodies }
    }

    /// One substep under a force at the tip's centre and a moment about z; gives what the bore did.
    fn step(&mut self, force: Vec3<f64>, moment: f64) -> Touch<f64> {
        let (m, masses) = (&self.plant, space_masses(&self.params));
        let k = kinematics(m, &masses, &self.bodies);
        let touch = touch_points(m, &space_pairs(m, &self.params), &k.parts, &mut self.states, true);
        let u = Actuation { braked: 0.0, thrust: force, torque: vec3(0.0, 0.0, moment), joint: [] };
        self.bodies = settle(advance(m, &masses, &self.bodies, &k, &u, touch.wrench));
        touch
    }
}

/// How far a peg on two contacts 20 mm apart moves under 10 N, a lateral force and a moment, once it has two contacts.
fn inserted(lateral: f64, moment: f64) -> f64 {
    let length = 0.02;
    let mut peg = Peg::new(RADIUS + 1e-5, &[(0.0, RADIUS), (0.0, -RADIUS), (length, RADIUS), (length, -RADIUS)]);
    let mut held = 0.0;
    for step in 0..24_000 {
        if step == 10_000 {
            held = peg.bodies.chaser.com.x;
        }
        // The moment first, so that the peg has its two contacts before it is pushed.
        let push = if step < 4000 { Vec3::zero() } else { vec3(10.0, lateral, 0.0) };
        peg.step(push, moment);
    }
    peg.bodies.chaser.com.x - held
}

#[test]
fn peg_on_two_points_jams_as_in_the_diagram() {
    // M / (r F) + mu (1 + lambda) F_lateral / F = +- lambda, with lambda = l / (2 r mu) = 2.5 and r F = 0.2 N m.
    for lateral in [0.0, 10.0, -5.0] {
        for sign in [-1.0, 1.0] {
            let bound = 0.2 * (sign * 2.5 - FRICTION * 3.5 * lateral / 10.0);
            let (jams, slides) = (inserted(lateral, 1.02 * bound), inserted(lateral, 0.98 * bound));
            // At least 0.12 N too much push 1 kg by more than 5 mm in the last 0.35 s.
            assert!(jams.abs() < 1e-6, "{lateral} N aside: jams at {bound} N m, yet moves {jams} m");
            assert!(slides > 5e-3, "{lateral} N aside: slides at {bound} N m, yet moves {slides} m");
        }
    }
}

#[test]
fn a_squeezed_peg_stays_wedged_only_within_the_friction_cones() {
    // Two opposite contacts pressed in by 10 um: each cone contains their chord if l <= mu d = 8 mm.
    let left = |length: f64| {
        let mut peg = Peg::new(RADIUS - 1e-5, &[(-0.5 * length, RADIUS), (0.5 * length, -RADIUS)]);
        // The cone is that of Coulomb's friction: stiff before it slips.
        (peg.params.bristle_stiffness, peg.params.bristle_damping) = (2e7, 2000.0);
        (0..20_000).map(|_| peg.step(Vec3::zero(), 0.0).force).last().expect("a step")
    };
    let (short, long) = (left(0.00784), left(0.00816));
    assert!(short > 0.5, "7.84 mm: wedged, yet only {short} N hold");
    assert!(long < 1e-3, "8.16 mm: free, yet {long} N hold");
}

/// Inserted length \[m\] at which a tilted peg first touches twice: its tip's edge inside, its flank at the mouth.
///
/// The length counts along the flank from the tip to the mouth.
fn two_point_length(peg: f64, bore: f64, tilt: f64) -> f64 {
    let mut model = two_bodies(1e-3, 1.0, 0.0);
    model.contact.b.solids[0].shape = Shape::Bore { radius: bore, depth: 10.0, chamfer: 0.0, points: 0 };
    let m = Plant::new(model);
    let (along, across) = (vec3(tilt.cos(), tilt.sin(), 0.0), vec3(-tilt.sin(), tilt.cos(), 0.0));
    let clearance = |depth: f64| {
        // The leading edge lies against the wall; the other flank runs out through the mouth.
        let edge = vec3(depth, bore, 0.0);
        assert!(union_distance(&m.solids[1], edge).distance.abs() < 1e-12);
        let flank = |back: f64| union_distance(&m.solids[1], edge - across * (2.0 * peg) - along * back).distance;
        (0..=4000).map(|i| flank(2.0 * depth * f64::from(i) / 4000.0)).fold(f64::INFINITY, f64::min)
    };
    let (mut free, mut pressed) = (1e-3, 0.2);
    while pressed - free > 1e-6 {
        let middle = 0.5 * (free + pressed);
        *(if clearance(middle) > 0.0 { &mut free } else { &mut pressed }) = middle;
    }
    (pressed + 2.0 * peg * tilt.sin()) / tilt.cos()
}

#[test]
fn tilted_peg_has_two_contacts_as_in_the_geometry() {
    // D = 50 mm, clearance ratio 0.002: l = (D - d cos t) / sin t.
    let (bore, peg) = (0.025, 0.025 * 0.998);
    for (tilt, exact) in [(0.3f64.to_radians(), 0.0192), (0.01, 0.2 * 2.0 * peg)] {
        let formula = 2.0 * (bore - peg * tilt.cos()) / tilt.sin();
        let found = two_point_length(peg, bore, tilt);
        assert!((formula - exact).abs() < 0.03 * exact, "the formula gives {formula} m");
        assert!((found - formula).abs() < 1e-3 * formula, "{found} m and not {formula} m at {tilt} rad");
    }
}
