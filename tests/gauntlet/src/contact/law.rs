//! The contact's law: normal force with its damping, and bristle friction whose level is proportional to it.

/// Depth over which damping sets in \[m\]: a blow starts without a jump of the force.
const DAMPING_DEPTH: f64 = 1e-5;
/// Depth at which laws of any exponent agree \[m\].
pub(crate) const REFERENCE_DEPTH: f64 = 1e-3;
/// Distance from the plate at which tension is gone \[m\].
pub(crate) const TENSION_RANGE: f64 = 1e-4;
/// Speed over which static friction falls \[m/s\].
pub(crate) const STRIBECK_SPEED: f64 = 0.01;
/// Damping of the bristles, as the time by which their rate leads \[s\].
const BRISTLE_LEAD: f64 = 2e-4;
/// Time in which bristles out of contact straighten \[s\].
const BRISTLE_RELEASE: f64 = 2e-3;
/// Time in which the relaxing spring of a contact with memory forgets \[s\].
pub(crate) const MEMORY_TIME: f64 = 0.05;

/// The law's numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Law {
    /// Stiffness \[N/m\] and exponent; damping linear \[N s/m\], with depth \[N s/m^2\], with speed \[N s^2/m^2\].
    pub(crate) stiffness: f64,
    pub(crate) exponent: f64,
    pub(crate) damping: f64,
    pub(crate) depth_damping: f64,
    pub(crate) speed_damping: f64,
    /// Share of the deepest depth that stays as a dent.
    pub(crate) plastic: f64,
    /// Tension \[N\].
    pub(crate) adhesion: f64,
    /// Stiffness of the relaxing spring \[N/m\].
    pub(crate) memory: f64,
    /// Friction: coefficient, static excess, anisotropy, deviation over the plate, travel \[m\].
    pub(crate) friction: f64,
    pub(crate) stribeck: f64,
    pub(crate) anisotropy: f64,
    pub(crate) map_deviation: f64,
    pub(crate) travel: f64,
    /// Waves of the map over the plate: numbers along x and y \[rad/m\], phase \[rad\].
    pub(crate) map: [[f64; 3]; 3],
}

impl Law {
    /// Force \[N\] of a first loading to a depth \[m\].
    fn loading(&self, depth: f64) -> f64 {
        if self.exponent == 1.0 {
            self.stiffness * depth
        } else {
            self.stiffness * REFERENCE_DEPTH * (depth / REFERENCE_DEPTH).powf(self.exponent)
        }
    }

    /// Force \[N\] at a depth \[m\]; below the deepest so far a plastic contact follows the line from there to its dent.
    fn elastic(&self, depth: f64, deepest: f64) -> f64 {
        if self.plastic == 0.0 || depth >= deepest {
            return self.loading(depth);
        }
        let dent = self.touch(deepest);
        self.loading(deepest) * (depth - dent) / (deepest - dent)
    }

    /// Depth \[m\] at which the plate, dented so far, is touched.
    pub(crate) fn touch(&self, deepest: f64) -> f64 {
        self.plastic * deepest
    }

    /// Normal force \[N\] at a depth \[m\] and its rate \[m/s\]; what the relaxing spring remembers is a depth too.
    pub(crate) fn normal(&self, depth: f64, rate: f64, deepest: f64, memory: f64) -> f64 {
        let tension = self.adhesion * ((depth + TENSION_RANGE) / TENSION_RANGE).clamp(0.0, 1.0);
        let inside = depth - self.touch(deepest.max(depth));
        if inside <= 0.0 {
            return -tension;
        }
        let damping = self.damping * rate + self.speed_damping * rate * rate.abs() + self.depth_damping * depth * rate;
        let relaxing = self.memory * (depth - memory);
        let push = self.elastic(depth, deepest) + relaxing + damping * (inside / DAMPING_DEPTH).tanh();
        push.max(0.0) - tension
    }

    /// Rate of the memory \[m/s\].
    pub(crate) fn memory_rate(&self, depth: f64, memory: f64) -> f64 {
        (depth.max(0.0) - memory) / MEMORY_TIME
    }

    /// Friction coefficient at a place \[m\] and sliding speed \[m/s\].
    pub(crate) fn coefficient(&self, place: [f64; 2], speed: f64) -> f64 {
        let mut coefficient = self.friction;
        if self.stribeck != 0.0 {
            coefficient += self.stribeck * (-speed / STRIBECK_SPEED).exp();
        }
        if self.map_deviation != 0.0 {
            let wave = |[x, y, phase]: &[f64; 3]| (x * place[0] + y * place[1] + phase).sin();
            // Each sine has variance 1/2.
            coefficient += self.map_deviation * (2.0_f64 / 3.0).sqrt() * self.map.iter().map(wave).sum::<f64>();
        }
        coefficient.max(0.0)
    }

    /// Rate of the bristles \[m/s\] and friction force on the body \[N\], under a normal force \[N\].
    pub(crate) fn tangential(
        &self,
        place: [f64; 2],
        rate: [f64; 2],
        bristles: [f64; 2],
        normal: f64,
    ) -> ([f64; 2], [f64; 2]) {
        if normal <= 0.0 {
            return (bristles.map(|bristle| -bristle / BRISTLE_RELEASE), [0.0; 2]);
        }
        let speed = rate[0].hypot(rate[1]);
        let bristle_rate: [f64; 2] = std::array::from_fn(|i| rate[i] - speed * bristles[i] / self.travel);
        let level = self.coefficient(place, speed) * normal / self.travel;
        let axes = [1.0 + self.anisotropy, 1.0 - self.anisotropy];
        let force = std::array::from_fn(|i| -level * axes[i] * (bristles[i] + BRISTLE_LEAD * bristle_rate[i]));
        (bristle_rate, force)
    }
}
