//! Phase lead on the measured wrench: F + c F', and F + c F' + c^2/2 F'' (Qi et al. 2016: the first order against a
//! force delay, the second against a motion simulator that lags).
//!
//! Derivatives are differences of samples behind a first-order low-pass. A backward difference is half a tick late and
//! the low-pass by its time constant more: of a lead c that eats c (T/2 + lag) F'', in phase with the force, and leaves
//! w^3 c^2 T/4 of growth; with the second order the lags of both differences cancel to that order. Without the
//! low-pass noise grows by about sqrt(2) c/T. The second order on a damped contact grows with the third power of the
//! frequency over the mass's second: it needs the low-pass, or differences swing up from k h T/m of about 1/r on.

use super::{Compensation, ContactLine, may_pull, never_pulling};
use crate::params::Params;
use crate::plant::Plant;
use crate::real::Real;
use crate::space::Wrench;
use crate::vector::Vec3;

/// The derivative of the measured wrench after one more sample.
#[inline(always)]
pub(crate) fn rate<R: Real>(m: &Plant, p: &Params<R>, s: &Compensation<R>, measured: Wrench<R>) -> Wrench<R> {
    let tick = R::lit(m.timing.tick());
    let gain = tick / (tick + p.compensator_lag);
    Wrench {
        force: filtered(m, gain, s.rate.force, measured.force - s.measured.force),
        moment: filtered(m, gain, s.rate.moment, measured.moment - s.measured.moment),
    }
}

#[inline(always)]
fn filtered<R: Real>(m: &Plant, gain: R, rate: Vec3<R>, difference: Vec3<R>) -> Vec3<R> {
    (difference * R::lit(1.0 / m.timing.tick()) - rate).scale_add(gain, rate)
}

/// F + c F', with its pull taken out.
#[inline(always)]
pub(crate) fn first<R: Real>(m: &Plant, line: &ContactLine<R>, next: &Compensation<R>, lead: R) -> Wrench<R> {
    let lead = in_contact(m, line, lead);
    never_pulling(m, line, next.rate.scale_add(lead, next.measured))
}

/// F + c F' + c^2/2 F'', with its pull taken out.
#[inline(always)]
pub(crate) fn second<R: Real>(
    m: &Plant,
    p: &Params<R>,
    line: &ContactLine<R>,
    s: &Compensation<R>,
    next: &Compensation<R>,
) -> Wrench<R> {
    let lead = in_contact(m, line, p.compensator_delay);
    let bend = lead * lead * R::lit(0.5 / m.timing.tick());
    let change = next.rate - s.rate;
    never_pulling(m, line, change.scale_add(bend, next.rate.scale_add(lead, next.measured)))
}

/// The lead time; zero out of contact, where there is nothing but noise to lead (and a force that may pull ends with
/// the jump of its last sample).
#[inline(always)]
fn in_contact<R: Real>(m: &Plant, line: &ContactLine<R>, lead: R) -> R {
    if may_pull(m) { lead } else { R::select(line.touching, lead, R::lit(0.0)) }
}
