//! Meshes against exact solids and against the law of a bedding: force, moment, ripple, refused surfaces.

use super::bench::{job, numbered, run};
use crate::gpu::gpu;
use softdock_engine::Engine;
use softdock_kernels::contact::distance::union_distance;
use softdock_kernels::contact::mesh::Mesh;
use softdock_kernels::contact::space_pairs;
use softdock_kernels::fields::filled;
use softdock_kernels::frame::touch_points;
use softdock_kernels::model::{Model, Shape, Solid, Timing};
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use softdock_kernels::space::{Motion, Parts, Wrench};
use softdock_kernels::vector::{Pose, Quat, Vec3, vec3};
use softdock_mesh::{MeshFault, Options, Triangles, prepare, report};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

const STIFFNESS: f64 = 1e6;

/// Area of a shell that has the stiffness \[m^2\].
const PATCH: f64 = 1e-4;

/// Segments of a body of revolution.
const SEGMENTS: usize = 240;

/// A closed body of revolution about x from its outline (axis, radius), which begins and ends on the axis.
///
/// The corners of a polygon lie beyond the circle, so that its mean radius is that of the circle.
fn revolved(outline: &[[f64; 2]], segments: usize) -> Triangles {
    let wide = 1.0 + (PI / segments as f64).powi(2) / 3.0;
    let corner = |[x, radius]: [f64; 2], segment: usize| {
        let (sine, cosine) = (TAU * (segment % segments) as f64 / segments as f64).sin_cos();
        vec3(x, wide * radius * cosine, wide * radius * sine)
    };
    let mut corners = Vec::new();
    for pair in outline.windows(2) {
        for segment in 0..segments {
            let [a, b] = [corner(pair[0], segment), corner(pair[0], segment + 1)];
            let [c, d] = [corner(pair[1], segment + 1), corner(pair[1], segment)];
            corners.extend([[a, b, c], [a, c, d]]);
        }
    }
    let turned = |[a, b, c]: [Vec3<f64>; 3]| [a, c, b];
    let volume: f64 = corners.iter().map(|[a, b, c]| a.dot(b.cross(*c))).sum();
    Triangles::of(corners.into_iter().map(|own| if volume < 0.0 { turned(own) } else { own }))
}

/// A sphere of meridians and parallels.
pub(crate) fn sphere(radius: f64, segments: usize) -> Triangles {
    let steps = segments / 2;
    let outline: Vec<[f64; 2]> = (0..=steps)
        .map(|step| {
            let angle = PI * step as f64 / steps as f64;
            let across = if step == 0 || step == steps { 0.0 } else { radius * angle.sin() };
            [-radius * angle.cos(), across]
        })
        .collect();
    revolved(&outline, segments)
}

/// A box about the origin.
fn cuboid(half: Vec3<f64>) -> Triangles {
    let corner = |index: usize| {
        let sign = |bit: usize| if index >> bit & 1 == 0 { -1.0 } else { 1.0 };
        vec3(sign(0) * half.x, sign(1) * half.y, sign(2) * half.z)
    };
    let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let halves = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]);
    Triangles::of(halves.map(|triangle| triangle.map(corner)))
}

/// A block with a hollow cone that opens to -x.
pub(crate) fn block_with_cone([mouth, bottom, depth]: [f64; 3], outer: f64, segments: usize) -> Triangles {
    let back = depth + 0.02;
    revolved(&[[depth, 0.0], [depth, bottom], [0.0, mouth], [0.0, outer], [back, outer], [back, 0.0]], segments)
}

fn solid_of(triangles: &Triangles) -> softdock_mesh::ClosedMesh {
    softdock_mesh::ClosedMesh::check(triangles).expect("a closed surface")
}

/// A mesh with so many cells along its longest edge, for points of a radius, with so many points of its own.
fn mesh_of(triangles: &Triangles, cells: f64, margin: f64, points: usize) -> Shape {
    let solid = solid_of(triangles);
    let [low, high] = solid.bounds();
    let size = high - low;
    let resolution = (cells != CELLS).then(|| size.x.max(size.y).max(size.z) / cells);
    Shape::Mesh(Arc::new(prepare(&solid, &Options { resolution, margin, points, patch: PATCH }).expect("a grid")))
}

fn mesh(shape: &Shape) -> &Mesh {
    match shape {
        Shape::Mesh(mesh) => mesh,
        other => panic!("{other:?} is no mesh"),
    }
}

fn plant(a: Shape, b: Shape) -> Plant {
    let timing = Timing { substep: 1e-4, substeps: 1, max_ticks: 10 };
    let mut model = Model::two_bodies(timing, 1e-4);
    let of = |shape| vec![Solid { frame: Pose::identity(), shape }];
    (model.contact.a.points, model.contact.a.solids, model.contact.b.solids) = (Vec::new(), of(a), of(b));
    Plant::new(model)
}

fn still(position: Vec3<f64>, turn: Vec3<f64>) -> Motion<f64> {
    let attitude = Quat::from_rotation_vector(turn);
    Motion { position, velocity: Vec3::zero(), attitude, omega: Vec3::zero() }
}

/// Wrench on part A about its origin, at a place and attitude before part B.
fn pressed(m: &Plant, position: Vec3<f64>, turn: Vec3<f64>) -> Wrench<f64> {
    let parts = Parts { a: still(position, turn), b: still(Vec3::zero(), Vec3::zero()) };
    let params = Params { contact_stiffness: STIFFNESS, ..Params::null() };
    let mut states = vec![filled(0.0); m.contact_states()];
    touch_points(m, &space_pairs(m, &params), &parts, &mut states, true).wrench
}

/// Difference of two wrenches over the second; moments over force times `lever`.
fn difference(one: &Wrench<f64>, two: &Wrench<f64>, lever: f64) -> f64 {
    let force = two.force.norm();
    assert!(force > 1.0, "they touch: {two:?}");
    ((one.force - two.force).norm() / force).max((one.moment - two.moment).norm() / (force * lever))
}

/// A part's primitive, what it meets as a primitive and as a mesh, its place and attitude, and its lever.
struct Case {
    name: &'static str,
    part: Shape,
    exact: Shape,
    triangles: Triangles,
    margin: f64,
    position: Vec3<f64>,
    turn: Vec3<f64>,
    lever: f64,
}

/// All a millimetre deep or less.
fn cases() -> Vec<Case> {
    let plate = || {
        let mut plate = cuboid(vec3(0.01, 0.06, 0.05));
        plate.vertices.iter_mut().for_each(|vertex| vertex.x += 0.01);
        plate
    };
    let cone = [0.06, 0.03, 0.06];
    // Half the angle of the cone: the place of a sphere that is 0.5 mm deep in one side of it.
    let angle = f64::atan2(cone[0] - cone[1], cone[2]);
    let (along, across) = (0.03, 0.5 * (cone[0] + cone[1]));
    let inwards = vec3(-angle.sin(), -angle.cos(), 0.0);
    vec![
        Case {
            name: "sphere on plane",
            part: Shape::Sphere { radius: 0.02 },
            exact: Shape::Plane,
            triangles: plate(),
            margin: 0.02,
            position: vec3(-0.0195, 0.0123, -0.0077),
            turn: Vec3::zero(),
            lever: 0.02,
        },
        Case {
            name: "box on plane",
            part: Shape::Box { half: vec3(0.02, 0.03, 0.01) },
            exact: Shape::Plane,
            triangles: plate(),
            margin: 0.0,
            position: vec3(-0.0195, 0.003, 0.004),
            turn: vec3(0.0, 0.008, 0.006),
            lever: 0.03,
        },
        Case {
            name: "sphere in cone",
            part: Shape::Sphere { radius: 0.02 },
            exact: Shape::Cone { mouth: cone[0], bottom: cone[1], depth: cone[2] },
            triangles: block_with_cone(cone, 0.08, SEGMENTS),
            margin: 0.02,
            position: vec3(along, across, 0.0) + inwards * (0.02 - 0.5e-3),
            turn: Vec3::zero(),
            lever: 0.02,
        },
        Case {
            name: "peg in bore",
            part: Shape::Cylinder { radius: 0.029, length: 0.04, points: 32 },
            exact: Shape::Bore { radius: 0.03, depth: 0.06, chamfer: 0.0, points: 0 },
            triangles: block_with_cone([0.03, 0.03, 0.06], 0.05, SEGMENTS),
            margin: 0.0,
            position: vec3(0.03, 0.0012, 0.0009),
            turn: vec3(0.0, 0.005, 0.012),
            lever: 0.02,
        },
    ]
}

/// Cells along the longest edge of a mesh whose resolution is not stated.
const CELLS: f64 = softdock_mesh::DEFAULT_CELLS;

#[test]
fn primitives_press_meshes_as_they_press_exact_solids() {
    for case in cases() {
        let exact = pressed(&plant(case.part.clone(), case.exact.clone()), case.position, case.turn);
        let errors = [0.25, 0.5, 1.0].map(|share| {
            let mesh = mesh_of(&case.triangles, share * CELLS, case.margin, 0);
            let found = pressed(&plant(case.part.clone(), mesh), case.position, case.turn);
            difference(&found, &exact, case.lever)
        });
        assert!(errors[2] < 0.02, "{}: {errors:?}", case.name);
        // On a plane all are exact but for rounding.
        assert!(errors[2] < errors[0].max(1e-4), "{} does not converge: {errors:?}", case.name);
    }
}

/// The law of a bedding: every place of the surface pushes by stiffness over patch, depth, and the area that faces the other
/// part; integrated over a fine lattice of a sphere.
fn bedded_sphere(m: &Plant, radius: f64, position: Vec3<f64>) -> Wrench<f64> {
    let mut sum = Wrench { force: Vec3::zero(), moment: Vec3::zero() };
    let count = 400_000;
    for index in 0..count {
        // A Fibonacci lattice has cells of equal area.
        let height = 1.0 - (2.0 * index as f64 + 1.0) / f64::from(count);
        let (sine, cosine) = (f64::from(index) * PI * (3.0 - 5.0_f64.sqrt())).sin_cos();
        let across = (1.0 - height * height).sqrt();
        let normal = vec3(height, across * cosine, across * sine);
        let at = union_distance(&m.solids[1], position + normal * radius);
        let area = 4.0 * PI * radius * radius / f64::from(count);
        let facing = (-normal.dot(at.normal)).max(0.0);
        let push = at.normal * (STIFFNESS / PATCH * (-at.distance).max(0.0) * area * facing);
        sum.force = sum.force + push;
        sum.moment = sum.moment + (normal * radius).cross(push);
    }
    sum
}

#[test]
fn shells_press_exact_solids_as_a_bedding_does() {
    // A box flat and tilted on a plane: the integrals of the depth over its face.
    let half = vec3(0.02, 0.03, 0.01);
    for points in [400, 1600] {
        let m = plant(mesh_of(&cuboid(half), 16.0, 0.0, points), Shape::Plane);
        let (area, depth) = (4.0 * half.y * half.z, 0.5e-3);
        let flat = pressed(&m, vec3(-half.x + depth, 0.0, 0.0), Vec3::zero());
        let right = -STIFFNESS * depth * area / PATCH;
        assert!((flat.force.x / right - 1.0).abs() < 1e-3, "{points} points: {flat:?} for {right} N");
        assert!(flat.moment.norm() < 1e-3 * right.abs() * half.y, "{points} points: {flat:?}");
        // Turned about z by so little that the whole face stays in the plane.
        let angle = 0.8 * depth / half.y;
        let turned = pressed(&m, vec3(-half.x + depth, 0.0, 0.0), vec3(0.0, 0.0, angle));
        let second_moment = 2.0 * half.z * (2.0 * half.y).powi(3) / 12.0;
        // The whole force acts on the face, which has turned aside of the box's middle.
        let moment = STIFFNESS / PATCH * angle * second_moment + right * half.x * angle;
        assert!((turned.force.norm() / right.abs() - 1.0).abs() < 0.02, "{points} points: {turned:?}");
        let found = turned.moment.z.abs();
        assert!((found / moment - 1.0).abs() < 0.02, "{points} points: {turned:?} for {moment} N m");
        // Back towards where it lay flat.
        assert!(turned.moment.z < 0.0, "{turned:?}");
    }
    // A sphere on a plane and in a cone; the cap of the first is 63 mm wide.
    let radius = 0.1;
    let ball = sphere(radius, SEGMENTS);
    let cone = Shape::Cone { mouth: 0.3, bottom: 0.05, depth: 0.25 };
    let scenes = [("plane", Shape::Plane, vec3(-radius + 5e-3, 0.0, 0.0)), ("cone", cone, vec3(0.165, 0.002, 0.001))];
    for (name, exact, position) in scenes {
        let errors = [250, 1000, 4000].map(|points| {
            let m = plant(mesh_of(&ball, 16.0, 0.0, points), exact.clone());
            let right = bedded_sphere(&m, radius, position);
            difference(&pressed(&m, position, Vec3::zero()), &right, radius)
        });
        assert!(errors[2] < 0.02 && errors[2] < errors[0], "{name}: {errors:?}");
    }
}

#[test]
fn mesh_presses_mesh_with_the_stiffness_of_the_smaller_face() {
    let (small, large) = (vec3(0.02, 0.02, 0.02), vec3(0.01, 0.05, 0.05));
    let (depth, area) = (0.4e-3, 4.0 * 0.02 * 0.02);
    let right = STIFFNESS * depth * area / PATCH;
    // Both with shells, then one of them alone.
    for points in [[1500, 4000], [1500, 0], [0, 4000]] {
        let a = mesh_of(&cuboid(small), 32.0, 0.0, points[0]);
        let b = mesh_of(&cuboid(large), 64.0, 0.0, points[1]);
        let m = plant(a, b);
        assert_eq!(m.shells.len(), points.iter().filter(|count| **count > 0).count());
        let found = pressed(&m, vec3(-(small.x + large.x) + depth, 0.003, -0.002), Vec3::zero());
        // The points of the larger face end where the smaller does: to their spacing.
        let allowed = if points[1] == 0 { 0.02 } else { 0.08 };
        assert!((-found.force.x / right - 1.0).abs() < allowed, "{points:?}: {found:?} for {right} N");
    }
}

#[test]
fn meshes_act_on_both_parts_with_opposite_wrenches() {
    let peg = || mesh_of(&revolved(&[[-0.02, 0.0], [-0.02, 0.03], [0.02, 0.03], [0.02, 0.0]], 48), 32.0, 0.0, 600);
    let block = || mesh_of(&cuboid(vec3(0.02, 0.04, 0.05)), 32.0, 0.0, 500);
    let motion = |x: f64, turn: Vec3<f64>, velocity: Vec3<f64>, omega: Vec3<f64>| Motion {
        velocity,
        omega,
        ..still(vec3(x, 0.013, -0.011), turn)
    };
    let one = motion(-0.039, vec3(0.02, -0.01, 0.1), vec3(0.1, 0.02, 0.0), vec3(0.1, -0.4, 0.2));
    let two = motion(0.0, vec3(-0.01, 0.02, 0.0), vec3(-0.05, 0.0, 0.01), vec3(-0.2, 0.1, 0.3));
    let wrench = |a: Shape, b: Shape, parts: Parts<f64>| {
        let m = plant(a, b);
        let params = Params {
            contact_stiffness: 1e5,
            contact_damping: 30.0,
            contact_friction: 0.3,
            bristle_stiffness: 1e5,
            bristle_damping: 5.0,
            ..Params::null()
        };
        let mut states = vec![filled(0.0); m.contact_states()];
        let touch = (0..50).map(|_| touch_points(&m, &space_pairs(&m, &params), &parts, &mut states, true)).last();
        touch.expect("fifty substeps").wrench
    };
    let first = wrench(peg(), block(), Parts { a: one, b: two });
    let second = wrench(block(), peg(), Parts { a: two, b: one });
    assert!(first.force.norm() > 10.0, "{first:?}");
    let moment = -(first.moment + (one.position - two.position).cross(first.force));
    assert!((first.force + second.force).norm() < 1e-12 * first.force.norm(), "{first:?} {second:?}");
    assert!((second.moment - moment).norm() < 1e-12 * first.moment.norm(), "{moment:?} {second:?}");
}

/// The friction of a shell: mu times its load at most, against the slip, also where its normals cancel.
#[test]
fn shell_slides_with_the_friction_of_its_load() {
    let half = vec3(0.02, 0.03, 0.01);
    let slide = |m: &Plant, position: Vec3<f64>, velocity: Vec3<f64>| {
        let params = Params {
            contact_stiffness: STIFFNESS,
            contact_friction: 0.25,
            bristle_stiffness: STIFFNESS,
            ..Params::null()
        };
        let a = Motion { velocity, ..still(position, Vec3::zero()) };
        let parts = Parts { a, b: still(Vec3::zero(), Vec3::zero()) };
        let mut states = vec![filled(0.0); m.contact_states()];
        let touch = (0..2000).map(|_| touch_points(m, &space_pairs(m, &params), &parts, &mut states, true)).last();
        let touch = touch.expect("substeps");
        (touch.wrench.force, touch.force)
    };
    let m = plant(mesh_of(&cuboid(half), 16.0, 0.0, 400), Shape::Plane);
    let (force, load) = slide(&m, vec3(-half.x + 0.5e-3, 0.0, 0.0), vec3(0.0, 0.01, 0.0));
    assert!((force.y + 0.25 * load).abs() < 1e-6 * load, "{force:?} under {load} N");
    // A peg with an oversize of 0.2 mm: pressed all around, it slides along the bore.
    let peg = revolved(&[[-0.02, 0.0], [-0.02, 0.0302], [0.02, 0.0302], [0.02, 0.0]], 96);
    let m = plant(mesh_of(&peg, 32.0, 0.0, 1000), Shape::Bore { radius: 0.03, depth: 0.2, chamfer: 0.0, points: 0 });
    let (force, load) = slide(&m, vec3(0.05, 0.0, 0.0), vec3(0.01, 0.0, 0.0));
    let pressed = STIFFNESS / PATCH * 0.2e-3 * TAU * 0.0302 * 0.04;
    assert!((load / pressed - 1.0).abs() < 0.02, "{load} N for {pressed} N");
    assert!((force.x + 0.25 * load).abs() < 1e-3 * load, "{force:?} under {load} N");
}

/// A sphere along the side of a cone at 1 mm/s, one deep path across the cells of its grid.
#[test]
fn slow_slide_across_cells_has_a_ripple_below_a_hundredth() {
    let case = cases().swap_remove(2);
    let m = plant(case.part.clone(), mesh_of(&case.triangles, CELLS, case.margin, 0));
    // Half a millimetre more: 1 mm deep.
    let (radius, angle) = (0.02, f64::atan2(0.03, 0.06));
    let force = |along: f64, around: f64| {
        let outwards = vec3(0.0, around.cos(), around.sin());
        let inwards = vec3(-angle.sin(), 0.0, 0.0) - outwards * angle.cos();
        let surface = vec3(along, 0.0, 0.0) + outwards * (0.06 - 0.5 * along);
        pressed(&m, surface + inwards * (radius - 1e-3), Vec3::zero()).force.norm()
    };
    // 10 mm down the side, then 10 mm around, 0.05 mm (50 ms) apart.
    let paths: [Vec<f64>; 2] = [
        (0..200).map(|step| force(0.02 + 5e-5 * f64::from(step) * angle.cos(), 0.4)).collect(),
        (0..200).map(|step| force(0.03, 0.4 + 5e-5 * f64::from(step) / 0.045)).collect(),
    ];
    for forces in paths {
        let mean = forces.iter().sum::<f64>() / forces.len() as f64;
        let square = forces.iter().map(|force| (force - mean).powi(2)).sum::<f64>() / forces.len() as f64;
        assert!(square.sqrt() < 0.01 * mean, "{} N around {mean} N", square.sqrt());
        assert!((mean / (STIFFNESS * 1e-3) - 1.0).abs() < 0.02, "{mean} N");
    }
}

/// The same in runs on lanes and on a GPU: one for each place of the path, of bodies too heavy to move.
#[test]
fn slow_press_over_cells_has_a_ripple_below_a_hundredth_on_lanes_and_on_a_gpu() {
    let case = cases().swap_remove(2);
    let timing = Timing { substep: 1e-4, substeps: 1, max_ticks: 2 };
    let mut model = Model::two_bodies(timing, 0.0);
    let of = |shape| vec![Solid { frame: Pose::identity(), shape }];
    let grid = mesh_of(&case.triangles, CELLS, case.margin, 0);
    (model.contact.a.points, model.contact.a.solids, model.contact.b.solids) = (Vec::new(), of(case.part), of(grid));
    let (radius, angle) = (0.02, f64::atan2(0.03, 0.06));
    let press = |along: f64, around: f64| {
        let outwards = vec3(0.0, around.cos(), around.sin());
        let inwards = vec3(-angle.sin(), 0.0, 0.0) - outwards * angle.cos();
        let surface = vec3(along, 0.0, 0.0) + outwards * (0.06 - 0.5 * along);
        let offset = surface + inwards * (radius - 1e-3);
        let drift = vec3(0.0, -around.sin(), around.cos()) * 1e-3;
        Params { offset, drift, base_mass: 1e9, target_mass: 1e9, contact_stiffness: STIFFNESS, ..Params::null() }
    };
    // 10 mm down the side, then 10 mm around, 0.05 mm (50 ms at 1 mm/s) apart.
    let steps = || (0..200).map(|step| 5e-5 * f64::from(step));
    let down = steps().map(|way| press(0.02 + way * angle.cos(), 0.4));
    let runs: Vec<_> = down.chain(steps().map(|way| press(0.03, 0.4 + way / 0.045))).collect();
    let (job, inputs) = (job(model.clone(), &runs), numbered(&runs));
    let single = gpu().run(&job, &inputs, &|_| true).expect("the batch ends");
    for rows in [run(model, &runs), single] {
        for path in rows.chunks(200) {
            let forces: Vec<f64> = path.iter().map(|row| row.space.peak_contact_force).collect();
            let mean = forces.iter().sum::<f64>() / forces.len() as f64;
            let square = forces.iter().map(|force| (force - mean).powi(2)).sum::<f64>() / forces.len() as f64;
            assert!(square.sqrt() < 0.01 * mean, "{} N around {mean} N", square.sqrt());
            assert!((mean / (STIFFNESS * 1e-3) - 1.0).abs() < 0.02, "{mean} N");
        }
    }
}

/// The work of a slow way around a closed loop vanishes: the force has a potential.
#[test]
fn normal_force_of_a_grid_has_a_potential() {
    let case = cases().swap_remove(2);
    let m = plant(case.part.clone(), mesh_of(&case.triangles, 0.5 * CELLS, case.margin, 0));
    let (steps, size) = (4000, 1.5e-3);
    let at = |step: i32| {
        let (sine, cosine) = (TAU * f64::from(step) / f64::from(steps)).sin_cos();
        case.position + vec3(size * cosine, 0.4e-3 * sine, size * sine)
    };
    let (mut work, mut turned) = (0.0, 0.0);
    for step in 0..steps {
        let way = at(step + 1) - at(step);
        let part = pressed(&m, (at(step) + at(step + 1)) * 0.5, Vec3::zero()).force.dot(way);
        (work, turned) = (work + part, turned + part.abs());
    }
    assert!(work.abs() < 0.01 * turned, "{work} J of {turned} J");
}

#[test]
fn points_of_a_shell_have_the_whole_area_and_its_sharp_places() {
    let half = vec3(0.02, 0.03, 0.01);
    let area = 8.0 * (half.x * half.y + half.y * half.z + half.z * half.x);
    for points in [100, 500, 2000] {
        let shape = mesh_of(&cuboid(half), 16.0, 0.0, points);
        let shell = &mesh(&shape).shell;
        let total: f64 = shell.iter().map(|point| point.share * PATCH).sum();
        assert!((total / area - 1.0).abs() < 1e-9, "{points}: {total} m^2 for {area} m^2");
        // About the number that was asked for, and more on the edges.
        let count = shell.len();
        assert!(count > points / 2 && count < 3 * points, "{points}: {count}");
        let at_corner = |point: &&softdock_kernels::contact::mesh::ShellPoint<f64>| {
            (point.position.map(f64::abs) - half).norm() < 1e-12
        };
        assert_eq!(shell.iter().filter(at_corner).count(), 24, "three faces at each of eight corners");
        assert!(shell.iter().all(|point| (point.normal.norm() - 1.0).abs() < 1e-9));
    }
}

#[test]
fn report_states_volume_mass_and_error_of_the_grid() {
    let half = vec3(0.02, 0.03, 0.01);
    let solid = solid_of(&cuboid(half));
    let options = Options { resolution: Some(1.1e-3), margin: 5e-3, points: 200, patch: PATCH };
    let made = prepare(&solid, &options).expect("a grid");
    let found = report(&solid, &made, Some(2700.0));
    assert_eq!(found.triangles, 12);
    assert!((found.volume / (8.0 * half.x * half.y * half.z) - 1.0).abs() < 1e-12, "{found:?}");
    let mass = found.mass.expect("for a density");
    assert!((mass.mass - 2700.0 * 48e-6).abs() < 1e-9, "{mass:?}");
    let inertia = mass.mass / 3.0 * (half.y * half.y + half.z * half.z);
    assert!((mass.inertia.xx / inertia - 1.0).abs() < 1e-9 && mass.centre.norm() < 1e-12, "{mass:?}");
    // Flat faces are exact, edges are rounded by less than a cell.
    assert!(found.error_of_faces < 1e-8, "{found:?}");
    assert!(found.error_of_edges > 1e-6 && found.error_of_edges < 1e-3, "{found:?}");
    assert!((made.half_thickness - half.z).abs() < 1e-3, "{}", made.half_thickness);
    // A sphere: the error of its faces goes with the square of the cell.
    let solid = solid_of(&sphere(0.02, SEGMENTS));
    let error = |cell: f64| {
        let options = Options { resolution: Some(cell), ..options };
        report(&solid, &prepare(&solid, &options).expect("a grid"), None)
    };
    let [coarse, fine] = [error(2e-3), error(1e-3)];
    let ratio = coarse.error_of_faces / fine.error_of_faces;
    assert!(ratio > 3.0 && ratio < 5.5, "{ratio}: {coarse:?} {fine:?}");
    let suggested = coarse.resolution_for(fine.error_of_faces);
    assert!((suggested / 1e-3 - 1.0).abs() < 0.2, "{suggested}");
}

#[test]
fn surfaces_without_an_inside_are_refused() {
    let whole = cuboid(vec3(0.01, 0.02, 0.03));
    let refused = |change: fn(&mut Triangles)| -> MeshFault {
        let mut changed = whole.clone();
        change(&mut changed);
        softdock_mesh::ClosedMesh::check(&changed).expect_err("refused")
    };
    let cases = [
        ("hole", refused(|m| m.triangles.truncate(11))),
        ("inwards", refused(|m| m.triangles.iter_mut().for_each(|triangle| triangle.swap(0, 1)))),
        ("against each other", refused(|m| m.triangles[3].swap(0, 1))),
        ("volume", refused(|m| m.vertices.iter_mut().for_each(|vertex| vertex.z = 0.0))),
        ("more than two", refused(|m| m.triangles.push(m.triangles[0]))),
        ("itself", refused(|m| m.vertices[7] = vec3(-0.02, -0.03, -0.04))),
    ];
    for (expected, fault) in cases {
        assert!(fault.message.contains(expected), "{expected}: {fault:?}");
        assert!(!fault.remedy.is_empty(), "{fault:?}");
    }
    let message = refused(|m| m.triangles.truncate(11)).message;
    assert!(message.contains("3 edges") && message.contains("mm"), "{message}");
}

#[test]
fn grid_beyond_the_limit_is_refused_with_the_finest_that_fits() {
    let solid = solid_of(&cuboid(vec3(0.1, 0.1, 0.1)));
    let fine = Options { resolution: Some(1e-5), margin: 0.0, points: 0, patch: PATCH };
    let fault = prepare(&solid, &fine).expect_err("2e4 nodes along each edge");
    let least = fault.remedy.split('"').nth(1).and_then(|text| text.strip_suffix(" mm")).expect("a length");
    let least: f64 = least.parse().expect("a number");
    assert!(least > 0.5 && least < 1.0, "{fault:?}");
}
