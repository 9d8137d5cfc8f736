//! Forward kinematics of the joint chain in base axes.

use super::Manipulator;
use crate::math::sin_cos;
use crate::real::Real;
use crate::vector::{Pose, Quat, Vec3, vec3};

/// Poses of the link frames in base axes, from joint angles \[rad\]; shape: one per joint.
#[inline(always)]
pub fn link_frames<R: Real, const N: usize>(robot: &Manipulator, angle: [R; N]) -> [Pose<R>; N] {
    let (mut at, mut frames) = (Pose::identity(), [Pose::identity(); N]);
    for i in 0..N {
        let joint = &robot.joints[i];
        let (sin, cos) = sin_cos(angle[i] * R::lit(0.5 * joint.sign));
        let zero = R::lit(0.0);
        let turn = Quat { w: cos, v: vec3(zero, zero, sin) };
        at = at.compose(Pose::lit(joint.link.origin)).compose(Pose { position: Vec3::zero(), attitude: turn });
        frames[i] = at;
    }
    frames
}

/// Pose of the flange in base axes.
#[inline(always)]
pub fn flange<R: Real, const N: usize>(robot: &Manipulator, angle: [R; N]) -> Pose<R> {
    let frames = link_frames(robot, angle);
    let last = frames.last().copied().unwrap_or_else(Pose::identity);
    last.compose(Pose::lit(robot.flange))
}

/// Unit vector about which a positive joint rate turns the link, base axes.
#[inline(always)]
pub fn joint_axis<R: Real>(frame: Pose<R>, sign: f64) -> Vec3<R> {
    let zero = R::lit(0.0);
    frame.attitude.rotate(vec3(zero, zero, R::lit(sign)))
}
