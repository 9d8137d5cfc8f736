//! A bolt in its nut, both of triangles: what it advances in a turn, and that no push drives it through the thread.

use softdock_kernels::contact::space_pairs;
use softdock_kernels::fields::filled;
use softdock_kernels::frame::touch_points;
use softdock_kernels::model::{Model, Shape, Solid, Timing};
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use softdock_kernels::space::{Motion, Parts};
use softdock_kernels::vector::{Pose, Quat, Vec3, vec3};
use softdock_mesh::{ClosedMesh, Options, Triangles, prepare};
use softdock_test_size::first;
use std::f64::consts::TAU;
use std::sync::{Arc, LazyLock};

/// M16 x 2 \[m\]: pitch, radii of crest and root of the bolt, and the clearance of the nut at right angles to its axis.
const PITCH: f64 = 2e-3;
const CREST: f64 = 8e-3;
const ROOT: f64 = 6.92e-3;
const CLEARANCE: f64 = 0.15e-3;

/// Mass of the bolt \[kg\] and step \[s\]: 4 kHz.
const MASS: f64 = 0.5;
const STEP: f64 = 0.25e-3;

/// Depth from which a run is invalid \[m\].
const MAX_DEPTH: f64 = 0.4e-3;

/// Radius of the thread at a place of the pitch: an eighth at the crest, a quarter at the root, flanks of 30 degrees.
fn profile(turns: f64) -> f64 {
    let from_crest = 2.0 * (turns - turns.round()).abs();
    let share = ((from_crest - 0.125) / (0.75 - 0.125)).clamp(0.0, 1.0);
    CREST + (ROOT - CREST) * share
}

/// A right-handed thread about x, `from` to `to`, so many segments around; a bolt, or a nut with its outer wall.
fn threaded(from: f64, to: f64, wider: f64, outer: Option<f64>) -> Triangles {
    let (segments, rows) = (72, ((to - from) / (PITCH / 16.0)).round() as usize);
    let corner = |row: usize, segment: usize| {
        let x = from + (to - from) * row as f64 / rows as f64;
        let turn = (segment % segments) as f64 / segments as f64;
        let (sine, cosine) = (TAU * turn).sin_cos();
        let radius = wider + profile(x / PITCH - turn);
        vec3(x, radius * cosine, radius * sine)
    };
    let rim = |x: f64, radius: f64, segment: usize| {
        let (sine, cosine) = (TAU * (segment % segments) as f64 / segments as f64).sin_cos();
        vec3(x, radius * cosine, radius * sine)
    };
    let mut quads = Vec::new();
    let mut faces = Vec::new();
    for segment in 0..segments {
        for row in 0..rows {
            let [a, b, c, d] = [(0, 0), (0, 1), (1, 1), (1, 0)].map(|(up, on)| corner(row + up, segment + on));
            quads.push(if outer.is_some() { [a, d, c, b] } else { [a, b, c, d] });
        }
        let [low, high] = [0, rows].map(|row| [corner(row, segment), corner(row, segment + 1)]);
        match outer {
            Some(radius) => {
                let [below, above] = [from, to].map(|x| [rim(x, radius, segment), rim(x, radius, segment + 1)]);
                quads.push([low[0], low[1], below[1], below[0]]);
                quads.push([high[1], high[0], above[0], above[1]]);
                quads.push([below[0], below[1], above[1], above[0]]);
            }
            None => faces.extend([[vec3(from, 0.0, 0.0), low[1], low[0]], [vec3(to, 0.0, 0.0), high[0], high[1]]]),
        }
    }
    faces.extend(quads.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]));
    Triangles::of(faces.into_iter())
}

fn mesh(triangles: &Triangles, points: usize) -> Shape {
    let solid = ClosedMesh::check(triangles).expect("a closed surface");
    let options = Options { resolution: Some(0.2e-3), margin: 0.0, points, patch: 1e-5 };
    Shape::Mesh(Arc::new(prepare(&solid, &options).expect("a grid")))
}

/// The bolt with contact points in the nut, which has a grid of distances.
static BOLT_IN_NUT: LazyLock<Plant> = LazyLock::new(|| {
    let mut model = Model::two_bodies(Timing { substep: STEP, substeps: 1, max_ticks: 10 }, 0.0);
    let of = |shape| vec![Solid { frame: Pose::identity(), shape }];
    model.contact.a.points = Vec::new();
    model.contact.a.solids = of(mesh(&threaded(-6e-3, 8e-3, 0.0, None), 3000));
    model.contact.b.solids = of(mesh(&threaded(0.0, 6e-3, CLEARANCE, Some(10e-3)), 0));
    model.task.max_depth = MAX_DEPTH;
    Plant::new(model)
});

/// How a bolt ended.
#[derive(Debug)]
struct Way {
    /// Along the axis \[m\].
    advance: f64,
    /// Greatest overlap \[m\].
    depth: f64,
    /// Greatest distance beside the axis \[m\].
    beside: f64,
}

/// The bolt is turned at a rate \[rad/s\], free along its axis, on a guide of a stiffness \[N/m\] across it, pushed by a force
/// \[N\] and with a first speed.
fn turned(rate: f64, time: f64, guide: f64, push: f64, speed: f64) -> Way {
    let m = &*BOLT_IN_NUT;
    let params = Params {
        contact_stiffness: 1e5,
        contact_damping: 30.0,
        contact_friction: 0.1,
        bristle_stiffness: 1e4,
        bristle_damping: 5.0,
        ..Params::null()
    };
    let pairs = space_pairs(m, &params);
    let mut states = vec![filled(0.0); m.contact_states()];
    let still =
        Motion { position: Vec3::zero(), velocity: Vec3::zero(), attitude: Quat::identity(), omega: Vec3::zero() };
    let mut bolt = Motion { velocity: vec3(speed, 0.0, 0.0), omega: vec3(rate, 0.0, 0.0), ..still };
    let mut way = Way { advance: 0.0, depth: 0.0, beside: 0.0 };
    for step in 0..(time / STEP).round() as u32 {
        let (sine, cosine) = (0.5 * rate * STEP * f64::from(step)).sin_cos();
        bolt.attitude = Quat { w: cosine, v: vec3(sine, 0.0, 0.0) };
        let touch = touch_points(m, &pairs, &Parts { a: bolt, b: still }, &mut states, true);
        let across = |v: Vec3<f64>| vec3(0.0, v.y, v.z);
        let guided = across(bolt.position) * -guide + across(bolt.velocity) * (-0.6 * (guide * MASS).sqrt());
        let force = touch.wrench.force + vec3(push, 0.0, 0.0) + guided;
        bolt.velocity = force.scale_add(STEP / MASS, bolt.velocity);
        bolt.position = bolt.velocity.scale_add(STEP, bolt.position);
        way.depth = way.depth.max(touch.depth);
        way.beside = way.beside.max(bolt.position.y.hypot(bolt.position.z));
    }
    Way { advance: bolt.position.x, ..way }
}

/// Play of the bolt along the axis to each side: the clearance at right angles over the slope of the flank.
fn play() -> f64 {
    CLEARANCE * (0.625 * 0.5 * PITCH) / (CREST - ROOT)
}

#[test]
fn bolt_advances_by_its_pitch_in_a_turn_up_to_300_mm_per_s_at_the_thread() {
    // Surface speeds at the crest; pushed back, so that one flank slides on the other all the time. Free across its axis the bolt
    // has its play besides.
    for (speed, turns, guide, allowed) in first(
        2,
        [
            (0.3, [0.5, 1.5], 1e6, 0.005 * PITCH),
            (0.3, [0.5, 1.5], 0.0, 2.0 * play()),
            (0.05, [0.25, 0.75], 1e6, 0.005 * PITCH),
        ],
    ) {
        let rate = speed / CREST;
        // The first part settles it.
        let [settled, way] = turns.map(|turns| turned(rate, turns * TAU / rate, guide, -20.0, 0.0));
        let (advance, right) = (way.advance - settled.advance, (turns[1] - turns[0]) * PITCH);
        println!("{speed} m/s: {advance} for {right} m, {way:?}");
        assert!((advance - right).abs() < allowed, "{speed} m/s: {advance} m for {right} m, {settled:?} {way:?}");
        assert!(way.depth < 0.5 * MAX_DEPTH && way.beside < 2.0 * CLEARANCE, "{speed} m/s: {way:?}");
    }
}

#[test]
fn no_push_drives_a_bolt_through_its_thread_unnoticed() {
    for speed in [0.05, 0.3, -0.3] {
        let way = turned(0.0, 0.05, 0.0, 100.0 * f64::signum(speed), speed);
        assert!(way.advance.abs() < play() + MAX_DEPTH && way.depth < MAX_DEPTH, "{speed} m/s: {way:?}");
    }
    // Beyond the speeds that the thread withstands a run is invalid by its depth.
    let mut slipped = 0;
    for speed in [1.0, 3.0, 5.0] {
        let way = turned(0.0, 0.01, 0.0, 0.0, speed);
        println!("{speed} m/s: {way:?}");
        let slips = way.advance.abs() > 0.5 * PITCH;
        slipped += u32::from(slips);
        assert!(!slips || way.depth > MAX_DEPTH, "{speed} m/s: {way:?}");
    }
    assert!(slipped > 0, "the last speed drives it through");
}
