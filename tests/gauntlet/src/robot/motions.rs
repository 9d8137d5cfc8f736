//! Experiments of the robot, all axes at once: three for training, one held out, one that is never recorded.

use super::nominal::AXES;
use crate::motion::{Motion, burst, chirp, sine};
use crate::session::{FRESH, HOLDOUT};

/// Length of a record \[s\].
pub(crate) const DURATION_S: f64 = 6.0;

/// Training experiments.
pub(crate) const TRAINING: &[&str] = &["multisine", "sweep", "creep"];

/// The motions of an experiment, axis by axis \[rad\].
pub(crate) fn motions(experiment: &str) -> [Motion; AXES] {
    match experiment {
        "multisine" => multisine(),
        "sweep" => sweep(),
        "creep" => creep(),
        HOLDOUT => validation(),
        FRESH => fresh(),
        _ => unreachable!("experiments come from the list above"),
    }
}

/// Every axis between 0.2 and 3 Hz, no two at the same frequencies.
fn multisine() -> [Motion; AXES] {
    [
        Motion { centre: 0.1, waves: vec![sine(0.3, 0.23, 0.4), sine(0.05, 0.83, 2.0), sine(0.012, 2.3, 1.1)] },
        Motion {
            centre: -0.5,
            waves: vec![sine(0.3, 0.2, 0.3), sine(0.07, 0.57, 2.1), sine(0.02, 1.3, 5.5), sine(0.007, 2.9, 3.3)],
        },
        Motion { centre: 0.8, waves: vec![sine(0.35, 0.31, 1.4), sine(0.06, 1.1, 0.2), sine(0.01, 2.6, 4.0)] },
    ]
}

/// Slow strokes of the shoulder over most of its range under a chirp; base and elbow follow at their own pace.
fn sweep() -> [Motion; AXES] {
    let stroke = |harmonic: f64, sign: f64| sine(sign * 0.5 / (harmonic * harmonic), harmonic / 6.0, 0.0);
    let shoulder = vec![stroke(1.0, 0.81), stroke(3.0, -0.81), stroke(5.0, 0.81), chirp(0.003, 1.0, 6.0, 0.5, 5.8)];
    [
        Motion { centre: -0.2, waves: vec![burst(0.2, 0.4, 0.0, 6.0)] },
        Motion { centre: -0.4, waves: shoulder },
        Motion { centre: 1.0, waves: vec![burst(0.25, 0.29, 0.0, 6.0)] },
    ]
}

/// Slowly through zero speed and reversals of two sizes; base and elbow creep too.
fn creep() -> [Motion; AXES] {
    [
        Motion { centre: 0.0, waves: vec![burst(0.012, 0.45, 0.0, 6.0)] },
        Motion {
            centre: 0.1,
            waves: vec![burst(0.014, 0.4, 0.0, 3.0), burst(0.0006, 2.5, 3.0, 4.4), burst(0.008, 1.6, 4.4, 6.0)],
        },
        Motion { centre: 0.6, waves: vec![burst(0.013, 0.5, 0.5, 5.5)] },
    ]
}

/// Other frequencies, other poses, and two seconds of creeping at other speeds: no axis stands, since what it does then
/// is its bristles' alone.
fn validation() -> [Motion; AXES] {
    [
        Motion {
            centre: 0.3,
            waves: vec![burst(0.2, 0.35, 0.0, 4.0), burst(0.02, 1.7, 0.5, 3.5), burst(0.012, 0.6, 3.7, 6.0)],
        },
        Motion {
            centre: -0.3,
            waves: vec![burst(0.25, 0.37, 0.0, 3.6), chirp(0.012, 3.0, 1.1, 0.3, 3.5), burst(0.011, 0.55, 3.6, 6.0)],
        },
        Motion {
            centre: 0.5,
            waves: vec![burst(0.25, 0.43, 0.0, 4.2), burst(0.015, 1.9, 0.4, 3.8), burst(0.013, 0.65, 3.9, 6.0)],
        },
    ]
}

/// Motion for the true gain; none of its spectral lines is in a recording.
fn fresh() -> [Motion; AXES] {
    [
        Motion { centre: -0.1, waves: vec![burst(0.25, 0.27, 0.0, 4.4), burst(0.014, 0.5, 4.1, 6.0)] },
        Motion {
            centre: -0.6,
            waves: vec![burst(0.3, 0.31, 0.0, 3.4), burst(0.04, 1.01, 0.0, 3.4), burst(0.016, 0.45, 3.4, 6.0)],
        },
        Motion {
            centre: 0.9,
            waves: vec![burst(0.22, 0.49, 0.0, 4.4), burst(0.012, 2.2, 0.3, 3.9), burst(0.012, 0.7, 4.1, 6.0)],
        },
    ]
}
