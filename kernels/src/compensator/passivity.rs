//! Time-domain passivity: an observer of the energy that the facility takes from the simulated bodies along the contact
//! line, and a damper that keeps it from giving more than it took.
//!
//! Hannaford and Ryu's form, F <- F + alpha v with alpha = -E/(v^2 T), on the energy predicted for the tick ahead. A
//! damped contact hides what the delay creates behind what it really loses; so the loss of an estimated contact damping
//! is taken out of the account (as in "A Passivity-Based Velocity Control Method", Aerospace 9(7):368, 2022). The
//! account begins anew with each contact; a debt is kept.

use super::{Compensation, ContactLine, add_along, may_pull};
use crate::params::Params;
use crate::plant::Plant;
use crate::real::Real;

/// The measured wrench under the controller.
#[inline(always)]
pub(crate) fn control<R: Real>(
    m: &Plant,
    p: &Params<R>,
    s: &Compensation<R>,
    line: &ContactLine<R>,
    next: Compensation<R>,
) -> Compensation<R> {
    inject(m, p, s, line, observe(m, p, s, line, next))
}

/// Energy after the tick that has passed: what the acting force took, less the loss of the contact's own damper, which
/// works only while a force acts.
#[inline(always)]
pub(crate) fn observe<R: Real>(
    m: &Plant,
    p: &Params<R>,
    s: &Compensation<R>,
    line: &ContactLine<R>,
    next: Compensation<R>,
) -> Compensation<R> {
    let (zero, tick) = (R::lit(0.0), R::lit(m.timing.tick()));
    let was = zero.lt(s.touching);
    // Without a measured force there is no line: the speed is then the last one that was seen.
    let mean = R::select(line.touching, (s.speed + line.speed) * R::lit(0.5), s.speed);
    let damping = R::select(zero.lt(s.push.abs()), p.compensator_damping, zero);
    let drain = (s.push + damping * mean) * mean;
    let fresh = R::select(line.touching, s.energy.min(zero), s.energy);
    let energy = R::select(was, s.energy - drain * tick, fresh);
    Compensation { energy, least: s.least.min(energy), ..next }
}

/// Speed along the line in the middle of the tick ahead, as it has changed over the last one.
#[inline(always)]
fn mean_speed_ahead<R: Real>(s: &Compensation<R>, line: &ContactLine<R>) -> R {
    let ahead = (line.speed - s.speed).mul_add(R::lit(0.5), line.speed);
    R::select(R::lit(0.0).lt(s.touching), ahead, line.speed)
}

/// Observed energy after the tick ahead, if `next.output` acts; as much as a quarter of the last change of speed would
/// move it is held back for the error of the prediction.
#[inline(always)]
pub(crate) fn energy_ahead<R: Real>(
    m: &Plant,
    p: &Params<R>,
    s: &Compensation<R>,
    line: &ContactLine<R>,
    next: &Compensation<R>,
) -> R {
    let speed = mean_speed_ahead(s, line);
    let (force, damper) = (next.output.force.dot(line.normal), p.compensator_damping * speed);
    let reserve = (force.abs() + damper.abs()) * (speed - line.speed).abs() * R::lit(0.5);
    next.energy - ((force + damper) * speed + reserve) * R::lit(m.timing.tick())
}

/// Damping along the line that brings the energy ahead back to minus what is allowed.
///
/// It never pulls where that is not allowed, which is enough: without a push nothing is given. Once the push is gone it
/// stays away as long as it would make a debt and the parts do not close again; it would chatter otherwise. And it
/// pushes no harder than twice the force and the contact's own damper, so that a stand-still asks for no infinite
/// damping.
#[inline(always)]
pub(crate) fn inject<R: Real>(
    m: &Plant,
    p: &Params<R>,
    s: &Compensation<R>,
    line: &ContactLine<R>,
    next: Compensation<R>,
) -> Compensation<R> {
    let (zero, tiny) = (R::lit(0.0), R::lit(1e-12));
    let speed = mean_speed_ahead(s, line);
    let ahead = energy_ahead(m, p, s, line, &next);
    let lack = (-(ahead + p.compensator_energy)).max(zero);
    let path = speed * R::lit(m.timing.tick());
    let force = next.output.force.dot(line.normal);
    let most = force.abs() + p.compensator_damping * speed.abs();
    let least = if may_pull(m) { -most } else { -force };
    let wanted = -(lack / R::select(path.abs().lt(tiny), tiny, path));
    let injected = R::select(zero.lt(lack), wanted.min(most).max(least), zero);
    let over = zero.lt(s.touching) & s.push.abs().le(zero) & zero.lt(line.speed) & ahead.lt(zero);
    let injected = if may_pull(m) { injected } else { R::select(over, least, injected) };
    let injected = R::select(line.touching, injected, zero);
    Compensation {
        output: add_along(line, next.output, injected),
        push: R::select(line.touching, force + injected, zero),
        speed: R::select(line.touching, line.speed, s.speed),
        ..next
    }
}
