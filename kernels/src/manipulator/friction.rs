//! Joint friction: presliding bristle, Coulomb, Stribeck, viscous and load-dependent parts.

use super::Friction;
use crate::math::exp;
use crate::real::Real;

/// The presliding state after a further joint displacement \[rad\]; state in [-1, 1], `travel` \[rad\] > 0.
///
/// Dahl's model, integrated exactly for a constant direction: the state depends on the path and not on time, so that a
/// joint that stops keeps the torque with which it stopped. P. Dahl, A solid friction model (1968).
#[inline(always)]
pub fn bristle<R: Real>(state: R, displacement: R, travel: f64) -> R {
    let (zero, one) = (R::lit(0.0), R::lit(1.0));
    let forwards = R::select(zero.lt(displacement), one, R::select(displacement.lt(zero), -one, state));
    let kept = exp(-(displacement.abs() * R::lit(1.0 / travel)));
    (state - forwards).mul_add(kept, forwards)
}

/// Friction torque at the joint \[N m\], against the motion's sign: what the drive must add.
///
/// `state` as from [`bristle`], `rate` \[rad/s\], `load` the torque that the gear transmits \[N m\].
#[inline(always)]
pub fn friction_torque<R: Real>(friction: &Friction, state: R, rate: R, load: R) -> R {
    let weakening = exp(-(rate.abs() * R::lit(1.0 / friction.stribeck_speed)));
    let dry = weakening.mul_add(R::lit(friction.stribeck), R::lit(friction.coulomb));
    let dry = load.abs().mul_add(R::lit(friction.load_coefficient), dry);
    state.mul_add(dry, rate * R::lit(friction.viscous))
}
