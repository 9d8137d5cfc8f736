//! Signed distances of a part's solids, exact but for meshes, and of their union, with the direction out of the material.

use crate::contact::profile::{Profile, Surface};
use crate::contact_parts::ENDLESS;
use crate::mesh::Grid;
use crate::plant::PreparedSolid;
use crate::real::Real;
use crate::vector::{Vec3, vec3};

/// Signed distance (positive in free space) and unit normal pointing out of the solid.
#[derive(Clone, Copy, Debug)]
pub struct Distance<R> {
    /// Distance to the surface \[m\].
    pub distance: R,
    /// Outward normal; in the frame of the query.
    pub normal: Vec3<R>,
    /// Half thickness of the nearest solid: deeper in, its other side is nearer \[m\].
    pub half_thickness: R,
}

/// A distance and a direction in a solid's own frame.
struct Local<R> {
    distance: R,
    normal: Vec3<R>,
}

/// Distance of a point to the union of a part's solids, in the part's frame.
#[inline(always)]
pub fn union_distance<R: Real>(solids: &[PreparedSolid], point: Vec3<R>) -> Distance<R> {
    nearest_solid::<R, true>(solids, point)
}

/// [`union_distance`]; without `MESHES` none of the solids may be one.
#[inline(always)]
pub(crate) fn nearest_solid<R: Real, const MESHES: bool>(solids: &[PreparedSolid], point: Vec3<R>) -> Distance<R> {
    let normal = vec3(R::lit(-1.0), R::lit(0.0), R::lit(0.0));
    let far = Distance { distance: R::lit(1.0e3), normal, half_thickness: R::lit(ENDLESS) };
    let mut best = far;
    for solid in solids {
        let other = distance_to::<R, MESHES>(solid, point);
        let nearer = other.distance.lt(best.distance);
        best = Distance {
            distance: R::select(nearer, other.distance, best.distance),
            normal: Vec3::select(nearer, other.normal, best.normal),
            half_thickness: R::select(nearer, other.half_thickness, best.half_thickness),
        };
    }
    best
}

/// Distance of a point to a solid, in the frame of its part.
#[inline(always)]
pub fn solid_distance<R: Real>(solid: &PreparedSolid, point: Vec3<R>) -> Distance<R> {
    distance_to::<R, true>(solid, point)
}

#[inline(always)]
fn distance_to<R: Real, const MESHES: bool>(solid: &PreparedSolid, point: Vec3<R>) -> Distance<R> {
    let local = solid.to_local(point);
    let d = match &solid.surface {
        Surface::HalfSpace => half_space(local),
        Surface::Sphere { radius } => sphere(*radius, local),
        Surface::Box { half } => cuboid(*half, local),
        Surface::Capsule { half, radius } => capsule(*half, *radius, local),
        Surface::Ring { radius, tube } => ring(*radius, *tube, local),
        Surface::Revolved(profile) => revolved(profile, local),
        Surface::Mesh(grid) if MESHES => mesh(grid, local),
        Surface::Mesh(_) => unreachable!("a law with a mesh has a function of its own"),
    };
    let half_thickness = R::lit(solid.solid.shape.half_thickness());
    Distance { distance: d.distance, normal: solid.to_part(d.normal), half_thickness }
}

/// The half space x >= 0.
#[inline(always)]
fn half_space<R: Real>(p: Vec3<R>) -> Local<R> {
    Local { distance: -p.x, normal: vec3(R::lit(-1.0), R::lit(0.0), R::lit(0.0)) }
}

/// A mesh, interpolated in its grid.
#[inline(always)]
fn mesh<R: Real>(grid: &Grid, p: Vec3<R>) -> Local<R> {
    let read = grid.read(p);
    Local { distance: read.distance, normal: read.normal }
}

/// A body of revolution about x.
#[inline(always)]
fn revolved<R: Real>(profile: &Profile, p: Vec3<R>) -> Local<R> {
    let radius = p.y.mul_add(p.y, p.z * p.z).sqrt();
    let inverse = R::lit(1.0) / radius.max(R::lit(1e-15));
    let d = profile.distance(p.x, radius);
    let radial = d.along_radius * inverse;
    Local { distance: d.distance, normal: vec3(d.along_axis, radial * p.y, radial * p.z) }
}

/// A sphere about the nearest point of the axis.
#[inline(always)]
fn capsule<R: Real>(half: f64, radius: f64, p: Vec3<R>) -> Local<R> {
    let along = p.x.max(R::lit(-half)).min(R::lit(half));
    sphere(radius, vec3(p.x - along, p.y, p.z))
}

/// A sphere about the nearest point of the tube's circle.
#[inline(always)]
fn ring<R: Real>(radius: f64, tube: f64, p: Vec3<R>) -> Local<R> {
    let across = p.y.mul_add(p.y, p.z * p.z).sqrt();
    let share = R::lit(radius) / across.max(R::lit(1e-15));
    sphere(tube, vec3(p.x, p.y - p.y * share, p.z - p.z * share))
}

#[inline(always)]
fn sphere<R: Real>(radius: f64, p: Vec3<R>) -> Local<R> {
    let norm = p.norm();
    Local { distance: norm - R::lit(radius), normal: p * (R::lit(1.0) / norm.max(R::lit(1e-15))) }
}

/// Outside: distance to the nearest face, edge or corner. Inside: to the nearest face.
#[inline(always)]
fn cuboid<R: Real>(half: Vec3<f64>, p: Vec3<R>) -> Local<R> {
    let (zero, one) = (R::lit(0.0), R::lit(1.0));
    let sign = p.map(|c| R::select(c.lt(zero), -one, one));
    let q = p.map(Real::abs) - Vec3::lit(half);
    let outside = q.map(|c| c.max(zero));
    let reach = outside.norm();
    let deepest = q.x.max(q.y).max(q.z);
    let face = vec3(
        R::select(q.y.le(q.x) & q.z.le(q.x), one, zero),
        R::select(q.x.lt(q.y) & q.z.le(q.y), one, zero),
        R::select(q.x.lt(q.z) & q.y.lt(q.z), one, zero),
    );
    let inside = deepest.le(zero);
    let normal = Vec3::select(inside, face, outside * (one / reach.max(R::lit(1e-15))));
    Local { distance: R::select(inside, deepest, reach), normal: normal.zip(sign, |n, s| n * s) }
}
