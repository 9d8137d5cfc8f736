//! A joint's controller between the reference that it was sent and the torque that it asked for.
//!
//! Proportional and derivative on the measured angle, with feedforward from a model, sampled at its own period, which is
//! the step. The reference may come late, lag, be held or be limited on its way; the output is the torque asked for.
//! The controller runs a period ahead of its log: a stamp that is early shows what was asked for later. Between two
//! periods the log's clock interpolates, so that a reference that is held stays held whatever the clock says.

use super::Block;
use crate::bundle;
use crate::fields::filled;
use crate::math::{exp, lagged, lagged_along};
use crate::range::UNLIMITED;
use crate::real::Real;

bundle! {
    /// A controller's values, what may happen to its reference, and what may differ unnoticed.
    ControllerValues {
        period: R, "s", "period, which is the step";
        position_gain: R, "N m/rad", "torque per position error";
        velocity_gain: R, "N m s/rad", "torque per rate error";
        derivative_lag: R, "s", "time constant of the low-pass on the measured rate";
        inertia: R, "kg m^2", "feedforward of the reference's acceleration";
        viscous: R, "N m s/rad", "feedforward of the reference's rate";
        coulomb: R, "N m", "feedforward of dry friction";
        coulomb_speed: R, "rad/s", "rate over which that changes its sign";
        torque_limit: R, "N m", "greatest torque that is asked for";
        delay: R, "s", "transport delay of the reference";
        clock_offset: R, "s", "delay of the torque command against its time stamp";
        clock_skew: R, "1", "growth of the delay with time";
        hold: R, "s", "period over which the reference is held";
        lag: R, "s", "time constant of a lag of the reference";
        rate_limit: R, "rad/s", "greatest rate of the reference";
        offset: R, "N m", "offset of the torque command";
    }
}

impl ControllerValues<f64> {
    /// A controller without gains and period, and a reference that comes at once.
    pub fn null() -> Self {
        Self { coulomb_speed: 1.0, torque_limit: UNLIMITED, rate_limit: UNLIMITED, ..filled(0.0) }
    }
}

bundle! {
    /// What a controller measures a period after an instant.
    ControllerInput {
        angle: R, "rad", "measured angle";
        rate: R, "rad/s", "measured rate";
    }
}

impl<R: Real> ControllerInput<R> {
    /// The angle at the moment at which the torque was asked for.
    #[inline(always)]
    fn then(&self, p: &ControllerValues<R>) -> R {
        self.rate.mul_add(p.clock_offset - within(p), self.angle)
    }
}

/// The part of the clock's offset that lies within a period \[s\].
#[inline(always)]
fn within<R: Real>(p: &ControllerValues<R>) -> R {
    p.clock_offset.min(p.period).max(-p.period)
}

bundle! {
    /// A reference as it was sent.
    Reference {
        angle: R, "rad", "angle";
        rate: R, "rad/s", "rate";
        acceleration: R, "rad/s^2", "acceleration";
        weight: R, "N m", "feedforward of the weight";
        stiffness: R, "N m/rad", "what the angle changes in it";
    }
}

bundle! {
    /// What is hidden in a controller.
    ControllerHidden {
        measured: R, "rad", "measured angle";
        rate: R, "rad/s", "measured rate behind the low-pass";
        received: Reference<R>, "1", "reference as it came";
        lagging: Reference<R>, "1", "reference behind the lag";
        angle: R, "rad", "angle of the reference behind the limit";
        asked: R, "N m", "torque that is asked for a period after the instant";
        before: R, "N m", "torque a period before that";
        earlier: R, "N m", "torque two periods before that";
    }
}

bundle! {
    /// What a controller asks for.
    ControllerOutput {
        asked: R, "N m", "torque";
    }
}

/// A joint's controller, from reference to torque.
#[derive(Clone, Copy, Debug, Default)]
pub struct ControllerBlock;

impl Block for ControllerBlock {
    type Params<R: Real> = ControllerValues<R>;
    type State<R: Real> = ControllerHidden<R>;
    type Input<R: Real> = ControllerInput<R>;
    type Late<R: Real> = Reference<R>;
    type Output<R: Real> = ControllerOutput<R>;

    #[inline(always)]
    fn lateness<R: Real>(&self, p: &ControllerValues<R>, time: R) -> R {
        let zero = R::lit(0.0);
        let ahead = p.period + p.clock_offset - within(p);
        let tick = time + ahead;
        let hold = R::select(p.hold.le(zero), R::lit(1.0), p.hold);
        // A period that ends with a hold belongs to the next one, whatever rounding makes of it.
        let held = tick - (tick / hold + R::lit(1e-6)).floor() * hold;
        let late = p.clock_skew.mul_add(tick, p.delay - ahead);
        late + R::select(p.hold.le(zero), zero, held)
    }

    #[inline(always)]
    fn start<R: Real>(
        &self,
        p: &ControllerValues<R>,
        u: &ControllerInput<R>,
        late: &Reference<R>,
    ) -> ControllerHidden<R> {
        let (measured, rate) = (u.then(p), late.rate);
        let asked = asked(p, late, measured, rate);
        let (before, earlier) = (asked, asked);
        ControllerHidden { measured, rate, received: *late, lagging: *late, angle: late.angle, asked, before, earlier }
    }

    #[inline(always)]
    fn advance<R: Real>(
        &self,
        step: f64,
        p: &ControllerValues<R>,
        s: &ControllerHidden<R>,
        u: &ControllerInput<R>,
        late: &Reference<R>,
    ) -> ControllerHidden<R> {
        let measured = u.then(p);
        let rate = lagged(step, p.derivative_lag, s.rate, (measured - s.measured) * R::lit(1.0 / step));
        let (was, at) = (&s.received, &s.lagging);
        let lagging = Reference {
            angle: lagged_along(step, p.lag, at.angle, was.angle, late.angle),
            rate: lagged_along(step, p.lag, at.rate, was.rate, late.rate),
            acceleration: lagged_along(step, p.lag, at.acceleration, was.acceleration, late.acceleration),
            weight: lagged_along(step, p.lag, at.weight, was.weight, late.weight),
            stiffness: late.stiffness,
        };
        let reference = limited(step, p, s.angle, &lagging);
        ControllerHidden {
            measured,
            rate,
            received: *late,
            lagging,
            angle: reference.angle,
            asked: asked(p, &reference, measured, rate),
            before: s.asked,
            earlier: s.before,
        }
    }

    #[inline(always)]
    fn output<R: Real>(
        &self,
        p: &ControllerValues<R>,
        s: &ControllerHidden<R>,
        _u: &ControllerInput<R>,
        _late: &Reference<R>,
    ) -> ControllerOutput<R> {
        let zero = R::lit(0.0);
        let share = within(p) / R::select(p.period.le(zero), R::lit(1.0), p.period);
        let slope = R::select(share.lt(zero), s.before - s.earlier, s.asked - s.before);
        ControllerOutput { asked: slope.mul_add(share, s.before) }
    }
}

/// The reference behind the limit of its rate: while it runs after what came, its rate is the limit, and constant.
#[inline(always)]
fn limited<R: Real>(step: f64, p: &ControllerValues<R>, at: R, came: &Reference<R>) -> Reference<R> {
    let zero = R::lit(0.0);
    let (reach, way) = (p.rate_limit * R::lit(step), came.angle - at);
    let behind = reach.lt(way.abs());
    let rate = R::select(way.lt(zero), -p.rate_limit, p.rate_limit);
    let angle = R::select(behind, rate.mul_add(R::lit(step), at), came.angle);
    Reference {
        angle,
        rate: R::select(behind, rate, came.rate),
        acceleration: R::select(behind, zero, came.acceleration),
        weight: came.stiffness.mul_add(angle - came.angle, came.weight),
        stiffness: came.stiffness,
    }
}

/// Hyperbolic tangent.
#[inline(always)]
fn tanh<R: Real>(x: R) -> R {
    let (one, fall) = (R::lit(1.0), exp(-(x.abs() * R::lit(2.0))));
    let size = (one - fall) / (one + fall);
    R::select(x.lt(R::lit(0.0)), -size, size)
}

/// Torque that is asked for.
#[inline(always)]
fn asked<R: Real>(p: &ControllerValues<R>, r: &Reference<R>, measured: R, rate: R) -> R {
    let back = (r.angle - measured).mul_add(p.position_gain, (r.rate - rate) * p.velocity_gain);
    let dry = p.coulomb * tanh(r.rate / p.coulomb_speed);
    let ahead = r.acceleration.mul_add(p.inertia, r.rate.mul_add(p.viscous, dry + r.weight));
    let asked = back + ahead + p.offset;
    asked.min(p.torque_limit).max(-p.torque_limit)
}
