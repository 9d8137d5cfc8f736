//! Commanded path: sampled, and followed through its samples.

use crate::motion::Reference;

/// Path that a rig is commanded to follow.
#[derive(Clone, Debug, PartialEq)]
pub struct CommandedPath {
    /// From one sample to the next \[s\].
    pub step_s: f64,
    /// Angles \[rad\], sample by sample; it begins and ends at rest.
    pub path: Vec<f64>,
    /// Number of repeats.
    pub repeats: u64,
}

impl CommandedPath {
    /// Returns the duration \[s\].
    pub(crate) fn duration_s(&self) -> f64 {
        (self.path.len().max(1) - 1) as f64 * self.step_s
    }

    /// A sample with its rate and acceleration by central differences of the fourth order; at rest beyond both ends.
    fn node(&self, i: usize) -> [f64; 3] {
        let at = |offset: usize| self.path[(i + offset).clamp(2, self.path.len() + 1) - 2];
        let [far_before, before, own, after, far_after] = std::array::from_fn(at);
        let rate = (8.0 * (after - before) - (far_after - far_before)) / 12.0;
        let bend = (16.0 * (after + before) - 30.0 * own - (far_after + far_before)) / 12.0;
        [own, rate / self.step_s, bend / (self.step_s * self.step_s)]
    }
}

impl Reference for CommandedPath {
    /// Polynomials of the fifth degree between the samples: rate and acceleration are continuous, as in a drive that
    /// interpolates its set points.
    fn at(&self, time: f64) -> [f64; 3] {
        let (h, last) = (self.step_s, self.path.len() - 1);
        let place = time / h;
        if place <= 0.0 || place >= last as f64 {
            return [self.path[if place <= 0.0 { 0 } else { last }], 0.0, 0.0];
        }
        let i = place.floor() as usize;
        let scaled = |node: [f64; 3]| [node[0], h * node[1], h * h * node[2]];
        let ([q, v, a], [to, to_v, to_a]) = (scaled(self.node(i)), scaled(self.node(i + 1)));
        let (way, turn, bend) = (to - q - v - 0.5 * a, to_v - v - a, to_a - a);
        let c = [
            10.0 * way - 4.0 * turn + 0.5 * bend,
            -15.0 * way + 7.0 * turn - bend,
            6.0 * way - 3.0 * turn + 0.5 * bend,
        ];
        let s = place - i as f64;
        let value = q + s * (v + s * (0.5 * a + s * (c[0] + s * (c[1] + s * c[2]))));
        let rate = v + s * (a + s * (3.0 * c[0] + s * (4.0 * c[1] + s * 5.0 * c[2])));
        let acceleration = a + s * (6.0 * c[0] + s * (12.0 * c[1] + s * 20.0 * c[2]));
        [value, rate / h, acceleration / (h * h)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn sampled_sine_is_followed_with_rate_and_acceleration() {
        let (step_s, omega) = (0.004, TAU * 2.0);
        let path = (0..=500).map(|i| 0.3 * (omega * f64::from(i) * step_s).sin()).collect();
        let commanded = CommandedPath { step_s, path, repeats: 1 };
        assert!((commanded.duration_s() - 2.0).abs() < 1e-12);
        for time in [0.0501, 0.333, 0.9999, 1.25, 1.7] {
            let [value, rate, acceleration] = commanded.at(time);
            let (sin, cos) = (omega * time).sin_cos();
            assert!((value - 0.3 * sin).abs() < 1e-7, "{time}");
            assert!((rate - 0.3 * omega * cos).abs() < 1e-5 * 0.3 * omega, "{time}");
            assert!((acceleration + 0.3 * omega * omega * sin).abs() < 1e-3 * 0.3 * omega * omega, "{time}");
            let slope = |order: usize| (commanded.at(time + 1e-6)[order] - commanded.at(time - 1e-6)[order]) / 2e-6;
            assert!((slope(0) - rate).abs() < 1e-6 && (slope(1) - acceleration).abs() < 1e-3, "{time}");
        }
        assert_eq!(
            (commanded.at(-0.1), commanded.at(5.0)),
            ([commanded.path[0], 0.0, 0.0], [commanded.path[500], 0.0, 0.0])
        );
    }
}
