//! Joint friction: presliding bristle, Coulomb, Stribeck, viscous and load-dependent parts.

use super::Friction;
use crate::math::exp;
use crate::real::Real;

/// The presliding state after a further joint displacement \[rad\]; state in [-1, 1], `travel` \[rad\] > 0.
///
/// Dahl's model, integrated exactly for a constant direction: the state depends on the path and not on time, so that a
/// joint that stops keeps the torque with which it stopped. P. Dahl, A solid friction model (1968).
#[inline(always)]
pub fn bristle<R: Real>(state: R, displacement: R, travel: R) -> R {
    let (zero, one) = (R::lit(0.0), R::lit(1.0));
    let forwards = R::select(zero.lt(displacement), one, R::select(displacement.lt(zero), -one, state));
    let kept = exp(-(displacement.abs() / travel));
    (state - forwards).mul_add(kept, forwards)
}

/// The sizes of a joint's friction, each as in [`Friction`].
#[derive(Clone, Copy, Debug)]
pub struct Levels<R> {
    /// Coulomb friction \[N m\].
    pub coulomb: R,
    /// Viscous friction \[N m s/rad\].
    pub viscous: R,
    /// Static friction beyond Coulomb's \[N m\].
    pub stribeck: R,
    /// Speed at which the static part has fallen to 1/e \[rad/s\].
    pub stribeck_speed: R,
    /// Coulomb friction per transmitted torque.
    pub load_coefficient: R,
}

impl<R: Real> Levels<R> {
    /// The constants of a joint.
    #[inline(always)]
    pub fn of(friction: &Friction) -> Self {
        Self {
            coulomb: R::lit(friction.coulomb),
            viscous: R::lit(friction.viscous),
            stribeck: R::lit(friction.stribeck),
            stribeck_speed: R::lit(friction.stribeck_speed),
            load_coefficient: R::lit(friction.load_coefficient),
        }
    }

    /// Friction torque at the joint \[N m\], against the motion's sign: what the drive must add.
    ///
    /// `state` as from [`bristle`], `rate` \[rad/s\], `load` the torque that the gear transmits \[N m\].
    #[inline(always)]
    pub fn torque(&self, state: R, rate: R, load: R) -> R {
        let weakening = exp(-(rate.abs() / self.stribeck_speed));
        let dry = weakening.mul_add(self.stribeck, self.coulomb);
        let dry = load.abs().mul_add(self.load_coefficient, dry);
        state.mul_add(dry, rate * self.viscous)
    }
}
