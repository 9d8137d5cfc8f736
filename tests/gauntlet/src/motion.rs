//! Commanded motions as sums of faded-in waves, with exact rates and accelerations.

use std::f64::consts::{FRAC_PI_2, TAU};

/// Time over which a wave fades in and out \[s\].
const FADE_S: f64 = 0.4;

/// A sine of steady or steadily changing frequency, inside a smooth window.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wave {
    /// Amplitude, in the unit of the motion.
    pub(crate) amplitude: f64,
    /// Frequency where the window opens and where it closes \[Hz\].
    pub(crate) from_hz: f64,
    pub(crate) to_hz: f64,
    /// Phase where the window opens \[rad\].
    pub(crate) phase: f64,
    /// Where the window opens and closes \[s\].
    pub(crate) opens_s: f64,
    pub(crate) closes_s: f64,
}

/// A sine that fades in at t = 0 and lasts.
pub(crate) const fn sine(amplitude: f64, hz: f64, phase: f64) -> Wave {
    Wave { amplitude, from_hz: hz, to_hz: hz, phase, opens_s: 0.0, closes_s: f64::INFINITY }
}

/// A sine inside a window.
pub(crate) const fn burst(amplitude: f64, hz: f64, opens_s: f64, closes_s: f64) -> Wave {
    Wave { amplitude, from_hz: hz, to_hz: hz, phase: 0.0, opens_s, closes_s }
}

/// A constant inside a window.
pub(crate) const fn plateau(amplitude: f64, opens_s: f64, closes_s: f64) -> Wave {
    Wave { amplitude, from_hz: 0.0, to_hz: 0.0, phase: FRAC_PI_2, opens_s, closes_s }
}

/// A sweep of the frequency inside a window.
pub(crate) const fn chirp(amplitude: f64, from_hz: f64, to_hz: f64, opens_s: f64, closes_s: f64) -> Wave {
    Wave { amplitude, from_hz, to_hz, phase: 0.0, opens_s, closes_s }
}

/// Smooth step from 0 to 1 with its first two derivatives. At the ends the third vanishes too: who rebuilds rate and
/// acceleration from a log of the position finds no kink there.
fn fade(time: f64) -> [f64; 3] {
    let s = (time / FADE_S).clamp(0.0, 1.0);
    let slope = 140.0 * (s * (1.0 - s)).powi(3) / FADE_S;
    let bend = 420.0 * (s * (1.0 - s)).powi(2) * (1.0 - 2.0 * s) / (FADE_S * FADE_S);
    [s.powi(4) * (35.0 - s * (84.0 - s * (70.0 - 20.0 * s))), slope, bend]
}

/// Product of two functions given with their first two derivatives.
fn product(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] * b[0], a[1] * b[0] + a[0] * b[1], a[2] * b[0] + 2.0 * a[1] * b[1] + a[0] * b[2]]
}

impl Wave {
    /// Value, rate and acceleration at a time \[s\].
    pub(crate) fn at(&self, time: f64) -> [f64; 3] {
        let since = time - self.opens_s;
        let until = self.closes_s - time;
        if since <= 0.0 || until <= 0.0 {
            return [0.0; 3];
        }
        let sweep = if self.from_hz == self.to_hz { 0.0 } else { (self.to_hz - self.from_hz) / (since + until) };
        let omega = TAU * (self.from_hz + sweep * since);
        let (sin, cos) = (self.phase + TAU * since * (self.from_hz + 0.5 * sweep * since)).sin_cos();
        let wave = [sin, omega * cos, TAU * sweep * cos - omega * omega * sin].map(|x| self.amplitude * x);
        let [out, out_slope, out_bend] = fade(until);
        product(product(wave, fade(since)), [out, -out_slope, out_bend])
    }
}

/// Reference of a controller.
pub(crate) trait Reference {
    /// Position, rate and acceleration at a time \[s\]; at rest before t = 0.
    fn at(&self, time: f64) -> [f64; 3];
}

/// A motion about a centre.
#[derive(Clone, Debug)]
pub(crate) struct Motion {
    /// Where it starts, at rest.
    pub(crate) centre: f64,
    /// What is added.
    pub(crate) waves: Vec<Wave>,
}

impl Motion {
    /// Position, rate and acceleration at a time \[s\]; at rest before t = 0.
    pub(crate) fn at(&self, time: f64) -> [f64; 3] {
        self.waves.iter().fold([self.centre, 0.0, 0.0], |sum, wave| {
            let add = wave.at(time);
            std::array::from_fn(|i| sum[i] + add[i])
        })
    }
}

impl Reference for Motion {
    fn at(&self, time: f64) -> [f64; 3] {
        Self::at(self, time)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_and_accelerations_are_those_of_the_position() {
        let motion = Motion { centre: 0.5, waves: vec![sine(0.3, 0.7, 1.0), chirp(0.01, 1.0, 7.0, 1.0, 5.0)] };
        assert_eq!(motion.at(0.0), [0.5, 0.0, 0.0]);
        for time in [0.1, 0.3, 1.2, 3.0, 4.8] {
            let [_, rate, acceleration] = motion.at(time);
            let slope = |order: usize| (motion.at(time + 1e-6)[order] - motion.at(time - 1e-6)[order]) / 2e-6;
            assert!((slope(0) - rate).abs() < 1e-8, "{time}");
            assert!((slope(1) - acceleration).abs() < 1e-6, "{time}");
        }
    }
}
