//! Virtual damping: a damper of b_v = k^ h (1 + margin) on the undelayed relative velocity while the parts touch.
//!
//! A delay h turns a spring k into a spring with a damper of -k h (Zebenay et al.: measured force and a virtual one).
//! On the undelayed velocity m s^2 + b_v s + k e^(-hs) = 0 needs no more than k h sin(phi)/phi with
//! phi^2/cos(phi) = k h^2/m.

use super::ContactLine;
use crate::params::Params;
use crate::real::Real;

/// Force of the damper along the contact line.
#[inline(always)]
pub(crate) fn force<R: Real>(p: &Params<R>, line: &ContactLine<R>) -> R {
    let damping = p.compensator_stiffness * p.compensator_delay * (R::lit(1.0) + p.compensator_margin);
    -(damping * line.speed)
}
