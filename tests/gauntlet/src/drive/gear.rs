//! The gear between motor and link: its kinematics, and the spring or the gap in it.

/// Periodic error of the gear's kinematics.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Transmission {
    /// Sine: amplitude \[rad\], periods \[rad/rad\], phase \[rad\].
    pub(crate) sine: (f64, f64, f64),
    /// Triangle with rounded corners, the same.
    pub(crate) triangle: (f64, f64, f64),
}

/// Sine of the arc that a triangle's corner reaches: 1 would be sharp.
const ROUNDNESS: f64 = 0.95;

/// Link angle that belongs to a motor angle, with its first two derivatives.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ratio {
    pub(crate) angle: f64,
    pub(crate) slope: f64,
    pub(crate) bend: f64,
}

impl Transmission {
    /// The link angle without twist at a motor angle \[rad\].
    pub(crate) fn at(&self, angle: f64) -> Ratio {
        let mut out = Ratio { angle, slope: 1.0, bend: 0.0 };
        let (amplitude, number, phase) = self.sine;
        if amplitude != 0.0 {
            let (sin, cos) = (number * angle + phase).sin_cos();
            out.angle += amplitude * sin;
            out.slope += amplitude * number * cos;
            out.bend -= amplitude * number * number * sin;
        }
        let (amplitude, number, phase) = self.triangle;
        if amplitude != 0.0 {
            let scale = amplitude / ROUNDNESS.asin();
            let (sin, cos) = (number * angle + phase).sin_cos();
            let rest = 1.0 - (ROUNDNESS * sin).powi(2);
            out.angle += scale * (ROUNDNESS * sin).asin();
            out.slope += scale * number * ROUNDNESS * cos / rest.sqrt();
            out.bend -= scale * number * number * ROUNDNESS * sin * (1.0 - ROUNDNESS * ROUNDNESS) / rest.powf(1.5);
        }
        out
    }
}

/// One side of the teeth: they touch where the twist exceeds the gap.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Flank {
    /// Gap \[rad\].
    pub(crate) gap: f64,
    /// Stiffness \[N m/rad\].
    pub(crate) stiffness: f64,
}

/// A gear that yields.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spring {
    /// Flanks that drive the link in the positive and in the negative direction.
    pub(crate) positive: Flank,
    pub(crate) negative: Flank,
    /// Linear damping of a gear without gap \[N m s/rad\].
    pub(crate) damping: f64,
    /// Damping of teeth that may part, in proportion to the torque \[s/rad\] (Hunt and Crossley 1975).
    pub(crate) impact: f64,
}

impl Spring {
    /// Whether there is a gap.
    pub(crate) fn loose(&self) -> bool {
        self.positive.gap > 0.0 || self.negative.gap > 0.0
    }

    /// Torque on the link \[N m\] of a twist \[rad\] and its rate \[rad/s\]. Teeth push and never pull.
    pub(crate) fn torque(&self, twist: f64, rate: f64) -> f64 {
        if !self.loose() {
            return self.positive.stiffness * twist + self.damping * rate;
        }
        let push = |flank: Flank, twist: f64, rate: f64| {
            let depth = twist - flank.gap;
            if depth > 0.0 { (flank.stiffness * depth * (1.0 + self.impact * rate)).max(0.0) } else { 0.0 }
        };
        push(self.positive, twist, rate) - push(self.negative, -twist, -rate)
    }

    /// Twist \[rad\] that carries a static torque \[N m\].
    pub(crate) fn twist(&self, torque: f64) -> f64 {
        let flank = if torque >= 0.0 { self.positive } else { self.negative };
        (flank.gap + torque.abs() / flank.stiffness).copysign(torque)
    }

    /// Functions of the twist that change sign where teeth meet or part.
    pub(crate) fn surfaces(&self, twist: f64) -> [f64; 2] {
        if self.loose() { [twist - self.positive.gap, twist + self.negative.gap] } else { [1.0; 2] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_of_the_kinematics_are_its_own() {
        let transmission = Transmission { sine: (0.001, 30.0, 0.4), triangle: (0.002, 21.0, 1.1) };
        for angle in [-0.3, 0.0, 0.27, 1.1] {
            let at = transmission.at(angle);
            let (low, high) = (transmission.at(angle - 1e-7), transmission.at(angle + 1e-7));
            assert!(((high.angle - low.angle) / 2e-7 - at.slope).abs() < 1e-7);
            assert!(((high.slope - low.slope) / 2e-7 - at.bend).abs() < 1e-4);
        }
    }

    #[test]
    fn gap_transmits_no_torque_and_teeth_never_pull() {
        let flank = Flank { gap: 0.001, stiffness: 1e6 };
        let spring = Spring { positive: flank, negative: flank, damping: 0.0, impact: 20.0 };
        assert_eq!(spring.torque(0.0009, 1.0), 0.0);
        assert_eq!(spring.torque(-0.0009, 1.0), 0.0);
        assert!((spring.torque(0.0011, 0.0) - 100.0).abs() < 1e-9);
        assert!((spring.torque(-0.0011, 0.0) + 100.0).abs() < 1e-9);
        assert_eq!(spring.torque(0.0011, -1.0), 0.0);
        assert!((spring.torque(spring.twist(-40.0), 0.0) + 40.0).abs() < 1e-9);
    }
}
