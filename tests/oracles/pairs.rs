//! Laws of material pairs: rebound at every speed, the depth ramp of a damper, a stop, several laws at one point.

use super::bench::{assert_close, at, closing, job, run, two_bodies};
use softdock_engine::RunInput;
use softdock_engine::cpu::replay;
use softdock_kernels::contact::{Point, PointState, contact_point, space_pair, space_pairs};
use softdock_kernels::fields::filled;
use softdock_kernels::frame::touch_points;
use softdock_kernels::material::Pair;
use softdock_kernels::metrics::flags;
use softdock_kernels::model::{ContactPoint, MaterialPair, Members, Model, NormalLaw, Shape, Solid};
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use softdock_kernels::space::{Motion, Parts};
use softdock_kernels::vector::{Pose, Quat, Vec3, vec3};
use softdock_test_size::first;
use std::f64::consts::PI;

const STIFFNESS: f64 = 9e5;

fn members(points: &[usize], solids: &[usize]) -> Members {
    Members { points: points.to_vec(), solids: solids.to_vec() }
}

/// A point of part A before the plane, with its own contact law.
fn with_pair(law: NormalLaw, properties: Pair<f64>) -> Model {
    let mut model = two_bodies(1e-5, 0.3, 1e-4);
    model.contact.pairs =
        vec![MaterialPair { a: members(&[0], &[]), b: members(&[], &[0]), law, properties, patch_radius: 0.0 }];
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
    let point = Point { position: Vec3::zero(), radius: 0.0, share: 1.0 };
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
        a: members(&[point], &[]),
        b: members(&[], solids),
        law: NormalLaw::Linear,
        properties: Pair { stiffness, ..pair() },
        patch_radius: 0.0,
    };
    let mut model = two_bodies(1e-5, 0.3, 1e-4);
    let point = model.contact.a.points[0];
    model.contact.a.points = vec![point, ContactPoint { position: vec3(0.0, 0.1, 0.0), radius: 0.0 }, point];
    // At x = 3 mm the points lie 3 mm in the first plane and 2 mm in the second.
    model.contact.b.solids = vec![plane(0.0), plane(1e-3)];
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

/// The sphere as part A before the plane, and the plane as part A before the sphere: the same contact seen from either
/// part. The frames are turned and off their bodies, so that levers and axes count.
#[test]
fn contact_is_the_same_with_the_parts_exchanged() {
    let turn = |x: f64, y: f64, z: f64| Quat::from_rotation_vector(vec3(x, y, z));
    let sphere = Solid { frame: at(0.02, 0.03, -0.01), shape: Shape::Sphere { radius: 0.1 } };
    let wall = Solid { frame: Pose { position: Vec3::zero(), attitude: turn(0.1, 0.2, 0.3) }, shape: Shape::Plane };
    let moving = |x: f64, attitude: Quat<f64>, velocity: Vec3<f64>, omega: Vec3<f64>| Motion {
        position: vec3(x, 0.05, -0.02),
        velocity,
        attitude,
        omega,
    };
    let ball = moving(-0.095, turn(0.3, -0.2, 0.1), vec3(0.1, 0.02, 0.0), vec3(0.1, -0.4, 0.2));
    let plate = moving(0.0, turn(-0.05, 0.1, 0.0), vec3(-0.05, 0.0, 0.01), vec3(-0.2, 0.1, 0.3));
    let wrench = |a: &Solid, b: &Solid, parts: &Parts<f64>| {
        let mut model = two_bodies(1e-4, 0.3, 1e-4);
        (model.contact.a.points, model.contact.a.solids, model.contact.b.solids) =
            (Vec::new(), vec![a.clone()], vec![b.clone()]);
        let m = Plant::new(model);
        assert_eq!(m.contacts.len(), 1);
        let params = Params {
            contact_stiffness: 1e4,
            contact_damping: 30.0,
            contact_friction: 0.3,
            bristle_stiffness: 1e4,
            bristle_damping: 5.0,
            ..Params::null()
        };
        let mut states = vec![filled(0.0); m.contacts.len()];
        let touch = (0..50).map(|_| touch_points(&m, &space_pairs(&m, &params), parts, &mut states, true)).last();
        touch.expect("fifty substeps").wrench
    };
    let first = wrench(&sphere, &wall, &Parts { a: ball, b: plate });
    // Exchanged: what acts on part A now is the reaction, about the origin of the other part.
    let second = wrench(&wall, &sphere, &Parts { a: plate, b: ball });
    assert!(first.force.norm() > 10.0, "they touch");
    let lever = ball.position - plate.position;
    let moment = -(first.moment + lever.cross(first.force));
    assert!((first.force + second.force).norm() < 1e-12 * first.force.norm(), "{first:?} {second:?}");
    assert!((second.moment - moment).norm() < 1e-12 * first.moment.norm(), "{moment:?} {second:?}");
}

/// Depth and force of solids on a plane that they touch flat, on an edge, or with a round side.
#[test]
fn solids_press_a_plane_with_their_whole_contact() {
    let quarter = std::f64::consts::FRAC_PI_2;
    let pressed = |shape: Shape, pitch: f64, x: f64| {
        let mut model = two_bodies(1e-4, 0.3, 1e-4);
        let frame = Pose { position: Vec3::zero(), attitude: Quat::from_rotation_vector(vec3(0.0, pitch, 0.0)) };
        (model.contact.a.points, model.contact.a.solids) = (Vec::new(), vec![Solid { frame, shape }]);
        let m = Plant::new(model);
        let params = Params { contact_stiffness: 1e4, ..Params::null() };
        let mut states = vec![filled(0.0); m.contacts.len()];
        let touch = touch_points(&m, &space_pairs(&m, &params), &parts(x, 0.0), &mut states, true);
        (touch.wrench.force.norm(), touch.wrench.moment.norm())
    };
    let box_of = Shape::Box { half: vec3(0.1, 0.2, 0.3) };
    // Four vertices 1 mm deep each; turned by 45 degrees about y, two of an edge.
    assert_close("face", pressed(box_of.clone(), 0.0, -0.099).0, 4.0 * 1e4 * 1e-3, 1e-9);
    let diagonal = 0.1 * 0.5_f64.sqrt() + 0.3 * 0.5_f64.sqrt();
    assert_close("edge", pressed(box_of, 0.5 * quarter, -(diagonal - 1e-3)).0, 2.0 * 1e4 * 1e-3, 1e-9);
    // A rim that lies flat is as stiff as four points, with any number of them, and without a moment.
    for points in [4, 16, 63] {
        let disc = Shape::Cylinder { radius: 0.1, length: 0.2, points };
        let (force, moment) = pressed(disc, 0.0, -0.099);
        assert_close(&format!("rim of {points}"), force, 4.0 * 1e4 * 1e-3, 1e-9);
        assert!(moment < 1e-9, "{moment}");
        let cone = Shape::Frustum { front: 0.05, back: 0.1, length: 0.3, points };
        assert_close(&format!("back rim of {points}"), pressed(cone, 0.0, -0.299).0, 4.0 * 1e4 * 1e-3, 1e-9);
    }
    // Lying on its side a capsule touches with both ends, standing with one.
    let capsule = Shape::Capsule { radius: 0.05, length: 0.2, points: 2 };
    assert_close("lying", pressed(capsule.clone(), quarter, -0.049).0, 2.0 * 1e4 * 1e-3, 1e-9);
    assert_close("standing", pressed(capsule, 0.0, -0.149).0, 1e4 * 1e-3, 1e-9);
    let ring = Shape::Ring { radius: 0.2, tube: 0.03, points: 24 };
    assert_close("ring", pressed(ring, 0.0, -0.029).0, 4.0 * 1e4 * 1e-3, 1e-9);
}

/// Of two solids no place of contact counts twice: a sphere on the vertex of a box, a sphere on a sphere.
#[test]
fn round_solids_meet_other_solids_once() {
    let force = |a: Shape, b: Shape, x: f64, shift: Vec3<f64>| {
        let mut model = two_bodies(1e-4, 0.3, 1e-4);
        let of = |shape| vec![Solid { frame: Pose::identity(), shape }];
        (model.contact.a.points, model.contact.a.solids, model.contact.b.solids) = (Vec::new(), of(a), of(b));
        let m = Plant::new(model);
        let params = Params { contact_stiffness: 1e4, ..Params::null() };
        let mut states = vec![filled(0.0); m.contacts.len()];
        let mut at = parts(x, 0.0);
        at.a.position = at.a.position + shift;
        touch_points(&m, &space_pairs(&m, &params), &at, &mut states, true).wrench.force.norm()
    };
    let ball = || Shape::Sphere { radius: 0.1 };
    let cube = || Shape::Box { half: vec3(0.2, 0.2, 0.2) };
    // The ball's centre on the diagonal beyond the vertex, 1 mm too near.
    let place = 0.2 + 0.099 / 3.0_f64.sqrt();
    let diagonal = vec3(0.0, -place, -place);
    assert_close("ball on a vertex", force(ball(), cube(), -place, diagonal), 10.0, 1e-9);
    assert_close("vertex on a ball", force(cube(), ball(), -place, diagonal), 10.0, 1e-9);
    assert_close("ball on a ball", force(ball(), ball(), -0.199, Vec3::zero()), 10.0, 1e-9);
    assert_close("ball on a face", force(ball(), cube(), -0.299, Vec3::zero()), 10.0, 1e-9);
}

/// A probe whose head meets a plate of 5 mm: a run in which the head's centre comes through is invalid at any speed.
#[test]
fn probe_that_comes_through_a_thin_plate_makes_the_run_invalid() {
    for (radius, substep) in [(0.0, 2.5e-4), (0.02, 2.5e-4), (0.0, 1e-4)] {
        let mut model = two_bodies(substep, 3.0, 0.0);
        model.base_pose = at(-0.03, 0.0, 0.0);
        model.contact.a.points[0].radius = radius;
        let frame = Pose { position: vec3(2.5e-3, 0.0, 0.0), attitude: Quat::identity() };
        model.contact.b.solids = vec![Solid { frame, shape: Shape::Box { half: vec3(2.5e-3, 0.1, 0.1) } }];
        model.task.max_depth = 0.05;
        let speeds = [0.02, 0.05, 0.1, 0.2, 0.5, 1.0];
        // 50 kg of reduced mass on 20 kN/m: 1 mm deep at 0.02 m/s, 2.5 mm at 0.05 m/s.
        let runs = run(model, &speeds.map(|speed| closing(50.0, speed, 2e4, 0.0)));
        for (speed, row) in speeds.into_iter().zip(runs) {
            assert!(row.space.touch_time > 0.0, "{speed} m/s touches");
            let is_invalid = row.flags & flags::SPACE_PENETRATION != 0;
            let depth = speed * f64::sqrt(50.0 / 2e4);
            assert_eq!(is_invalid, depth > radius + 0.8 * 2.5e-3, "{radius} m, {speed} m/s: {:?}", row.space);
        }
    }
}

/// Softer parts on the robots go deeper than those in space: beyond the limit the facility's answer is none, and the run is
/// invalid. A session that was stopped has failed already.
#[test]
fn depth_beyond_the_limit_on_the_facility_makes_the_run_invalid() {
    let mut model = two_bodies(2.5e-4, 2.0, 0.0);
    model.base_pose = at(-5e-3, 0.0, 0.0);
    // 50 kg of reduced mass at 0.1 m/s: 5 mm deep on 20 kN/m, 10 mm on the 5 kN/m of the mounted parts.
    let params = Params { contact_stiffness_error: -0.75, ..closing(50.0, 0.1, 2e4, 0.0) };
    for (limit, rule, flagged) in [(0.011, f64::INFINITY, false), (0.006, f64::INFINITY, true), (0.006, 40.0, false)] {
        model.task.max_depth = limit;
        model.facility.rules.force = rule;
        let row = &run(model.clone(), &[params])[0];
        assert_eq!(row.flags & flags::SPACE_PENETRATION, 0, "{:?}", row.space);
        assert_eq!(row.flags & flags::HIL_PENETRATION != 0, flagged, "{limit} m: {:?}", row.hil);
        assert_eq!(row.flags & flags::INVALID != 0, flagged, "{limit} m");
    }
}

/// Loss-free bounces between two walls: the energy of the first approach is there after four thousand contacts.
#[test]
fn loss_free_bounces_between_walls_keep_their_energy() {
    let (speed, mass, stiffness) = (0.1, 50.0, 5e4);
    // The springs of the power law are softer here, and its contacts last three times as long.
    for (law, time) in first(1, [(NormalLaw::Linear, 900.0), (NormalLaw::Power { exponent: 1.5 }, 1900.0)]) {
        let mut model = two_bodies(2.5e-4, time, 5e-3);
        let back = Pose { position: vec3(-0.01, 0.0, 0.0), attitude: Quat::from_rotation_vector(vec3(0.0, 0.0, PI)) };
        model.contact.b.solids.push(Solid { frame: back, shape: Shape::Plane });
        (model.contact.law, model.task.end_after_separation) = (law, f64::INFINITY);
        let params = closing(mass, speed, stiffness, 0.0);
        let (mut last, mut bounces) = (speed, 0);
        replay(&job(model, &[params]), RunInput::new(0, params), &mut |signals| {
            let gap = signals.parts[0].a.position.x - signals.parts[0].b.position.x;
            // Between the walls all energy is in the motion.
            if (-0.009..-0.001).contains(&gap) {
                let now = signals.parts[0].a.velocity.x - signals.parts[0].b.velocity.x;
                bounces += u32::from(now * last < 0.0);
                last = now;
            }
        });
        assert!(bounces >= 4000, "{bounces} bounces");
        let energy = last.powi(2) / (speed * speed);
        assert_close(&format!("{law:?}"), energy, 1.0, 1e-3);
    }
}

/// A constant force presses part A on the plane until it rests: K d within 0.1 %, at light and heavy targets.
#[test]
fn static_press_gives_the_spring_of_its_law() {
    let laws = [(NormalLaw::Linear, 1.0), (NormalLaw::Power { exponent: 1.5 }, 1.5), (REBOUND, 1.5), (STOP, 1.0)];
    for (law, exponent) in laws {
        for target in [4.0, 400.0, 4000.0] {
            for force in [10.0, 200.0, 2000.0] {
                let mut model = with_pair(law, Pair { stiffness: 1e6, damping: 2e3, dissipation: 40.0, ..pair() });
                (model.timing.substep, model.task.end_after_separation) = (1e-5, f64::INFINITY);
                let m = Plant::new(model);
                let pairs = space_pairs(&m, &Params::null());
                let (mut depth, mut rate, mut states) = (0.0, 1e-3, vec![filled(0.0); m.contacts.len()]);
                let mut push = 0.0;
                for _ in 0..400_000 {
                    push = touch_points(&m, &pairs, &parts(depth, rate), &mut states, true).wrench.force.norm();
                    // The reduced mass is half the target's; the press itself is damped, with 8 1/s.
                    rate += m.timing.substep * ((force - push) / (0.5 * target) - 8.0 * rate);
                    depth += m.timing.substep * rate;
                }
                let spring = 1e6 * f64::powf(depth, exponent);
                assert_close(&format!("{law:?}, {target} kg, {force} N: rest"), push, force, 1e-4);
                assert_close(&format!("{law:?}, {target} kg, {force} N: K d"), push, spring, 1e-3);
            }
        }
    }
}

const REBOUND: NormalLaw = NormalLaw::Rebound { exponent: 1.5, slowest: 1e-3 };
const STOP: NormalLaw = NormalLaw::Stop { stroke: 0.05, stiffness: 1e7, exponent: 1.0 };
