//! Laws of a contact point: normal force over depth, friction over slip; and what the mounted parts may add to both.

use super::Pair;
use crate::effects::EffectId;
use crate::math::{exp, log, power};
use crate::model::NormalLaw;
use crate::plant::Plant;
use crate::real::Real;
use crate::vector::Vec3;

/// Depth at which an error of the exponent changes nothing \[m\].
pub const REFERENCE_DEPTH: f64 = 1e-3;

const EXPONENT: EffectId = EffectId::of("K2_exponent");
const STRIBECK: EffectId = EffectId::of("K5_stribeck");
const ANISOTROPY: EffectId = EffectId::of("K6_anisotropy");
const ADHESION: EffectId = EffectId::of("K8_adhesion");

/// Normal force over depth and sink rate; pulls only if the pair is bilateral, or as far as it adheres.
#[inline(always)]
pub(super) fn normal_force<R: Real>(m: &Plant, pair: &Pair<R>, depth: R, sink_rate: R) -> R {
    let zero = R::lit(0.0);
    let stiffness = stiffness(m, pair, depth);
    let force = match m.contact.law {
        NormalLaw::Linear => stiffness.mul_add(depth, pair.damping * sink_rate),
        NormalLaw::Power { exponent } => {
            let spring = stiffness * power(depth.max(zero), exponent);
            (spring * pair.dissipation).mul_add(sink_rate, spring)
        }
    };
    if m.contact.bilateral {
        return force;
    }
    if !m.effects.has(ADHESION) {
        return R::select(zero.lt(depth), force.max(zero), zero);
    }
    R::select(zero.lt(depth), force.max(zero - pair.adhesion), tension(m, pair, stiffness, -depth))
}

/// Stiffness K, or K (d / 1 mm)^e.
#[inline(always)]
fn stiffness<R: Real>(m: &Plant, pair: &Pair<R>, depth: R) -> R {
    if !m.effects.has(EXPONENT) {
        return pair.stiffness;
    }
    let relative = depth.abs().max(R::lit(1e-12)) * R::lit(1.0 / REFERENCE_DEPTH);
    pair.stiffness * exp(log(relative) * pair.exponent_error)
}

/// Force on parts that are `gap` apart: the spring goes on beyond the surface until the adhesion is reached, without
/// damping. A function of the gap alone: what it takes at the parting it gave at the approach.
#[inline(always)]
fn tension<R: Real>(m: &Plant, pair: &Pair<R>, stiffness: R, gap: R) -> R {
    let zero = R::lit(0.0);
    let pull = match m.contact.law {
        NormalLaw::Linear => stiffness * gap,
        NormalLaw::Power { exponent } => stiffness * power(gap.max(zero), exponent),
    };
    R::select(zero.lt(gap) & pull.lt(pair.adhesion), -pull, zero)
}

/// Bristle friction: a tangential spring and damper whose force is cut at mu N; the spring keeps what holds the cut.
///
/// Within the cut the deflection is a state of rest, so that a block on an incline stands: true stiction.
/// All vectors in part B's axes, so that the bristle turns with the surface. Gives the force against the slip and the
/// bristle after the substep.
#[inline(always)]
pub(super) fn friction<R: Real>(
    m: &Plant,
    pair: &Pair<R>,
    normal_force: R,
    slip: Vec3<R>,
    bristle: Vec3<R>,
    normal: Vec3<R>,
) -> (Vec3<R>, Vec3<R>) {
    let (zero, one) = (R::lit(0.0), R::lit(1.0));
    let moved = slip.scale_add(R::lit(m.timing.substep), bristle);
    let flat = normal.scale_add(-moved.dot(normal), moved);
    let spring = flat * pair.bristle_stiffness;
    let limit = coefficient(m, pair, slip, flat) * normal_force.max(zero);
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

/// Friction coefficient mu (1 + s exp(-|v| / v_s)) (1 + a cos 2 theta), theta between the bristle and part B's y axis.
#[inline(always)]
fn coefficient<R: Real>(m: &Plant, pair: &Pair<R>, slip: Vec3<R>, flat: Vec3<R>) -> R {
    let (one, two) = (R::lit(1.0), R::lit(2.0));
    let mut mu = pair.friction;
    if m.effects.has(STRIBECK) {
        mu = mu * exp(-(slip.norm() / pair.stribeck_speed)).mul_add(pair.stribeck, one);
    }
    if m.effects.has(ANISOTROPY) {
        let along = flat.y * flat.y / flat.dot(flat).max(R::lit(1e-30));
        mu = mu * (two.mul_add(along, -one)).mul_add(pair.anisotropy, one);
    }
    mu
}
