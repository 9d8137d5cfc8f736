//! Inverse kinematics in closed form: an arm of two links in a vertical plane that turns, with a spherical wrist.
//!
//! Modified (Craig) Denavit-Hartenberg table with `alpha = 0, -90, 0, -90, 90, -90 deg` and the lengths below; the
//! wrist's centre fixes the first three joints, the rest of the attitude the last three (Pieper 1968).

use super::Manipulator;
use crate::math::{acos, atan2, sin_cos};
use crate::real::Real;
use crate::vector::{Mat3, Pose, Quat, Vec3, vec3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Below this sine of the wrist's bend, or of the elbow's, or this distance of the wrist from axis 1 \[m\], a posture
/// counts as singular: one degree, and a tenth of a forearm.
const SINGULAR_SINE: f64 = 0.0175;
const SINGULAR_DISTANCE: f64 = 0.1;

/// The lengths of the arm and the way its joints count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphericalWrist {
    /// Height of joint 2 above the base \[m\].
    height: f64,
    /// Distance of joint 2 from axis 1 \[m\].
    shoulder: f64,
    /// Length of the upper arm \[m\].
    upper: f64,
    /// Offset of axis 4 from joint 3 \[m\].
    elbow: f64,
    /// Distance of the wrist's centre from joint 3, along axis 4 \[m\].
    forearm: f64,
    /// Distance of frame 6 from the wrist's centre \[m\].
    hand: f64,
    /// Angle of each frame at joint angle 0 \[rad\].
    offset: [f64; 6],
    /// +1 or -1.
    sign: [f64; 6],
}

/// One of the eight postures that reach a pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Branch {
    /// The arm reaches over its own back.
    pub back: bool,
    /// The elbow hangs below the line from shoulder to wrist.
    pub elbow_down: bool,
    /// The wrist is turned over: joint 5 has the other sign.
    pub flipped: bool,
}

impl Branch {
    /// All eight.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..8).map(|bits| Self { back: bits & 1 != 0, elbow_down: bits & 2 != 0, flipped: bits & 4 != 0 })
    }
}

/// A posture, and how near it is to the edge of what the closed form can do.
#[derive(Clone, Copy, Debug)]
pub struct Posture<R> {
    /// Joint angles \[rad\].
    pub angle: [R; 6],
    /// 1 where the pose is out of reach or singular (the angles are then those of the nearest arm that is stretched).
    pub singular: R,
}

impl SphericalWrist {
    /// Reads the lengths from a robot's joints; none if it is built otherwise.
    pub fn of(robot: &Manipulator) -> Option<Self> {
        if robot.joints.len() != 6 {
            return None;
        }
        let tilts = [0.0, -FRAC_PI_2, 0.0, -FRAC_PI_2, FRAC_PI_2, -FRAC_PI_2];
        let (mut offset, mut place) = ([0.0; 6], [(0.0, 0.0); 6]);
        for (i, joint) in robot.joints.iter().enumerate() {
            // Rx(alpha) Rz(offset) with the alpha of the table: undo the tilt, a turn about z must be left.
            let (s, c) = (0.5 * tilts[i]).sin_cos();
            let tilt = Quat { w: c, v: vec3(s, 0.0, 0.0) };
            let rest = tilt.conjugate().compose(joint.link.origin.attitude);
            let at = tilt.rotate_back(joint.link.origin.position);
            if rest.v.x.hypot(rest.v.y) > 1e-9 || at.y.abs() > 1e-9 {
                return None;
            }
            offset[i] = 2.0 * rest.v.z.atan2(rest.w);
            place[i] = (at.x, at.z);
        }
        let absent = [place[0].0, place[1].1, place[2].1, place[4].0, place[4].1, place[5].0];
        let sign = std::array::from_fn(|i| robot.joints[i].sign);
        absent.iter().all(|length| length.abs() < 1e-9).then_some(Self {
            height: place[0].1,
            shoulder: place[1].0,
            upper: place[2].0,
            elbow: place[3].0,
            forearm: place[3].1,
            hand: place[5].1,
            offset,
            sign,
        })
    }

    /// The posture of a branch that puts frame 6 (origin and axes, base axes) at a pose.
    #[inline(always)]
    pub fn inverse<R: Real>(&self, branch: Branch, frame6: Pose<R>) -> Posture<R> {
        let axes = frame6.attitude.matrix();
        let wrist = axes.z.scale_add(R::lit(-self.hand), frame6.position);
        let (turned, [theta1, theta2, theta3]) = self.reach(branch, wrist);
        // Frame 3, then the wrist's turn Rz(theta4) Ry(-theta5) Rz(theta6).
        let third = plane_axes(theta1, theta2 + theta3);
        let (x, z) = (third.transposed_times(axes.x), third.transposed_times(axes.z));
        let (y, sign) = (third.transposed_times(axes.y), if branch.flipped { -1.0 } else { 1.0 });
        // In axes turned by Rx(-90): (x, y, z) there is (x, -z, y) here.
        let bend = z.x.mul_add(z.x, z.z * z.z).sqrt();
        let theta4 = atan2(z.z * R::lit(-sign), z.x * R::lit(sign));
        let theta5 = -atan2(bend * R::lit(sign), z.y);
        let theta6 = atan2(y.y * R::lit(sign), x.y * R::lit(-sign));
        let theta = [theta1, theta2, theta3, theta4, theta5, theta6];
        let mut angle = theta;
        for i in 0..6 {
            angle[i] = (theta[i] - R::lit(self.offset[i])) * R::lit(self.sign[i]);
        }
        let (zero, one) = (R::lit(0.0), R::lit(1.0));
        let singular = R::select(bend.lt(R::lit(SINGULAR_SINE)), one, zero);
        Posture { angle, singular: singular.max(turned) }
    }

    /// Angles of the first three frames for a wrist's centre, and 1 where the arm cannot or can hardly reach it.
    #[inline(always)]
    fn reach<R: Real>(&self, branch: Branch, wrist: Vec3<R>) -> (R, [R; 3]) {
        let (zero, one) = (R::lit(0.0), R::lit(1.0));
        let out = wrist.x.mul_add(wrist.x, wrist.y * wrist.y).sqrt();
        let side = R::lit(if branch.back { -1.0 } else { 1.0 });
        let theta1 = atan2(wrist.y * side, wrist.x * side);
        // The vertical plane: x outwards from joint 2, y downwards.
        let (x, y) = (out * side - R::lit(self.shoulder), R::lit(self.height) - wrist.z);
        let lower = self.elbow.hypot(self.forearm);
        let square = x.mul_add(x, y * y);
        let cosine = (square - R::lit(self.upper * self.upper + lower * lower)) * R::lit(0.5 / (self.upper * lower));
        let bent = acos(cosine) * R::lit(if branch.elbow_down { -1.0 } else { 1.0 });
        let (sine, cosine_bent) = sin_cos(bent);
        let theta2 = atan2(y, x) - atan2(sine * R::lit(lower), cosine_bent.mul_add(R::lit(lower), R::lit(self.upper)));
        let theta3 = bent - R::lit(self.forearm.atan2(self.elbow));
        let stretched = sine.abs().lt(R::lit(SINGULAR_SINE));
        let overhead = out.lt(R::lit(SINGULAR_DISTANCE));
        (R::select(stretched | overhead, one, zero), [theta1, theta2, theta3])
    }
}

/// Axes of a frame in the turning plane: Rz(theta1) Rx(-90) Rz(theta).
#[inline(always)]
fn plane_axes<R: Real>(theta1: R, theta: R) -> Mat3<R> {
    let ((s1, c1), (s, c)) = (sin_cos(theta1), sin_cos(theta));
    Mat3 { x: vec3(c * c1, c * s1, -s), y: vec3(-(s * c1), -(s * s1), -c), z: vec3(-s1, c1, R::lit(0.0)) }
}

/// The angle within half a turn of `near` \[rad\].
pub fn nearest_turn(angle: f64, near: f64) -> f64 {
    angle - TAU * ((angle - near) / TAU).round()
}

/// The branch whose posture lies farthest inside the joints' ranges, with its angles; none if no posture is inside.
///
/// `frame6` in base axes; a joint that can turn more than once takes the turn nearest to the middle of its range.
pub fn best_posture(robot: &Manipulator, wrist: &SphericalWrist, frame6: Pose<f64>) -> Option<(Branch, [f64; 6])> {
    let mut best: Option<(f64, Branch, [f64; 6])> = None;
    for branch in Branch::all() {
        let posture = wrist.inverse(branch, frame6);
        if posture.singular > 0.0 {
            continue;
        }
        let (mut angle, mut room) = (posture.angle, f64::INFINITY);
        for (angle, joint) in angle.iter_mut().zip(&robot.joints) {
            let (lower, upper) = (joint.limits.lower, joint.limits.upper);
            *angle = nearest_turn(*angle, 0.5 * (lower + upper));
            // Room as a share of half a turn at most, so that a wide range does not decide alone.
            room = room.min(((*angle - lower).min(upper - *angle) / PI).min(1.0));
        }
        if room >= 0.0 && best.is_none_or(|(most, ..)| room > most) {
            best = Some((room, branch, angle));
        }
    }
    best.map(|(_, branch, angle)| (branch, angle))
}
