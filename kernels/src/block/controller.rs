//! A joint's controller between the reference that it was sent and the torque that it asked for.
//!
//! Proportional and derivative on the measured angle, with feedforward from a model, sampled at its own period, which is
//! the step. The reference may come late, lag, be held or be limited on its way; the output is the torque asked for.

use super::Block;
use crate::bundle;
use crate::fields::filled;
use crate::math::{lagged, lagged_along};
use crate::params::UNLIMITED;
use crate::real::Real;

bundle! {
    /// A controller's values, what may happen to its reference, and what may differ unnoticed.
    ControllerValues {
        position_gain: R, "N m/rad", "torque per position error";
        velocity_gain: R, "N m s/rad", "torque per rate error";
        derivative_lag: R, "s", "time constant of the low-pass on the measured rate";
        inertia: R, "kg m^2", "feedforward of the reference's acceleration";
        viscous: R, "N m s/rad", "feedforward of the reference's rate";
        torque_limit: R, "N m", "greatest torque that is asked for";
        delay: R, "s", "transport delay of the reference";
        clock_offset: R, "s", "how much later the torque was asked for than its time stamp says";
        clock_skew: R, "1", "growth of the delay with time";
        hold: R, "s", "period over which the reference is held";
        lag: R, "s", "time constant of a lag of the reference";
        rate_limit: R, "rad/s", "greatest rate of the reference";
        offset: R, "N m", "torque asked for beyond what the controller says";
    }
}

impl ControllerValues<f64> {
    /// A controller without gains, and a reference that comes at once.
    pub fn null() -> Self {
        Self { torque_limit: UNLIMITED, rate_limit: UNLIMITED, ..filled(0.0) }
    }
}

bundle! {
    /// What a controller measures and adds at an instant.
    ControllerInput {
        angle: R, "rad", "measured angle";
        rate: R, "rad/s", "measured rate";
    }
}

impl<R: Real> ControllerInput<R> {
    /// The angle at the moment at which the torque was asked for.
    #[inline(always)]
    fn then(&self, p: &ControllerValues<R>) -> R {
        self.rate.mul_add(p.clock_offset, self.angle)
    }
}

bundle! {
    /// A reference as it was sent.
    Reference {
        angle: R, "rad", "angle";
        rate: R, "rad/s", "rate";
        acceleration: R, "rad/s^2", "acceleration";
        feedforward: R, "N m", "feedforward of friction and weight";
    }
}

bundle! {
    /// What is hidden in a controller.
    ControllerHidden {
        before: R, "rad", "measured angle a period ago";
        rate: R, "rad/s", "measured rate behind the low-pass";
        received: Reference<R>, "1", "reference as it came, a period ago";
        reference: Reference<R>, "1", "reference behind lag and limit";
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
pub struct Controller;

impl Block for Controller {
    type Params<R: Real> = ControllerValues<R>;
    type State<R: Real> = ControllerHidden<R>;
    type Input<R: Real> = ControllerInput<R>;
    type Late<R: Real> = Reference<R>;
    type Output<R: Real> = ControllerOutput<R>;

    #[inline(always)]
    fn lateness<R: Real>(&self, p: &ControllerValues<R>, time: R) -> R {
        let zero = R::lit(0.0);
        let period = R::select(p.hold.le(zero), R::lit(1.0), p.hold);
        let held = time - (time / period).floor() * period;
        let late = p.clock_skew.mul_add(time, p.delay - p.clock_offset);
        late + R::select(p.hold.le(zero), zero, held)
    }

    #[inline(always)]
    fn start<R: Real>(
        &self,
        p: &ControllerValues<R>,
        u: &ControllerInput<R>,
        late: &Reference<R>,
    ) -> ControllerHidden<R> {
        ControllerHidden { before: u.then(p), rate: late.rate, received: *late, reference: *late }
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
        let angle = u.then(p);
        let slope = (angle - s.before) * R::lit(1.0 / step);
        let (was, at) = (&s.received, &s.reference);
        let came = Reference {
            angle: lagged_along(step, p.lag, at.angle, was.angle, late.angle),
            rate: lagged_along(step, p.lag, at.rate, was.rate, late.rate),
            acceleration: lagged_along(step, p.lag, at.acceleration, was.acceleration, late.acceleration),
            feedforward: lagged_along(step, p.lag, at.feedforward, was.feedforward, late.feedforward),
        };
        let reach = p.rate_limit * R::lit(step);
        let way = came.angle - s.reference.angle;
        let cut = way.min(reach).max(-reach);
        let rate = came.rate.min(p.rate_limit).max(-p.rate_limit);
        ControllerHidden {
            before: angle,
            rate: lagged(step, p.derivative_lag, s.rate, slope),
            received: *late,
            reference: Reference { angle: s.reference.angle + cut, rate, ..came },
        }
    }

    #[inline(always)]
    fn output<R: Real>(
        &self,
        p: &ControllerValues<R>,
        s: &ControllerHidden<R>,
        u: &ControllerInput<R>,
        _late: &Reference<R>,
    ) -> ControllerOutput<R> {
        let r = &s.reference;
        let back = (r.angle - u.then(p)).mul_add(p.position_gain, (r.rate - s.rate) * p.velocity_gain);
        let ahead = r.acceleration.mul_add(p.inertia, r.rate.mul_add(p.viscous, r.feedforward));
        let asked = back + ahead + p.offset;
        ControllerOutput { asked: asked.min(p.torque_limit).max(-p.torque_limit) }
    }
}
