//! Measured states of a rigid body: pose and twist at a frame from a parabola through its neighbours.

use crate::data::grid::Piece;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Frames on either side that a state is computed from.
pub const REACH: usize = 2;

/// Weights of five frames for the value, the rate and the bend of their parabola.
const VALUE: [f64; 5] = [-3.0 / 35.0, 12.0 / 35.0, 17.0 / 35.0, 12.0 / 35.0, -3.0 / 35.0];
const RATE: [f64; 5] = [-0.2, -0.1, 0.0, 0.1, 0.2];
const BEND: [f64; 5] = [2.0 / 14.0, -1.0 / 14.0, -2.0 / 14.0, -1.0 / 14.0, 2.0 / 14.0];

/// Standard deviation of a [`BodyState`]'s velocity or rate, in noises of a frame over the step.
pub const RATE_NOISE: f64 = 0.316_227_766_016_837_94;

/// State of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyState {
    /// Position \[m\].
    pub position: Vector3<f64>,
    /// Rotation from body to world axes.
    pub attitude: UnitQuaternion<f64>,
    /// Velocity in world axes \[m/s\].
    pub velocity: Vector3<f64>,
    /// Angular rate in body axes \[rad/s\].
    pub rate: Vector3<f64>,
    /// Residuals of the parabolas, as noise of one frame: positions \[m\] and angles \[rad\], each axis.
    pub left: [f64; 2],
}

/// Poses of a recording.
#[derive(Clone, Debug)]
pub struct Poses {
    /// Sampling period \[s\].
    pub step: f64,
    /// Positions \[m\].
    pub position: Vec<Vector3<f64>>,
    /// Rotations from body to world axes.
    pub attitude: Vec<UnitQuaternion<f64>>,
}

impl Poses {
    /// Reads the poses from a recording.
    pub fn of(piece: &Piece) -> Self {
        let at = |name: &str, i: usize| piece.signals[name][i];
        let position = |i| Vector3::new(at("position.x", i), at("position.y", i), at("position.z", i));
        let attitude = |i| {
            let [w, x, y, z] = ["w", "x", "y", "z"].map(|axis| at(&format!("orientation.{axis}"), i));
            UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
        };
        let frames = 0..piece.samples();
        Self {
            step: piece.step,
            position: frames.clone().map(position).collect(),
            attitude: frames.map(attitude).collect(),
        }
    }

    /// Returns the number of frames.
    pub fn frames(&self) -> usize {
        self.position.len()
    }

    /// Returns the rotation vector from one frame to another, in body axes at the first \[rad\].
    pub fn turn(&self, from: usize, to: usize) -> Vector3<f64> {
        (self.attitude[from].inverse() * self.attitude[to]).scaled_axis()
    }

    /// Returns the state at a frame; `None` too close to an end.
    pub fn state(&self, frame: usize) -> Option<BodyState> {
        if frame < REACH || frame + REACH >= self.frames() {
            return None;
        }
        let near = |j: usize| frame - REACH + j;
        let way: [Vector3<f64>; 5] = std::array::from_fn(|j| self.position[near(j)] - self.position[frame]);
        let turn: [Vector3<f64>; 5] = std::array::from_fn(|j| self.turn(frame, near(j)));
        Some(BodyState {
            position: self.position[frame] + sum(&way, &VALUE),
            attitude: self.attitude[frame] * UnitQuaternion::from_scaled_axis(sum(&turn, &VALUE)),
            velocity: sum(&way, &RATE) / self.step,
            rate: sum(&turn, &RATE) / self.step,
            left: [left(&way), left(&turn)],
        })
    }
}

fn sum(values: &[Vector3<f64>; 5], weights: &[f64; 5]) -> Vector3<f64> {
    values.iter().zip(weights).map(|(value, weight)| value * *weight).sum()
}

/// Returns the residual of a parabola through five vectors, as noise of one of them: two of five are free.
fn left(values: &[Vector3<f64>; 5]) -> f64 {
    let (value, rate, bend) = (sum(values, &VALUE), sum(values, &RATE), sum(values, &BEND));
    let rest = |j: usize| {
        let t = j as f64 - REACH as f64;
        (values[j] - value - rate * t - bend * (t * t)).norm_squared()
    };
    ((0..5).map(rest).sum::<f64>() / 6.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn state_of_a_falling_spinning_body_is_exact() {
        let (step, rate, v) = (0.0068, Vector3::new(1.0, -4.0, 2.0), Vector3::new(0.5, 0.1, 0.3));
        let fall = Vector3::new(0.0, 0.0, -9.81);
        let begin = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, 0.2, -2.0));
        let time = |i: usize| i as f64 * step;
        let poses = Poses {
            step,
            position: (0..9).map(|i| v * time(i) + fall * (0.5 * time(i) * time(i))).collect(),
            attitude: (0..9).map(|i| begin * UnitQuaternion::from_scaled_axis(rate * time(i))).collect(),
        };
        let state = poses.state(4).expect("neighbours");
        assert!((state.velocity - v - fall * time(4)).norm() < 1e-12 && (state.rate - rate).norm() < 1e-9);
        assert!((state.position - poses.position[4]).norm() < 1e-12 && state.left.iter().all(|left| *left < 1e-9));
        assert!(poses.state(1).is_none() && poses.state(7).is_none());
        let mut bent = poses.clone();
        bent.position[6].x += 1e-3;
        assert!(bent.state(4).expect("neighbours").left[0] > 1e-4);
    }
}
