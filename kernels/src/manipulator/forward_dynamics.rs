//! Forward dynamics of the joint chain on its fixed base: the articulated-body algorithm, with rotors behind gears.

use super::{Manipulator, joint_axis, link_frames};
use crate::aba::{Folded, PlacedLink, Spatial, drift_forces, fold};
use crate::real::Real;
use crate::space::Wrench;
use crate::vector::{Pose, Sym3, Vec3};

/// A point mass in base axes.
#[derive(Clone, Copy)]
pub(crate) struct PointMass<R> {
    /// Mass \[kg\].
    pub(crate) mass: R,
    /// Place \[m\].
    pub(crate) place: Vec3<R>,
}

impl<R: Real> PointMass<R> {
    /// Mass and place of a link that carries it; a mass of nothing changes no bit of either.
    #[inline(always)]
    fn on(self, mass: R, link: PlacedLink<R>) -> (R, PlacedLink<R>) {
        let both = mass + self.mass;
        let share = self.mass / both;
        let lever = self.place - link.com;
        let inertia = link.inertia + Sym3::point_mass(mass * share, lever);
        (both, PlacedLink { com: lever.scale_add(share, link.com), inertia })
    }
}

/// The chain under joint torques \[N m\] and a wrench on the last link, folded into what its base feels; base axes.
///
/// `armature` \[kg m^2\] is felt by the joint's own acceleration alone (a rotor behind its gear); `tip` acts about
/// the base's origin; `unknown` is carried by the last link besides its own mass.
#[inline(always)]
pub(crate) fn fold_chain<R: Real, const N: usize>(
    robot: &Manipulator,
    frames: &[Pose<R>; N],
    rate: [R; N],
    torque: &[R; N],
    armature: &[R; N],
    tip: Wrench<R>,
    unknown: Option<PointMass<R>>,
) -> Folded<R, N> {
    let mut masses = [R::lit(0.0); N];
    let mut links = [PlacedLink { com: Vec3::zero(), inertia: Sym3::splat(R::lit(0.0)) }; N];
    let mut axes = [Spatial::zero(); N];
    for i in 0..N {
        let link = &robot.joints[i].link;
        let at = frames[i].attitude.matrix();
        let axis = joint_axis(frames[i], robot.joints[i].sign);
        masses[i] = R::lit(link.mass);
        links[i].com = frames[i].position + at.times(Vec3::lit(link.com));
        links[i].inertia = Sym3::lit(link.inertia).rotated(at);
        axes[i] = Spatial { angular: axis, linear: frames[i].position.cross(axis) };
    }
    if let Some(mass) = unknown {
        (masses[N - 1], links[N - 1]) = mass.on(masses[N - 1], links[N - 1]);
    }
    // Gravity is felt as if the base accelerated upwards.
    let lifted = Spatial { angular: Vec3::zero(), linear: -Vec3::lit(robot.gravity) };
    let force = drift_forces(&masses, &links, &axes, rate, Spatial::zero(), lifted);
    let tip = Spatial { angular: tip.moment, linear: tip.force };
    fold(&masses, &links, axes, &force, torque, Some(armature), tip)
}

/// Joint accelerations \[rad/s^2\] from joint angles \[rad\], without rotors, on a resting base.
pub fn accelerations<const N: usize>(
    robot: &Manipulator,
    angle: [f64; N],
    rate: [f64; N],
    torque: &[f64; N],
) -> [f64; N] {
    fold_chain(robot, &link_frames(robot, angle), rate, torque, &[0.0; N], Wrench::zero(), None)
        .accelerations_on(Vec3::zero())
}
