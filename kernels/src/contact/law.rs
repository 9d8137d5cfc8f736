//! Laws of a contact point: normal force over depth, friction over slip; and what the mounted parts may add to both.

use crate::effects::EffectId;
use crate::material::{NormalLaw, Pair};
use crate::math::{exp, log, power};
use crate::plant::{ContactPair, Plant};
use crate::real::Real;
use crate::vector::Vec3;

/// Depth at which an error of the exponent changes nothing \[m\].
pub const REFERENCE_DEPTH: f64 = 1e-3;

const EXPONENT: EffectId = EffectId::of("K2_exponent");
const STRIBECK: EffectId = EffectId::of("K5_stribeck");
const ANISOTROPY: EffectId = EffectId::of("K6_anisotropy");
const ADHESION: EffectId = EffectId::of("K8_adhesion");

/// Lever of the friction of a patch of uniform pressure over its radius: the mean distance of its area from its middle.
const PATCH_LEVER: f64 = 2.0 / 3.0;

/// Speed of approach of a point that comes to touch without one \[m/s\].
const STANDING: f64 = 1e-9;

/// A law with the properties of a loop's pair.
pub(super) struct Law<'a, R> {
    pub(super) m: &'a Plant,
    pub(super) of: &'a ContactPair,
    pub(super) pair: &'a Pair<R>,
}

impl<R: Real> Law<'_, R> {
    /// Whether a term is there: an effect of the facility may have it, or the material pair has it in both loops.
    fn has(&self, effect: EffectId, own: impl Fn(&Pair<f64>) -> f64) -> bool {
        self.m.effects.has(effect) || self.of.properties.is_some_and(|pair| own(&pair) != 0.0)
    }

    /// Whether a point has a patch that resists spinning.
    pub(super) fn has_patch(&self) -> bool {
        self.of.patch_radius > 0.0
    }

    /// Moment of a spinning patch over its friction force, and sliding speed over its spin \[m\]: 2/3 of the radius.
    pub(super) fn patch_lever(&self) -> f64 {
        PATCH_LEVER * self.of.patch_radius
    }

    /// Speed of approach at the touch, after a substep; 0 when apart.
    #[inline(always)]
    pub(super) fn approach(&self, depth: R, sink_rate: R, before: R) -> R {
        let zero = R::lit(0.0);
        if !self.of.law.needs_approach() {
            return before;
        }
        let touched = R::select(zero.lt(before), before, sink_rate.max(R::lit(STANDING)));
        R::select(zero.lt(depth), touched, zero)
    }

    /// Normal force over depth and sink rate; pulls only if the pair is bilateral, or as far as it adheres.
    #[inline(always)]
    pub(super) fn normal_force(&self, depth: R, sink_rate: R, approach: R) -> R {
        let (zero, pair) = (R::lit(0.0), self.pair);
        let stiffness = self.stiffness(depth);
        let force = match self.of.law {
            NormalLaw::Linear => stiffness.mul_add(depth, pair.damping * sink_rate),
            NormalLaw::Power { exponent } => {
                let spring = stiffness * power(depth.max(zero), exponent);
                (spring * pair.dissipation).mul_add(sink_rate, spring)
            }
            NormalLaw::Rebound { exponent, slowest } => {
                let spring = stiffness * power(depth.max(zero), exponent);
                let slower = R::lit(slowest) / approach.max(R::lit(slowest));
                (spring * (pair.dissipation * slower)).mul_add(sink_rate, spring)
            }
            NormalLaw::Impact { exponent, ramp } => {
                let share = (depth * R::lit(1.0 / ramp)).max(zero).min(R::lit(1.0));
                let step = share * share * R::lit(-2.0).mul_add(share, R::lit(3.0));
                (pair.damping * step).mul_add(sink_rate, stiffness * power(depth.max(zero), exponent))
            }
            NormalLaw::Stop { stroke, stiffness: stop, exponent } => {
                let beyond = R::lit(stop) * power((depth - R::lit(stroke)).max(zero), exponent);
                stiffness.mul_add(depth, pair.damping.mul_add(sink_rate, beyond))
            }
        };
        if self.m.contact.bilateral {
            return force;
        }
        if !self.has(ADHESION, |pair| pair.adhesion) {
            return R::select(zero.lt(depth), force.max(zero), zero);
        }
        R::select(zero.lt(depth), force.max(zero - pair.adhesion), self.tension(stiffness, -depth))
    }

    /// Stiffness K, or K (d / 1 mm)^e.
    #[inline(always)]
    fn stiffness(&self, depth: R) -> R {
        if !self.m.effects.has(EXPONENT) {
            return self.pair.stiffness;
        }
        let relative = depth.abs().max(R::lit(1e-12)) * R::lit(1.0 / REFERENCE_DEPTH);
        self.pair.stiffness * exp(log(relative) * self.pair.exponent_error)
    }

    /// Force on parts that are `gap` apart: the spring goes on beyond the surface until the adhesion is reached, without
    /// damping. A function of the gap alone: what it takes at the parting it gave at the approach.
    #[inline(always)]
    fn tension(&self, stiffness: R, gap: R) -> R {
        let zero = R::lit(0.0);
        let pull = match self.of.law {
            NormalLaw::Linear | NormalLaw::Stop { .. } => stiffness * gap,
            NormalLaw::Power { exponent }
            | NormalLaw::Rebound { exponent, .. }
            | NormalLaw::Impact { exponent, .. } => stiffness * power(gap.max(zero), exponent),
        };
        R::select(zero.lt(gap) & pull.lt(self.pair.adhesion), -pull, zero)
    }

    /// Bristle friction: a tangential spring and damper whose force is cut at mu N; the spring keeps what holds the cut.
    ///
    /// Within the cut the deflection is a state of rest, so that a block on an incline stands: true stiction.
    /// All vectors in the axes of the part with the solids, so that the bristle turns with the surface. Gives the force against the slip and the
    /// bristle after the substep.
    ///
    /// With a patch the slip's part along the normal is the spin times [`Law::patch_lever`], and so are those of bristle and
    /// force: sliding and spinning share the friction mu N of an ellipsoid (Howe and Cutkosky 1996).
    #[inline(always)]
    pub(super) fn friction(
        &self,
        normal_force: R,
        slip: Vec3<R>,
        bristle: Vec3<R>,
        normal: Vec3<R>,
    ) -> (Vec3<R>, Vec3<R>) {
        let (zero, one, pair) = (R::lit(0.0), R::lit(1.0), self.pair);
        let moved = slip.scale_add(R::lit(self.m.timing.substep), bristle);
        let flat = if self.has_patch() { moved } else { normal.scale_add(-moved.dot(normal), moved) };
        let spring = flat * pair.bristle_stiffness;
        let limit = self.coefficient(slip, flat, normal) * normal_force.max(zero);
        let size = spring.norm();
        let cut = (limit / size.max(R::lit(1e-20))).min(one);
        let held = spring * cut;
        // Damping acts only while the bristle holds, and never beyond the cut.
        let damped = slip.scale_add(pair.bristle_damping, held);
        let over = (limit / damped.norm().max(R::lit(1e-20))).min(one);
        let touching = zero.lt(normal_force);
        let force = Vec3::select(touching, damped * -over, Vec3::zero());
        (force, Vec3::select(touching, flat * cut, Vec3::zero()))
    }

    /// Friction coefficient mu (1 + s exp(-|v| / v_s)) (1 + a cos 2 theta), theta between the bristle and part B's y
    /// axis.
    #[inline(always)]
    fn coefficient(&self, slip: Vec3<R>, flat: Vec3<R>, normal: Vec3<R>) -> R {
        let (one, two, pair) = (R::lit(1.0), R::lit(2.0), self.pair);
        let mut mu = pair.friction;
        if self.has(STRIBECK, |pair| pair.stribeck) {
            mu = mu * exp(-(slip.norm() / pair.stribeck_speed)).mul_add(pair.stribeck, one);
        }
        if self.has(ANISOTROPY, |pair| pair.anisotropy) {
            let mut across = one;
            let (mut plane, all) = (flat, flat.dot(flat).max(R::lit(1e-30)));
            if self.has_patch() {
                // Spinning has no direction: alone it meets mu.
                let twist = flat.dot(normal);
                plane = normal.scale_add(-twist, flat);
                across = one - twist * twist / all;
            }
            let along = plane.y * plane.y / all;
            mu = mu * (two.mul_add(along, -across)).mul_add(pair.anisotropy, one);
        }
        mu
    }
}
