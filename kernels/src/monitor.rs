//! Monitor stage: peaks, events, energies and the end of a loop; and the metrics that follow from them.

use crate::bundle;
use crate::contact::{LatchState, PointContact, sliding_velocity};
use crate::metrics::Metrics;
use crate::model::Model;
use crate::plant::Plant;
use crate::real::Real;
use crate::space::{Bodies, Parts, Wrench};
use crate::test_motion::Followed;
use crate::vector::Vec3;

bundle! {
    /// All points of part A together; the most loaded point stands for the direction.
    Touch {
        wrench: Wrench<R>, "1", "contact wrench on part A about A's origin, inertial axes";
        force: R, "N", "largest normal force of a point";
        depth: R, "m", "largest overlap";
        normal: Vec3<R>, "1", "normal at the most loaded point";
        lever: Vec3<R>, "m", "most loaded point from A's origin";
    }
}

bundle! {
    /// What the monitor remembers of one loop.
    Watch {
        touch_time: R, "s", "time of the first touch, -1 before";
        normal: Vec3<R>, "1", "normal at the first touch, inertial axes";
        lever: Vec3<R>, "m", "contact point at the first touch from A's origin, inertial axes";
        approach_speed: R, "m/s", "normal speed of the simulated parts at the first touch, -1 before";
        touching: R, "1", "1 while the parts push each other";
        bounces: R, "1", "number of separations, up to 2";
        again: R, "1", "1 once the parts have touched a second time";
        separated_at: R, "s", "time of the last separation";
        separation_speed: R, "m/s", "normal speed of separation now";
        best_separation: R, "m/s", "largest of it between the first touch and the second";
        contact_duration: R, "s", "time in contact";
        peak_force: R, "N", "largest contact force";
        peak_moment: R, "N m", "largest moment";
        peak_depth: R, "m", "largest depth";
        impulse: R, "N s", "integral of the force magnitude";
        closed: R, "1", "1 once the latch has closed";
        capture_time: R, "s", "time of capture, -1 before";
        capture_offset: R, "m", "radial offset at capture, -1 before";
        contact_work: R, "J", "work of the contact (latch excluded) on the parts";
        absorbed: R, "J", "largest energy that the contact has held";
        push: Wrench<R>, "1", "contact wrench of the last substep (latch excluded), for the work of the next";
        port_energy: R, "J", "energy through the port on the simulated side";
        hardware_energy: R, "J", "energy through the port on the hardware side";
        done: R, "1", "1 once the loop has ended";
        unstable: R, "1", "1 if the loop ended by divergence";
        end_time: R, "s", "time of the end";
    }
}

/// 1 after the first touch.
#[inline(always)]
pub fn touched<R: Real>(watch: &Watch<R>) -> R {
    R::select(R::lit(0.0).le(watch.touch_time), R::lit(1.0), R::lit(0.0))
}

/// Nothing touches.
#[inline(always)]
pub fn no_touch<R: Real>() -> Touch<R> {
    let (zero, none) = (R::lit(0.0), Vec3::zero());
    Touch { wrench: Wrench::zero(), force: zero, depth: R::lit(-1.0e3), normal: none, lever: none }
}

/// With one point more.
#[inline(always)]
pub fn gather<R: Real>(sum: &Touch<R>, c: &PointContact<R>) -> Touch<R> {
    let more = sum.force.abs().lt(c.force.abs());
    Touch {
        wrench: sum.wrench + c.wrench,
        force: R::select(more, c.force, sum.force),
        depth: sum.depth.max(c.depth),
        normal: Vec3::select(more, c.normal, sum.normal),
        lever: Vec3::select(more, c.lever, sum.lever),
    }
}

/// Contact and latch together.
#[inline(always)]
pub fn total_wrench<R: Real>(touch: &Touch<R>, latch: &LatchState<R>) -> Wrench<R> {
    touch.wrench + latch.wrench
}

/// Power of a wrench on part A (and its opposite on part B) into the relative motion.
#[inline(always)]
pub fn port_power<R: Real>(parts: &Parts<R>, w: Wrench<R>) -> R {
    let slide = sliding_velocity(&parts.a, &parts.b, Vec3::zero());
    w.force.dot(slide) + w.moment.dot(parts.a.omega - parts.b.omega)
}

/// A watch before the start.
#[inline(always)]
pub fn new_watch<R: Real>() -> Watch<R> {
    let (zero, never, none) = (R::lit(0.0), R::lit(-1.0), Vec3::zero());
    Watch {
        touch_time: never,
        normal: none,
        lever: none,
        approach_speed: never,
        touching: zero,
        bounces: zero,
        again: zero,
        separated_at: zero,
        separation_speed: zero,
        best_separation: zero,
        contact_duration: zero,
        peak_force: zero,
        peak_moment: zero,
        peak_depth: zero,
        impulse: zero,
        closed: zero,
        capture_time: never,
        capture_offset: never,
        contact_work: zero,
        absorbed: zero,
        push: Wrench::zero(),
        port_energy: zero,
        hardware_energy: zero,
        done: zero,
        unstable: zero,
        end_time: zero,
    }
}

/// One substep of contact: `parts` are those that touch, `simulated` those whose bounce counts.
#[inline(always)]
pub fn observe<R: Real>(
    m: &Plant,
    s: &Watch<R>,
    time: R,
    parts: &Parts<R>,
    simulated: &Parts<R>,
    touch: &Touch<R>,
    latch: &LatchState<R>,
) -> Watch<R> {
    let (zero, one, dt) = (R::lit(0.0), R::lit(1.0), R::lit(m.timing.substep));
    let on = zero.lt(touch.force.abs());
    let first = on & s.touch_time.lt(zero);
    let was = zero.lt(s.touching);
    let (begins, ends) = (on & !was & !first, was & !on);
    let normal = Vec3::select(first, touch.normal, s.normal);
    let lever = Vec3::select(first, touch.lever, s.lever);
    let separation = sliding_velocity(&simulated.a, &simulated.b, lever).dot(normal);
    let again = R::select(begins, one, s.again);
    let touched = first | zero.le(s.touch_time);
    let open = touched & again.lt(R::lit(0.5));
    let force = touch.wrench.force.norm();
    let total = total_wrench(touch, latch);
    // The parts came here with this substep's velocity under the mean of the last wrench and this one.
    let half = |old: Vec3<R>, new: Vec3<R>| (old + new) * R::lit(0.5);
    let mean =
        Wrench { force: half(s.push.force, touch.wrench.force), moment: half(s.push.moment, touch.wrench.moment) };
    let step_work = port_power(parts, mean) * dt;
    let work = s.contact_work + step_work;
    let closes = zero.lt(latch.closed) & s.closed.le(zero);
    Watch {
        touch_time: R::select(first, time, s.touch_time),
        normal,
        lever,
        approach_speed: R::select(first, -separation, s.approach_speed),
        touching: R::select(on, one, zero),
        bounces: R::select(ends, (s.bounces + one).min(R::lit(2.0)), s.bounces),
        again,
        separated_at: R::select(ends, time, s.separated_at),
        separation_speed: R::select(touched, separation, s.separation_speed),
        best_separation: R::select(open, s.best_separation.max(separation), s.best_separation),
        contact_duration: R::select(on, s.contact_duration + dt, s.contact_duration),
        peak_force: s.peak_force.max(force),
        peak_moment: s.peak_moment.max(total.moment.norm()),
        peak_depth: s.peak_depth.max(touch.depth),
        impulse: force.mul_add(dt, s.impulse),
        closed: latch.closed,
        capture_time: R::select(closes, time, s.capture_time),
        capture_offset: R::select(closes, latch.offset, s.capture_offset),
        contact_work: work,
        absorbed: s.absorbed.max(-work),
        push: touch.wrench,
        hardware_energy: port_power(parts, latch.wrench).mul_add(dt, s.hardware_energy + step_work),
        ..*s
    }
}

/// Whether the loop is over, once per tick; `last` is 1 in the last tick.
#[inline(always)]
pub fn finish<R: Real>(m: &Plant, s: &Watch<R>, time: R, simulated: &Parts<R>, last: R) -> Watch<R> {
    let (zero, one) = (R::lit(0.0), R::lit(1.0));
    let since = |event: R| time - event;
    let apart = zero.lt(s.bounces) & s.touching.le(zero);
    let parted = apart & R::lit(finite(m.task.end_after_separation)).lt(since(s.separated_at));
    let captured = zero.le(s.capture_time) & R::lit(finite(m.task.end_after_capture)).lt(since(s.capture_time));
    let slide = sliding_velocity(&simulated.a, &simulated.b, Vec3::zero());
    // Not "greater than": the comparison must also catch a NaN.
    let calm = slide.norm().le(R::lit(m.facility.unstable_speed));
    let over = parted | captured | zero.lt(last) | !calm;
    let ends = over & s.done.le(zero);
    Watch {
        done: R::select(over, one, s.done),
        unstable: R::select(ends & !calm, one, s.unstable),
        end_time: R::select(ends, time, s.end_time),
        ..*s
    }
}

/// An unused limit as a number that f32 can hold and a run cannot reach.
fn finite(limit: f64) -> f64 {
    limit.min(1.0e9)
}

/// Metrics of a finished loop; `created` is 1 on the facility, where the ports may differ and robots follow.
#[inline(always)]
pub fn metrics<R: Real, const N: usize>(
    m: &Plant,
    s: &Watch<R>,
    bodies: &Bodies<R, N>,
    followed: &Followed<R>,
    created: R,
) -> Metrics<R> {
    let (zero, one, never) = (R::lit(0.0), R::lit(1.0), R::lit(-1.0));
    let bounced = zero.lt(s.bounces) & zero.lt(s.approach_speed);
    let restitution = s.best_separation / R::select(bounced, s.approach_speed, one);
    let restitution = R::select(bounced, restitution, never);
    let (linear, angular) = momentum_errors(bodies);
    let success = succeeds(m, s, restitution);
    Metrics {
        success: R::select(success, one, zero),
        touch_time: s.touch_time,
        approach_speed: s.approach_speed,
        restitution,
        contact_duration: s.contact_duration,
        peak_force: s.peak_force,
        peak_moment: s.peak_moment,
        peak_depth: s.peak_depth.max(zero),
        impulse: s.impulse,
        capture_time: s.capture_time,
        capture_offset: s.capture_offset,
        separation_speed: s.separation_speed,
        linear_momentum_error: linear,
        angular_momentum_error: angular,
        created_energy: (s.port_energy - s.hardware_energy) * created,
        tracking_gain: R::select(zero.lt(created), followed.gain, never),
        tracking_lag: followed.lag * created,
        tracking_error: followed.error * created,
        tracking_overshoot: followed.overshoot * created,
        end_time: s.end_time,
    }
}

/// Total momenta against the account of start and external impulses.
#[inline(always)]
fn momentum_errors<R: Real, const N: usize>(b: &Bodies<R, N>) -> (R, R) {
    let place = |body: &crate::space::Body<R>| body.com + body.com_step;
    let linear = b.chaser.momentum + b.target.momentum - b.impulse;
    let angular = (b.chaser.spin + place(&b.chaser).cross(b.chaser.momentum))
        + (b.target.spin + place(&b.target).cross(b.target.momentum))
        - b.moment_impulse;
    (linear.norm(), angular.norm())
}

/// The scenario's criteria, all of them; an unused one folds away.
#[inline(always)]
fn succeeds<R: Real>(m: &Model, s: &Watch<R>, restitution: R) -> R::Mask {
    let (zero, task) = (R::lit(0.0), &m.task);
    let mut holds = s.unstable.le(zero);
    if task.capture {
        holds = holds & zero.lt(s.closed);
    }
    if task.touch {
        holds = holds & zero.le(s.touch_time);
    }
    if task.max_force.is_finite() {
        holds = holds & s.peak_force.le(R::lit(task.max_force));
    }
    if task.max_time.is_finite() {
        let event = if task.capture { s.capture_time } else { s.separated_at };
        holds = holds & event.le(R::lit(task.max_time));
    }
    if task.max_restitution.is_finite() {
        holds = holds & restitution.le(R::lit(task.max_restitution));
    }
    holds
}
