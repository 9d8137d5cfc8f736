//! Soft capture ring: part B rides on a rigid ring, and six legs with load control join the ring to its mount on the target.
//!
//! A Stewart mechanism ([`crate::stewart`]): each leg runs from a joint of the mount to a joint of the ring,
//! and its force acts along it, with opposite signs on both. A leg commands stiffness times shortening plus damping times its
//! rate, within a force limit; its actuator follows with a first-order lag. A stop beyond either end of its stroke pushes back.
//!
//! Frames: joints of both ends in part B's frame at the start, when the ring's frame is the mount's. In space the mount is part
//! B's place on the target; on the facility robot 2 holds the mount, and the ring is hardware.

use crate::bundle;
use crate::plant::Plant;
use crate::real::Real;
use crate::space::{Body, Motion, Parts, Wrench};
use crate::stewart::{LEGS, PreparedRing};
use crate::vector::{Mat3, Sym3, Vec3};

bundle! {
    /// A soft capture ring in motion; written every substep.
    Ring {
        body: Body<R>, "1", "the ring, its axes those of part B";
        force: [R; LEGS], "N", "forces of the legs without stops; positive pushes ring and mount apart";
        back: Wrench<R>, "1", "wrench of the legs on the ring about part A's origin, inertial axes; its negative acts on the mount";
        impulse: Vec3<R>, "N s", "momentum at the start, for the account of momentum";
        moment_impulse: Vec3<R>, "kg m^2/s", "angular momentum about the origin at the start, likewise";
        peak_force: R, "N", "greatest force of a leg, stops included";
        peak_stroke: R, "m", "greatest change of a leg's length since the start";
        work: R, "J", "work of the legs on ring and mount";
    }
}

/// Whether part B rides on a ring.
#[inline(always)]
pub fn has_ring(m: &Plant) -> bool {
    m.capture_ring.is_some()
}

/// No ring, or one before its run.
#[inline(always)]
pub fn no_ring<R: Real>() -> Ring<R> {
    crate::fields::filled(R::lit(0.0))
}

/// The ring at rest on its mount, which has the motion of part B in `parts`; legs without force.
#[inline(always)]
pub fn ring_at<R: Real>(m: &Plant, parts: &Parts<R>) -> Ring<R> {
    let Some(PreparedRing { ring, .. }) = &m.capture_ring else { return no_ring() };
    let mount = parts.b;
    let axes = mount.attitude.matrix();
    let lever = axes.times(Vec3::lit(ring.centre));
    let com = mount.position + lever;
    let momentum = (mount.velocity + mount.omega.cross(lever)) * R::lit(ring.mass);
    let spin = axes.times(Sym3::lit(ring.inertia).times(axes.transposed_times(mount.omega)));
    Ring {
        body: Body { com, com_step: Vec3::zero(), attitude: mount.attitude, momentum, spin },
        impulse: momentum,
        moment_impulse: spin + com.cross(momentum),
        ..no_ring()
    }
}

/// Angular velocity of the ring, inertial axes.
#[inline(always)]
fn ring_rate<R: Real>(of: &PreparedRing, axes: Mat3<R>, spin: Vec3<R>) -> Vec3<R> {
    axes.times(Sym3::lit(of.inverse_inertia).times(axes.transposed_times(spin)))
}

/// Motion of part B on its ring.
#[inline(always)]
fn ring_motion<R: Real>(of: &PreparedRing, body: &Body<R>, axes: Mat3<R>) -> Motion<R> {
    let (lever, omega) = (axes.times(Vec3::lit(of.ring.centre)), ring_rate(of, axes, body.spin));
    Motion {
        position: body.com + (body.com_step - lever),
        attitude: body.attitude,
        velocity: body.momentum.scale_add(R::lit(1.0 / of.ring.mass), lever.cross(omega)),
        omega,
    }
}

/// The parts with part B on the ring, from those with part B's mount.
#[inline(always)]
pub fn on_ring<R: Real>(m: &Plant, s: &Ring<R>, parts: &Parts<R>) -> Parts<R> {
    match &m.capture_ring {
        Some(of) => Parts { b: ring_motion(of, &s.body, s.body.attitude.matrix()), ..*parts },
        None => *parts,
    }
}

/// One substep of the ring: part B of `parts` is its mount, and `w` the wrench on part A about A's origin, whose negative acts
/// on the ring.
#[inline(always)]
pub fn push_ring<R: Real>(m: &Plant, s: &Ring<R>, parts: &Parts<R>, w: Wrench<R>) -> Ring<R> {
    let Some(of) = &m.capture_ring else { return *s };
    let ring = &of.ring;
    let (zero, dt) = (R::lit(0.0), R::lit(m.timing.substep));
    let (a, mount) = (parts.a, parts.b);
    let (mount_axes, axes) = (mount.attitude.matrix(), s.body.attitude.matrix());
    let b = ring_motion(of, &s.body, axes);
    // Implicit Euler: stable for any lag.
    let follow = R::lit(m.timing.substep / (ring.lag + m.timing.substep));
    let gap = b.position - mount.position;
    let (mut next, mut sum) = (*s, Wrench::zero());
    for i in 0..LEGS {
        let leg = &ring.legs[i];
        let (near, far) = (mount_axes.times(Vec3::lit(leg.mount)), axes.times(Vec3::lit(leg.ring)));
        let reach = gap + (far - near);
        let length = reach.norm();
        let along = reach * (R::lit(1.0) / length);
        let rate = along.dot((b.velocity - mount.velocity) + (b.omega.cross(far) - mount.omega.cross(near)));
        let stretch = length - R::lit(of.start_lengths[i]);
        let mut wanted = stretch * R::lit(-ring.stiffness) - rate * R::lit(ring.damping);
        if ring.force_limit.is_finite() {
            wanted = wanted.min(R::lit(ring.force_limit)).max(R::lit(-ring.force_limit));
        }
        let force = if ring.lag > 0.0 { (wanted - s.force[i]).mul_add(follow, s.force[i]) } else { wanted };
        let [shorter, longer] = ring.strokes;
        let beyond = (R::lit(-shorter) - stretch).max(zero) - (stretch - R::lit(longer)).max(zero);
        let push = beyond.mul_add(R::lit(ring.stop_stiffness), force);
        sum = Wrench { force: along.scale_add(push, sum.force), moment: far.cross(along * push) + sum.moment };
        next.force[i] = force;
        next.peak_force = next.peak_force.max(push.abs());
        next.peak_stroke = next.peak_stroke.max(stretch.abs());
        next.work = (push * rate).mul_add(dt, next.work);
    }
    let from_a = b.position - a.position;
    next.back = Wrench { force: sum.force, moment: sum.moment + from_a.cross(sum.force) };
    let body = &mut next.body;
    let lever = a.position - (body.com + body.com_step);
    let net = next.back - w;
    body.momentum = net.force.scale_add(dt, body.momentum);
    body.spin = (net.moment + lever.cross(net.force)).scale_add(dt, body.spin);
    body.com_step = body.momentum.scale_add(dt * R::lit(1.0 / ring.mass), body.com_step);
    // Midpoint rule, as of the target.
    let half = body.attitude.turned(ring_rate(of, axes, body.spin) * (dt * R::lit(0.5)));
    body.attitude = body.attitude.turned(ring_rate(of, half.matrix(), body.spin) * dt);
    next
}

/// Closes a tick: the centre of mass takes over its step.
#[inline(always)]
pub fn settle_ring<R: Real>(m: &Plant, s: &Ring<R>) -> Ring<R> {
    if !has_ring(m) {
        return *s;
    }
    let body = Body { com: s.body.com + s.body.com_step, com_step: Vec3::zero(), ..s.body };
    Ring { body, ..*s }
}

/// What the ring adds to the linear momentum and to the angular momentum about the origin since the start.
#[inline(always)]
pub(crate) fn ring_momenta<R: Real>(s: &Ring<R>) -> (Vec3<R>, Vec3<R>) {
    let (body, place) = (&s.body, s.body.com + s.body.com_step);
    (body.momentum - s.impulse, (body.spin + place.cross(body.momentum)) - s.moment_impulse)
}
