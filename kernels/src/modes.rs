//! Hidden modes of the facility's simulated target: propellant that sways, an appendage that bends (effects P2, P3).
//!
//! A share mu of the target's mass hangs at its centre of mass on an equal spring and damper in each inertial axis:
//! s'' + 2 z w s' + w^2 s = -a, with its displacement s from the structure and the structure's acceleration a. The
//! target's momentum stays that of the whole, changed by applied wrenches alone; the structure moves with
//! P / M - mu s' and stands mu s behind the whole's centre. What s x s' would add to the angular momentum, second
//! order in the displacement, is left out.

use crate::bundle;
use crate::effects::{EffectId, EffectSet};
use crate::params::Params;
use crate::real::Real;
use crate::vector::Vec3;
use std::f64::consts::TAU;

/// Slosh, then the appendage.
pub const MODES: usize = 2;

const EFFECTS: [EffectId; MODES] = [EffectId::of("P2_slosh"), EffectId::of("P3_appendage")];

bundle! {
    /// A mass on a spring inside the target.
    Mode {
        share: R, "1", "its share of the target's mass";
        frequency: R, "1/s", "angular frequency in a fixed target";
        damping: R, "1", "damping ratio";
    }
}

bundle! {
    /// Where such a mass is; written by the space stage.
    Sway {
        shift: Vec3<R>, "m", "displacement from its place in the target, inertial axes";
        velocity: Vec3<R>, "m/s", "rate of the displacement";
    }
}

impl<R: Real> Mode<R> {
    /// Acceleration of spring and damper towards the rest position \[m/s^2\].
    #[inline(always)]
    pub(crate) fn pull(&self, s: &Sway<R>) -> Vec3<R> {
        let brake = s.velocity * (self.damping * self.frequency * R::lit(2.0));
        s.shift.scale_add(self.frequency * self.frequency, brake)
    }
}

/// The modes that the facility simulates.
#[inline(always)]
pub(crate) fn hil_modes<R: Real>(p: &Params<R>) -> [Mode<R>; MODES] {
    let around = R::lit(TAU);
    [
        Mode { share: p.slosh_share, frequency: p.slosh_frequency * around, damping: p.slosh_damping },
        Mode { share: p.appendage_share, frequency: p.appendage_frequency * around, damping: p.appendage_damping },
    ]
}

/// Displacement and velocity of the structure from the whole's centre of mass.
#[inline(always)]
pub(crate) fn recoil<R: Real>(
    effects: EffectSet,
    modes: &[Mode<R>; MODES],
    s: &[Sway<R>; MODES],
) -> (Vec3<R>, Vec3<R>) {
    let (mut shift, mut velocity) = (Vec3::zero(), Vec3::zero());
    for i in 0..MODES {
        if effects.has(EFFECTS[i]) {
            shift = s[i].shift.scale_add(-modes[i].share, shift);
            velocity = s[i].velocity.scale_add(-modes[i].share, velocity);
        }
    }
    (shift, velocity)
}

/// One substep of the modes, semi-implicit; `pushed` is the applied force over the whole's mass \[m/s^2\].
#[inline(always)]
pub(crate) fn swayed<R: Real>(
    effects: EffectSet,
    dt: R,
    modes: &[Mode<R>; MODES],
    s: &[Sway<R>; MODES],
    pushed: Vec3<R>,
) -> [Sway<R>; MODES] {
    let (mut fixed, mut thrust, mut next) = (R::lit(1.0), pushed, *s);
    let mut pull = [Vec3::zero(); MODES];
    for i in 0..MODES {
        if effects.has(EFFECTS[i]) {
            pull[i] = modes[i].pull(&s[i]);
            thrust = pull[i].scale_add(modes[i].share, thrust);
            fixed = fixed - modes[i].share;
        }
    }
    let structure = thrust * (R::lit(1.0) / fixed);
    for i in 0..MODES {
        if effects.has(EFFECTS[i]) {
            let velocity = (structure + pull[i]).scale_add(-dt, s[i].velocity);
            next[i] = Sway { shift: velocity.scale_add(dt, s[i].shift), velocity };
        }
    }
    next
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vector::vec3;

    const DT: f64 = 1e-4;
    const SHARE: f64 = 0.3;
    const FREQUENCY: f64 = 2.0;

    fn mode(share: f64, frequency: f64, damping: f64) -> Mode<f64> {
        Mode { share, frequency: TAU * frequency, damping }
    }

    /// Velocity of the structure of 1 kg in all after each step, pushed by 1 N from the start on until a time.
    fn velocities(modes: [Mode<f64>; MODES], until: f64, seconds: f64) -> Vec<f64> {
        let mut s: [Sway<f64>; MODES] = crate::fields::filled(0.0);
        let steps = (seconds / DT) as usize;
        let mut momentum = 0.0;
        let mut step = |index: usize| {
            let force = if (index as f64) * DT < until { 1.0 } else { 0.0 };
            s = swayed(EffectSet::ALL, DT, &modes, &s, vec3(force, 0.0, 0.0));
            momentum += force * DT;
            momentum + recoil(EffectSet::ALL, &modes, &s).1.x
        };
        (0..steps).map(&mut step).collect()
    }

    #[test]
    fn at_first_the_structure_moves_without_the_mass_that_hangs_in_it() {
        let v = velocities([mode(SHARE, FREQUENCY, 0.02), mode(0.2, 5.0, 0.0)], 1.0, 2e-3);
        let acceleration = v[10] / (11.0 * DT);
        assert!((acceleration * 0.5 - 1.0).abs() < 1e-3, "{acceleration}: half of the mass hangs");
    }

    #[test]
    fn a_free_target_rings_higher_than_one_held_fast_and_at_last_moves_as_one() {
        let v = velocities([mode(SHARE, FREQUENCY, 0.0), mode(0.0, 5.0, 0.0)], 0.1, 10.0);
        let mean = 0.1;
        let crossings: Vec<f64> = (2000..v.len() - 1)
            .filter(|i| v[*i] < mean && v[i + 1] >= mean)
            .map(|i| (i as f64 + (mean - v[i]) / (v[i + 1] - v[i])) * DT)
            .collect();
        let periods = (crossings.len() - 1) as f64;
        let found = periods / (crossings[crossings.len() - 1] - crossings[0]);
        let expected = FREQUENCY / (1.0 - SHARE).sqrt();
        assert!((found / expected - 1.0).abs() < 1e-4, "{found} Hz instead of {expected} Hz");
        let damped = velocities([mode(SHARE, FREQUENCY, 0.1), mode(0.1, 5.0, 0.1)], 0.1, 20.0);
        assert!((damped[damped.len() - 1] / mean - 1.0).abs() < 1e-6, "{}", damped[damped.len() - 1]);
    }

    #[test]
    fn a_ringing_decays_by_its_damping_ratio() {
        let (share, ratio) = (1e-6, 0.05);
        let v = velocities([mode(share, FREQUENCY, ratio), mode(0.0, 5.0, 0.0)], DT, 3.0);
        let ringing: Vec<f64> = v.iter().map(|v| (v - DT) / share).collect();
        let peak = |from: usize| ringing[from..from + 5000].iter().fold(0.0_f64, |most, v| most.max(v.abs()));
        // Two periods later: e^(-2 pi z / sqrt(1 - z^2)) for each.
        let (found, root) = ((peak(15_000) / peak(5_000)).ln(), (1.0 - ratio * ratio).sqrt());
        assert!((found / (-2.0 * TAU * ratio / root) - 1.0).abs() < 0.02, "{found}");
    }
}
