//! Phase lead whose gain an energy observer switches, with damping injection as the last resort.
//!
//! The best of the published compensators that need neither stiffness nor geometry: the lead of Qi et al. (2016) for
//! the measurement delay, with the switched gain of the instable-target simulator (Actuators 13(4):123, 2024) - lead
//! c, and c (1 + margin) while the observer foresees a debt - and the observer of Aerospace 9(7):368 (2022) that
//! allows for the contact's own damping. A lead alone leaves theta^3/6 of growth and a bounce above 1; the switched
//! gain removes most of that smoothly, and the injection, by [`passivity`], bounds the rest.

use super::{Compensation, ContactLine, lead, passivity};
use crate::fields::Bundle;
use crate::params::Params;
use crate::plant::Plant;
use crate::real::Real;

/// The measured wrench under lead and controller.
#[inline(always)]
pub(crate) fn control<R: Real>(
    m: &Plant,
    p: &Params<R>,
    s: &Compensation<R>,
    line: &ContactLine<R>,
    next: Compensation<R>,
) -> Compensation<R> {
    let seen = passivity::observe(m, p, s, line, next);
    let plain = Compensation { output: lead::first(m, line, &seen, p.compensator_delay), ..seen };
    let more = p.compensator_delay * (R::lit(1.0) + p.compensator_margin);
    let raised = Compensation { output: lead::first(m, line, &seen, more), ..seen };
    // Only while the parts part: a raised lead that meets closing parts would brake them harder than the contact does.
    let zero = R::lit(0.0);
    let debt = zero.lt(line.speed) & passivity::energy_ahead(m, p, s, line, &plain).lt(zero);
    let mut led = plain;
    led.set_where(debt, &raised);
    passivity::inject(m, p, s, line, led)
}
