//! Experiments of the drive: three for training, one held out, one that is never recorded.

use crate::motion::{Motion, burst, chirp, sine};
use crate::session::{FRESH, HOLDOUT};

/// Length of a record \[s\].
pub(crate) const DURATION_S: f64 = 6.0;

/// Training experiments.
pub(crate) const TRAINING: &[&str] = &["multisine", "sweep", "creep"];

/// The motion of an experiment \[rad\].
pub(crate) fn motion(experiment: &str) -> Motion {
    match experiment {
        "multisine" => multisine(),
        "sweep" => sweep(),
        "creep" => creep(),
        HOLDOUT => validation(),
        FRESH => fresh(),
        _ => unreachable!("experiments come from the list above"),
    }
}

/// 0.2 to 4 Hz: rich in acceleration, over half a radian of pose.
fn multisine() -> Motion {
    let lines = [
        (0.30, 0.2, 0.3),
        (0.10, 0.47, 2.1),
        (0.05, 0.9, 4.0),
        (0.02, 1.4, 5.5),
        (0.012, 2.1, 1.2),
        (0.008, 2.8, 3.3),
        (0.006, 3.4, 0.7),
        (0.005, 4.0, 2.6),
    ];
    Motion { centre: 0.6, waves: lines.map(|(amplitude, hz, phase)| sine(amplitude, hz, phase)).into() }
}

/// A slow triangle (its first three harmonics) under a chirp of 1 to 7 Hz: steady speeds both ways, over most of the range.
fn sweep() -> Motion {
    let triangle = |harmonic: f64, sign: f64| sine(sign * 0.6 / (harmonic * harmonic), harmonic / 6.0, 0.0);
    let waves = vec![triangle(1.0, 0.81), triangle(3.0, -0.81), triangle(5.0, 0.81), chirp(0.003, 1.0, 7.0, 0.5, 5.8)];
    Motion { centre: 0.6, waves }
}

/// Slowly through zero speed (up to 0.05 rad/s), then reversals of two sizes, in a pose with half the gravity load.
fn creep() -> Motion {
    let waves = vec![burst(0.014, 0.4, 0.0, 3.0), burst(0.0006, 2.5, 3.0, 4.4), burst(0.008, 1.6, 4.4, 6.0)];
    Motion { centre: 1.1, waves }
}

/// Other frequencies, another pose, and 2.4 s of creeping at other speeds.
fn validation() -> Motion {
    let mut waves = vec![burst(0.25, 0.37, 0.0, 3.6), chirp(0.015, 3.2, 1.1, 0.3, 3.5), burst(0.002, 5.3, 1.0, 3.3)];
    waves.extend([burst(0.05, 0.8, 0.0, 3.6), burst(0.011, 0.55, 3.6, 6.0)]);
    Motion { centre: 0.4, waves }
}

/// Motion for the true gain; none of its spectral lines is in a recording.
fn fresh() -> Motion {
    let mut waves = vec![burst(0.35, 0.31, 0.0, 3.4), burst(0.05, 1.01, 0.0, 3.4), chirp(0.004, 6.0, 2.0, 0.5, 3.3)];
    waves.extend([burst(0.015, 1.7, 0.2, 3.0), burst(0.016, 0.45, 3.4, 6.0)]);
    Motion { centre: 0.75, waves }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Greatest speed \[rad/s\] and acceleration \[rad/s^2\], and the range of the angle \[rad\].
    fn extremes(motion: &Motion) -> (f64, f64, f64) {
        let at = (0..6000).map(|tick| motion.at(f64::from(tick) * 1e-3));
        let (mut speed, mut acceleration, mut low, mut high) = (0.0_f64, 0.0_f64, f64::MAX, f64::MIN);
        for [angle, rate, bend] in at {
            (speed, acceleration) = (speed.max(rate.abs()), acceleration.max(bend.abs()));
            (low, high) = (low.min(angle), high.max(angle));
        }
        (speed, acceleration, high - low)
    }

    #[test]
    fn every_motion_is_within_the_limits_of_the_drive() {
        for name in TRAINING.iter().chain(&[HOLDOUT, FRESH]) {
            let (speed, acceleration, range) = extremes(&motion(name));
            assert!(speed < 1.5 && acceleration < 25.0 && range < 2.0, "{name}: {speed} {acceleration} {range}");
        }
        let (speed, acceleration, range) = extremes(&multisine());
        assert!(speed > 0.5 && acceleration > 6.0 && range > 0.5, "{speed} {acceleration} {range}");
        let (_, _, range) = extremes(&sweep());
        assert!(range > 1.0, "{range}");
        let (speed, _, _) = extremes(&Motion { waves: creep().waves[..2].to_vec(), ..creep() });
        assert!(speed > 0.03 && speed < 0.07, "{speed}");
    }
}
