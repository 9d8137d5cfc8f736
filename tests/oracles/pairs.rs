//! Laws of material pairs: rebound at every speed, the depth ramp of a damper, a stop, several laws at one point.

use super::bench::{assert_close, at, closing, run, two_bodies};
use softdock_kernels::contact::{Point, PointState, contact_point, space_pair, space_pairs};
use softdock_kernels::fields::filled;
use softdock_kernels::frame::touch_points;
use softdock_kernels::material::Pair;
use softdock_kernels::model::{ContactPoint, MaterialPair, Model, NormalLaw, Shape, Solid};
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use softdock_kernels::space::{Motion, Parts};
use softdock_kernels::vector::{Quat, Vec3, vec3};

const STIFFNESS: f64 = 9e5;

/// A point of part A before the plane, with a law of its own.
fn with_pair(law: NormalLaw, properties: Pair<f64>) -> Model {
    let mut model = two_bodies(1e-5, 0.3, 1e-4);
    model.contact.pairs = vec![MaterialPair { points: vec![0], solids: vec![0], law, properties }];
    model.task.end_after_separation = 2e-3;
    model
}

fn pair() -> Pair<f64> {
    Pair { stiffness: STIFFNESS, stribeck_speed: 0.01, ..filled(0.0) }
}

/// Force of part A's point at a depth in the plane that grows at a rate.
fn force(law: NormalLaw, properties: Pair<f64>, depth: f64, rate: f64) -> f64 {
    let m = Plant::new(with_pair(law, properties));
    let state = PointState { approach: 0.2, ..filled(0.0) };
    let point = Point { position: Vec3::zero(), radius: 0.0 };
    let pair = space_pair(&m.pairs[0], &Params::null());
    contact_point(&m, &m.pairs[0], &pair, &parts(depth, rate), point, state).force
}

fn parts(depth: f64, rate: f64) -> Parts<f64> {
    let still =
        Motion { position: Vec3::zero(), velocity: Vec3::zero(), attitude: Quat::identity(), omega: Vec3::zero() };
    Parts { a: Motion { position: vec3(depth, 0.0, 0.0), velocity: vec3(rate, 0.0, 0.0), ..still }, b: still }
}

/// D of F = K d^n (1 + D d' / v) for a restitution: D (1 + e) = ln((1 + D) / (1 - e D)).
const EXACT: [(f64, f64); 4] = [(0.3, 3.087082), (0.5, 1.432_75), (0.8, 0.373_15), (0.95, 0.078_93)];

#[test]
fn rebound_law_returns_its_restitution_at_every_speed() {
    let slowest = 1e-3;
    for (restitution, factor) in EXACT {
        let residual = factor * (1.0 + restitution) - ((1.0 + factor) / (1.0 - restitution * factor)).ln();
        assert!(residual.abs() < 1e-4, "the table: {restitution}, {residual}");
        let model =
            with_pair(NormalLaw::Rebound { exponent: 1.5, slowest }, Pair { dissipation: factor / slowest, ..pair() });
        let speeds = [0.02, 0.1, 0.5];
        let runs = run(model, &speeds.map(|speed| closing(50.0, speed, 1.0, 0.0)));
        for (speed, row) in speeds.into_iter().zip(runs) {
            let energy = row.space.restitution * row.space.restitution;
            assert_close(&format!("e = {restitution} at {speed} m/s"), energy, restitution * restitution, 1e-2);
        }
    }
}

#[test]
fn touch_below_the_slowest_speed_is_damped_as_one_of_that_speed() {
    let properties = Pair { dissipation: 3.0, ..pair() };
    let rebound = force(NormalLaw::Rebound { exponent: 1.5, slowest: 0.4 }, properties, 1e-3, 0.1);
    let power = force(NormalLaw::Power { exponent: 1.5 }, properties, 1e-3, 0.1);
    assert_close("force", rebound, power, 1e-12);
}

#[test]
fn damping_of_the_impact_law_rises_with_depth() {
    let (law, properties) = (NormalLaw::Impact { exponent: 1.5, ramp: 2e-3 }, Pair { damping: 400.0, ..pair() });
    for (depth, share) in [(0.5e-3, 0.156_25), (1e-3, 0.5), (2e-3, 1.0), (5e-3, 1.0)] {
        let right = STIFFNESS * f64::powf(depth, 1.5) + share * 400.0 * 0.1;
        assert_close(&format!("{depth} m"), force(law, properties, depth, 0.1), right, 1e-12);
    }
    let touch = force(law, properties, 1e-9, 0.1);
    assert!(touch < 1e-4, "no jump of {touch} N at the touch");
}

#[test]
fn stop_adds_its_spring_beyond_the_stroke() {
    let law = NormalLaw::Stop { stroke: 2e-3, stiffness: 5e7, exponent: 1.5 };
    let properties = Pair { damping: 400.0, ..pair() };
    for (depth, stop) in [(1e-3, 0.0), (2e-3, 0.0), (3e-3, 5e7 * f64::powf(1e-3, 1.5))] {
        let right = STIFFNESS * depth + 400.0 * 0.1 + stop;
        assert_close(&format!("{depth} m"), force(law, properties, depth, 0.1), right, 1e-12);
    }
}

/// Two points and two planes: the common law, a pair of one point and both planes, a pair of one point and one plane.
#[test]
fn each_point_meets_each_solid_under_the_law_of_their_pair() {
    let plane = |x: f64| Solid { frame: at(x, 0.0, 0.0), shape: Shape::Plane };
    let row = |point: usize, solids: &[usize], stiffness: f64| MaterialPair {
        points: vec![point],
        solids: solids.to_vec(),
        law: NormalLaw::Linear,
        properties: Pair { stiffness, ..pair() },
    };
    let mut model = two_bodies(1e-5, 0.3, 1e-4);
    let point = model.contact.points[0];
    model.contact.points = vec![point, ContactPoint { position: vec3(0.0, 0.1, 0.0), radius: 0.0 }, point];
    // At x = 3 mm the points lie 3 mm in the first plane and 2 mm in the second.
    model.contact.solids = vec![plane(0.0), plane(1e-3)];
    model.contact.pairs = vec![row(1, &[0, 1], 1e4), row(2, &[1], 1e5)];
    let m = Plant::new(model);
    let params = Params { contact_stiffness: 1e3, ..Params::null() };
    let mut states = vec![filled(0.0); m.contacts.len()];
    let touch = touch_points(&m, &space_pairs(&m, &params), &parts(3e-3, 0.0), &mut states, true);
    // The union of the planes under one law has one depth; two laws at a point are two forces.
    let right = 1e3 * 3e-3 + 1e4 * 3e-3 + (1e3 * 3e-3 + 1e5 * 2e-3);
    assert_close("force", touch.wrench.force.norm(), right, 1e-12);
    assert_eq!(m.contacts.len(), 4);
}
