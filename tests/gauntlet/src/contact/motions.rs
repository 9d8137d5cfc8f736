//! The contact rig's experiments: pushes and slides.

use crate::motion::{Motion, Wave, burst, plateau, sine};
use crate::session::{FRESH, HOLDOUT};

/// Length of a record \[s\].
pub(crate) const DURATION_S: f64 = 3.0;

/// Training experiments.
pub(crate) const TRAINING: &[&str] = &["press", "bounce", "slide"];

/// One experiment.
pub(crate) struct Experiment {
    /// Push towards the plate \[N\].
    pub(crate) push: Motion,
    /// Lateral carriage \[m\].
    pub(crate) carriage: [Motion; 2],
    /// Height of the contact point over the nominal plate at the start, at rest \[m\].
    pub(crate) height: f64,
}

fn about(centre: f64, waves: &[Wave]) -> Motion {
    Motion { centre, waves: waves.to_vec() }
}

/// The experiment of a name.
pub(crate) fn experiment(name: &str) -> Experiment {
    let still = || about(0.0, &[]);
    match name {
        // Three depths, then pulled off.
        "press" => {
            let steps = [plateau(50.0, 0.2, 2.6), plateau(100.0, 0.8, 2.2), plateau(180.0, 1.3, 1.9)];
            let pull = plateau(-60.0, 2.3, 3.0);
            Experiment {
                push: about(12.0, &[&steps[..], &[pull]].concat()),
                carriage: [still(), still()],
                height: 2e-4,
            }
        }
        // A constant push makes it fall like a ball: a ladder of speeds from 0.1 m/s down.
        "bounce" => Experiment { push: about(22.0, &[]), carriage: [still(), still()], height: 0.009 },
        // All directions, from creeping to 0.1 m/s, under two loads.
        "slide" => Experiment {
            push: about(50.0, &[plateau(80.0, 1.4, 3.4)]),
            carriage: [
                about(0.0, &[sine(0.012, 0.9, 0.0), sine(0.002, 2.6, 1.0)]),
                about(0.0, &[sine(0.012, 0.6, 1.0), burst(0.004, 2.1, 1.5, 3.0)]),
            ],
            height: -5e-4,
        },
        // Glancing blows at other speeds.
        HOLDOUT => Experiment {
            push: about(30.0, &[plateau(60.0, 1.2, 2.3)]),
            carriage: [about(0.0, &[sine(0.01, 1.2, 0.5)]), about(0.0, &[sine(0.007, 0.8, 2.0)])],
            height: 0.005,
        },
        FRESH => Experiment {
            push: about(26.0, &[plateau(40.0, 0.9, 1.6), plateau(110.0, 1.8, 2.6)]),
            carriage: [about(0.0, &[sine(0.008, 0.7, 2.5)]), about(0.0, &[sine(0.009, 1.4, 0.2)])],
            height: 0.007,
        },
        _ => unreachable!("experiments come from the list above"),
    }
}
