//! Contact events against closed forms: bounces, sliding, and the momentum that all events together give.

use super::bench::{assert_close, at, closing, inertia, job, numbered, two_bodies};
use super::meshes::sphere;
use softdock_engine::cpu::{CpuEngine, contact_events, replay};
use softdock_engine::{Engine, Job, RunInput};
use softdock_kernels::fields::filled;
use softdock_kernels::material::Pair;
use softdock_kernels::model::{ContactPoint, MaterialPair, Members, Model, NormalLaw, Shape, Solid};
use softdock_kernels::outcome::{ContactEvent, Finished};
use softdock_kernels::params::Params;
use softdock_kernels::plant::PointSource::{Point, Solid as OfSolid};
use softdock_kernels::vector::{Pose, Quat, Vec3, vec3};
use softdock_mesh::{ClosedMesh, Options, prepare};
use std::sync::Arc;

/// Events of both loops of run 0, which is the same as without a recorder.
fn events(job: &Job, params: &Params<f64>, merge_gap: f64) -> (Finished, [Vec<ContactEvent>; 2]) {
    let (finished, loops) = contact_events(job, &RunInput::new(0, *params), merge_gap);
    let unobserved = CpuEngine::new().run(job, &numbered(&[*params]), &|_| true).expect("nobody stops the batch");
    assert_eq!(finished, unobserved[0], "the recorder changes no bit");
    (finished, loops)
}

/// Velocities of part A in space, before the first tick's contact and at the end.
fn velocities(job: &Job, params: &Params<f64>) -> [Vec3<f64>; 2] {
    let mut seen = Vec::new();
    replay(job, RunInput::new(0, *params), &mut |signals| seen.push(signals.parts[0].a.velocity));
    [seen[0], *seen.last().expect("at least one tick")]
}

/// A ball before a heavy plane.
fn heavy(mass: f64, params: Params<f64>) -> Params<f64> {
    Params { base_mass: mass, target_mass: 1e9, target_inertia_scale: 1e9, ..params }
}

const GRAVITY: f64 = 2.0;
const RESTITUTION: f64 = 0.8;

/// A ball of 1 kg that falls on a plane: from 0.5 m/s, 187.5 mm above it, so that it meets it at 1 m/s after 0.25 s.
fn ball() -> (Model, Params<f64>) {
    let slowest = 0.05;
    let mut model = two_bodies(1e-5, 2.1, 0.1875);
    model.field = vec3(GRAVITY, 0.0, 0.0);
    model.contact.law = NormalLaw::Rebound { exponent: 1.0, slowest };
    // D of a restitution of 0.8.
    let params = Params { contact_dissipation: 0.373_15 / slowest, ..closing(1.0, 0.5, 1e7, 0.0) };
    (model, heavy(1.0, params))
}

#[test]
fn bounces_of_a_ball_have_times_impulses_and_energies_of_the_closed_form() {
    let (model, params) = ball();
    let job = job(model, &[params]);
    let (finished, [in_space, on_facility]) = events(&job, &params, 0.0);
    assert_eq!(in_space.len(), 3, "{in_space:#?}");
    let (mut time, mut speed) = (0.25, 1.0);
    for (number, event) in in_space.iter().enumerate() {
        let what = |quantity: &str| format!("{quantity} of bounce {number}");
        assert_close(&what("time"), event.start, time, 1e-2);
        assert_close(&what("closing speed"), event.closing_speed, speed, 1e-2);
        assert_close(&what("impulse"), -event.impulse.x, (1.0 + RESTITUTION) * speed, 1e-2);
        let lost = 0.5 * speed * speed * (1.0 - RESTITUTION * RESTITUTION);
        assert_close(&what("energy"), -event.work, lost, 1e-2);
        assert!(event.peak_force > 0.0 && event.peak_force == event.peak_normal_force, "no friction: {event:?}");
        assert!(event.impulse.y == 0.0 && event.impulse.z == 0.0 && event.slip == 0.0);
        assert!(event.start < event.peak_time && event.peak_time < event.start + event.duration);
        assert!(event.depth > 0.0 && event.duration < 2e-3 && !event.is_open);
        assert_eq!((event.members, event.pair), ([Point(0), OfSolid(0)], None));
        assert!((event.normal - vec3(-1.0, 0.0, 0.0)).norm() < 1e-12, "out of part B: {:?}", event.normal);
        assert!(0.0 < event.place.x && event.place.x <= event.depth && event.place.y == 0.0, "{:?}", event.place);
        (time, speed) = (time + 2.0 * RESTITUTION * speed / GRAVITY, RESTITUTION * speed);
    }
    for (events, metrics) in [(&in_space, finished.space), (&on_facility, finished.hil)] {
        let peak = events.iter().map(|event| event.peak_force).fold(0.0, f64::max);
        assert_close("peak", peak, metrics.peak_contact_force, 1e-12);
        assert_eq!(events.len() as f64, metrics.contact_count);
        let duration: f64 = events.iter().map(|event| event.duration).sum();
        assert_close("time in contact", duration, metrics.contact_duration, 1e-9);
    }
}

#[test]
fn a_merge_gap_makes_one_event_of_bounces_that_are_closer() {
    let (model, params) = ball();
    let job = job(model, &[params]);
    // The flights last 0.8 s and 0.64 s.
    for (gap, count) in [(0.5, 3), (0.7, 2), (0.9, 1)] {
        let (_, [in_space, _]) = events(&job, &params, gap);
        assert_eq!(in_space.len(), count, "{gap} s");
        let impulse: f64 = in_space.iter().map(|event| -event.impulse.x).sum();
        assert_close("sum of the impulses", impulse, 1.8 * (1.0 + 0.8 + 0.64), 1e-2);
    }
}

const FRICTION: f64 = 0.5;

/// A block of 10 kg on four corners of a plane that it presses with 98.1 N; it slides at 1 m/s.
fn block() -> (Model, Params<f64>) {
    let mut model = two_bodies(1e-4, 0.4, 0.05);
    model.tool = at(0.05, 0.0, 0.0);
    model.base_pose = at(-0.05, 0.0, 0.0);
    model.contact.a.points = Vec::new();
    let frame = at(-0.05, 0.0, 0.0);
    model.contact.a.solids = vec![Solid { frame, shape: Shape::Box { half: vec3(0.05, 0.1, 0.1) } }];
    model.base_inertia = inertia(0.07, 0.04, 0.04);
    model.field = vec3(9.81, 0.0, 0.0);
    let params = Params {
        contact_friction: FRICTION,
        bristle_stiffness: 1e5,
        bristle_damping: 200.0,
        contact_stiffness: 1e5,
        contact_damping: 400.0,
        drift: vec3(0.0, 1.0, 0.0),
        ..Params::null()
    };
    (model, heavy(10.0, params))
}

#[test]
fn a_block_slides_as_far_as_friction_lets_it() {
    let (model, params) = block();
    let job = job(model, &[params]);
    let (_, [in_space, _]) = events(&job, &params, 0.0);
    let [event] = in_space.as_slice() else { panic!("the points of a solid are one event: {in_space:#?}") };
    assert_eq!(event.members, [OfSolid(0), OfSolid(0)]);
    assert_close("path", event.slip, 1.0 / (2.0 * FRICTION * 9.81), 1e-2);
    assert_close("tangential impulse", event.impulse.y, -10.0, 1e-2);
    assert_close("normal impulse", event.impulse.x, -98.1 * 0.4, 1e-2);
    // What it has lost in speed, and in height on its springs.
    let sunk = 98.1 / 4e5;
    assert_close("energy", -event.work, 5.0 + 98.1 * sunk, 1e-2);
    assert!(event.is_open && event.peak_force > event.peak_normal_force, "{event:?}");
}

fn members(points: &[usize], solids: &[usize]) -> Members {
    Members { points: points.to_vec(), solids: solids.to_vec() }
}

/// A plane through `place` whose face looks against the direction at `angle` from x to y.
fn plane(place: Pose<f64>, angle: f64) -> Solid {
    let attitude = Quat::from_rotation_vector(vec3(0.0, 0.0, angle));
    Solid { frame: Pose { attitude, ..place }, shape: Shape::Plane }
}

#[test]
fn impulses_of_all_events_are_the_change_of_momentum() {
    let row = |point: usize, solid: usize, stiffness: f64| MaterialPair {
        a: members(&[point], &[]),
        b: members(&[], &[solid]),
        law: NormalLaw::Linear,
        properties: Pair {
            stiffness,
            damping: 20.0,
            friction: 0.3,
            bristle_stiffness: 1e4,
            stribeck_speed: 0.01,
            ..filled(0.0)
        },
        patch_radius: 0.0,
    };
    let mut model = two_bodies(1e-4, 1.2, 0.01);
    let side = ContactPoint { position: vec3(-0.05, 0.06, 0.01), radius: 0.01 };
    model.contact.a.points.push(side);
    model.contact.b.solids = vec![plane(at(0.0, 0.0, 0.0), 0.0), plane(at(0.0, 0.1, 0.0), std::f64::consts::FRAC_PI_2)];
    model.contact.pairs = vec![row(0, 0, 2e4), row(1, 1, 5e4)];
    let params = heavy(10.0, Params { drift: vec3(0.0, 0.15, 0.0), ..closing(10.0, 0.1, 1e4, 0.0) });
    let job = job(model, &[params]);
    let (finished, [in_space, on_facility]) = events(&job, &params, 0.0);
    let pairs: Vec<_> = in_space.iter().map(|event| (event.members, event.pair)).collect();
    assert!(pairs.contains(&([Point(0), OfSolid(0)], Some(0))), "{pairs:?}");
    assert!(pairs.contains(&([Point(1), OfSolid(1)], Some(1))), "{pairs:?}");
    assert!(!on_facility.is_empty());
    let impulse = in_space.iter().fold(Vec3::zero(), |sum, event| sum + event.impulse);
    let [before, after] = velocities(&job, &params);
    let momentum = (after - before) * 10.0;
    assert!((impulse - momentum).norm() < 1e-9 * momentum.norm(), "{impulse:?} for {momentum:?}");
    assert!(finished.space.linear_momentum_error < 1e-12 && momentum.x < -1.0 && momentum.y < -0.3, "{momentum:?}");
    assert!(in_space.windows(2).all(|pair| pair[0].start <= pair[1].start), "in the order of the touches");
}

/// A ball of mesh that meets both sides of a groove at a time.
#[test]
fn a_shell_between_two_solids_has_an_event_with_each() {
    let radius = 0.05;
    let solid = ClosedMesh::check(&sphere(radius, 48)).expect("a closed surface");
    let options = Options { resolution: None, margin: 0.0, points: 600, patch: 1e-4 };
    let ball = Shape::Mesh(Arc::new(prepare(&solid, &options).expect("a grid")));
    let mut model = two_bodies(1e-4, 0.4, 0.09);
    model.contact.a.points = Vec::new();
    model.contact.a.solids = vec![Solid { frame: Pose::identity(), shape: ball }];
    let angle = std::f64::consts::FRAC_PI_4;
    model.contact.b.solids = vec![plane(at(0.0, 0.0, 0.0), angle), plane(at(0.0, 0.0, 0.0), -angle)];
    let params =
        Params { contact_friction: 0.2, bristle_stiffness: 1e4, bristle_damping: 10.0, ..closing(5.0, 0.2, 1e5, 50.0) };
    let params = heavy(5.0, params);
    let job = job(model, &[params]);
    let (_, [in_space, _]) = events(&job, &params, 1e-3);
    let [one, two] = in_space.as_slice() else { panic!("one event for each side: {in_space:#?}") };
    let solids = [one, two].map(|event| event.members);
    assert!(solids.contains(&[OfSolid(0), OfSolid(0)]) && solids.contains(&[OfSolid(0), OfSolid(1)]), "{solids:?}");
    assert_close("the same push", one.impulse.x, two.impulse.x, 2e-2);
    assert_close("from opposite sides", one.impulse.y, -two.impulse.y, 2e-2);
    assert_close("normal of a side", one.normal.y.abs(), angle.sin(), 2e-2);
    let [before, after] = velocities(&job, &params);
    let (impulse, momentum) = (one.impulse + two.impulse, (after - before) * 5.0);
    assert!((impulse - momentum).norm() < 1e-9 * momentum.norm(), "{impulse:?} for {momentum:?}");
}
