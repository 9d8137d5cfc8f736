//! Where a robot's joints hold its part, and which joint angles and rates hold it where it shall be.

use super::{Cell, JOINTS};
use crate::chain::driven::Frames;
use crate::manipulator::inverse_kinematics::Posture;
use crate::math::sin_cos;
use crate::real::Real;
use crate::space::Motion;
use crate::vector::{Pose, Quat, Vec3};
use std::f64::consts::TAU;

/// The part's pose in the laboratory, from joint angles: its place changes by the screws, last joint first.
#[inline(always)]
pub(super) fn tool_pose<R: Real>(cell: &Cell, angle: [R; JOINTS]) -> Pose<R> {
    let (mut shift, mut turn) = (Vec3::zero(), Quat::identity());
    for i in (0..JOINTS).rev() {
        let (axis, lever) = (Vec3::lit(cell.screws[i].0), Vec3::lit(cell.screws[i].1));
        let (s, c) = sin_cos(angle[i] * R::lit(0.5));
        // (rotation - 1) r = 2 s (c a x r + s a x (a x r)) with the half angle: small for a small angle.
        let r: Vec3<R> = lever + shift;
        let across = axis.cross(r);
        shift = (across * c + axis.cross(across) * s).scale_add(s + s, shift);
        turn = Quat { w: c, v: axis * s }.compose(turn);
    }
    Pose { position: Vec3::lit(cell.home.position) + shift, attitude: turn.compose(Quat::lit(cell.home.attitude)) }
}

/// What the part's twist and the joints' rates have to do with each other at a posture; the chain's axes at its base.
pub(super) struct Reach<R> {
    origin: [Vec3<R>; JOINTS],
    axes: [Vec3<R>; JOINTS],
    part: Vec3<R>,
}

impl<R: Real> Reach<R> {
    #[inline(always)]
    pub(super) fn at(cell: &Cell, angle: [R; JOINTS]) -> Self {
        let turns = cell.arm.turns(angle);
        let Frames { origin, joint: axes, last } = cell.arm.posture(&turns).frames();
        let part = origin[JOINTS - 1] + last.times(Vec3::lit(cell.arm.chain.tool.position));
        Self { origin, axes, part }
    }

    /// Velocity of the part's origin and angular velocity.
    #[inline(always)]
    pub(super) fn twist(&self, rate: [R; JOINTS]) -> (Vec3<R>, Vec3<R>) {
        let (mut velocity, mut omega) = (Vec3::zero(), Vec3::zero());
        for (i, rate) in rate.into_iter().enumerate() {
            velocity = self.axes[i].cross(self.part - self.origin[i]).scale_add(rate, velocity);
            omega = self.axes[i].scale_add(rate, omega);
        }
        (velocity, omega)
    }
}

/// The posture that puts the part at a pose, to the scalar's rounding of metres, and the part's place in base axes; the
/// posture's `singular` is 1 beyond the robot's reach too. Ranges are not checked.
#[inline(always)]
pub(super) fn closed_form<R: Real>(cell: &Cell, reference: &Motion<R>) -> (Posture<R>, Vec3<R>) {
    let (zero, one) = (R::lit(0.0), R::lit(1.0));
    let pose = Pose { position: reference.position, attitude: reference.attitude };
    let part = Pose::lit(cell.base_inverse).compose(pose);
    let mut found = cell.wrist.inverse(cell.branch, part.compose(Pose::lit(cell.tool_inverse)));
    let away = part.position.x.mul_add(part.position.x, part.position.y * part.position.y);
    let reach = cell.robot.workspace.reach;
    found.singular = found.singular.max(R::select(R::lit(reach * reach).lt(away), one, zero));
    (found, part.position)
}

/// Rates of the joints at the posture for velocities of the part, laboratory axes.
#[inline(always)]
pub(super) fn rates<R: Real>(
    cell: &Cell,
    (at, part): &(Posture<R>, Vec3<R>),
    velocity: Vec3<R>,
    omega: Vec3<R>,
) -> [R; JOINTS] {
    let to_base = Quat::lit(cell.base_inverse.attitude);
    cell.wrist.rates(at, *part, to_base.rotate(velocity), to_base.rotate(omega))
}

/// Angles of a posture from the start posture \[rad\], each within half a turn.
#[inline(always)]
pub(super) fn angles<R: Real>(cell: &Cell, at: &Posture<R>) -> [R; JOINTS] {
    let mut angle = cell.wrist.angles(at);
    for (i, angle) in angle.iter_mut().enumerate() {
        let away = *angle - R::lit(cell.start[i]);
        let turns = away.mul_add(R::lit(1.0 / TAU), R::lit(0.5)).floor();
        *angle = turns.mul_add(R::lit(-TAU), away);
    }
    angle
}

/// Joint angles that put the part at a pose whose closed form is known, to the rounding of millimetres: one Newton step
/// on the small differences from it.
#[inline(always)]
pub(super) fn refined<R: Real>(cell: &Cell, reference: &Motion<R>, found: &(Posture<R>, Vec3<R>)) -> [R; JOINTS] {
    let angle = angles(cell, &found.0);
    let at = tool_pose(cell, angle);
    let turn = reference.attitude.compose(at.attitude.conjugate()).small_rotation_vector();
    let step = rates(cell, found, reference.position - at.position, turn);
    let mut wanted = angle;
    for i in 0..JOINTS {
        wanted[i] = angle[i] + step[i];
    }
    wanted
}

/// Joint angles cut to the ranges of the robot's model; `limited` becomes 1 where one was beyond.
#[inline(always)]
pub(super) fn within_ranges<R: Real>(cell: &Cell, wanted: [R; JOINTS], limited: R) -> ([R; JOINTS], R) {
    let (zero, one) = (R::lit(0.0), R::lit(1.0));
    let (mut angle, mut limited) = (wanted, limited);
    for i in 0..JOINTS {
        let limits = &cell.robot.joints[i].limits;
        let wanted = wanted[i];
        angle[i] = wanted.min(R::lit(limits.upper - cell.start[i])).max(R::lit(limits.lower - cell.start[i]));
        let beyond = angle[i].lt(wanted) | wanted.lt(angle[i]);
        limited = limited.max(R::select(beyond, one, zero));
    }
    (angle, limited)
}
