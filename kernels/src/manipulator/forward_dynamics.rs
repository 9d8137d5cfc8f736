//! Forward dynamics of the joint chain on its fixed base: the articulated-body algorithm, with rotors behind gears.

use super::{Manipulator, joint_axis, link_frames};
use crate::aba::{PlacedLink, Spatial, drift_forces, fold};
use crate::real::Real;
use crate::space::Wrench;
use crate::vector::{Pose, Sym3, Vec3};

/// Joint accelerations \[rad/s^2\] under joint torques \[N m\] and a wrench on the last link, in base axes.
///
/// `armature` \[kg m^2\] is felt by the joint's own acceleration alone (a rotor behind its gear); `tip` acts about
/// the base's origin; the base itself accelerates by `base` \[m/s^2\] (a rail), gravity not counted.
#[inline(always)]
pub fn forward_dynamics<R: Real, const N: usize>(
    robot: &Manipulator,
    frames: &[Pose<R>; N],
    rate: [R; N],
    torque: &[R; N],
    armature: &[R; N],
    tip: Wrench<R>,
    base: Vec3<R>,
) -> [R; N] {
    let mut masses = [0.0; N];
    let mut links = [PlacedLink { com: Vec3::zero(), inertia: Sym3::splat(R::lit(0.0)) }; N];
    let mut axes = [Spatial::zero(); N];
    for i in 0..N {
        let link = &robot.joints[i].link;
        let at = frames[i].attitude.matrix();
        let axis = joint_axis(frames[i], robot.joints[i].sign);
        masses[i] = link.mass;
        links[i].com = frames[i].position + at.times(Vec3::lit(link.com));
        links[i].inertia = Sym3::lit(link.inertia).rotated(at);
        axes[i] = Spatial { angular: axis, linear: frames[i].position.cross(axis) };
    }
    // Gravity is felt as if the base accelerated upwards.
    let lifted = Spatial { angular: Vec3::zero(), linear: base - Vec3::lit(robot.gravity) };
    let force = drift_forces(&masses, &links, &axes, rate, Spatial::zero(), lifted);
    let tip = Spatial { angular: tip.moment, linear: tip.force };
    fold(&masses, &links, axes, &force, torque, Some(armature), tip).accelerations(Spatial::zero())
}

/// [`forward_dynamics`] from joint angles \[rad\], without rotors, on a resting base.
pub fn accelerations<const N: usize>(
    robot: &Manipulator,
    angle: [f64; N],
    rate: [f64; N],
    torque: &[f64; N],
) -> [f64; N] {
    let tip = Wrench { force: Vec3::zero(), moment: Vec3::zero() };
    forward_dynamics(robot, &link_frames(robot, angle), rate, torque, &[0.0; N], tip, Vec3::zero())
}
