//! A first-order low-pass of a measured signal, exact for signals that are parabolas over each step.

use crate::math::exp;
use crate::real::Real;
use crate::vector::Vec3;

/// A low-pass over a step.
pub struct LowPass<R> {
    /// Time constant in steps.
    steps: R,
    /// Share that is left after a step of what the filter was off.
    keep: R,
}

impl<R: Real> LowPass<R> {
    /// With a time constant \[s\], over a step \[s\]; without a time constant the signal passes.
    #[inline(always)]
    pub fn of(step: f64, lag: R) -> Self {
        Self { steps: lag * R::lit(1.0 / step), keep: exp(-(R::lit(step) / lag.max(R::lit(1e-9)))) }
    }

    /// The filter's output at the end of a step from `before` to `now`; `bend` is half the signal's second derivative
    /// times the square of the step. In the long run the filter follows at `u - T u' + T^2 u''`.
    #[inline(always)]
    pub fn after(&self, before: R, now: R, bend: R, filtered: R) -> R {
        let way = now - before;
        let curved = bend * (self.steps * self.steps * R::lit(2.0));
        let off = filtered - before - (way - bend).mul_add(-self.steps, curved);
        off.mul_add(self.keep, now + (way + bend).mul_add(-self.steps, curved))
    }

    /// The same, component by component.
    #[inline(always)]
    pub fn after_vector(&self, before: Vec3<R>, now: Vec3<R>, bend: Vec3<R>, filtered: Vec3<R>) -> Vec3<R> {
        Vec3 {
            x: self.after(before.x, now.x, bend.x, filtered.x),
            y: self.after(before.y, now.y, bend.y, filtered.y),
            z: self.after(before.z, now.z, bend.z, filtered.z),
        }
    }
}
