//! Initial states of the drives: three for training, one held out, one that is never recorded.

use super::bodies::Part;
use crate::session::{FRESH, HOLDOUT};
use crate::space::{Vector, scaled, sum, turned};

/// Length of a record \[s\].
pub(crate) const DURATION_S: f64 = 1.8;

/// Training experiments.
pub(crate) const TRAINING: &[&str] = &["head_on", "aslant", "turning"];

/// Start of a drive. Part B stands at the origin of the contact frame; the parts slide on one another from the first
/// touch to the last, so that friction is at its limit whatever its law makes of sticking.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Start {
    /// Part A's origin \[m\] and its velocity \[m/s\].
    position: Vector,
    velocity: Vector,
    /// Rotation of the chaser \[rad\], rates of chaser and target \[rad/s\].
    tilt: Vector,
    rates: [Vector; 2],
}

impl Start {
    pub(crate) fn of(experiment: &str) -> Self {
        let none = [[0.0; 3]; 2];
        let of = |position, velocity, tilt, rates| Self { position, velocity, tilt, rates };
        match experiment {
            "head_on" => of([-0.053, -0.02, 0.014], [0.055, 0.07, -0.015], [0.0; 3], none),
            "aslant" => of([-0.045, 0.024, -0.025], [0.04, -0.04, 0.05], [0.01, 0.02, -0.015], none),
            "turning" => of(
                [-0.035, -0.01, 0.01],
                [0.05, 0.015, -0.07],
                [0.0, -0.02, 0.01],
                [[0.01, 0.0, 0.02], [0.03, -0.01, 0.0]],
            ),
            HOLDOUT => {
                of([-0.054, 0.03, 0.037], [0.06, -0.06, -0.055], [0.02, 0.0, 0.01], [[0.0, 0.02, 0.0], [0.0; 3]])
            }
            FRESH => {
                of([-0.05, -0.038, -0.012], [0.048, 0.06, 0.04], [0.0, 0.01, 0.02], [[0.0; 3], [0.0, 0.015, 0.01]])
            }
            _ => unreachable!("experiments come from the list above"),
        }
    }

    /// Parts A and B at the start.
    pub(crate) fn parts(&self) -> [Part; 2] {
        self.coasting(0.0)
    }

    /// Parts A and B a time \[s\] before the start: the robots have set off long before, at a steady pace.
    pub(crate) fn coasting(&self, before: f64) -> [Part; 2] {
        let level = [1.0, 0.0, 0.0, 0.0];
        let [omega_a, omega_b] = self.rates;
        [
            Part {
                position: sum(self.position, scaled(-before, self.velocity)),
                attitude: turned(turned(level, self.tilt), scaled(-before, omega_a)),
                velocity: self.velocity,
                omega: omega_a,
            },
            Part {
                position: [0.0; 3],
                attitude: turned(level, scaled(-before, omega_b)),
                velocity: [0.0; 3],
                omega: omega_b,
            },
        ]
    }
}
