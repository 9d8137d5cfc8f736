//! Friction of the drive: LuGre bristles with their own damping (Canudas de Wit 1995), viscous friction, and drags.

/// Speed over which static friction falls to Coulomb's \[rad/s\].
pub(crate) const STRIBECK_SPEED: f64 = 0.03;
/// Exponent of the Stribeck curve where it is the hidden effect of the catalogue, and of the form outside it.
pub(crate) const STRIBECK_EXPONENT: f64 = 1.0;
/// Damping ratio of the drive on its bristles.
pub(crate) const BRISTLE_DAMPING_RATIO: f64 = 0.01;
/// The sliding level stays above this share of Coulomb's, whatever is taken off it.
const LEAST_SHARE: f64 = 0.05;

/// One wave of a friction map over the angle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MapWave {
    /// Periods \[rad/rad\] and phase \[rad\].
    pub(crate) number: f64,
    pub(crate) phase: f64,
}

/// The law's numbers, joint side.
#[derive(Clone, Debug)]
pub(crate) struct Friction {
    /// Coulomb level \[N m\].
    pub(crate) coulomb: f64,
    /// Added for motion in the positive direction, taken off in the negative \[N m\].
    pub(crate) half_difference: f64,
    /// Static friction beyond Coulomb's with exponent 1, and with exponent 2 \[N m\].
    pub(crate) stribeck: f64,
    pub(crate) stribeck_squared: f64,
    /// Change over the angle: standard deviation \[N m\] and waves.
    pub(crate) map_deviation: f64,
    pub(crate) map: [MapWave; 3],
    /// Share of the gear's static load that adds to the level, always and when warm.
    pub(crate) load_share: f64,
    pub(crate) warm_load_share: f64,
    /// Bristle stiffness \[N m/rad\] and damping \[N m s/rad\].
    pub(crate) stiffness: f64,
    pub(crate) damping: f64,
    /// Viscous friction \[N m s/rad\], and its logarithmic loss when warm.
    pub(crate) viscous: f64,
    pub(crate) warm_loss: f64,
    /// Drag with the square and the cube of the speed \[N m s^2/rad^2, N m s^3/rad^3\].
    pub(crate) quadratic: f64,
    pub(crate) cubic: f64,
}

/// Where the drive is and how it moves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sliding {
    /// Angle \[rad\], rate \[rad/s\], bristle deflection \[rad\].
    pub(crate) angle: f64,
    pub(crate) rate: f64,
    pub(crate) bristle: f64,
    /// Static torque that the gear carries \[N m\].
    pub(crate) load: f64,
    /// 0 cold, 1 warm.
    pub(crate) warmth: f64,
}

impl Friction {
    /// Level of steady sliding \[N m\].
    pub(crate) fn level(&self, at: Sliding) -> f64 {
        let mut level = self.coulomb + self.half_difference.copysign(at.rate);
        let speed = at.rate.abs() / STRIBECK_SPEED;
        if self.stribeck != 0.0 {
            level += self.stribeck * (-speed.powf(STRIBECK_EXPONENT)).exp();
        }
        if self.stribeck_squared != 0.0 {
            level += self.stribeck_squared * (-speed * speed).exp();
        }
        if self.map_deviation != 0.0 {
            let sum: f64 = self.map.iter().map(|wave| (wave.number * at.angle + wave.phase).sin()).sum();
            // Each sine has variance 1/2.
            level += self.map_deviation * (2.0 / self.map.len() as f64).sqrt() * sum;
        }
        level += (self.load_share + self.warm_load_share * at.warmth) * at.load.abs();
        level.max(LEAST_SHARE * self.coulomb)
    }

    /// Rate of the bristle's deflection \[rad/s\] and friction torque against positive motion \[N m\].
    pub(crate) fn of(&self, at: Sliding) -> (f64, f64) {
        let Sliding { rate, bristle, .. } = at;
        let bristle_rate = rate - self.stiffness * rate.abs() * bristle / self.level(at);
        let viscous = self.viscous * (-self.warm_loss * at.warmth).exp();
        let drag = (viscous + self.quadratic * rate.abs() + self.cubic * rate * rate) * rate;
        (bristle_rate, self.stiffness * bristle + self.damping * bristle_rate + drag)
    }
}
