//! The links' dynamics by the Jacobians of their centres of mass.

use super::nominal::{AXES, ROBOT};
use crate::space::{Matrix, Vector, carried, cross, difference, dot, scaled, sum};

/// One number an axis.
pub(crate) type Axes = [f64; AXES];

/// Standard gravity, downwards \[m/s^2\].
const GRAVITY: Vector = [0.0, 0.0, -9.80665];

/// What the links ask of torques.
pub(crate) struct Dynamics {
    /// Mass matrix \[kg m^2\].
    pub(crate) mass_matrix: [Axes; AXES],
    /// Torques while no axis accelerates: gravity and Coriolis \[N m\].
    pub(crate) bias: Axes,
    /// Those at rest: gravity \[N m\].
    pub(crate) weight: Axes,
}

/// The links at angles \[rad\] and rates \[rad/s\].
pub(crate) fn dynamics(angle: &Axes, rate: &Axes) -> Dynamics {
    let (mut mass_matrix, mut bias, mut weight) = ([[0.0; AXES]; AXES], [0.0; AXES], [0.0; AXES]);
    let (mut axes, mut feet) = ([[0.0; 3]; AXES], [[0.0; 3]; AXES]);
    // Columns: the frame's axes in the world's.
    let mut frame: Matrix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let (mut foot, mut omega, mut alpha, mut gain) = ([0.0; 3], [0.0; 3], [0.0; 3], [0.0; 3]);
    for (i, link) in ROBOT.iter().enumerate() {
        let [a, tilt, d] = link.row;
        let before = foot;
        let tilted = turned(&frame, 0, tilt);
        frame = turned(&tilted, 2, angle[i]);
        foot = sum(foot, sum(scaled(a, tilted[0]), scaled(d, frame[2])));
        let axis = frame[2];
        (axes[i], feet[i]) = (axis, foot);
        // Accelerations while no axis accelerates.
        gain = sum(gain, carried(omega, alpha, difference(foot, before)));
        alpha = sum(alpha, scaled(rate[i], cross(omega, axis)));
        omega = sum(omega, scaled(rate[i], axis));
        let lever = (0..3).fold([0.0; 3], |lever, k| sum(lever, scaled(link.com[k], frame[k])));
        let pull = difference(sum(gain, carried(omega, alpha, lever)), GRAVITY);
        let turning =
            |v: Vector| (0..3).fold([0.0; 3], |out, k| sum(out, scaled(link.inertia[k] * dot(frame[k], v), frame[k])));
        let moment = sum(turning(alpha), cross(omega, turning(omega)));
        let centre = sum(foot, lever);
        let linear: [Vector; AXES] = std::array::from_fn(|k| cross(axes[k], difference(centre, feet[k])));
        for r in 0..=i {
            weight[r] -= link.mass * dot(linear[r], GRAVITY);
            bias[r] += link.mass * dot(linear[r], pull) + dot(axes[r], moment);
            for c in 0..=i {
                mass_matrix[r][c] += link.mass * dot(linear[r], linear[c]) + dot(axes[r], turning(axes[c]));
            }
        }
    }
    Dynamics { mass_matrix, bias, weight }
}

/// A frame (by its axes) turned about one of its own axes.
fn turned(frame: &Matrix, about: usize, angle: f64) -> Matrix {
    let (sin, cos) = angle.sin_cos();
    let (p, q) = ((about + 1) % 3, (about + 2) % 3);
    let mut out = *frame;
    out[p] = sum(scaled(cos, frame[p]), scaled(sin, frame[q]));
    out[q] = sum(scaled(cos, frame[q]), scaled(-sin, frame[p]));
    out
}

/// Accelerations under torques: the mass matrix' inverse times them.
pub(crate) fn accelerations(mass_matrix: &[Axes; AXES], torque: &Axes) -> Axes {
    crate::space::times(&crate::space::inverse(mass_matrix), *torque)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Kinetic and potential energy \[J\].
    fn energy(angle: &Axes, rate: &Axes) -> f64 {
        let Dynamics { mass_matrix, .. } = dynamics(angle, rate);
        let kinetic: f64 = (0..AXES).map(|i| 0.5 * rate[i] * dot(mass_matrix[i], *rate)).sum();
        // Shoulder and elbow lower the arm as they turn forwards.
        let (shoulder, elbow) = (angle[1], angle[1] + angle[2]);
        let height = |along: f64, angle: f64| -along * angle.sin();
        let upper = ROBOT[1].mass * height(ROBOT[1].com[0], shoulder);
        let fore = ROBOT[2].mass * (height(ROBOT[2].row[0], shoulder) + height(ROBOT[2].com[0], elbow));
        kinetic + 9.80665 * (upper + fore)
    }

    #[test]
    fn a_falling_arm_keeps_its_energy() {
        let (mut angle, mut rate) = ([0.3, -0.4, 0.7], [0.5, -0.8, 1.1]);
        let before = energy(&angle, &rate);
        let step = 1e-4;
        let slope = |angle: &Axes, rate: &Axes| {
            let Dynamics { mass_matrix, bias, .. } = dynamics(angle, rate);
            accelerations(&mass_matrix, &bias.map(|bias| -bias))
        };
        let along = |a: &Axes, b: &Axes, s: f64| -> Axes { std::array::from_fn(|i| a[i] + s * b[i]) };
        for _ in 0..5000 {
            // The midpoint rule.
            let half = along(&rate, &slope(&angle, &rate), 0.5 * step);
            let middle = along(&angle, &rate, 0.5 * step);
            rate = along(&rate, &slope(&middle, &half), step);
            angle = along(&angle, &half, step);
        }
        assert!((energy(&angle, &rate) - before).abs() < 1e-4 * before.abs().max(100.0), "{before}");
    }
}
