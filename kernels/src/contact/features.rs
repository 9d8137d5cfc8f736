//! Contact points that a solid has by its shape: spheres that cover it where it is convex.

use crate::contact_parts::{ContactPoint, Shape};
use crate::vector::{Vec3, vec3};
use std::f64::consts::TAU;

/// Contact points of a rim that together are as stiff as the rim, whatever their number.
const OF_A_RIM: f64 = 4.0;

/// A contact point of a solid, in the solid's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Feature {
    /// The point.
    pub point: ContactPoint,
    /// Share of the pair's stiffness and damping that the point has.
    pub share: f64,
}

/// Returns the contact points of a shape: the centre of a sphere, the axis of a capsule and of a ring's tube, the vertices
/// of a box, the rims of a cylinder and of a frustum, the edge of a bore. A plane and a hollow cone have none: other parts
/// touch them. Those of a mesh are its shell.
pub fn features(shape: &Shape) -> Vec<Feature> {
    let single = |position, radius| Feature { point: ContactPoint { position, radius }, share: 1.0 };
    match *shape {
        Shape::Plane | Shape::Cone { .. } | Shape::Mesh(_) => Vec::new(),
        Shape::Bore { radius, chamfer, points, .. } => circle(chamfer, radius, 0.0, points).collect(),
        Shape::Sphere { radius } => vec![single(Vec3::zero(), radius)],
        Shape::Capsule { radius, length, points } => {
            let place = |index: usize| length * (index as f64 / (points - 1) as f64 - 0.5);
            (0..points).map(|index| single(vec3(place(index), 0.0, 0.0), radius)).collect()
        }
        Shape::Box { half } => {
            let sign = |index: usize, bit: usize| if index >> bit & 1 == 0 { -1.0 } else { 1.0 };
            let corner = |index| vec3(sign(index, 0) * half.x, sign(index, 1) * half.y, sign(index, 2) * half.z);
            (0..8).map(|index| single(corner(index), 0.0)).collect()
        }
        Shape::Cylinder { radius, length, points } => {
            [-0.5, 0.5].into_iter().flat_map(|end| circle(end * length, radius, 0.0, points)).collect()
        }
        Shape::Frustum { front, back, length, points } => {
            [(0.0, front), (length, back)].into_iter().flat_map(|(x, radius)| circle(x, radius, 0.0, points)).collect()
        }
        Shape::Ring { radius, tube, points } => circle(0.0, radius, tube, points).collect(),
    }
}

/// Points on a circle about x.
fn circle(x: f64, circle: f64, radius: f64, points: usize) -> impl Iterator<Item = Feature> {
    (0..points).map(move |index| {
        let (sine, cosine) = (TAU * index as f64 / points as f64).sin_cos();
        let position = vec3(x, circle * cosine, circle * sine);
        Feature { point: ContactPoint { position, radius }, share: OF_A_RIM / points as f64 }
    })
}
