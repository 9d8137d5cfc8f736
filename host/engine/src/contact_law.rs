//! Evaluates the contact stage along measured relative motions, many parameter sets at once, on CPU lanes.

use crate::blocks::{Outputs, by_tiles, kept_by_lane};
use crate::decimator::Decimator;
use crate::instructions::{InstructionSet, OnLanes};
use softdock_kernels::contact::{Point, PointState, contact_point};
use softdock_kernels::fields::{Bundle, Field, fields};
use softdock_kernels::lanes::Lane;
use softdock_kernels::material::{NormalLaw, Pair};
use softdock_kernels::model::{Model, Timing};
use softdock_kernels::plant::Plant;
use softdock_kernels::space::{Motion, Parts};
use softdock_kernels::vector::{Quat, Vec3, vec3};
use std::f64::consts::FRAC_1_SQRT_2;

/// Position and velocity of a point relative to a plate at an instant; z is the plate's normal, out of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointMotion {
    /// Position \[m\].
    pub position: Vec3<f64>,
    /// Velocity \[m/s\].
    pub velocity: Vec3<f64>,
}

/// A point on a plate under a law of contact, along a measured motion at equal steps.
pub struct PointOnPlate {
    plant: Plant,
    motion: Vec<PointMotion>,
    stride: usize,
}

/// Name of the last parameter, which the pair of materials does not have.
pub const SURFACE: &str = "surface";

impl PointOnPlate {
    /// Builds the contact from a motion at instants `step` \[s\] apart; every `stride`-th instant gives a force.
    pub fn new(law: NormalLaw, step: f64, stride: usize, motion: Vec<PointMotion>) -> Self {
        let mut model = Model::two_bodies(Timing { substep: step, substeps: 1, max_ticks: 1 }, 0.0);
        model.contact.law = law;
        // The plane's normal is -x of its frame: it turns to z.
        model.contact.b.solids[0].frame.attitude = Quat { w: FRAC_1_SQRT_2, v: vec3(0.0, FRAC_1_SQRT_2, 0.0) };
        Self { plant: Plant::new(model), motion, stride }
    }

    /// The field table of the parameters: those of a [`Pair`], and the height of the plate's surface.
    pub fn parameters() -> Vec<Field> {
        let mut all = fields::<f64, Pair<f64>>();
        all.push(Field::new(SURFACE, "m", "height of the plate's surface"));
        all
    }

    /// Number of instants that give a force.
    pub fn samples(&self) -> usize {
        self.motion.len().div_ceil(self.stride)
    }
}

/// Forces of the plate on the point \[N\], in plate axes: by contact and parameter set x, y, z of each sample.
///
/// `sets` in the order of [`PointOnPlate::parameters`].
pub fn contact_forces(contacts: &[&PointOnPlate], sets: &[Vec<f64>]) -> Outputs {
    let instructions = InstructionSet::detect();
    by_tiles(contacts, sets, &|contact, sets| instructions.run(Tile { contact, sets }))
}

/// As many parameter sets as there are lanes, or fewer, along one motion.
struct Tile<'a> {
    contact: &'a PointOnPlate,
    sets: &'a [Vec<f64>],
}

impl OnLanes for Tile<'_> {
    type Output = Vec<Vec<f64>>;
    #[inline(always)]
    fn execute<L: Lane>(self) -> Vec<Vec<f64>> {
        let Self { contact, sets } = self;
        let mut out = Vec::with_capacity(sets.len());
        for group in sets.chunks(L::WIDTH) {
            let mut field = 0;
            let mut next = || {
                field += 1;
                // Lanes without a set of their own repeat the first.
                L::gather(|lane| group.get(lane).unwrap_or(&group[0])[field - 1])
            };
            let pair = Pair::read(&mut next);
            let surface = next();
            let lanes = forces(contact, &pair, surface);
            out.extend(kept_by_lane(lanes, contact.samples(), &Decimator::none(), group.len()));
        }
        out
    }
}

/// Forces along the motion, sample by sample, each for all lanes.
#[inline(always)]
fn forces<L: Lane>(contact: &PointOnPlate, pair: &Pair<L>, surface: L) -> Vec<L> {
    let m = &contact.plant;
    let (zero, none) = (L::lit(0.0), Vec3::zero());
    let still = Motion { position: none, attitude: Quat::lit(Quat::identity()), velocity: none, omega: none };
    let point = Point { position: none, radius: surface, share: L::lit(1.0) };
    let mut state = PointState { bristle: none, approach: zero };
    let mut out = Vec::with_capacity(3 * contact.samples());
    for (instant, at) in contact.motion.iter().enumerate() {
        let a = Motion { position: Vec3::lit(at.position), velocity: Vec3::lit(at.velocity), ..still };
        let parts = Parts { a, b: still };
        let found = contact_point(m, &m.pairs[0], pair, &parts, point, state);
        state = found.state;
        if instant % contact.stride == 0 {
            let force = found.wrench.force;
            out.push(force.x);
            out.push(force.y);
            out.push(force.z);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use softdock_kernels::contact::REFERENCE_DEPTH;

    /// Field by field: stiffness at 1 mm, damping, dissipation, friction, bristle's stiffness and damping, exponent - 1.
    fn set(values: [f64; 7], surface: f64) -> Vec<f64> {
        let [stiffness, damping, dissipation, friction, bristle, bristle_damping, exponent] = values;
        vec![stiffness, damping, dissipation, friction, bristle, bristle_damping, exponent, 0.0, 0.1, 0.0, 0.0, surface]
    }

    #[test]
    fn forces_are_those_of_the_law() {
        assert_eq!(PointOnPlate::parameters().len(), 12);
        let press = |i: usize| 1e-4 * i as f64;
        let at = |i: usize| PointMotion {
            position: vec3(0.01 * i as f64, 0.0, 5e-4 - press(i)),
            velocity: vec3(1.0, 0.0, -0.01),
        };
        let motion: Vec<_> = (0..60).map(at).collect();
        let contact = PointOnPlate::new(NormalLaw::Power { exponent: 1.0 }, 0.01, 2, motion);
        let sets: Vec<_> = (0..11).map(|i| set([1e5, 0.0, 2.0, 0.3, 1e5, 0.0, 0.1 * f64::from(i)], 2e-4)).collect();
        let found = contact_forces(&[&contact], &sets);
        for (number, forces) in found[0].iter().enumerate() {
            assert_eq!(forces.len(), 3 * 30);
            for (sample, force) in forces.chunks(3).enumerate() {
                let depth = (press(2 * sample) - 5e-4 + 2e-4).max(0.0);
                let spring = 1e5 * depth * (depth / REFERENCE_DEPTH).powf(0.1 * number as f64);
                let push = if depth > 0.0 { spring * (1.0 + 2.0 * 0.01) } else { 0.0 };
                assert!((force[2] - push).abs() < 1e-9 * push.max(1.0), "{number} {sample}: {} of {push}", force[2]);
                assert!((force[0] + 0.3 * push).abs() < 1e-6 * push.max(1.0), "friction: {} of {push}", force[0]);
            }
        }
    }
}
