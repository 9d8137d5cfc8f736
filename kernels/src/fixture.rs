//! Fixture: part B's mount on robot 2, a mass on a spring and damper that the contact pushes (effect K10).
//!
//! Three equal translations in laboratory axes; the mount does not turn. x'' + 2 z w x' + w^2 x = w^2 c F with the
//! compliance c: without one nothing moves, whatever the frequency.

use crate::bundle;
use crate::effects::EffectId;
use crate::params::Params;
use crate::plant::Plant;
use crate::real::Real;
use crate::robot::Robots;
use crate::space::{Motion, Wrench};
use crate::vector::Vec3;
use std::f64::consts::TAU;

const FIXTURE: EffectId = EffectId::of("K10_fixture");

bundle! {
    /// Deflection of part B's mount; written by the fixture stage.
    Fixture {
        shift: Vec3<R>, "m", "displacement of part B on its mount, laboratory";
        velocity: Vec3<R>, "m/s", "rate of the displacement";
    }
}

/// Whether part B's mount is compliant.
pub fn is_compliant(m: &Plant) -> bool {
    m.effects.has(FIXTURE)
}

/// A mount without deflection.
#[inline(always)]
pub(crate) fn at_rest<R: Real>() -> Fixture<R> {
    crate::fields::filled(R::lit(0.0))
}

/// The robots after one substep of part B's mount under the contact's wrench on part A, laboratory axes.
///
/// Implicit midpoint rule: stable at any step, without damping of its own.
#[inline(always)]
pub fn push_fixture<R: Real>(m: &Plant, p: &Params<R>, s: &Robots<R>, w: Wrench<R>) -> Robots<R> {
    let (one, half, dt) = (R::lit(1.0), R::lit(0.5), R::lit(m.timing.substep));
    let rate = p.fixture_frequency * R::lit(TAU);
    let (square, brake) = (rate * rate, p.fixture_damping * rate * dt);
    let bend = square * R::lit(0.25 * m.timing.substep * m.timing.substep);
    let at = s.fixture;
    let pull = w.force * -p.fixture_compliance - at.shift;
    let inverse = one / (one + brake + bend);
    let velocity = pull.scale_add(square * dt, at.velocity * (one - brake - bend)) * inverse;
    let shift = (at.velocity + velocity).scale_add(half * dt, at.shift);
    Robots { fixture: Fixture { shift, velocity }, ..*s }
}

/// Part B where its mount holds it.
#[inline(always)]
pub(crate) fn on_fixture<R: Real>(m: &Plant, s: &Fixture<R>, b: Motion<R>) -> Motion<R> {
    if !is_compliant(m) {
        return b;
    }
    Motion { position: b.position + s.shift, velocity: b.velocity + s.velocity, ..b }
}
