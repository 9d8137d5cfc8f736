//! Values in whole steps, as noise blurs them.

use crate::real::Real;

/// The expected reading of a value that is rounded to whole steps behind a noise of a half-width (uniform, at most half
/// a step); the value itself if there is no step.
#[inline(always)]
pub(super) fn stepped<R: Real>(value: R, step: R, blur: R) -> R {
    let (zero, half, one) = (R::lit(0.0), R::lit(0.5), R::lit(1.0));
    let none = step.le(zero);
    let whole = R::select(none, one, step);
    let inverse = one / whole;
    let place = value.mul_add(inverse, half);
    let below = place.floor();
    let share = place - below;
    let width = (blur * inverse).min(half).max(R::lit(1e-6));
    let up = (share + width - one).max(zero);
    let down = (width - share).max(zero);
    R::select(none, value, (below + (up - down) / (width + width)) * whole)
}
