//! A rigid box tossed onto a plane: free flight, and contact of its eight corners.
//!
//! A recording is cut into segments. Each begins with a measured state, so that nothing chaotic adds up over several
//! blows, and ends with what is compared: how far the body has come in it, and how far it has turned. Each corner is a
//! ball on a spring that gives back the square of the restitution of the work done on it (Walton and Braun, J. Rheol. 30
//! (1986) 949): the restitution of a single blow is then the same for every speed and every effective mass, as in the
//! impulsive law that a simulation usually has.

use super::Block;
use crate::bundle;
use crate::contact::REFERENCE_DEPTH;
use crate::fields::filled;
use crate::math::{atan2, exp};
use crate::real::Real;
use crate::vector::{Quat, Vec3, vec3};

bundle! {
    /// A tossed body's values and effects; the world's z points up, the plane lies near z = 0.
    TossValues {
        mass: R, "kg", "mass";
        inertia: Vec3<R>, "kg m^2", "moments of inertia about the centre of mass";
        centre: Vec3<R>, "m", "centre of mass from the middle of the box, body axes";
        half_width: R, "m", "half the edge of the box";
        corner_radius: R, "m", "radius of its corners";
        gravity: Vec3<R>, "m/s^2", "acceleration of free fall";
        drag: R, "1/m", "deceleration by the air over the square of the speed";
        stiffness: R, "N/m", "stiffness of a corner at a depth of 1 mm";
        hardening: R, "1", "share by which the stiffness is greater for each further millimetre of depth";
        restitution: R, "1", "speed after a blow over that before";
        depth_damping: R, "N s/m^2", "damping per depth besides: the restitution then falls with the speed";
        friction: R, "1", "friction coefficient";
        stribeck: R, "1", "friction coefficient at rest beyond that of sliding";
        stribeck_speed: R, "m/s", "speed at which that has fallen to 1/e";
        anisotropy: R, "1", "share by which friction along x is higher and along y lower";
        anisotropy_across: R, "1", "the same along the diagonals: x = y higher, x = -y lower";
        rolling: R, "m", "lever of the moment against rolling and spinning";
        surface: R, "m", "height of the plane at x = y = 0";
        slope_x: R, "1", "its slope along x";
        slope_y: R, "1", "its slope along y";
    }
}

impl TossValues<f64> {
    /// A box of a kilogram with edges of two metres that flies without weight.
    pub fn null() -> Self {
        Self { mass: 1.0, inertia: Vec3::splat(2.0 / 3.0), half_width: 1.0, stribeck_speed: 0.1, ..filled(0.0) }
    }
}

bundle! {
    /// What was measured at an instant, where a segment begins or ends.
    TossInput {
        begins: R, "1", "1 where a segment begins, and the one before ends";
        position: Vec3<R>, "m", "middle of the box at its begin";
        attitude: Quat<R>, "1", "rotation from body to world axes";
        velocity: Vec3<R>, "m/s", "velocity of the middle";
        rate: Vec3<R>, "rad/s", "angular rate, body axes";
        way_weight: R, "1", "weight of the displacement in the segment that ends here";
        turn_weight: R, "1", "weight of the turn in it";
    }
}

bundle! {
    /// Nothing is on another clock but the time.
    TossClock {
        time: R, "s", "time since the recording's start";
    }
}

bundle! {
    /// A tossed body.
    TossHidden {
        position: Vec3<R>, "m", "centre of mass";
        attitude: Quat<R>, "1", "rotation from body to world axes";
        velocity: Vec3<R>, "m/s", "velocity of the centre of mass";
        rate: Vec3<R>, "rad/s", "angular rate, body axes";
        from: Vec3<R>, "m", "middle of the box where the segment began";
        facing: Quat<R>, "1", "attitude there";
        way: Vec3<R>, "m", "displacement of the centre before a new segment starts";
        turn: Quat<R>, "1", "how far the body has turned, likewise, in its axes at the begin";
        speed: Vec3<R>, "m/s", "velocity of the middle, likewise";
    }
}

bundle! {
    /// Output of the model at the end of a segment.
    TossOutput {
        way: Vec3<R>, "m", "displacement of the centre since the segment's start, weighted";
        turn: Vec3<R>, "rad", "rotation vector since then in the body's axes at the begin, weighted";
        velocity: Vec3<R>, "m/s", "velocity of the middle";
    }
}

/// A tossed body, from measured states to the next.
#[derive(Clone, Copy, Debug, Default)]
pub struct TossBlock;

/// Speed over which a corner's spring changes between deepening and rising \[m/s\]: slow against any blow.
const TURNING_SPEED: f64 = 2e-3;
/// Share of the mass that resists a corner's sliding at least: it bounds how fast friction may act within a step.
const SLIDING_SHARE: f64 = 0.25;
/// Rate over which the moment against rolling sets in \[rad/s\].
const ROLLING_RATE: f64 = 0.1;
/// The corners of a box.
const CORNERS: [[f64; 3]; 8] = [
    [-1.0, -1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, 1.0, 1.0],
    [1.0, -1.0, -1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, -1.0],
    [1.0, 1.0, 1.0],
];

impl Block for TossBlock {
    type Params<R: Real> = TossValues<R>;
    type State<R: Real> = TossHidden<R>;
    type Input<R: Real> = TossInput<R>;
    type Late<R: Real> = TossClock<R>;
    type Output<R: Real> = TossOutput<R>;

    #[inline(always)]
    fn lateness<R: Real>(&self, _p: &TossValues<R>, _time: R) -> R {
        R::lit(0.0)
    }

    #[inline(always)]
    fn start<R: Real>(&self, p: &TossValues<R>, u: &TossInput<R>, _late: &TossClock<R>) -> TossHidden<R> {
        begun(p, u, Vec3::zero(), Quat::identity(), u.velocity)
    }

    /// Half a drift, a kick, half a drift.
    #[inline(always)]
    fn advance<R: Real>(
        &self,
        step: f64,
        p: &TossValues<R>,
        s: &TossHidden<R>,
        u: &TossInput<R>,
        _late: &TossClock<R>,
    ) -> TossHidden<R> {
        let (half, dt) = (R::lit(0.5 * step), R::lit(step));
        let at = drifted(half, s);
        let push = pushes(step, p, &at);
        let air = -(p.drag * s.velocity.norm());
        let fall = s.velocity.scale_add(air, push.force.scale_add(R::lit(1.0) / p.mass, p.gravity));
        let turning = push.moment - at.rate.cross(at.rate.zip(p.inertia, |rate, inertia| rate * inertia));
        let kicked = TossHidden {
            velocity: fall.scale_add(dt, s.velocity),
            rate: turning.zip(p.inertia, |moment, inertia| moment / inertia).scale_add(dt, s.rate),
            ..at
        };
        let on = drifted(half, &kicked);
        let arm = on.attitude.rotate(p.centre);
        let way = on.position - arm - s.from;
        let turn = s.facing.conjugate().compose(on.attitude);
        let speed = on.velocity - on.attitude.rotate(on.rate.cross(p.centre));
        let ended = TossHidden { way, turn, speed, ..on };
        select(R::lit(0.5).lt(u.begins), begun(p, u, way, turn, speed), ended)
    }

    #[inline(always)]
    fn output<R: Real>(
        &self,
        _p: &TossValues<R>,
        s: &TossHidden<R>,
        u: &TossInput<R>,
        _late: &TossClock<R>,
    ) -> TossOutput<R> {
        TossOutput { way: s.way * u.way_weight, turn: rotation(s.turn) * u.turn_weight, velocity: s.speed }
    }
}

/// The body at the begin of a segment, with what the one before ended with.
#[inline(always)]
fn begun<R: Real>(p: &TossValues<R>, u: &TossInput<R>, way: Vec3<R>, turn: Quat<R>, speed: Vec3<R>) -> TossHidden<R> {
    TossHidden {
        position: u.position + u.attitude.rotate(p.centre),
        attitude: u.attitude,
        velocity: u.velocity + u.attitude.rotate(u.rate.cross(p.centre)),
        rate: u.rate,
        from: u.position,
        facing: u.attitude,
        way,
        turn,
        speed,
    }
}

/// Componentwise choice.
#[inline(always)]
fn select<R: Real>(mask: R::Mask, then: TossHidden<R>, other: TossHidden<R>) -> TossHidden<R> {
    TossHidden {
        position: Vec3::select(mask, then.position, other.position),
        attitude: Quat::select(mask, then.attitude, other.attitude),
        velocity: Vec3::select(mask, then.velocity, other.velocity),
        rate: Vec3::select(mask, then.rate, other.rate),
        from: Vec3::select(mask, then.from, other.from),
        facing: Quat::select(mask, then.facing, other.facing),
        // What a segment ended with is the same in both.
        ..other
    }
}

/// A body on its way, over a time \[s\].
#[inline(always)]
fn drifted<R: Real>(time: R, s: &TossHidden<R>) -> TossHidden<R> {
    let way = s.attitude.rotate(s.rate) * time;
    TossHidden { position: s.velocity.scale_add(time, s.position), attitude: s.attitude.turned(way), ..*s }
}

/// The rotation vector of a turn by less than pi.
#[inline(always)]
fn rotation<R: Real>(turn: Quat<R>) -> Vec3<R> {
    let sine = turn.v.norm();
    let sign = R::select(turn.w.lt(R::lit(0.0)), R::lit(-1.0), R::lit(1.0));
    let angle = R::lit(2.0) * atan2(sine, turn.w * sign);
    // Of a small turn the angle is twice the sine of its half.
    let factor = R::select(R::lit(1e-6).lt(sine), angle / sine.max(R::lit(1e-6)), R::lit(2.0));
    turn.v * (factor * sign)
}

/// Force in world axes, and moment about the centre of mass in body axes.
#[derive(Clone, Copy)]
struct Push<R> {
    force: Vec3<R>,
    moment: Vec3<R>,
}

/// What the plane does to all corners over a step \[s\].
#[inline(always)]
fn pushes<R: Real>(step: f64, p: &TossValues<R>, s: &TossHidden<R>) -> Push<R> {
    let (zero, one) = (R::lit(0.0), R::lit(1.0));
    let length = p.slope_x.mul_add(p.slope_x, p.slope_y.mul_add(p.slope_y, one)).sqrt();
    let normal = vec3(-p.slope_x, -p.slope_y, one) * (one / length);
    let (mut force, mut moment, mut load) = (Vec3::zero(), Vec3::zero(), zero);
    let out = p.half_width - p.corner_radius;
    let spin = s.attitude.rotate(s.rate);
    for corner in CORNERS {
        let place = vec3(R::lit(corner[0]), R::lit(corner[1]), R::lit(corner[2])) * out - p.centre;
        let arm = s.attitude.rotate(place) - normal * p.corner_radius;
        let own = Corner {
            depth: p.surface * normal.z - normal.dot(s.position + arm),
            velocity: s.velocity + spin.cross(arm),
        };
        let push = own.normal(p, normal);
        let on_corner = own.friction(step, p, normal, push) + normal * push;
        force = force + on_corner;
        moment = moment + arm.cross(on_corner);
        load = load + push;
    }
    let held = p.rolling * load / spin.norm().max(R::lit(ROLLING_RATE));
    Push { force, moment: s.attitude.rotate_back(moment - spin * held) }
}

/// The lowest point of a corner.
struct Corner<R> {
    /// Below the plane \[m\].
    depth: R,
    /// World axes \[m/s\].
    velocity: Vec3<R>,
}

impl<R: Real> Corner<R> {
    /// Force of the plane along its normal: a spring that is stiffer while it is deepened than while it rises.
    #[inline(always)]
    fn normal(&self, p: &TossValues<R>, normal: Vec3<R>) -> R {
        let (zero, one, half) = (R::lit(0.0), R::lit(1.0), R::lit(0.5));
        let inside = self.depth.max(zero);
        let rate = -normal.dot(self.velocity);
        let more = (inside * R::lit(1.0 / REFERENCE_DEPTH) - one).mul_add(p.hardening, one).max(R::lit(0.05));
        let turning = rate.mul_add(rate, R::lit(TURNING_SPEED * TURNING_SPEED)).sqrt();
        let back = p.restitution * p.restitution;
        let share = ((one - back) * (rate / turning) + one + back) * half;
        let spring = p.stiffness * more * share;
        p.depth_damping.mul_add(rate, spring).max(zero) * inside
    }

    /// Friction under a push, against the sliding; within a step \[s\] it stops the corner at most.
    #[inline(always)]
    fn friction(&self, step: f64, p: &TossValues<R>, normal: Vec3<R>, push: R) -> Vec3<R> {
        let sliding = self.velocity - normal * normal.dot(self.velocity);
        let speed = sliding.norm();
        let level = exp(-(speed / p.stribeck_speed)).mul_add(p.stribeck, p.friction) * push;
        let least = level * R::lit(step) / (p.mass * R::lit(SLIDING_SHARE));
        let along = sliding * (level / speed.max(least).max(R::lit(1e-12)));
        let x = p.anisotropy.mul_add(along.x, p.anisotropy_across.mul_add(along.y, along.x));
        let y = p.anisotropy_across.mul_add(along.x, along.y - p.anisotropy * along.y);
        -vec3(x, y, along.z)
    }
}
