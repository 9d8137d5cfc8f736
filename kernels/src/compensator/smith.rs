//! Smith predictor, its force part: what a spring of the estimated stiffness would have given since the parts stood as
//! they were measured.
//!
//! F_c = F(t - h) - k^ n.(d(t) - d(t - h)): with k^ = k the delay is gone, m s^2 + k^ + (k - k^) e^(-hs) = 0. Contact
//! is known from the measured force alone, so that a touch is met one delay late.

use super::ContactLine;
use crate::params::Params;
use crate::real::Real;
use crate::space::Parts;
use crate::vector::Vec3;

/// Force of the model along the contact line for the travel since the measured instant.
#[inline(always)]
pub(crate) fn force<R: Real>(p: &Params<R>, line: &ContactLine<R>, now: &Parts<R>, past: &Parts<R>) -> R {
    let travel = place(now, line.lever) - place(past, line.lever);
    let normal = now.b.attitude.rotate_back(now.a.attitude.rotate(line.normal));
    -(p.compensator_stiffness * travel.dot(normal))
}

/// Where a point of part A stands in part B's axes, from part B's origin.
#[inline(always)]
fn place<R: Real>(parts: &Parts<R>, point: Vec3<R>) -> Vec3<R> {
    let gap = (parts.a.position - parts.b.position) + parts.a.attitude.rotate(point);
    parts.b.attitude.rotate_back(gap)
}
