//! Articulated-body algorithm of the free-floating chain, all links in one set of axes about one point.
//!
//! Spatial vectors are (angular, linear) at the system's centre of mass O in inertial axes; articulated inertias
//! of neighbours add without transforms. Featherstone, Rigid Body Dynamics Algorithms (2008), sections 7.2 and 9.4.

use crate::plant::Plant;
use crate::real::Real;
use crate::space::{Actuation, Kinematics, Wrench};
use crate::vector::{Mat3, Sym3, Vec3, vec3};

/// A spatial vector: motion (angular, linear) or force (moment, force) at O.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spatial<R> {
    pub(crate) angular: Vec3<R>,
    pub(crate) linear: Vec3<R>,
}

/// Articulated inertia: moment = J w + B v, force = B^T w + M v.
#[derive(Clone, Copy, Debug)]
struct Articulated<R> {
    rotation: Sym3<R>,
    coupling: Mat3<R>,
    translation: Sym3<R>,
}

impl<R: Real> Spatial<R> {
    #[inline(always)]
    pub(crate) fn zero() -> Self {
        Self { angular: Vec3::zero(), linear: Vec3::zero() }
    }
    #[inline(always)]
    pub(crate) fn plus(self, o: Self) -> Self {
        Self { angular: self.angular + o.angular, linear: self.linear + o.linear }
    }
    #[inline(always)]
    pub(crate) fn scale_add(self, s: R, o: Self) -> Self {
        Self { angular: self.angular.scale_add(s, o.angular), linear: self.linear.scale_add(s, o.linear) }
    }
    #[inline(always)]
    pub(crate) fn dot(self, o: Self) -> R {
        self.angular.dot(o.angular) + self.linear.dot(o.linear)
    }
    /// Spatial cross product with a motion.
    #[inline(always)]
    pub(crate) fn cross_motion(self, o: Self) -> Self {
        Self {
            angular: self.angular.cross(o.angular),
            linear: self.angular.cross(o.linear) + self.linear.cross(o.angular),
        }
    }
    /// Spatial cross product with a force.
    #[inline(always)]
    pub(crate) fn cross_force(self, o: Self) -> Self {
        Self {
            angular: self.angular.cross(o.angular) + self.linear.cross(o.linear),
            linear: self.angular.cross(o.linear),
        }
    }
}

impl<R: Real> Articulated<R> {
    /// A rigid body of the given mass and central inertia at `com`.
    #[inline(always)]
    fn rigid(mass: R, com: Vec3<R>, inertia: Sym3<R>) -> Self {
        let h = com * mass;
        let o = R::lit(0.0);
        // B v = h x v: columns of the cross product matrix.
        let coupling = Mat3 { x: vec3(o, h.z, -h.y), y: vec3(-h.z, o, h.x), z: vec3(h.y, -h.x, o) };
        Self {
            rotation: inertia + Sym3::point_mass(mass, com),
            coupling,
            translation: Sym3::diagonal(Vec3::splat(mass)),
        }
    }

    #[inline(always)]
    fn times(&self, v: Spatial<R>) -> Spatial<R> {
        Spatial {
            angular: self.rotation.times(v.angular) + self.coupling.times(v.linear),
            linear: self.coupling.transposed_times(v.angular) + self.translation.times(v.linear),
        }
    }

    #[inline(always)]
    fn plus(&self, o: &Self) -> Self {
        Self {
            rotation: self.rotation + o.rotation,
            coupling: Mat3 {
                x: self.coupling.x + o.coupling.x,
                y: self.coupling.y + o.coupling.y,
                z: self.coupling.z + o.coupling.z,
            },
            translation: self.translation + o.translation,
        }
    }

    /// What is left of the inertia when the joint that resists with `u` gives way: minus u u^T / d.
    #[inline(always)]
    fn released(&self, u: Spatial<R>, inverse_d: R) -> Self {
        let s = Spatial { angular: u.angular * -inverse_d, linear: u.linear * -inverse_d };
        Self {
            rotation: self.rotation.plus_outer(s.angular, u.angular),
            coupling: Mat3 {
                x: s.angular.scale_add(u.linear.x, self.coupling.x),
                y: s.angular.scale_add(u.linear.y, self.coupling.y),
                z: s.angular.scale_add(u.linear.z, self.coupling.z),
            },
            translation: self.translation.plus_outer(s.linear, u.linear),
        }
    }

    /// The motion that a force causes.
    #[inline(always)]
    fn solve(&self, f: Spatial<R>) -> Spatial<R> {
        let inverse = self.translation.inverse();
        // Schur complement J - B M^-1 B^T; rows of B are columns of its transpose.
        let rows = self.coupling.transposed();
        let (a, b, c) = (inverse.times(rows.x), inverse.times(rows.y), inverse.times(rows.z));
        let schur = Sym3 {
            xx: self.rotation.xx - rows.x.dot(a),
            yy: self.rotation.yy - rows.y.dot(b),
            zz: self.rotation.zz - rows.z.dot(c),
            xy: self.rotation.xy - rows.x.dot(b),
            xz: self.rotation.xz - rows.x.dot(c),
            yz: self.rotation.yz - rows.y.dot(c),
        };
        let angular = schur.inverse().times(f.angular - self.coupling.times(inverse.times(f.linear)));
        let linear = inverse.times(f.linear - self.coupling.transposed_times(angular));
        Spatial { angular, linear }
    }
}

/// Joint accelerations under actuation and a wrench on part A at `point` (from O).
#[inline(always)]
pub(crate) fn joint_accelerations<R: Real, const N: usize>(
    m: &Plant,
    base_mass: R,
    rate: [R; N],
    k: &Kinematics<R, N>,
    u: &Actuation<R, N>,
    w: Wrench<R>,
    point: Vec3<R>,
) -> [R; N] {
    if N == 0 {
        return rate;
    }
    let zero = R::lit(0.0);
    let mut axes = [Spatial::zero(); N];
    for i in 0..N {
        axes[i] = joint_axis(k, i);
    }
    let mut twist = Spatial { angular: k.omega, linear: k.velocity };
    let mut base = Articulated::rigid(base_mass, k.base_com, k.base_inertia);
    let mut base_force = twist.cross_force(base.times(twist));
    base_force.angular = base_force.angular - k.base_com.cross(u.thrust) - u.torque;
    base_force.linear = base_force.linear - u.thrust;

    // Outwards: velocities, rigid inertias, bias forces and accelerations.
    let mut inertia = [base; N];
    let mut force = [base_force; N];
    let mut bias = [Spatial::zero(); N];
    for i in 0..N {
        bias[i] = twist.cross_motion(axes[i]).scale_add(rate[i], Spatial::zero());
        twist = axes[i].scale_add(rate[i], twist);
        inertia[i] = Articulated::rigid(R::lit(m.links[i].mass), k.links[i].com, k.links[i].inertia);
        force[i] = twist.cross_force(inertia[i].times(twist));
    }
    force[N - 1].angular = force[N - 1].angular - w.moment - point.cross(w.force);
    force[N - 1].linear = force[N - 1].linear - w.force;

    // Inwards: articulated inertias and forces.
    let mut resist = axes;
    let (mut inverse_d, mut drive) = ([zero; N], [zero; N]);
    for i in (0..N).rev() {
        resist[i] = inertia[i].times(axes[i]);
        inverse_d[i] = R::lit(1.0) / axes[i].dot(resist[i]);
        drive[i] = u.joint[i] - axes[i].dot(force[i]);
        let released = inertia[i].released(resist[i], inverse_d[i]);
        let passed = resist[i].scale_add(drive[i] * inverse_d[i], force[i].plus(released.times(bias[i])));
        if i > 0 {
            inertia[i - 1] = inertia[i - 1].plus(&released);
            force[i - 1] = force[i - 1].plus(passed);
        } else {
            base = base.plus(&released);
            base_force = base_force.plus(passed);
        }
    }

    // Outwards again: accelerations, starting from the free base.
    let push = Spatial { angular: -base_force.angular, linear: -base_force.linear };
    let mut acceleration = base.solve(push);
    let mut joint = [zero; N];
    for i in 0..N {
        acceleration = acceleration.plus(bias[i]);
        joint[i] = (drive[i] - resist[i].dot(acceleration)) * inverse_d[i];
        acceleration = axes[i].scale_add(joint[i], acceleration);
    }
    joint
}

/// Spatial axis of joint `i` at O.
#[inline(always)]
pub(crate) fn joint_axis<R: Real, const N: usize>(k: &Kinematics<R, N>, i: usize) -> Spatial<R> {
    let link = &k.links[i];
    Spatial { angular: link.axis, linear: link.origin.cross(link.axis) }
}
