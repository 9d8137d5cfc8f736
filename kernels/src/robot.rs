//! Command and robot stages: simulated motion to laboratory commands, delayed, and followed by two robots and a rail.
//!
//! The laboratory's axes are the inertial ones at the start. Robot 1 carries part A and makes its share of the
//! relative translation, robot 2 carries part B and makes the rest the other way; each turns its own part.

use crate::bundle;
use crate::effects::EffectId;
use crate::fields::Bundle;
use crate::fixture::{Fixture, at_rest, on_fixture};
use crate::model::{Model, Rail};
use crate::params::Params;
use crate::plant::Plant;
use crate::range::MAX_DELAY_S;
use crate::real::Real;
use crate::space::{Motion, Parts};
use crate::vector::{Quat, Vec3};

const SKEW: EffectId = EffectId::of("C5_clock_skew");
const HOLD: EffectId = EffectId::of("C6_hold");
const RATE_LIMIT: EffectId = EffectId::of("C7_rate_limit");

bundle! {
    /// Second-order response of a robot's tool.
    Axes {
        motion: Motion<R>, "1", "actual motion of the tool, laboratory";
        rail: R, "m", "actual rail position";
        rail_rate: R, "m/s", "actual rail speed";
    }
}

bundle! {
    /// Both robots; written by the robot stage.
    Robots {
        robot1: Axes<R>, "1", "robot 1 with part A, on the rail";
        robot2: Axes<R>, "1", "robot 2 with part B";
        fixture: Fixture<R>, "1", "part B's mount on robot 2", of "K10_fixture";
        limited: R, "1", "1 once a robot has met a speed limit";
    }
}

bundle! {
    /// Lost commands of a run; written by the frame when it sends.
    LinkCounts {
        lost: R, "1", "commands lost in a row";
        dropped: R, "1", "1 once one was lost";
    }
}

/// Simulated part motions to laboratory commands.
#[inline(always)]
pub fn command<R: Real>(m: &Model, parts: &Parts<R>) -> Parts<R> {
    let (share, rest) = (R::lit(m.facility.robot1_share), R::lit(m.facility.robot1_share - 1.0));
    let gap = parts.a.position - parts.b.position;
    let slide = parts.a.velocity - parts.b.velocity;
    Parts {
        a: Motion { position: gap * share, velocity: slide * share, ..parts.a },
        b: Motion { position: gap * rest, velocity: slide * rest, ..parts.b },
    }
}

/// Whether the robots are commanded poses alone: those of a facility are, since their protocols have no velocities.
pub fn commands_poses(m: &Plant) -> bool {
    m.facility.session_robots.is_some()
}

/// The third of three neighbouring commands with the velocities that robots find in commanded poses: three-point
/// backward differences, exact for constant acceleration.
#[inline(always)]
pub fn by_differences<R: Real>(m: &Plant, first: &Parts<R>, second: &Parts<R>, third: &Parts<R>) -> Parts<R> {
    Parts { a: differenced(m, first.a, second.a, third.a), b: differenced(m, first.b, second.b, third.b) }
}

#[inline(always)]
fn differenced<R: Real>(m: &Plant, first: Motion<R>, second: Motion<R>, third: Motion<R>) -> Motion<R> {
    // Differences of neighbours first: they are exact in f32, and what poses are rounded by cancels from tick to tick.
    let (new, old) = (R::lit(1.5 / m.timing.tick()), R::lit(-0.5 / m.timing.tick()));
    let (way, turn) = (third.position - second.position, second.attitude.small_rotation_to(third.attitude));
    let (way_before, turn_before) =
        (second.position - first.position, first.attitude.small_rotation_to(second.attitude));
    Motion { velocity: way.scale_add(new, way_before * old), omega: turn.scale_add(new, turn_before * old), ..third }
}

/// Command transport delay in ticks at a time \[s\]: the loop's dead time less the sensor's and the frame's own, what
/// unequal clocks have added to it, and how long a held command is held already.
#[inline(always)]
pub fn transport<R: Real>(m: &Plant, p: &Params<R>, time: R) -> R {
    let mut delay = m.timing.transport_delay(p.loop_delay, p.sensor_delay);
    if m.effects.has(SKEW) {
        delay = time.mul_add(p.clock_skew, delay).min(R::lit(MAX_DELAY_S));
    }
    let delay = (delay * R::lit(1.0 / m.timing.tick())).max(R::lit(0.0));
    if m.effects.has(HOLD) { (delay + held_for(m, p, time)).min(R::lit(MAX_DELAY_S / m.timing.tick())) } else { delay }
}

/// Whole ticks since a held command was taken.
#[inline(always)]
fn held_for<R: Real>(m: &Plant, p: &Params<R>, time: R) -> R {
    let (zero, half, per_second) = (R::lit(0.0), R::lit(0.5), R::lit(1.0 / m.timing.tick()));
    let holds = zero.lt(p.command_hold);
    let period = R::select(holds, p.command_hold * per_second, R::lit(1.0));
    let tick = time.mul_add(per_second, half).floor();
    // Half a tick from every edge, so that rounding puts no tick into the period before it.
    let begun = ((tick + half) / period).floor() * period;
    R::select(holds, (tick - begun).max(zero), zero)
}

/// How much of a tick's commands the robots have come to see after a share of the tick: a held one stands at the
/// first substep's.
#[inline(always)]
pub fn progress<R: Real>(m: &Plant, p: &Params<R>, share: R) -> R {
    if !m.effects.has(HOLD) {
        return share;
    }
    R::select(R::lit(0.0).lt(p.command_hold), R::lit(1.0 / f64::from(m.timing.substeps)), share)
}

/// Extrapolates a command along its twist by `periods` command periods (backwards if negative).
#[inline(always)]
pub fn extrapolate<R: Real>(m: &Plant, parts: &Parts<R>, periods: R) -> Parts<R> {
    let time = periods * R::lit(m.timing.tick());
    Parts { a: move_on(parts.a, time), b: move_on(parts.b, time) }
}

#[inline(always)]
fn move_on<R: Real>(motion: Motion<R>, time: R) -> Motion<R> {
    Motion {
        position: motion.velocity.scale_add(time, motion.position),
        attitude: Quat::from_rotation_vector(motion.omega * time).compose(motion.attitude).normalized(),
        ..motion
    }
}

/// Where the robots are before the first tick of a run: on the commanded course since long, behind it by the delay of
/// the commands and by what their responses lag at constant speed, 2 z lag - T_z.
#[inline(always)]
pub fn on_course<R: Real>(m: &Plant, p: &Params<R>, reference: &Parts<R>) -> Parts<R> {
    let (zero, one) = (R::lit(0.0), R::lit(1.0));
    let behind = (transport(m, p, zero) + one) * R::lit(m.timing.tick());
    let lag = |lag: R, damping: R, lead: R| R::select(zero.lt(lag), (lag * damping).mul_add(R::lit(2.0), -lead), zero);
    let (lag1, lag2) = match m.cells {
        Some(_) => (zero, zero),
        None => (
            lag(p.robot1_lag, p.robot1_lag_damping, p.robot1_lag_zero),
            lag(p.robot2_lag, p.robot2_lag_damping, p.robot2_lag_zero),
        ),
    };
    Parts { a: move_on(reference.a, -(behind + lag1)), b: move_on(reference.b, -(behind + lag2)) }
}

/// Replacement of a lost command: the last one, extrapolated along its twist for some ticks, then at rest.
#[inline(always)]
pub fn substitute<R: Real>(m: &Plant, last: &Parts<R>, lost_before: R) -> Parts<R> {
    let moving = lost_before.lt(R::lit(f64::from(m.facility.drop_hold_ticks)));
    let on = extrapolate(m, last, R::lit(1.0));
    Parts { a: on_or_standing(moving, on.a, last.a), b: on_or_standing(moving, on.b, last.b) }
}

#[inline(always)]
fn on_or_standing<R: Real>(moving: R::Mask, on: Motion<R>, last: Motion<R>) -> Motion<R> {
    Motion {
        position: Vec3::select(moving, on.position, last.position),
        attitude: Quat::select(moving, on.attitude, last.attitude),
        velocity: Vec3::select(moving, last.velocity, Vec3::zero()),
        omega: Vec3::select(moving, last.omega, Vec3::zero()),
    }
}

/// Motion at a place between three neighbouring commands, 0 at the first and 2 at the third: cubic Hermite in position, spherical in attitude (normalised Hermite of the
/// quaternion), linear in velocity. Exact for constant acceleration, as a tick with a held wrench gives.
#[inline(always)]
pub fn interpolate<R: Real>(m: &Plant, first: &Parts<R>, second: &Parts<R>, third: &Parts<R>, place: R) -> Parts<R> {
    let (one, period) = (R::lit(1.0), R::lit(m.timing.tick()));
    let later = one.le(place);
    let (mut before, mut after) = (*first, *second);
    before.set_where(later, second);
    after.set_where(later, third);
    let fraction = R::select(later, place - one, place);
    Parts { a: between(period, before.a, after.a, fraction), b: between(period, before.b, after.b, fraction) }
}

#[inline(always)]
fn between<R: Real>(period: R, p: Motion<R>, q: Motion<R>, u: R) -> Motion<R> {
    let one = R::lit(1.0);
    let v = one - u;
    // Hermite basis written as corrections to the chord, so that small differences stay small in f32.
    let (bend_p, bend_q) = (u * v * v * period, -(u * u * v * period));
    let chord = q.position - p.position;
    let swing = u * v * (v - u);
    // p + u chord + corrections: tangents minus chord, weighted.
    let position = p.position + (p.velocity.scale_add(bend_p, q.velocity * bend_q) + chord * (u - swing));
    let attitude =
        Quat { w: p.attitude.w.mul_add(v, q.attitude.w * u), v: p.attitude.v.scale_add(v, q.attitude.v * u) };
    Motion {
        position,
        attitude: attitude.normalized(),
        velocity: p.velocity.scale_add(v, q.velocity * u),
        omega: p.omega.scale_add(v, q.omega * u),
    }
}

/// Moves both robots one substep towards the interpolated commands; an axis without lag is at its reference.
#[inline(always)]
pub fn robots<R: Real>(m: &Plant, p: &Params<R>, s: &Robots<R>, reference: &Parts<R>) -> Robots<R> {
    let (place, rate, reference_a) = rail_share(m.facility.rail.as_ref(), reference.a);
    let response1 = Response { lag: p.robot1_lag, damping: p.robot1_lag_damping, zero: p.robot1_lag_zero };
    let response2 = Response { lag: p.robot2_lag, damping: p.robot2_lag_damping, zero: p.robot2_lag_zero };
    let (motion1, limited1) = follow(m, p, response1, s.robot1.motion, reference_a);
    let (motion2, limited2) = follow(m, p, response2, s.robot2.motion, reference.b);
    let (rail, rail_rate) = slide(m, p, &s.robot1, place, rate);
    Robots {
        robot1: Axes { motion: motion1, rail, rail_rate },
        robot2: Axes { motion: motion2, ..s.robot2 },
        limited: s.limited.max(limited1).max(limited2),
        ..*s
    }
}

/// Position and speed of the rail after a substep towards its reference.
#[inline(always)]
fn slide<R: Real>(m: &Plant, p: &Params<R>, at: &Axes<R>, place: R, rate: R) -> (R, R) {
    if m.facility.rail.is_none() {
        return (at.rail, at.rail_rate);
    }
    let (dt, ideal) = (R::lit(m.timing.substep), p.rail_lag.le(R::lit(0.0)));
    let w = R::lit(1.0) / p.rail_lag.max(R::lit(1e-9));
    let pull = (w * w) * (place - at.rail) - (w * p.rail_lag_damping * R::lit(2.0)) * at.rail_rate;
    let lagging = pull.mul_add(dt, at.rail_rate);
    (R::select(ideal, place, lagging.mul_add(dt, at.rail)), R::select(ideal, rate, lagging))
}

/// Splits part A's command into the rail's place and speed and what is left for robot 1.
#[inline(always)]
pub(crate) fn rail_share<R: Real>(rail: Option<&Rail>, reference: Motion<R>) -> (R, R, Motion<R>) {
    let Some(rail) = rail else {
        return (R::lit(0.0), R::lit(0.0), reference);
    };
    let (axis, share) = (Vec3::lit(rail.axis), R::lit(rail.share));
    let (position, rate) = (axis.dot(reference.position) * share, axis.dot(reference.velocity) * share);
    let left = Motion {
        position: axis.scale_add(-position, reference.position),
        velocity: axis.scale_add(-rate, reference.velocity),
        ..reference
    };
    (position, rate, left)
}

/// w^2 (1 + T_z s) / (s^2 + 2 z w s + w^2).
#[derive(Clone, Copy)]
struct Response<R> {
    /// 1/w \[s\].
    lag: R,
    /// z.
    damping: R,
    /// T_z \[s\].
    zero: R,
}

/// A robot after a substep: behind its reference with a lag, at its reference without one; and 1 where a limit was met.
#[inline(always)]
fn follow<R: Real>(
    m: &Plant,
    p: &Params<R>,
    response: Response<R>,
    at: Motion<R>,
    reference: Motion<R>,
) -> (Motion<R>, R) {
    let zero = R::lit(0.0);
    let ideal = response.lag.le(zero);
    let turn = turn_between(at.attitude, reference.attitude);
    // Most often all lanes are of one kind, and one of the two is enough.
    let (late, cut) = if R::any(!ideal) { lagging(m, p, response, at, reference, turn) } else { (reference, zero) };
    let (prompt, held_back) = if R::any(ideal) { at_once(m, p, at, reference, turn) } else { (late, cut) };
    let motion = Motion {
        position: Vec3::select(ideal, prompt.position, late.position),
        attitude: Quat::select(ideal, prompt.attitude, late.attitude),
        velocity: Vec3::select(ideal, prompt.velocity, late.velocity),
        omega: Vec3::select(ideal, prompt.omega, late.omega),
    };
    (motion, R::select(ideal, held_back, cut))
}

/// The response on each axis, semi-implicit, within the limits of speed; rotations by the small error angle.
#[inline(always)]
fn lagging<R: Real>(
    m: &Plant,
    p: &Params<R>,
    response: Response<R>,
    at: Motion<R>,
    reference: Motion<R>,
    turn: Vec3<R>,
) -> (Motion<R>, R) {
    let (one, two, dt) = (R::lit(1.0), R::lit(2.0), R::lit(m.timing.substep));
    let w = one / response.lag.max(R::lit(1e-9));
    let (pull, brake, lead) = (w * w, -(two * response.damping * w), w * w * response.zero);
    let velocity = reference
        .velocity
        .scale_add(lead, at.velocity.scale_add(brake, (reference.position - at.position) * pull))
        .scale_add(dt, at.velocity);
    let omega = reference.omega.scale_add(lead, at.omega.scale_add(brake, turn * pull)).scale_add(dt, at.omega);
    let (velocity, omega, cut) = within_limits(m, p, velocity, omega);
    (moved(m, at, velocity, omega), cut)
}

/// A motion after a substep at a velocity and an angular velocity.
#[inline(always)]
fn moved<R: Real>(m: &Plant, at: Motion<R>, velocity: Vec3<R>, omega: Vec3<R>) -> Motion<R> {
    let dt = R::lit(m.timing.substep);
    Motion {
        position: velocity.scale_add(dt, at.position),
        attitude: Quat::from_rotation_vector(omega * dt).compose(at.attitude).normalized(),
        velocity,
        omega,
    }
}

/// Rotation vector from one attitude to another that is near.
#[inline(always)]
fn turn_between<R: Real>(from: Quat<R>, to: Quat<R>) -> Vec3<R> {
    to.compose(from.conjugate()).small_rotation_vector()
}

/// A twist cut to the limits, and 1 where it was cut.
#[inline(always)]
fn within_limits<R: Real>(m: &Plant, p: &Params<R>, velocity: Vec3<R>, omega: Vec3<R>) -> (Vec3<R>, Vec3<R>, R) {
    let (zero, one) = (R::lit(0.0), R::lit(1.0));
    if !m.effects.has(RATE_LIMIT) {
        return (velocity, omega, zero);
    }
    let (slower, calmer) = (velocity.clamp(p.tool_speed_limit), omega.clamp(p.tool_rotation_limit));
    let (over, beyond) = (velocity - slower, omega - calmer);
    (slower, calmer, R::select(zero.lt(over.dot(over) + beyond.dot(beyond)), one, zero))
}

/// A robot without lag: at its reference, or as near as its limits allow in a substep; and 1 in that case.
#[inline(always)]
fn at_once<R: Real>(m: &Plant, p: &Params<R>, at: Motion<R>, reference: Motion<R>, turn: Vec3<R>) -> (Motion<R>, R) {
    let zero = R::lit(0.0);
    if !m.effects.has(RATE_LIMIT) {
        return (reference, zero);
    }
    let per_second = R::lit(1.0 / m.timing.substep);
    let way = reference.position - at.position;
    let (velocity, omega, cut) = within_limits(m, p, way * per_second, turn * per_second);
    let late = moved(m, at, velocity, omega);
    let held_back = zero.lt(cut);
    let motion = Motion {
        position: Vec3::select(held_back, late.position, reference.position),
        attitude: Quat::select(held_back, late.attitude, reference.attitude),
        velocity: Vec3::select(held_back, late.velocity, reference.velocity),
        omega: Vec3::select(held_back, late.omega, reference.omega),
    };
    (motion, cut)
}

/// Motions of the parts by the encoders of the robots' axes, which see neither the error of part A's place nor the
/// deflection of part B's mount.
#[inline(always)]
pub fn parts_by_axes<R: Real>(m: &Plant, s: &Robots<R>) -> Parts<R> {
    let mut a = s.robot1.motion;
    if let Some(rail) = m.facility.rail {
        let axis = Vec3::lit(rail.axis);
        a.position = axis.scale_add(s.robot1.rail, a.position);
        a.velocity = axis.scale_add(s.robot1.rail_rate, a.velocity);
    }
    Parts { a, b: s.robot2.motion }
}

/// Actual motions of the parts on the robots' tools.
#[inline(always)]
pub fn mounted_parts<R: Real>(m: &Plant, p: &Params<R>, s: &Robots<R>) -> Parts<R> {
    let Parts { mut a, b } = parts_by_axes(m, s);
    a.position = a.position + p.place_error;
    Parts { a, b: on_fixture(m, &s.fixture, b) }
}

/// Robots at rest on their first command.
#[inline(always)]
pub fn robots_at<R: Real>(m: &Plant, reference: &Parts<R>) -> Robots<R> {
    let zero = R::lit(0.0);
    let (rail, rail_rate, a) = rail_share(m.facility.rail.as_ref(), reference.a);
    Robots {
        robot1: Axes { motion: a, rail, rail_rate },
        robot2: Axes { motion: reference.b, rail: zero, rail_rate: zero },
        fixture: at_rest(),
        limited: zero,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Timing;
    use crate::vector::vec3;

    /// A motion of constant acceleration and of constant angular velocity, at a time \[s\].
    fn motion(time: f64) -> Motion<f64> {
        let (start, speed, acceleration) = (vec3(0.3, -0.1, 0.8), vec3(0.05, 0.02, -0.03), vec3(-1.0, 2.0, 0.5));
        let omega = vec3(0.05, -0.08, 0.02);
        let tilt = Quat::from_rotation_vector(vec3(0.4, 1.0, -0.7));
        Motion {
            position: acceleration.scale_add(0.5 * time * time, speed.scale_add(time, start)),
            attitude: Quat::from_rotation_vector(omega * time).compose(tilt),
            velocity: acceleration.scale_add(time, speed),
            omega,
        }
    }

    #[test]
    fn differences_of_poses_give_the_velocities_of_a_constant_acceleration() {
        let timing = Timing { substep: 2.5e-4, substeps: 4, max_ticks: 1 };
        let plant = Plant::new(Model::two_bodies(timing, 0.0));
        let at = |time: f64| Parts { a: motion(time), b: motion(-time) };
        let backwards =
            |motion: Motion<f64>| Motion { attitude: Quat { w: -motion.attitude.w, v: -motion.attitude.v }, ..motion };
        let (first, second, third) = (at(0.0), at(1e-3), at(2e-3));
        let found = by_differences(&plant, &first, &second, &third);
        assert!((found.a.velocity - third.a.velocity).norm() < 1e-12);
        assert!((found.a.omega - third.a.omega).norm() < 1e-9);
        assert!((found.b.velocity + third.b.velocity).norm() < 1e-12, "backwards in time");
        assert!((found.b.omega + third.b.omega).norm() < 1e-9);
        let other = by_differences(&plant, &first, &Parts { a: backwards(second.a), ..second }, &third);
        assert!((found.a.omega - other.a.omega).norm() < 1e-12, "an attitude has two quaternions");
    }
}
