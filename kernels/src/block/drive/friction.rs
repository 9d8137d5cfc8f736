//! Dry friction on the motor's side of a gear.

use super::{DriveMotion, DriveValues};
use crate::math::exp;
use crate::real::Real;

/// Dry friction on the motor's side: where it settles when the drive slides on in a direction, and over which travel.
///
/// The bristles come to their level over a travel, so that friction lags behind the speed (Canudas de Wit 1995). Their
/// stiffness is what Coulomb friction and its presliding travel make it, whatever the level: the higher that is, the
/// further they bend.
#[derive(Clone, Copy)]
pub(super) struct Sliding<R> {
    pub(super) level: R,
    travel: R,
    compliance: R,
}

/// Least and greatest travel, as shares of the nominal one.
const TRAVELS: [f64; 2] = [0.05, 20.0];

impl<R: Real> Sliding<R> {
    /// Of a direction (1, -1, or 0 at rest), at a rate and under a torque that loads the gear.
    #[inline(always)]
    pub(super) fn of(p: &DriveValues<R>, u: &DriveMotion<R>, direction: R, rate: R, bearing: R) -> Self {
        let (zero, one) = (R::lit(0.0), R::lit(1.0));
        let dry = bearing.abs().mul_add(p.load_coefficient, p.coulomb) + stribeck(p, rate);
        let dry = dry + p.form.dry(u.angle) + direction * p.coulomb_asymmetry;
        // Without any Coulomb friction there is no stiffness to keep.
        let known = zero.lt(p.coulomb);
        let reference = R::select(known, p.coulomb, one);
        let share = (dry / reference).max(R::lit(TRAVELS[0])).min(R::lit(TRAVELS[1]));
        let travel = p.presliding_travel * R::select(known, share, one);
        Self { level: direction * dry, travel, compliance: p.presliding_travel / reference }
    }

    /// Friction after a displacement.
    #[inline(always)]
    pub(super) fn approached(&self, friction: R, displacement: R) -> R {
        let kept = exp(-(displacement.abs() / self.travel));
        (friction - self.level).mul_add(kept, self.level)
    }

    /// What the bristles bend by while their torque changes.
    #[inline(always)]
    pub(super) fn bent(&self, change: R) -> R {
        change * self.compliance
    }
}

/// Static friction beyond Coulomb's that is left at a rate.
#[inline(always)]
fn stribeck<R: Real>(p: &DriveValues<R>, rate: R) -> R {
    if p.stribeck.is_absent() {
        return R::lit(0.0);
    }
    exp(-(rate.abs() / p.stribeck_speed)) * p.stribeck
}
