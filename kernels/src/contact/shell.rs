//! The shell of a mesh against the solids of the other part: normal forces point by point, friction of all together.
//!
//! Everything up to the wrench is in the axes of the part with the solids, seen from the origin of the part with the
//! points. A shell has one bristle: at the centre of its normal forces, with their sum as load.

use super::mesh::ShellPoint;
use super::{PointContact, PointState, counted_depth, law::Law};
use crate::bundle;
use crate::contact::distance::union_distance;
use crate::contact_parts::Side;
use crate::material::Pair;
use crate::plant::{ContactPair, Plant, ShellOfPair};
use crate::real::Real;
use crate::space::{Motion, Parts, Wrench};
use crate::vector::{Mat3, Sym3, Vec3};

/// Force per share below which a shell counts as unloaded: keeps quotients finite \[N\].
const LEAST: f64 = 1e-20;

bundle! {
    /// Motion of the part with the points relative to that with the solids, in the latter's axes.
    Relative {
        axes: Mat3<R>, "1", "axes of the part with the points";
        position: Vec3<R>, "m", "its origin";
        velocity: Vec3<R>, "m/s", "velocity of its origin";
        omega: Vec3<R>, "rad/s", "its rate";
        near: R, "1", "1 if the shell is so near that a point may touch";
    }
}

bundle! {
    /// The points of a shell together.
    ShellTouch {
        force: Vec3<R>, "N", "sum of the normal forces";
        moment: Vec3<R>, "N m", "their moment about the origin of the part with the points";
        load: R, "N", "sum of their sizes";
        centre: Vec3<R>, "N m", "sum of the places, weighted by the sizes";
        normals: Sym3<R>, "N", "sum of the squared normals, weighted by the sizes";
        share: R, "1", "share of the points that push";
        depth: R, "m", "largest overlap";
        approach: R, "m/s", "largest speed of approach at the touch";
    }
}

/// Relative motion of the parts for a shell.
#[inline(always)]
pub fn relative<R: Real>(m: &Plant, shell: &ShellOfPair, parts: &Parts<R>) -> Relative<R> {
    let of = &m.pairs[shell.pair];
    let (own, other) = of_points(of, parts);
    let (own_axes, axes) = (own.attitude.matrix(), other.attitude.matrix());
    let offset = own.position - other.position;
    let in_other = |v: Vec3<R>| axes.transposed_times(v);
    let mut relative = Relative {
        axes: Mat3 { x: in_other(own_axes.x), y: in_other(own_axes.y), z: in_other(own_axes.z) },
        position: in_other(offset),
        velocity: in_other((own.velocity - other.velocity) - other.omega.cross(offset)),
        omega: in_other(own.omega - other.omega),
        near: R::lit(1.0),
    };
    let centre = relative.axes.times(Vec3::lit(shell.ball.centre)) + relative.position;
    let reach = R::lit(shell.ball.radius + shell.slack);
    let is_near = union_distance(&of.solids, centre).distance.lt(reach);
    relative.near = R::select(is_near, R::lit(1.0), R::lit(0.0));
    relative
}

/// The motions of the parts with the points and with the solids.
#[inline(always)]
fn of_points<'a, R: Real>(of: &ContactPair, parts: &'a Parts<R>) -> (&'a Motion<R>, &'a Motion<R>) {
    match of.points_of {
        Side::A => (&parts.a, &parts.b),
        Side::B => (&parts.b, &parts.a),
    }
}

/// No point yet.
#[inline(always)]
pub fn no_shell_touch<R: Real>() -> ShellTouch<R> {
    let zero = R::lit(0.0);
    ShellTouch { depth: R::lit(-1.0e3), ..crate::fields::filled(zero) }
}

/// With one point more. `before` is what the shell kept.
///
/// A point pushes by the share of its area that faces the surface: of the two points of an edge that lie in one place, one
/// for each face, only that of the face in contact.
#[inline(always)]
pub fn shell_point<R: Real>(
    m: &Plant,
    of: &ContactPair,
    pair: &Pair<R>,
    relative: &Relative<R>,
    point: &ShellPoint<R>,
    before: R,
    sum: &ShellTouch<R>,
) -> ShellTouch<R> {
    let zero = R::lit(0.0);
    let lever = relative.axes.times(point.position);
    let surface = union_distance(&of.solids, lever + relative.position);
    let normal = surface.normal;
    let facing = (-relative.axes.times(point.normal).dot(normal)).max(zero);
    let depth = -surface.distance;
    let sink_rate = -(relative.velocity + relative.omega.cross(lever)).dot(normal);
    let law = Law { m, of, pair };
    let approach = law.approach(depth, sink_rate, before);
    let share = point.share * facing;
    let force = law.normal_force(depth, sink_rate, approach) * share;
    let depth = if of.is_thin { counted_depth(m, depth, surface.distance, surface.half_thickness) } else { depth };
    let push = normal * force;
    let size = force.abs();
    ShellTouch {
        force: sum.force + push,
        moment: sum.moment + lever.cross(push),
        load: sum.load + force,
        centre: lever.scale_add(size, sum.centre),
        normals: sum.normals.plus_outer(normal * size, normal),
        share: R::select(zero.lt(size), sum.share + share, sum.share),
        depth: sum.depth.max(depth),
        approach: sum.approach.max(approach),
    }
}

/// What the shell does: the normal forces and the friction of its one bristle.
///
/// The slip is that at the centre of the forces, without its part along the normals: the mean projection, weighted by the
/// forces. A peg that is pressed from all sides has friction along its axis, although its normals cancel.
#[inline(always)]
pub fn shell_contact<R: Real>(
    m: &Plant,
    of: &ContactPair,
    pair: &Pair<R>,
    parts: &Parts<R>,
    relative: &Relative<R>,
    sum: &ShellTouch<R>,
    state: &PointState<R>,
) -> PointContact<R> {
    let (zero, one) = (R::lit(0.0), R::lit(1.0));
    // Of the sizes, so that a pull divides as a push does.
    let size = (sum.normals.xx + sum.normals.yy) + sum.normals.zz;
    let inverse = one / size.max(R::lit(LEAST));
    let centre = sum.centre * inverse;
    let flat = |v: Vec3<R>| v - sum.normals.times(v) * inverse;
    let slip = flat(relative.velocity + relative.omega.cross(centre));
    let law = Law { m, of, pair };
    let share = sum.share.max(R::lit(LEAST));
    let (friction, bristle) = law.friction(sum.load / share, slip, flat(state.bristle), Vec3::zero());
    let friction = friction * sum.share;
    let (own, other) = of_points(of, parts);
    let axes = other.attitude.matrix();
    let force = axes.times(sum.force + friction);
    let moment = axes.times(sum.moment + centre.cross(friction));
    let (normal, lever) = (axes.times(sum.force), axes.times(centre));
    let normal = normal * (one / normal.norm().max(R::lit(LEAST)));
    let approach = if of.law.needs_approach() { sum.approach.max(zero) } else { state.approach };
    let state = PointState { bristle, approach };
    let (depth, load) = (sum.depth, sum.load);
    match of.points_of {
        Side::A => PointContact { wrench: Wrench { force, moment }, state, depth, force: load, normal, lever },
        Side::B => {
            let offset = own.position - other.position;
            let wrench = Wrench { force: -force, moment: -(moment + offset.cross(force)) };
            PointContact { wrench, state, depth, force: load, normal: -normal, lever: offset + lever }
        }
    }
}

/// The whole shell: point by point, then together.
#[inline(always)]
pub fn touch_shell<R: Real>(
    m: &Plant,
    shell: &ShellOfPair,
    pair: &Pair<R>,
    parts: &Parts<R>,
    state: &PointState<R>,
) -> PointContact<R> {
    let of = &m.pairs[shell.pair];
    let relative = relative(m, shell, parts);
    let mut sum = no_shell_touch();
    if R::any(R::lit(0.0).lt(relative.near)) {
        // No iterator: what it calls might be compiled for any processor.
        let mut index = 0;
        while index < shell.points.len() {
            let point = &shell.points[index];
            let point = ShellPoint {
                position: Vec3::lit(point.position),
                normal: Vec3::lit(point.normal),
                share: R::lit(point.share),
            };
            sum = shell_point(m, of, pair, &relative, &point, state.approach, &sum);
            index += 1;
        }
    }
    shell_contact(m, of, pair, parts, &relative, &sum, state)
}
