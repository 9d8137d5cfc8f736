//! A peg in a bore: where it jams under force and moment, and where it wedges without any.
//!
//! Peg of radius r and diameter d at depth l in a bore of diameter D, friction mu, lambda = l / (2 r mu); lateral force
//! and moment at the centre of the peg's tip. Whitney, ASME J. Dynamic Systems, Measurement and Control 104 (1982) 65.

use super::bench::{at, closing, inertia, job, numbered, run, two_bodies};
use crate::gpu::gpu;
use softdock_campaign::criteria::first_breach;
use softdock_engine::Engine;
use softdock_kernels::contact::distance::union_distance;
use softdock_kernels::contact::{PointState, space_pairs};
use softdock_kernels::fields::filled;
use softdock_kernels::frame::touch_points;
use softdock_kernels::model::{ContactPoint, Model, PartShape, Shape, Solid, Timing};
use softdock_kernels::monitor::Touch;
use softdock_kernels::outcome::Finished;
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use softdock_kernels::space::{Actuation, Bodies, advance, kinematics, settle, space_masses};
use softdock_kernels::start::start;
use softdock_kernels::vector::{Vec3, vec3};
use std::path::Path;

/// Radius of the peg \[m\] and friction coefficient.
const RADIUS: f64 = 0.02;
const FRICTION: f64 = 0.2;

/// lambda of a length of 20 mm.
const LAMBDA: f64 = 2.5;

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

/// The vertices of the diagram (F_lateral / F, M / (r F)): one contact takes the whole load there.
fn vertices() -> [[f64; 2]; 4] {
    let (steep, far) = (1.0 / FRICTION, 2.0 * LAMBDA + 1.0);
    [[steep, -far], [-steep, 1.0], [steep, -1.0], [-steep, far]]
}

#[test]
fn peg_jams_at_the_four_vertices_of_the_diagram() {
    for [lateral, moment] in vertices() {
        let at = |share: f64| inserted(10.0 * lateral * share, 0.2 * moment * share);
        let (jams, slides) = (at(1.02), at(0.98));
        assert!(jams.abs() < 1e-6, "({lateral}, {moment}): jams, yet moves {jams} m");
        assert!(slides > 5e-3, "({lateral}, {moment}): slides, yet moves {slides} m");
    }
}

/// Runs on lanes in f64 and on a GPU in f32.
fn on_both(model: Model, runs: &[Params<f64>]) -> [Vec<Finished>; 2] {
    let (job, inputs) = (job(model.clone(), runs), numbered(runs));
    let single = gpu().run(&job, &inputs, &|_| true).expect("the batch ends");
    [run(model, runs), single]
}

/// Pushed at its centre of mass: the field gives the force, the place of the centre the moment. The friction differs.
#[test]
fn peg_jams_as_in_the_diagram_on_lanes_and_on_a_gpu() {
    let [first, second, third, fourth] = vertices();
    for [lateral, moment] in softdock_test_size::first(1, [first, second, third, fourth]) {
        let places = [(0.0, RADIUS), (0.0, -RADIUS), (0.02, RADIUS), (0.02, -RADIUS)];
        let Peg { plant, params, .. } = Peg::new(RADIUS + 1e-5, &places);
        let mut model = (*plant).clone();
        // 10 N on 1 kg. The tip is before the centre of mass, so that the push aside has a moment about it.
        let before = -RADIUS * moment / lateral;
        (model.tool, model.base_pose) = (at(before, 0.0, 0.0), at(0.05 - before, 0.0, 0.0));
        (model.field, model.base_inertia) = (vec3(10.0, 10.0 * lateral, 0.0), inertia(5e-3, 5e-3, 5e-3));
        model.timing = Timing { substep: 1e-4, substeps: 1, max_ticks: 15_000 };
        let runs = [1.02, 0.98].map(|share| Params { contact_friction: share * FRICTION, ..params });
        for rows in on_both(model, &runs) {
            let [jams, slides] = [0, 1].map(|run: usize| rows[run].space.insertion - 0.05);
            // At least 0.1 N too much push 1 kg by 0.1 m in 1.5 s; before it jams, the peg falls against the wall.
            assert!(jams < 0.02, "({lateral}, {moment}): jams, yet moves {jams} m");
            assert!(slides > 0.05, "({lateral}, {moment}): slides, yet moves {slides} m");
        }
    }
}

/// The tilt, and l = mu d 2 % apart on both sides, in the shipped scenario, whose bristles are stiffer here.
#[test]
fn squeezed_peg_wedges_at_the_angle_of_the_closed_form_on_lanes_and_on_a_gpu() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("campaigns/scenarios/wedging.toml");
    let scenario = softdock_campaign::load_scenario(&path).expect("a shipped scenario loads");
    let mut model = scenario.model;
    model.timing = Timing { substep: 5e-5, substeps: 4, max_ticks: 5000 };
    let (peg, bore, squeeze) = (0.02, 0.0201, 2e-6);
    let case = |(tilt, share): (f64, f64)| {
        let (sine, cosine) = tilt.sin_cos();
        let edge = (bore * cosine - peg + squeeze) / sine;
        let length = edge * cosine + bore * sine;
        Params {
            tilt: vec3(0.0, 0.0, tilt),
            offset: vec3(edge + 0.5 * peg * sine - 0.01, 0.5 * (bore + squeeze - peg * cosine), 0.0),
            contact_friction: share * length / peg,
            bristle_stiffness: 2e8,
            bristle_damping: 1e4,
            ..model.nominal
        }
    };
    let cases = [(0.01, 0.98), (0.01, 1.02), (0.016, 0.98), (0.016, 1.02)];
    for rows in on_both(model.clone(), &cases.map(case)) {
        for (row, (tilt, share)) in rows.iter().zip(cases) {
            let breach = first_breach(&model.task, &row.space).map(|(criterion, _)| criterion.id);
            let wedges = share > 1.0;
            assert_eq!(breach == Some("wedge"), wedges, "{tilt} rad, {share} of mu: {breach:?}, {:?}", row.space);
        }
    }
}

/// The tip's edge slides along the wall until the flank meets the mouth.
#[test]
fn peg_meets_the_mouth_at_the_two_point_depth_on_lanes_and_on_a_gpu() {
    let (bore, peg, speed, first, beside) = (0.05, 0.0499, 0.02, 5e-3, 1e-7);
    let timing = Timing { substep: 5e-4, substeps: 1, max_ticks: 4000 };
    let mut model = Model::two_bodies(timing, 0.0);
    let solid = |shape, x: f64| vec![Solid { frame: at(x, 0.0, 0.0), shape }];
    let cylinder = Shape::Cylinder { radius: 0.5 * peg, length: 0.2, points: 8 };
    model.contact.a = PartShape { points: Vec::new(), solids: solid(cylinder, -0.1) };
    let hole = Shape::Bore { radius: 0.5 * bore, depth: 0.3, chamfer: 0.0, points: 8 };
    model.contact.b = PartShape { points: Vec::new(), solids: solid(hole, 0.0) };
    let tilts = [0.3f64.to_radians(), 0.01, 0.015];
    let start = |tilt: f64| {
        let (sine, cosine) = tilt.sin_cos();
        // The middle of the tip, whose edge is `first` deep and `beside` the wall.
        let offset = vec3(first + 0.5 * peg * sine, 0.5 * (bore - peg * cosine) - beside, 0.0);
        Params { offset, tilt: vec3(0.0, 0.0, tilt), base_inertia_scale: 1e6, ..closing(1.0, speed, 1e4, 0.0) }
    };
    for rows in on_both(model, &tilts.map(start)) {
        for (row, tilt) in rows.iter().zip(tilts) {
            let (sine, cosine) = tilt.sin_cos();
            let found = first + speed * row.space.touch_time;
            // From the depth of the edge to the length along the flank: l = (D - d cos t) / sin t.
            let length = found * cosine + (bore - beside) * sine;
            let formula = (bore - peg * cosine) / sine;
            assert!((length / formula - 1.0).abs() < 0.01, "{tilt} rad: {length} m for {formula} m");
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
