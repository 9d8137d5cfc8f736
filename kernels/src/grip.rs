//! Fingers of part A on their way: prescribed by the arm's plan, whatever pushes them.

use crate::bundle;
use crate::real::Real;

bundle! {
    /// Fingers of part A.
    Grip {
        share: R, "1", "share of their way, 0 open to 1 closed";
        rate: R, "1/s", "its rate";
    }
}

/// Fingers that stay open.
#[inline(always)]
pub fn no_grip<R: Real>() -> Grip<R> {
    Grip { share: R::lit(0.0), rate: R::lit(0.0) }
}

/// The fingers a time \[s\] later, at the same rate.
#[inline(always)]
pub fn grip_after<R: Real>(grip: &Grip<R>, time: R) -> Grip<R> {
    Grip { share: grip.rate.mul_add(time, grip.share), rate: grip.rate }
}
