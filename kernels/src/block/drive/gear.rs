//! The link on its gear: rigid, elastic or with play.

use super::{DriveHidden, DriveValues};
use crate::math::{exp, sin_cos};
use crate::real::Real;

/// Least compliance that counts \[rad/(N m)\]: a gear without any is rigid far beyond this.
const RIGID: f64 = 1e-12;

/// The flank that carries a torque; without one the middle of the play.
#[inline(always)]
pub(super) fn flank<R: Real>(torque: R, half_backlash: R) -> R {
    let one = R::lit(1.0);
    torque.min(one).max(-one) * half_backlash
}

/// The link on its gear.
struct Gear<R> {
    compliance: R,
    /// Angular frequency of the link on the gear with the motor held \[rad/s\].
    frequency: R,
    damping: R,
}

impl<R: Real> Gear<R> {
    #[inline(always)]
    fn of(p: &DriveValues<R>, inertia: R) -> Self {
        let compliance = p.compliance.max(R::lit(RIGID));
        let frequency = R::lit(1.0) / (inertia * compliance).sqrt();
        Self { compliance, frequency, damping: p.gear_damping.min(R::lit(0.99)) }
    }

    /// Windup at rest under a torque, on the flank at `side`.
    #[inline(always)]
    fn rest(&self, torque: R, side: R) -> R {
        torque.mul_add(self.compliance, side)
    }
}

/// Whether the gear is compliant; without compliance and backlash it is rigid.
#[inline(always)]
fn is_compliant<R: Real>(p: &DriveValues<R>) -> R::Mask {
    R::lit(0.0).lt(p.compliance.max(p.half_backlash))
}

/// Torque that the gear transmits.
#[inline(always)]
pub(super) fn gear_torque<R: Real>(p: &DriveValues<R>, s: &DriveHidden<R>, inertia: R) -> R {
    if !R::any(is_compliant(p)) {
        return s.pull;
    }
    let gear = Gear::of(p, inertia);
    let stretch = s.windup - s.windup.min(p.half_backlash).max(-p.half_backlash);
    let damper = gear.damping * R::lit(2.0) * gear.frequency * inertia;
    let torque = stretch / gear.compliance + damper * s.windup_rate;
    // Teeth with a gap push and never pull.
    let (zero, loose) = (R::lit(0.0), R::lit(0.0).lt(p.half_backlash));
    let pushed = R::select(s.windup.lt(zero), torque.min(zero), torque.max(zero));
    let passed = R::select(engaged(p, s.windup), R::select(loose, pushed, torque), zero);
    R::select(is_compliant(p), passed, s.pull)
}

#[inline(always)]
fn engaged<R: Real>(p: &DriveValues<R>, windup: R) -> R::Mask {
    p.half_backlash.le(R::lit(0.0)) | p.half_backlash.le(windup.abs())
}

/// Windup and its rate after a step over which the pull goes from `s.pull` to `pull` in a straight line.
///
/// Free in the play until a flank is met, then the exact motion of a damped spring: no step limit, however stiff.
#[inline(always)]
pub(super) fn wind<R: Real>(step: f64, p: &DriveValues<R>, s: &DriveHidden<R>, inertia: R, pull: R) -> (R, R) {
    let (zero, half, step) = (R::lit(0.0), R::lit(0.5), R::lit(step));
    if !R::any(is_compliant(p)) {
        return (zero, zero);
    }
    let free = R::select(engaged(p, s.windup), zero, step);
    let acceleration = (s.pull + pull) * half / inertia;
    let reached = acceleration.mul_add(free * free * half, s.windup_rate.mul_add(free, s.windup));
    let past = p.half_backlash.lt(reached.abs());
    let side = R::select(reached.lt(zero), -p.half_backlash, p.half_backlash);
    let way = reached - s.windup;
    let met = free * ((side - s.windup) / R::select(past, way, R::lit(1.0)));
    let flight = R::select(past, met.max(zero).min(free), free);
    let windup = acceleration.mul_add(flight * flight * half, s.windup_rate.mul_add(flight, s.windup));
    let rate = acceleration.mul_add(flight, s.windup_rate);

    let gear = Gear::of(p, inertia);
    let slope = (pull - s.pull) / step;
    let behind = gear.damping * R::lit(2.0) / gear.frequency * slope;
    let side = windup.min(p.half_backlash).max(-p.half_backlash);
    let met_pull = slope.mul_add(flight, s.pull);
    let apart = (windup - gear.rest(met_pull - behind, side), rate - slope * gear.compliance);
    let (place, speed) = swing(&gear, step - flight, apart);
    let swung = (place + gear.rest(pull - behind, side), speed + slope * gear.compliance);
    let still_free = step.le(flight);
    let wound = (R::select(still_free, windup, swung.0), R::select(still_free, rate, swung.1));
    (R::select(is_compliant(p), wound.0, zero), R::select(is_compliant(p), wound.1, zero))
}

/// Free vibration about rest: place and speed after a time.
#[inline(always)]
fn swing<R: Real>(gear: &Gear<R>, time: R, (place, speed): (R, R)) -> (R, R) {
    let decay = gear.damping * gear.frequency;
    let damped = gear.frequency * (R::lit(1.0) - gear.damping * gear.damping).sqrt();
    let (sin, cos) = sin_cos(damped * time);
    let kept = exp(-(decay * time));
    let quarter = (decay.mul_add(place, speed)) / damped;
    let quarter_speed = (gear.frequency * gear.frequency).mul_add(place, decay * speed) / damped;
    (kept * (place * cos + quarter * sin), kept * (speed * cos - quarter_speed * sin))
}
