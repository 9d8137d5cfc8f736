//! Distances of part B's shapes against sampled outlines.

use super::bench::{at, two_bodies};
use softdock_kernels::contact::distance::union_distance;
use softdock_kernels::model::{Shape, Solid};
use softdock_kernels::plant::Plant;
use softdock_kernels::vector::{Vec3, vec3};

/// Repeatable points in a box of half a metre about the mouth.
fn scattered(count: u32) -> impl Iterator<Item = Vec3<f64>> {
    let part = |i: u32, ratio: f64| (f64::from(i) * ratio).fract() - 0.5;
    (1..=count).map(move |i| vec3(part(i, 0.8191725134), part(i, 0.6710436067), part(i, 0.5497004779)))
}

/// Distance to an outline in the half plane, from 20,000 samples.
fn sampled(corners: &[[f64; 2]], x: f64, r: f64) -> f64 {
    let mut least = f64::INFINITY;
    for pair in corners.windows(2) {
        for i in 0..=20_000 {
            let t = f64::from(i) / 20_000.0;
            let [px, pr] = [0, 1].map(|k| pair[0][k] + t * (pair[1][k] - pair[0][k]));
            least = least.min((x - px).hypot(r - pr));
        }
    }
    least
}

#[test]
fn hollow_shapes_have_exact_distances_and_unit_normals_out_of_the_material() {
    let cone = Shape::Cone { mouth: 0.3, bottom: 0.1, depth: 0.25 };
    let bore = Shape::Bore { radius: 0.15, depth: 0.3, chamfer: 0.05, points: 0 };
    let outlines = [
        (cone, vec![[0.0, 1.5], [0.0, 0.3], [0.25, 0.1], [0.25, 0.0]]),
        (bore, vec![[0.0, 1.5], [0.0, 0.2], [0.05, 0.15], [0.3, 0.15], [0.3, 0.0]]),
    ];
    for (shape, outline) in outlines {
        let mut model = two_bodies(1e-3, 1.0, 1.0);
        model.contact.b.solids = vec![Solid { frame: at(0.0, 0.0, 0.0), shape: shape.clone() }];
        let m = Plant::new(model);
        for p in scattered(300) {
            let found = union_distance(&m.solids[1], p);
            let exact = sampled(&outline, p.x, p.y.hypot(p.z));
            // Samples lie 65 um apart at most.
            assert!((found.distance.abs() - exact).abs() < 1e-4, "{shape:?} at {p:?}: {found:?}, sampled {exact}");
            assert!((found.normal.norm() - 1.0).abs() < 1e-12, "{shape:?} at {p:?}: {found:?}");
            let wall = outline[1..].windows(2).find(|w| (w[0][0]..=w[1][0]).contains(&p.x) && w[1][0] > w[0][0]);
            let free = p.x < 0.0
                || wall.is_some_and(|w| {
                    p.y.hypot(p.z) < w[0][1] + (w[1][1] - w[0][1]) * (p.x - w[0][0]) / (w[1][0] - w[0][0])
                });
            assert_eq!(found.distance > 0.0, free, "{shape:?} at {p:?}: {found:?}");
            // A step out of the material lengthens the distance by the step, away from edges and the axis.
            let further = union_distance(&m.solids[1], p + found.normal * 1e-7).distance - found.distance;
            assert!((further - 1e-7).abs() < 1e-9 || found.distance.abs() < 1e-6, "{shape:?} at {p:?}: {further}");
        }
    }
}

#[test]
fn solid_shapes_have_exact_distances_and_unit_normals_out_of_the_material() {
    let points = 8;
    let cylinder = Shape::Cylinder { radius: 0.2, length: 0.5, points };
    let frustum = Shape::Frustum { front: 0.1, back: 0.3, length: 0.4, points };
    let outlines: [(Shape, [[f64; 2]; 4]); 2] = [
        (cylinder, [[-0.25, 0.0], [-0.25, 0.2], [0.25, 0.2], [0.25, 0.0]]),
        (frustum, [[0.0, 0.0], [0.0, 0.1], [0.4, 0.3], [0.4, 0.0]]),
    ];
    let round = |centre: f64, radius: f64| (centre - radius).abs();
    for p in scattered(300) {
        let (x, r) = (p.x, p.y.hypot(p.z));
        let mut exact: Vec<(Shape, f64, bool)> = Vec::new();
        for (shape, outline) in &outlines {
            let ends = [outline[1], outline[2]];
            let share = (x - ends[0][0]) / (ends[1][0] - ends[0][0]);
            let is_inside = (0.0..=1.0).contains(&share) && r < ends[0][1] + share * (ends[1][1] - ends[0][1]);
            exact.push((shape.clone(), sampled(outline, x, r), is_inside));
        }
        let axis = (x - x.clamp(-0.1, 0.1)).hypot(r);
        exact.push((Shape::Capsule { radius: 0.2, length: 0.2, points: 2 }, round(axis, 0.2), axis < 0.2));
        let circle = x.hypot(r - 0.25);
        exact.push((Shape::Ring { radius: 0.25, tube: 0.1, points }, round(circle, 0.1), circle < 0.1));
        for (shape, distance, is_inside) in exact {
            let mut model = two_bodies(1e-3, 1.0, 1.0);
            model.contact.b.solids = vec![Solid { frame: at(0.0, 0.0, 0.0), shape: shape.clone() }];
            let m = Plant::new(model);
            let found = union_distance(&m.solids[1], p);
            assert!((found.distance.abs() - distance).abs() < 1e-4, "{shape:?} at {p:?}: {found:?}, {distance}");
            assert_eq!(found.distance < 0.0, is_inside, "{shape:?} at {p:?}: {found:?}");
            assert!((found.normal.norm() - 1.0).abs() < 1e-12, "{shape:?} at {p:?}: {found:?}");
            let further = union_distance(&m.solids[1], p + found.normal * 1e-7).distance - found.distance;
            assert!((further - 1e-7).abs() < 1e-9 || found.distance.abs() < 1e-6, "{shape:?} at {p:?}: {further}");
        }
    }
}
