//! Inverse dynamics of the joint chain: recursive Newton-Euler, all links in base axes about the base's origin.
//!
//! Featherstone, Rigid Body Dynamics Algorithms (2008), section 5.3; gravity enters as an acceleration of the base.

use super::{Counterweight, Levels, Manipulator, joint_axis, link_frames};
use crate::math::sin_cos;
use crate::real::Real;
use crate::spatial::{Spatial, inertial_force};
use crate::vector::{Sym3, Vec3};

/// Torques of the rigid links alone \[N m\] for angles \[rad\], rates \[rad/s\] and accelerations \[rad/s^2\].
#[inline(always)]
pub fn rigid_torques<R: Real, const N: usize>(
    robot: &Manipulator,
    angle: [R; N],
    rate: [R; N],
    acceleration: [R; N],
) -> [R; N] {
    chain_torques(robot, angle, rate, acceleration, Vec3::zero()).0
}

/// [`rigid_torques`] on a base that accelerates \[m/s^2\], and the force that the base puts on the chain \[N\]; base axes.
#[inline(always)]
pub(crate) fn chain_torques<R: Real, const N: usize>(
    robot: &Manipulator,
    angle: [R; N],
    rate: [R; N],
    acceleration: [R; N],
    base: Vec3<R>,
) -> ([R; N], Vec3<R>) {
    let frames = link_frames(robot, angle);
    let (mut axes, mut forces) = ([Spatial::zero(); N], [Spatial::zero(); N]);
    let mut twist = Spatial::zero();
    let mut gain = Spatial { angular: Vec3::zero(), linear: base - Vec3::lit(robot.gravity) };
    for i in 0..N {
        let joint = &robot.joints[i];
        let axis = joint_axis(frames[i], joint.sign);
        axes[i] = Spatial { angular: axis, linear: frames[i].position.cross(axis) };
        gain = axes[i].scale_add(acceleration[i], twist.cross_motion(axes[i]).scale_add(rate[i], gain));
        twist = axes[i].scale_add(rate[i], twist);
        let com = frames[i].position + frames[i].attitude.rotate(Vec3::lit(joint.link.com));
        let inertia = Sym3::lit(joint.link.inertia).rotated(frames[i].attitude.matrix());
        forces[i] = inertial_force(R::lit(joint.link.mass), com, inertia, twist, gain);
    }
    let mut torques = [R::lit(0.0); N];
    let mut load = Spatial::zero();
    for i in (0..N).rev() {
        load = load.plus(forces[i]);
        torques[i] = axes[i].dot(load);
    }
    (torques, load.linear)
}

/// Torque of a counterbalance on its joint \[N m\].
#[inline(always)]
pub fn counterweight_torque<R: Real>(counterweight: &Counterweight, angle: R) -> R {
    sin_cos(angle - R::lit(counterweight.angle)).0 * R::lit(-counterweight.torque)
}

/// Torques of the drives at the joints' side \[N m\]: rigid links, rotors, friction, counterbalances, offsets.
///
/// `slip` holds the presliding states of [`bristle`](super::bristle), in [-1, 1]. The load of the load-dependent friction is the torque
/// that the gear transmits: that of the links and of the counterbalance, without the rotor in front of the gear.
#[inline(always)]
pub fn inverse_dynamics<R: Real, const N: usize>(
    robot: &Manipulator,
    angle: [R; N],
    rate: [R; N],
    acceleration: [R; N],
    slip: [R; N],
) -> [R; N] {
    let rigid = rigid_torques(robot, angle, rate, acceleration);
    std::array::from_fn(|i| {
        let joint = &robot.joints[i];
        let helped = joint.counterweight.map_or(R::lit(0.0), |c| counterweight_torque(&c, angle[i]));
        let load = rigid[i] - helped;
        let rotor = acceleration[i] * R::lit(joint.drive.reflected_inertia());
        load + rotor + Levels::of(&joint.friction).torque(slip[i], rate[i], load) + R::lit(joint.drive.torque_offset)
    })
}
