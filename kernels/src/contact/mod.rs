//! Contact stage: points of one part against distances to the other's solids; bristle friction; the capture latch.
//!
//! Signs: depth is positive when the parts overlap, the normal points out of part B, and every force given here
//! acts on part A (its exact negative, at the same point, on part B). Forces are in inertial axes, moments about
//! the origin of part A's frame.

pub mod distance;
pub mod features;
mod law;
pub use crate::mesh;
pub mod overlap;
pub mod profile;
pub mod shell;

pub use law::REFERENCE_DEPTH;
pub use shell::touch_shell;

use crate::bundle;
use crate::contact::distance::nearest_solid;
use crate::contact::law::Law;
use crate::contact_parts::{Finger, Latch, Side};
use crate::fields::literal;
use crate::grip::Grip;
use crate::material::Pair;
use crate::math::atan2;
use crate::params::Params;
use crate::plant::{ContactPair, Plant};
use crate::real::Real;
use crate::space::{Motion, Parts, Wrench};
use crate::vector::{Vec3, vec3};

/// Share of a solid's half thickness up to which a depth counts as it is.
pub const NEAR_MIDDLE: f64 = 0.8;

/// Share of the fingers' way from which on they count as closed.
const GRIPPED: f64 = 0.999;

bundle! {
    /// One contact point.
    Point {
        position: Vec3<R>, "m", "centre, frame of its part";
        radius: R, "m", "radius";
        share: R, "1", "share of the pair's stiffness and damping";
    }
}

bundle! {
    /// What a contact point keeps from substep to substep under one law.
    PointState {
        bristle: Vec3<R>, "m", "tangential deflection, and along the normal the twist of a patch times 2/3 of its radius; axes of the part with the solids";
        approach: R, "m/s", "speed of approach at the touch, 0 when apart; kept for laws that need it";
    }
}

bundle! {
    /// What one contact point does.
    PointContact {
        wrench: Wrench<R>, "1", "wrench on part A about A's origin, inertial axes";
        state: PointState<R>, "1", "what it keeps after the substep";
        depth: R, "m", "overlap, negative when apart";
        force: R, "N", "normal force, positive when pushing apart";
        normal: Vec3<R>, "1", "outward normal of part B, inertial axes";
        lever: Vec3<R>, "m", "contact point from A's origin, inertial axes";
    }
}

bundle! {
    /// The latch after a substep.
    LatchState {
        closed: R, "1", "1 once the latch has closed";
        wrench: Wrench<R>, "1", "wrench on part A about A's origin, inertial axes";
        offset: R, "m", "radial offset of the latch point from the seat's axis";
        distance: R, "m", "distance of the latch point from the seat";
    }
}

/// The pair of the parameters.
#[inline(always)]
pub fn common_pair<R: Real>(p: &Params<R>) -> Pair<R> {
    let none = R::lit(0.0);
    Pair {
        stiffness: p.contact_stiffness,
        damping: p.contact_damping,
        dissipation: p.contact_dissipation,
        friction: p.contact_friction,
        bristle_stiffness: p.bristle_stiffness,
        bristle_damping: p.bristle_damping,
        exponent_error: none,
        stribeck: none,
        stribeck_speed: p.contact_stribeck_speed,
        anisotropy: none,
        adhesion: none,
    }
}

/// The true pair of a law: the loop in space.
#[inline(always)]
pub fn space_pair<R: Real>(of: &ContactPair, p: &Params<R>) -> Pair<R> {
    of.properties.map_or_else(|| common_pair(p), |given| literal(&given))
}

/// The true pairs of all laws of a plant.
pub fn space_pairs(m: &Plant, p: &Params<f64>) -> Vec<Pair<f64>> {
    m.pairs.iter().map(|of| space_pair(of, p)).collect()
}

/// The pair that is mounted on the robots: its errors are those of the parameters, whatever its law.
#[inline(always)]
pub fn hil_pair<R: Real>(of: &ContactPair, p: &Params<R>) -> Pair<R> {
    let one = R::lit(1.0);
    let (damping, space) = (one + p.contact_damping_error, space_pair(of, p));
    let mounted = Pair {
        stiffness: space.stiffness * (one + p.contact_stiffness_error),
        damping: space.damping * damping,
        dissipation: space.dissipation * damping,
        friction: space.friction * (one + p.contact_friction_error),
        exponent_error: p.contact_exponent_error,
        stribeck: p.contact_stribeck,
        anisotropy: p.contact_anisotropy,
        adhesion: p.contact_adhesion,
        ..space
    };
    let Some(given) = of.properties else { return mounted };
    let own_speed = if given.stribeck == 0.0 { p.contact_stribeck_speed } else { space.stribeck_speed };
    Pair {
        stribeck: space.stribeck + mounted.stribeck,
        stribeck_speed: own_speed,
        anisotropy: space.anisotropy + mounted.anisotropy,
        adhesion: space.adhesion + mounted.adhesion,
        ..mounted
    }
}

/// One contact point against the solids of a law, which are of the other part.
#[inline(always)]
pub fn contact_point<R: Real>(
    m: &Plant,
    of: &ContactPair,
    pair: &Pair<R>,
    parts: &Parts<R>,
    point: Point<R>,
    state: PointState<R>,
) -> PointContact<R> {
    match of.has_mesh {
        true => point_on_solids::<R, true>(m, of, pair, parts, point, state),
        false => point_on_solids::<R, false>(m, of, pair, parts, point, state),
    }
}

/// [`contact_point`] against solids of which none is a mesh.
#[inline(always)]
pub fn point_on_exact<R: Real>(
    m: &Plant,
    of: &ContactPair,
    pair: &Pair<R>,
    parts: &Parts<R>,
    point: Point<R>,
    state: PointState<R>,
) -> PointContact<R> {
    point_on_solids::<R, false>(m, of, pair, parts, point, state)
}

/// [`contact_point`] with or without reads of grids: lanes have a function of their own for each, since reads that are
/// never made cost the other contacts registers.
#[inline(always)]
fn point_on_solids<R: Real, const MESHES: bool>(
    m: &Plant,
    of: &ContactPair,
    pair: &Pair<R>,
    parts: &Parts<R>,
    point: Point<R>,
    state: PointState<R>,
) -> PointContact<R> {
    // All up to the force for part A's points; for part B's the parts change their roles.
    let (a, b) = match of.points_of {
        Side::A => (&parts.a, &parts.b),
        Side::B => (&parts.b, &parts.a),
    };
    let centre = a.attitude.rotate(point.position);
    let b_axes = b.attitude.matrix();
    let in_b = b_axes.transposed_times((a.position - b.position) + centre);
    let surface = nearest_solid::<R, MESHES>(&of.solids, in_b);
    let normal = b_axes.times(surface.normal);
    let depth = point.radius - surface.distance;
    let lever = normal.scale_add(-point.radius, centre);
    let velocity = sliding_velocity(a, b, lever);
    let sink_rate = -velocity.dot(normal);
    let law = Law { m, of, pair };
    let approach = law.approach(depth, sink_rate, state.approach);
    let mut force = law.normal_force(depth, sink_rate, approach);
    let depth = if of.is_thin { counted_depth(m, depth, surface.distance, surface.half_thickness) } else { depth };

    let mut slip = b_axes.transposed_times(normal.scale_add(sink_rate, velocity));
    if law.has_patch() {
        let spin = (a.omega - b.omega).dot(normal);
        slip = surface.normal.scale_add(spin * R::lit(law.patch_lever()), slip);
    }
    let (mut friction, bristle) = law.friction(force, slip, state.bristle, surface.normal);
    let mut spun = R::lit(0.0);
    if law.has_patch() {
        spun = friction.dot(surface.normal);
        friction = surface.normal.scale_add(-spun, friction);
    }
    let mut push = normal.scale_add(force, b_axes.times(friction));
    if of.shares {
        (force, push) = (force * point.share, push * point.share);
    }
    let state = PointState { bristle, approach };
    let mut contact = match of.points_of {
        Side::A => {
            let wrench = Wrench { force: push, moment: lever.cross(push) };
            PointContact { wrench, state, depth, force, normal, lever }
        }
        Side::B => {
            let (push, lever) = (-push, (a.position - b.position) + lever);
            let wrench = Wrench { force: push, moment: lever.cross(push) };
            PointContact { wrench, state, depth, force, normal: -normal, lever }
        }
    };
    if law.has_patch() {
        // Against the spin of the part with the points; the normal of the contact is that of part B.
        let own = R::lit(law.patch_lever()) * if of.shares { spun * point.share } else { spun };
        contact.wrench.moment = contact.normal.scale_add(own, contact.wrench.moment);
    }
    contact
}

/// The parts as a finger of part A has them: its frame is displaced with the finger.
#[inline(always)]
pub fn with_finger<R: Real>(finger: &Finger, parts: &Parts<R>, grip: &Grip<R>) -> Parts<R> {
    let a = parts.a;
    let shift = a.attitude.rotate(Vec3::lit(finger.travel) * grip.share);
    let speed = a.attitude.rotate(Vec3::lit(finger.travel) * grip.rate);
    let a = Motion { position: a.position + shift, velocity: a.velocity + (a.omega.cross(shift) + speed), ..a };
    Parts { a, ..*parts }
}

/// What a contact of a finger does to part A: about A's own origin.
#[inline(always)]
pub fn of_finger<R: Real>(finger: &Finger, parts: &Parts<R>, grip: &Grip<R>, c: &PointContact<R>) -> PointContact<R> {
    let shift = parts.a.attitude.rotate(Vec3::lit(finger.travel) * grip.share);
    let moment = c.wrench.moment + shift.cross(c.wrench.force);
    PointContact { wrench: Wrench { moment, ..c.wrench }, lever: c.lever + shift, ..*c }
}

/// Power of a finger's contact on the finger's motion in part A's frame \[W\].
#[inline(always)]
pub fn finger_power<R: Real>(finger: &Finger, parts: &Parts<R>, grip: &Grip<R>, c: &PointContact<R>) -> R {
    parts.a.attitude.rotate(Vec3::lit(finger.travel) * grip.rate).dot(c.wrench.force)
}

/// Depth that a run is judged by. A point that comes near the middle of a solid may leave it on the other side; it counts
/// `task.max_depth` deeper, so that the run is invalid.
#[inline(always)]
fn counted_depth<R: Real>(m: &Plant, depth: R, distance: R, half_thickness: R) -> R {
    let is_through = (half_thickness * R::lit(NEAR_MIDDLE)).lt(-distance);
    R::select(is_through, depth + R::lit(m.task.max_depth), depth)
}

/// Velocity of part A relative to part B at a point given from A's origin.
#[inline(always)]
pub fn sliding_velocity<R: Real>(a: &Motion<R>, b: &Motion<R>, lever: Vec3<R>) -> Vec3<R> {
    let from_b = (a.position - b.position) + lever;
    (a.velocity - b.velocity) + (a.omega.cross(lever) - b.omega.cross(from_b))
}

/// The capture latch: closes on geometry, of a part with fingers once they are closed (`gripped` is their share of the
/// way), then holds part A's latch frame to the seat.
#[inline(always)]
pub fn latch<R: Real>(m: &Plant, p: &Params<R>, parts: &Parts<R>, closed: R, gripped: R) -> LatchState<R> {
    let (zero, one) = (R::lit(0.0), R::lit(1.0));
    let Some(gate) = &m.contact.latch else {
        return LatchState { closed, wrench: Wrench::zero(), offset: zero, distance: zero };
    };
    let (a, b) = (parts.a, parts.b);
    let lever = a.attitude.rotate(Vec3::lit(gate.point));
    let seat = b.attitude.rotate(Vec3::lit(gate.seat));
    let gap = (a.position - b.position) + (lever - seat);
    let velocity = sliding_velocity(&a, &b, lever);
    let x = vec3(one, zero, zero);
    let (a_axis, b_axis) = (a.attitude.rotate(x), b.attitude.rotate(x));
    let axial = gap.dot(b_axis);
    let offset = b_axis.scale_add(-axial, gap).norm();
    let angle = atan2(b_axis.cross(a_axis).norm(), b_axis.dot(a_axis));
    let mut inside = axial.abs().le(R::lit(gate.depth))
        & offset.le(R::lit(gate.offset))
        & angle.le(R::lit(gate.angle))
        & velocity.norm().le(R::lit(gate.speed));
    if !m.contact.fingers.is_empty() {
        inside = inside & R::lit(GRIPPED).lt(gripped);
    }
    let hooked;
    (inside, hooked) = hooks(gate, p, parts, inside);
    let closed = R::select(inside, one, closed);

    // Relative attitude as a rotation vector, exact to third order: a closed latch turns by a few degrees.
    let relative = a.attitude.compose(b.attitude.conjugate());
    let twist = relative.small_rotation_vector();
    let force = velocity.scale_add(-p.latch_damping, gap * -p.latch_stiffness) * closed;
    let moment = (a.omega - b.omega).scale_add(-p.latch_rotation_damping, twist * -p.latch_rotation_stiffness) * closed;
    if !gate.hooks.is_empty() {
        let wrench = Wrench { force: hooked.force * closed, moment: moment + hooked.moment * closed };
        return LatchState { closed, wrench, offset, distance: gap.norm() };
    }
    LatchState { closed, wrench: Wrench { force, moment: moment + lever.cross(force) }, offset, distance: gap.norm() }
}

/// Whether the latch is inside its gate with all hooks that work, and their wrench on part A about A's origin once closed.
#[inline(always)]
fn hooks<R: Real>(gate: &Latch, p: &Params<R>, parts: &Parts<R>, mut inside: R::Mask) -> (R::Mask, Wrench<R>) {
    let (a, b, mut sum) = (&parts.a, &parts.b, Wrench::zero());
    for i in 0..gate.hooks.len() {
        let hook = &gate.hooks[i];
        let lever = a.attitude.rotate(Vec3::lit(hook.point));
        let gap = (a.position - b.position) + (lever - b.attitude.rotate(Vec3::lit(hook.seat)));
        let fails = (p.latch_failed - R::lit(i as f64 + 1.0)).abs().lt(R::lit(0.5));
        inside = inside & (fails | gap.norm().le(R::lit(gate.hook_reach)));
        let pull = sliding_velocity(a, b, lever).scale_add(-p.latch_damping, gap * -p.latch_stiffness);
        let pull = pull * R::select(fails, R::lit(0.0), R::lit(1.0));
        sum = sum + Wrench { force: pull, moment: lever.cross(pull) };
    }
    (inside, sum)
}
