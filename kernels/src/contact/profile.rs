//! Outlines of bodies of revolution: exact signed distance to a polyline in the half plane (axis, radius).

use crate::contact_parts::Shape;
use crate::mesh::Grid;
use crate::real::Real;
use crate::vector::Vec3;

/// Far enough for a front face that no part reaches its rim \[m\].
const FAR: f64 = 1.0e3;

/// The surface of a shape, prepared for signed distances.
#[derive(Clone, Debug)]
pub enum Surface {
    /// Half space x >= 0.
    HalfSpace,
    /// A ball about the origin.
    Sphere {
        /// Radius \[m\].
        radius: f64,
    },
    /// A box about the origin.
    Box {
        /// Half edge lengths \[m\].
        half: Vec3<f64>,
    },
    /// A line on the x axis about the origin, thick by a radius.
    Capsule {
        /// Half length of the line \[m\].
        half: f64,
        /// Radius \[m\].
        radius: f64,
    },
    /// A circle about x, thick by the radius of a tube.
    Ring {
        /// Radius of the circle \[m\].
        radius: f64,
        /// Radius of the tube \[m\].
        tube: f64,
    },
    /// A body of revolution about x, hollow or solid.
    Revolved(Profile),
    /// A mesh, by its grid of distances.
    Mesh(Grid),
}

impl Surface {
    /// The surface of a shape.
    pub fn of(shape: &Shape) -> Self {
        match *shape {
            Shape::Plane => Self::HalfSpace,
            Shape::Sphere { radius } => Self::Sphere { radius },
            Shape::Box { half } => Self::Box { half },
            Shape::Capsule { radius, length, .. } => Self::Capsule { half: 0.5 * length, radius },
            Shape::Ring { radius, tube, .. } => Self::Ring { radius, tube },
            Shape::Cylinder { radius, length, .. } => {
                Self::Revolved(Profile::solid([-0.5 * length, 0.5 * length], [radius; 2]))
            }
            Shape::Frustum { front, back, length, .. } => Self::Revolved(Profile::solid([0.0, length], [front, back])),
            Shape::Cone { mouth, bottom, depth } => {
                Self::Revolved(Profile::polyline(&[[0.0, FAR], [0.0, mouth], [depth, bottom], [depth, 0.0]]))
            }
            Shape::Bore { radius, depth, chamfer: 0.0, .. } => {
                Self::Revolved(Profile::polyline(&[[0.0, FAR], [0.0, radius], [depth, radius], [depth, 0.0]]))
            }
            Shape::Mesh(ref mesh) => Self::Mesh(mesh.grid.clone()),
            Shape::Bore { radius, depth, chamfer, .. } => Self::Revolved(Profile::polyline(&[
                [0.0, FAR],
                [0.0, radius + chamfer],
                [chamfer, radius],
                [depth, radius],
                [depth, 0.0],
            ])),
        }
    }
}

/// One straight piece; free space lies on the side of its normal.
#[derive(Clone, Copy, Debug)]
struct Segment {
    from: [f64; 2],
    along: [f64; 2],
    length: f64,
    normal: [f64; 2],
    /// Distance to the corner at the segment's start is positive (a ridge of the solid) or negative (a groove).
    corner_sign: f64,
}

/// The outline of a body of revolution: of a hollow one from the far rim of its front face inwards to the axis, of a
/// solid one from the middle of its back to the middle of its front.
#[derive(Clone, Debug)]
pub struct Profile {
    segments: Vec<Segment>,
}

/// Signed distance (positive in free space) and its gradient in the half plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlaneDistance<R> {
    pub(crate) distance: R,
    pub(crate) along_axis: R,
    pub(crate) along_radius: R,
}

impl Profile {
    /// The outline of a solid frustum between two ends, with their radii: walking from its back to its front, free space is
    /// on the right hand.
    fn solid([front, back]: [f64; 2], [narrow, wide]: [f64; 2]) -> Self {
        Self::polyline(&[[back, 0.0], [back, wide], [front, narrow], [front, 0.0]])
    }

    fn polyline(corners: &[[f64; 2]]) -> Self {
        let mut segments: Vec<Segment> = Vec::new();
        for pair in corners.windows(2) {
            let step = [pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]];
            let length = step[0].hypot(step[1]);
            let along = [step[0] / length, step[1] / length];
            // Walking from the rim inwards, free space is on the right hand: (along_r, -along_x).
            let normal = [along[1], -along[0]];
            let corner_sign = segments.last().map_or(1.0, |previous| {
                // A left turn folds the free space open: the solid has a ridge there.
                let turn = previous.along[0] * along[1] - previous.along[1] * along[0];
                if turn > 0.0 { 1.0 } else { -1.0 }
            });
            segments.push(Segment { from: pair[0], along, length, normal, corner_sign });
        }
        Self { segments }
    }

    /// Distance of the point (axis, radius): the nearest segment or corner.
    #[inline(always)]
    pub(crate) fn distance<R: Real>(&self, axis: R, radius: R) -> PlaneDistance<R> {
        let mut best = self.segments[0].distance(axis, radius);
        for segment in &self.segments[1..] {
            let other = segment.distance(axis, radius);
            let nearer = other.distance.abs().lt(best.distance.abs());
            best = PlaneDistance {
                distance: R::select(nearer, other.distance, best.distance),
                along_axis: R::select(nearer, other.along_axis, best.along_axis),
                along_radius: R::select(nearer, other.along_radius, best.along_radius),
            };
        }
        best
    }
}

impl Segment {
    /// Over the segment's length its plane, before its start the corner; beyond its end nothing (the next piece's corner).
    #[inline(always)]
    fn distance<R: Real>(&self, axis: R, radius: R) -> PlaneDistance<R> {
        let (x, r) = (axis - R::lit(self.from[0]), radius - R::lit(self.from[1]));
        let s = x.mul_add(R::lit(self.along[0]), r * R::lit(self.along[1]));
        let height = x.mul_add(R::lit(self.normal[0]), r * R::lit(self.normal[1]));
        let (zero, sign) = (R::lit(0.0), R::lit(self.corner_sign));
        let corner = x.mul_add(x, r * r).sqrt();
        let inverse = sign / corner.max(R::lit(1e-20));
        let before = s.lt(zero);
        let beyond = R::lit(self.length).lt(s);
        let over = R::select(beyond, R::lit(4.0 * FAR), height);
        PlaneDistance {
            distance: R::select(before, corner * sign, over),
            along_axis: R::select(before, x * inverse, R::lit(self.normal[0])),
            along_radius: R::select(before, r * inverse, R::lit(self.normal[1])),
        }
    }
}
