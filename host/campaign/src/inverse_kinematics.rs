//! Numeric inverse kinematics of any serial robot, also without a spherical wrist: damped least squares inside the
//! joint limits.

use nalgebra::{DMatrix, DVector, Vector3, Vector6};
use softdock_kernels::manipulator::{Manipulator, joint_axis, link_frames};
use softdock_kernels::vector::{Pose, Quat, Vec3};
use softdock_kernels::with_joints;
use std::f64::consts::TAU;

/// Position error \[m\] and angle error \[rad\] at which a posture counts as reached.
const CONVERGED: f64 = 1e-11;
/// Steps from one start.
const STEPS: usize = 200;
/// Starts after the seed itself has led nowhere.
const STARTS: usize = 48;
/// Damping of the first step, m or rad per rad.
const FIRST_DAMPING: f64 = 1e-2;
/// Largest damping: beyond it no step improves the posture.
const LARGEST_DAMPING: f64 = 1e6;

/// A pose that no posture inside the joint limits reaches, as far as the search finds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnreachedPose {
    /// Distance of the flange from the pose in the best posture \[m\].
    pub distance: f64,
    /// Angle between the flange and the pose in the best posture \[rad\].
    pub angle: f64,
}

impl std::fmt::Display for UnreachedPose {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (distance, angle) = (self.distance * 1e3, self.angle.to_degrees());
        write!(f, "no posture inside the joint limits reaches the pose: {distance:.3} mm and {angle:.3} deg are left")
    }
}

impl std::error::Error for UnreachedPose {}

/// Returns joint angles \[rad\] at which the flange has a pose in base axes, near `seed`.
///
/// The search starts at `seed`; only if it ends elsewhere, other starts inside the limits are tried, and the result
/// closest to `seed` is returned. A joint turns to the multiple of a turn that is nearest to its seed and inside its
/// limits.
///
/// # Errors
/// If no start converges, with the best distance and angle.
///
/// # Panics
/// If `seed` does not have one angle per joint.
pub fn inverse(robot: &Manipulator, pose: Pose<f64>, seed: &[f64]) -> Result<Vec<f64>, UnreachedPose> {
    assert_eq!(seed.len(), robot.joints.len(), "one angle per joint");
    let nearest = |angles: Vec<f64>| -> Vec<f64> {
        angles.iter().enumerate().map(|(i, angle)| unwound(robot, i, *angle, seed[i])).collect()
    };
    let mut best = match climb(robot, pose, seed.to_vec()) {
        Ok(angles) => return Ok(nearest(angles)),
        Err(missed) => missed,
    };
    let mut found: Option<(f64, Vec<f64>)> = None;
    for start in 1..=STARTS {
        match climb(robot, pose, start_of(robot, start)) {
            Ok(angles) => {
                let angles = nearest(angles);
                let distance = angles.iter().zip(seed).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
                if found.as_ref().is_none_or(|(least, _)| distance < *least) {
                    found = Some((distance, angles));
                }
            }
            Err(missed) if missed.distance + missed.angle < best.distance + best.angle => best = missed,
            Err(_) => {}
        }
    }
    found.map(|(_, angles)| angles).ok_or(best)
}

/// Start number `number` inside the limits: points of a Kronecker sequence, which fill the ranges evenly.
fn start_of(robot: &Manipulator, number: usize) -> Vec<f64> {
    // The positive root of x^(n + 1) = x + 1 gives the steps of an even sequence in n dimensions.
    let n = robot.joints.len() as i32;
    let root = (0..64).fold(1.5_f64, |x, _| (1.0 + x).powf(1.0 / f64::from(n + 1)));
    let share = |i: usize| (0.5 + number as f64 * root.powi(-(i as i32 + 1))).fract();
    let range = |i: usize| (robot.joints[i].limits.lower, robot.joints[i].limits.upper);
    (0..robot.joints.len()).map(|i| range(i).0 + share(i) * (range(i).1 - range(i).0)).collect()
}

/// The angle plus whole turns that is nearest to a seed, inside the limits.
fn unwound(robot: &Manipulator, joint: usize, angle: f64, seed: f64) -> f64 {
    let limits = &robot.joints[joint].limits;
    let turned = angle + ((seed - angle) / TAU).round() * TAU;
    let inside = |angle: &f64| (limits.lower..=limits.upper).contains(angle);
    [turned, turned - TAU, turned + TAU].into_iter().find(inside).unwrap_or(angle)
}

/// Damped least squares (Levenberg-Marquardt) from a start; every step ends inside the limits.
fn climb(robot: &Manipulator, pose: Pose<f64>, start: Vec<f64>) -> Result<Vec<f64>, UnreachedPose> {
    let mut angles = start;
    (0..angles.len()).for_each(|i| angles[i] = limited(robot, i, angles[i]));
    let (mut error, mut jacobian) = error_and_jacobian(robot, pose, &angles);
    let mut damping = FIRST_DAMPING;
    for _ in 0..STEPS {
        if error.norm() < CONVERGED || damping > LARGEST_DAMPING {
            break;
        }
        // A joint at its limit that the step would move beyond it is held.
        let mut free = vec![true; angles.len()];
        let step = loop {
            let step = damped_step(&jacobian, &error, damping, &free);
            let beyond = |i: usize| {
                let limits = &robot.joints[i].limits;
                (angles[i] >= limits.upper && step[i] > 0.0) || (angles[i] <= limits.lower && step[i] < 0.0)
            };
            let held: Vec<usize> = (0..angles.len()).filter(|i| free[*i] && beyond(*i)).collect();
            if held.is_empty() {
                break step;
            }
            held.into_iter().for_each(|i| free[i] = false);
        };
        let moved: Vec<f64> = (0..angles.len()).map(|i| limited(robot, i, angles[i] + step[i])).collect();
        let (next_error, next_jacobian) = error_and_jacobian(robot, pose, &moved);
        if next_error.norm() < error.norm() {
            (angles, error, jacobian) = (moved, next_error, next_jacobian);
            damping *= 0.1;
        } else {
            damping = damping.max(1e-12) * 10.0;
        }
    }
    if error.norm() < CONVERGED {
        return Ok(angles);
    }
    let (distance, angle) = (error.fixed_rows::<3>(0).norm(), error.fixed_rows::<3>(3).norm());
    Err(UnreachedPose { distance, angle })
}

fn limited(robot: &Manipulator, joint: usize, angle: f64) -> f64 {
    let limits = &robot.joints[joint].limits;
    angle.max(limits.lower).min(limits.upper)
}

/// `J^T (J J^T + damping^2 I)^-1 error` over the free joints.
fn damped_step(jacobian: &DMatrix<f64>, error: &Vector6<f64>, damping: f64, free: &[bool]) -> DVector<f64> {
    let mut used = jacobian.clone();
    (0..free.len()).filter(|i| !free[*i]).for_each(|i| used.column_mut(i).fill(0.0));
    let mut square = &used * used.transpose();
    (0..6).for_each(|i| square[(i, i)] += damping * damping + 1e-24);
    let error = DVector::from_column_slice(error.as_slice());
    let weights = square.cholesky().map(|factor| factor.solve(&error));
    weights.map_or_else(|| DVector::zeros(free.len()), |weights| used.transpose() * weights)
}

/// Error of the flange \[m, rad\] and its derivative by the joint angles, base axes.
fn error_and_jacobian(robot: &Manipulator, pose: Pose<f64>, angles: &[f64]) -> (Vector6<f64>, DMatrix<f64>) {
    let frames: Vec<Pose<f64>> = with_joints!(robot.joints.len(), frames(robot, angles));
    let flange = frames[frames.len() - 1].compose(robot.flange);
    let position = vector(pose.position - flange.position);
    let rotation = rotation_vector(pose.attitude.compose(flange.attitude.conjugate()));
    let mut jacobian = DMatrix::zeros(6, angles.len());
    for (i, frame) in frames.iter().enumerate() {
        let axis = vector(joint_axis(*frame, robot.joints[i].sign));
        let lever = vector(flange.position - frame.position);
        jacobian.fixed_view_mut::<3, 1>(0, i).copy_from(&axis.cross(&lever));
        jacobian.fixed_view_mut::<3, 1>(3, i).copy_from(&axis);
    }
    let error = Vector6::new(position.x, position.y, position.z, rotation.x, rotation.y, rotation.z);
    (error, jacobian)
}

fn frames<const N: usize>(robot: &Manipulator, angles: &[f64]) -> Vec<Pose<f64>> {
    link_frames::<f64, N>(robot, std::array::from_fn(|i| angles[i])).to_vec()
}

/// The rotation vector of a turn, at most half a turn long.
fn rotation_vector(turn: Quat<f64>) -> Vector3<f64> {
    let (sine, cosine) = (vector(turn.v).norm(), turn.w.abs());
    let side = if turn.w < 0.0 { -1.0 } else { 1.0 };
    let per_sine = if sine < 1e-12 { 2.0 } else { 2.0 * sine.atan2(cosine) / sine };
    vector(turn.v) * (side * per_sine)
}

fn vector(v: Vec3<f64>) -> Vector3<f64> {
    Vector3::new(v.x, v.y, v.z)
}

#[cfg(test)]
mod tests;
