//! The contact's law: a power of the depth with dissipation, and bristles that bend up to a short travel.

use super::nominal::{DISSIPATION, EXPONENT, FRICTION, STIFFNESS};
use crate::catalogue::Sizes;
use crate::random::Stream;
use std::f64::consts::TAU;

/// Depth at which laws of any exponent agree \[m\].
pub(crate) const REFERENCE_DEPTH: f64 = 1e-3;
/// Travel over which friction rises \[m\].
const TRAVEL: f64 = 5e-5;
/// Time in which bristles out of contact straighten \[s\].
const RELEASE: f64 = 2e-3;
/// Time in which the relaxing spring of a contact with memory forgets \[s\].
pub(crate) const MEMORY_TIME: f64 = 0.05;

/// The law's numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Law {
    /// \[N/m^n\], and n.
    stiffness: f64,
    excess: f64,
    /// \[s/m\]
    dissipation: f64,
    friction: f64,
    /// Offset of the plate towards the robots' measured position \[m\].
    pub(crate) offset: f64,
    /// Stiffness of the relaxing spring \[N/m\].
    memory: f64,
    /// Standard deviation of the stiffness over the plate, and the waves of it: numbers along y and z \[rad/m\], phase.
    deviation: f64,
    map: [[f64; 3]; 3],
}

impl Law {
    pub(crate) fn new(sizes: &Sizes, seed: u64) -> Self {
        let mut stream = Stream::new(seed, "stiffness map of the plate", 0);
        // Waves of 20 to 60 mm in any direction: a slide of some centimetres meets more than one.
        let map = std::array::from_fn(|_| {
            let (number, angle) = (TAU / stream.between(0.02, 0.06), stream.between(0.0, TAU));
            [number * angle.cos(), number * angle.sin(), stream.between(0.0, TAU)]
        });
        Self {
            stiffness: STIFFNESS * (1.0 + sizes.of("K1_stiffness")),
            excess: sizes.of("K2_exponent"),
            dissipation: DISSIPATION * (1.0 + sizes.of("K3_damping")),
            friction: FRICTION * (1.0 + sizes.of("K4_friction")),
            offset: sizes.of("K7_surface_offset"),
            memory: STIFFNESS * REFERENCE_DEPTH.powf(EXPONENT - 1.0) * sizes.of("contact_memory"),
            deviation: sizes.of("stiffness_map"),
            map,
        }
    }

    /// Normal force \[N\] at a depth \[m\], its rate \[m/s\] and a place on the plate \[m\]; what the relaxing spring remembers
    /// is a depth too. Never pulls.
    pub(crate) fn normal(&self, depth: f64, rate: f64, place: [f64; 2], memory: f64) -> f64 {
        if depth <= 0.0 {
            return 0.0;
        }
        let spring = self.stiffness * depth.powf(EXPONENT) * (depth / REFERENCE_DEPTH).powf(self.excess);
        let spring = spring * self.hardness(place) + self.memory * (depth - memory);
        (spring * (1.0 + self.dissipation * rate)).max(0.0)
    }

    /// Factor on the stiffness at a place on the plate \[m\].
    fn hardness(&self, [y, z]: [f64; 2]) -> f64 {
        let wave = |[along_y, along_z, phase]: &[f64; 3]| (along_y * y + along_z * z + phase).sin();
        // Each sine has variance 1/2.
        let sum: f64 = self.map.iter().map(wave).sum();
        (1.0 + self.deviation * (2.0_f64 / 3.0).sqrt() * sum).max(0.1)
    }

    /// Rate of the memory \[m/s\].
    pub(crate) fn memory_rate(&self, depth: f64, memory: f64) -> f64 {
        (depth.max(0.0) - memory) / MEMORY_TIME
    }

    /// Rate of the bristles \[m/s\] and friction force \[N\] on the body that slides at a speed \[m/s\], by Dahl (1968).
    pub(crate) fn tangential(&self, slip: [f64; 2], bristles: [f64; 2], normal: f64) -> ([f64; 2], [f64; 2]) {
        if normal <= 0.0 {
            return (bristles.map(|bristle| -bristle / RELEASE), [0.0; 2]);
        }
        let speed = slip[0].hypot(slip[1]);
        let rate = std::array::from_fn(|i| slip[i] - speed * bristles[i] / TRAVEL);
        (rate, bristles.map(|bristle| -self.friction * normal * bristle / TRAVEL))
    }
}
