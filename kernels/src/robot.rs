//! Command and robot stages: simulated motion to laboratory commands, delayed, and followed by two robots and a rail.
//!
//! The laboratory's axes are the inertial ones at the start. Robot 1 carries part A and makes its share of the
//! relative translation, robot 2 carries part B and makes the rest the other way; each turns its own part.

use crate::bundle;
use crate::fields::Bundle;
use crate::model::Rail;
use crate::params::Params;
use crate::plant::Plant;
use crate::real::Real;
use crate::space::{Motion, Parts};
use crate::vector::{Quat, Vec3};

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
        limited: R, "1", "1 once a robot has met a speed limit";
    }
}

/// Simulated part motions to laboratory commands.
#[inline(always)]
pub fn command<R: Real>(m: &Plant, parts: &Parts<R>) -> Parts<R> {
    let (share, rest) = (R::lit(m.facility.robot1_share), R::lit(m.facility.robot1_share - 1.0));
    let gap = parts.a.position - parts.b.position;
    let slide = parts.a.velocity - parts.b.velocity;
    Parts {
        a: Motion { position: gap * share, velocity: slide * share, ..parts.a },
        b: Motion { position: gap * rest, velocity: slide * rest, ..parts.b },
    }
}

/// Command transport delay in ticks: the loop's dead time less the sensor's and the frame's own.
#[inline(always)]
pub fn transport<R: Real>(m: &Plant, p: &Params<R>) -> R {
    let own = R::lit(m.timing.own_delay());
    ((p.loop_delay - p.sensor_delay - own) * R::lit(1.0 / m.timing.tick())).max(R::lit(0.0))
}

/// A command carried on along its twist for `periods` command periods (backwards if negative).
#[inline(always)]
pub fn carry_on<R: Real>(m: &Plant, parts: &Parts<R>, periods: R) -> Parts<R> {
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

/// What replaces a lost command: the last one, carried on along its twist for some ticks, then standing.
#[inline(always)]
pub fn substitute<R: Real>(m: &Plant, last: &Parts<R>, lost_before: R) -> Parts<R> {
    let moving = lost_before.lt(R::lit(f64::from(m.facility.drop_hold_ticks)));
    let on = carry_on(m, last, R::lit(1.0));
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
    let before = first.combine(second, &mut |a, b| R::select(later, b, a));
    let after = second.combine(third, &mut |a, b| R::select(later, b, a));
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

/// One substep of both robots towards the interpolated commands; an axis without lag is where it is told to be.
#[inline(always)]
pub fn robots<R: Real>(m: &Plant, p: &Params<R>, s: &Robots<R>, told: &Parts<R>) -> Robots<R> {
    let (place, rate, told_a) = rail_share(m.facility.rail.as_ref(), told.a);
    let (motion1, limited1) = follow(m, p.robot1_lag, p.robot1_lag_damping, p.robot1_lag_zero, s.robot1.motion, told_a);
    let (motion2, limited2) = follow(m, p.robot2_lag, p.robot2_lag_damping, p.robot2_lag_zero, s.robot2.motion, told.b);
    let (rail, rail_rate) = slide(m, p, &s.robot1, place, rate);
    Robots {
        robot1: Axes { motion: motion1, rail, rail_rate },
        robot2: Axes { motion: motion2, ..s.robot2 },
        limited: s.limited.max(limited1).max(limited2),
    }
}

/// Place and speed of the rail after a substep towards the place and speed that it is told.
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
pub(crate) fn rail_share<R: Real>(rail: Option<&Rail>, told: Motion<R>) -> (R, R, Motion<R>) {
    let Some(rail) = rail else {
        return (R::lit(0.0), R::lit(0.0), told);
    };
    let (axis, share) = (Vec3::lit(rail.axis), R::lit(rail.share));
    let (position, rate) = (axis.dot(told.position) * share, axis.dot(told.velocity) * share);
    let left = Motion {
        position: axis.scale_add(-position, told.position),
        velocity: axis.scale_add(-rate, told.velocity),
        ..told
    };
    (position, rate, left)
}

/// w^2 (1 + T_z s) / (s^2 + 2 z w s + w^2) on each axis, semi-implicit; rotations by the small error angle.
#[inline(always)]
fn follow<R: Real>(m: &Plant, lag: R, damping: R, zero_time: R, at: Motion<R>, told: Motion<R>) -> (Motion<R>, R) {
    let (zero, one, two) = (R::lit(0.0), R::lit(1.0), R::lit(2.0));
    let dt = R::lit(m.timing.substep);
    let ideal = lag.le(zero);
    let w = one / lag.max(R::lit(1e-9));
    let (pull, brake, lead) = (w * w, -(two * damping * w), w * w * zero_time);
    let error = told.attitude.compose(at.attitude.conjugate());
    let turn = error.v * R::select(error.w.lt(zero), -two, two);
    let free_velocity = told
        .velocity
        .scale_add(lead, at.velocity.scale_add(brake, (told.position - at.position) * pull))
        .scale_add(dt, at.velocity);
    let free_omega = told.omega.scale_add(lead, at.omega.scale_add(brake, turn * pull)).scale_add(dt, at.omega);
    let (velocity, omega) =
        (free_velocity.clamp(R::lit(m.facility.max_speed)), free_omega.clamp(R::lit(m.facility.max_rate)));
    let cut = (free_velocity - velocity).dot(free_velocity - velocity) + (free_omega - omega).dot(free_omega - omega);
    let lagging = Motion {
        position: velocity.scale_add(dt, at.position),
        attitude: Quat::from_rotation_vector(omega * dt).compose(at.attitude).normalized(),
        velocity,
        omega,
    };
    let motion = Motion {
        position: Vec3::select(ideal, told.position, lagging.position),
        attitude: Quat::select(ideal, told.attitude, lagging.attitude),
        velocity: Vec3::select(ideal, told.velocity, lagging.velocity),
        omega: Vec3::select(ideal, told.omega, lagging.omega),
    };
    (motion, R::select(ideal, zero, R::select(zero.lt(cut), one, zero)))
}

/// Actual motions of the parts on the robots' tools.
#[inline(always)]
pub fn mounted_parts<R: Real>(m: &Plant, p: &Params<R>, s: &Robots<R>) -> Parts<R> {
    let mut a = s.robot1.motion;
    a.position = a.position + p.place_error;
    if let Some(rail) = m.facility.rail {
        let axis = Vec3::lit(rail.axis);
        a.position = axis.scale_add(s.robot1.rail, a.position);
        a.velocity = axis.scale_add(s.robot1.rail_rate, a.velocity);
    }
    Parts { a, b: s.robot2.motion }
}

/// Robots at rest on their first command.
#[inline(always)]
pub fn robots_at<R: Real>(m: &Plant, told: &Parts<R>) -> Robots<R> {
    let zero = R::lit(0.0);
    let (rail, rail_rate, a) = rail_share(m.facility.rail.as_ref(), told.a);
    Robots {
        robot1: Axes { motion: a, rail, rail_rate },
        robot2: Axes { motion: told.b, rail: zero, rail_rate: zero },
        limited: zero,
    }
}
