//! A contact between two parts, from their measured relative motion to the force between them.
//!
//! The plate lies in x and y, z is its normal, out of it; the other part is a point. Force of the plate on the point:
//! a spring and a damper over the depth, never pulling but by adhesion, and bristles against the sliding. Nothing is
//! integrated but the bristles, the plate on its mount and the sensor's low-pass: errors of the law do not add up.

use super::Block;
use super::low_pass::LowPass;
use crate::bundle;
use crate::contact::REFERENCE_DEPTH;
use crate::fields::filled;
use crate::math::{exp, log};
use crate::real::Real;
use crate::vector::{Vec3, vec3};

bundle! {
    /// A contact's values, effects and what may differ unnoticed.
    ContactValues {
        stiffness: R, "N/m", "normal stiffness at a depth of 1 mm";
        exponent: R, "1", "exponent of force over depth";
        damping: R, "N s/m", "normal damping at any depth";
        damping_onset: R, "m", "depth over which the damping sets in";
        depth_damping: R, "N s/m^2", "normal damping per depth";
        friction: R, "1", "friction coefficient";
        stribeck: R, "1", "friction coefficient at rest beyond that of sliding";
        stribeck_speed: R, "m/s", "speed at which that has fallen to 1/e";
        anisotropy: R, "1", "share by which friction along x is higher and along y lower";
        anisotropy_across: R, "1", "the same along the diagonals: x = y higher, x = -y lower";
        presliding_travel: R, "m", "travel in which the distance to sliding friction falls to 1/e";
        bristle_lead: R, "s", "damping of the bristles over their stiffness: time by which friction leads them";
        surface: R, "m", "height of the surface";
        adhesion: R, "N", "tension between the parts before they separate";
        adhesion_range: R, "m", "distance at which the adhesion is zero";
        fixture_compliance: R, "m/N", "compliance of the plate's mount";
        fixture_frequency: R, "Hz", "frequency of the plate on its mount";
        fixture_damping: R, "1", "its damping ratio";
        bias: Vec3<R>, "N", "force that is read without any";
        lag: R, "s", "time constant of the force sensor's low-pass";
        clock_offset: R, "s", "delay of the force against its time stamp, without a common clock";
    }
}

impl ContactValues<f64> {
    /// A contact without stiffness, friction, errors or compliance of the mount.
    pub fn null() -> Self {
        Self {
            exponent: 1.0,
            stribeck_speed: 0.01,
            presliding_travel: 1e-4,
            adhesion_range: 1e-4,
            fixture_frequency: 100.0,
            fixture_damping: 0.02,
            ..filled(0.0)
        }
    }
}

bundle! {
    /// Nothing that the contact needs is on the force sensor's clock but the time.
    ContactClock {
        time: R, "s", "time since the session began";
    }
}

bundle! {
    /// Relative motion of the parts.
    ContactMotion {
        position: Vec3<R>, "m", "point of one part over the plate of the other";
        rate: Vec3<R>, "m/s", "its rate";
    }
}

bundle! {
    /// What is hidden in a contact.
    ContactHidden {
        position: Vec3<R>, "m", "where the point was";
        bristle: Vec3<R>, "1", "deflection of the bristles, of length 1 when they slide; none along z";
        plate: R, "m", "how far the plate has moved on its mount, out of its surface";
        plate_rate: R, "m/s", "its rate, half a step earlier";
        force: Vec3<R>, "N", "force of the plate on the point";
        filtered: Vec3<R>, "N", "the same behind the low-pass";
    }
}

bundle! {
    /// Output of a contact's model for a recording.
    ContactOutput {
        force: Vec3<R>, "N", "force of the plate on the point as the sensor reads it";
    }
}

/// A contact, from relative motion to force.
#[derive(Clone, Copy, Debug, Default)]
pub struct ContactBlock;

impl Block for ContactBlock {
    type Params<R: Real> = ContactValues<R>;
    type State<R: Real> = ContactHidden<R>;
    type Input<R: Real> = ContactClock<R>;
    type Late<R: Real> = ContactMotion<R>;
    type Output<R: Real> = ContactOutput<R>;

    #[inline(always)]
    fn lateness<R: Real>(&self, p: &ContactValues<R>, _time: R) -> R {
        p.clock_offset
    }

    #[inline(always)]
    fn start<R: Real>(&self, p: &ContactValues<R>, _u: &ContactClock<R>, late: &ContactMotion<R>) -> ContactHidden<R> {
        let (zero, none) = (R::lit(0.0), Vec3::zero());
        // The plate where a mount in balance holds it, with the force before it deflects.
        let rigid = normal(p, depth(p, zero, late), -late.rate.z);
        let plate = -(p.fixture_compliance * rigid);
        let force = vec3(zero, zero, normal(p, depth(p, plate, late), -late.rate.z));
        ContactHidden { position: late.position, bristle: none, plate, plate_rate: zero, force, filtered: force }
    }

    /// The plate by kick and drift, its mount's damper by the midpoint rule, and the rate that the contact feels carried
    /// on to the instant's: exact to second order.
    #[inline(always)]
    fn advance<R: Real>(
        &self,
        step: f64,
        p: &ContactValues<R>,
        s: &ContactHidden<R>,
        _u: &ContactClock<R>,
        late: &ContactMotion<R>,
    ) -> ContactHidden<R> {
        let dt = R::lit(step);
        let omega = p.fixture_frequency * R::lit(std::f64::consts::TAU);
        let pulled = p.fixture_compliance.mul_add(s.force.z, s.plate) * omega * omega * dt;
        let (one, slowed) = (R::lit(1.0), p.fixture_damping * omega * dt);
        let plate_rate = ((one - slowed) * s.plate_rate - pulled) / (one + slowed);
        let plate = plate_rate.mul_add(dt, s.plate);
        let rate_now = (plate_rate - s.plate_rate).mul_add(R::lit(0.5), plate_rate);

        let push = normal(p, depth(p, plate, late), rate_now - late.rate.z);
        let bristle = bristles(p, s.bristle, late.position - s.position, push);
        let force = friction(p, bristle, push, late.rate) + vec3(R::lit(0.0), R::lit(0.0), push);
        let filtered = LowPass::of(step, p.lag).after_vector(s.force, force, Vec3::zero(), s.filtered);
        ContactHidden { position: late.position, bristle, plate, plate_rate, force, filtered }
    }

    #[inline(always)]
    fn output<R: Real>(
        &self,
        p: &ContactValues<R>,
        s: &ContactHidden<R>,
        _u: &ContactClock<R>,
        _late: &ContactMotion<R>,
    ) -> ContactOutput<R> {
        ContactOutput { force: s.filtered + p.bias }
    }
}

/// How deep the point is in the plate, which has moved on its mount.
#[inline(always)]
fn depth<R: Real>(p: &ContactValues<R>, plate: R, late: &ContactMotion<R>) -> R {
    p.surface + plate - late.position.z
}

/// Normal force at a depth that grows at a rate.
#[inline(always)]
fn normal<R: Real>(p: &ContactValues<R>, depth: R, rate: R) -> R {
    let (zero, one) = (R::lit(0.0), R::lit(1.0));
    let near = (depth / p.adhesion_range + one).max(zero).min(one);
    pressed(p, depth.max(zero), rate) - p.adhesion * near
}

/// The part of it that pushes, which is none where nothing is inside.
#[inline(always)]
fn pressed<R: Real>(p: &ContactValues<R>, inside: R, rate: R) -> R {
    let (zero, one) = (R::lit(0.0), R::lit(1.0));
    if inside.is_absent() {
        return zero;
    }
    let relative = inside.max(R::lit(1e-12)) * R::lit(1.0 / REFERENCE_DEPTH);
    let spring = p.stiffness * inside * exp(log(relative) * (p.exponent - one));
    let damping = p.depth_damping.mul_add(inside, p.damping);
    // Rough parts touch one after the other: a damper that is there at once would make a blow begin with a jump.
    let set_in = one - exp(-(inside / p.damping_onset.max(R::lit(1e-12))));
    let push = (damping * set_in).mul_add(rate, spring).max(zero);
    R::select(zero.lt(inside), push, zero)
}

/// The bristles after a further way under a push: Dahl's model, exact for a straight way, in the plane.
#[inline(always)]
fn bristles<R: Real>(p: &ContactValues<R>, bristle: Vec3<R>, way: Vec3<R>, push: R) -> Vec3<R> {
    let (zero, none) = (R::lit(0.0), Vec3::zero());
    if !R::any(zero.lt(push)) {
        return none;
    }
    let way = vec3(way.x, way.y, zero);
    let length = way.norm();
    let ahead = way * (R::lit(1.0) / length.max(R::lit(1e-30)));
    let bent = (bristle - ahead).scale_add(exp(-(length / p.presliding_travel)), ahead);
    Vec3::select(zero.lt(push), bent, none)
}

/// Friction under a push, against bristles that the sliding has bent and bends further.
#[inline(always)]
fn friction<R: Real>(p: &ContactValues<R>, bristle: Vec3<R>, push: R, rate: Vec3<R>) -> Vec3<R> {
    if !R::any(R::lit(0.0).lt(push)) {
        return Vec3::zero();
    }
    let speed = rate.x.mul_add(rate.x, rate.y * rate.y).sqrt();
    let level = exp(-(speed / p.stribeck_speed)).mul_add(p.stribeck, p.friction) * push.max(R::lit(0.0));
    let bending = (rate - bristle * speed) * (R::lit(1.0) / p.presliding_travel);
    let bristle = bending.scale_add(p.bristle_lead, bristle);
    let along = p.anisotropy.mul_add(bristle.x, p.anisotropy_across.mul_add(bristle.y, bristle.x));
    let across = p.anisotropy_across.mul_add(bristle.x, bristle.y - p.anisotropy * bristle.y);
    vec3(along, across, R::lit(0.0)) * -level
}
