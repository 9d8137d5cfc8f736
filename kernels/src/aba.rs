//! Articulated-body algorithm of a chain whose links are given in one set of axes about one point O.
//!
//! Spatial vectors are (angular, linear) at O; articulated inertias of neighbours add without transforms.
//! Featherstone, Rigid Body Dynamics Algorithms (2008), section 7.2.

use crate::real::Real;
use crate::vector::{Mat3, Sym3, Vec3, vec3};

/// A spatial vector: motion (angular, linear) or force (moment, force) at O.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spatial<R> {
    pub(crate) angular: Vec3<R>,
    pub(crate) linear: Vec3<R>,
}

/// A link where the configuration has put it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlacedLink<R> {
    /// Centre of mass from O.
    pub(crate) com: Vec3<R>,
    /// Inertia about the centre of mass.
    pub(crate) inertia: Sym3<R>,
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

/// A rigid body's inertia times a motion at O: its momentum for a twist, the inertial force for an acceleration.
#[inline(always)]
pub(crate) fn momentum<R: Real>(mass: R, com: Vec3<R>, inertia: Sym3<R>, v: Spatial<R>) -> Spatial<R> {
    let linear = (v.linear + v.angular.cross(com)) * mass;
    Spatial { angular: inertia.times(v.angular) + com.cross(linear), linear }
}

/// The force that moves a rigid body with a twist and an acceleration.
#[inline(always)]
pub(crate) fn inertial_force<R: Real>(
    mass: R,
    com: Vec3<R>,
    inertia: Sym3<R>,
    twist: Spatial<R>,
    acceleration: Spatial<R>,
) -> Spatial<R> {
    let turning = twist.cross_force(momentum(mass, com, inertia, twist));
    momentum(mass, com, inertia, acceleration).plus(turning)
}

impl<R: Real> Articulated<R> {
    #[inline(always)]
    fn zero() -> Self {
        let (zero, none) = (R::lit(0.0), Vec3::zero());
        Self {
            rotation: Sym3::splat(zero),
            coupling: Mat3 { x: none, y: none, z: none },
            translation: Sym3::splat(zero),
        }
    }

    /// With a rigid body of the given mass and central inertia at `com` fixed to it.
    #[inline(always)]
    fn plus_rigid(mut self, mass: R, com: Vec3<R>, inertia: Sym3<R>) -> Self {
        let h = com * mass;
        self.rotation = self.rotation + inertia + Sym3::point_mass(mass, com);
        // B v = h x v: columns of the cross product matrix.
        let Mat3 { x, y, z } = self.coupling;
        self.coupling = Mat3 {
            x: vec3(x.x, x.y + h.z, x.z - h.y),
            y: vec3(y.x - h.z, y.y, y.z + h.x),
            z: vec3(z.x + h.y, z.y - h.x, z.z),
        };
        let Sym3 { xx, yy, zz, .. } = self.translation;
        self.translation = Sym3 { xx: xx + mass, yy: yy + mass, zz: zz + mass, ..self.translation };
        self
    }

    #[inline(always)]
    fn times(&self, v: Spatial<R>) -> Spatial<R> {
        Spatial {
            angular: self.rotation.times(v.angular) + self.coupling.times(v.linear),
            linear: self.coupling.transposed_times(v.angular) + self.translation.times(v.linear),
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
}

/// A chain folded into what its base feels: the inward pass of the algorithm.
pub(crate) struct Folded<R, const N: usize> {
    axes: [Spatial<R>; N],
    resist: [Spatial<R>; N],
    inverse_d: [R; N],
    drive: [R; N],
    outboard: Articulated<R>,
    load: Spatial<R>,
}

/// Outwards: inertial forces of the links while no joint accelerates, from the base's twist and acceleration.
#[inline(always)]
pub(crate) fn drift_forces<R: Real, const N: usize>(
    masses: &[R; N],
    links: &[PlacedLink<R>; N],
    axes: &[Spatial<R>; N],
    rate: [R; N],
    base_twist: Spatial<R>,
    base_acceleration: Spatial<R>,
) -> [Spatial<R>; N] {
    let mut force = [Spatial::zero(); N];
    let (mut twist, mut drift) = (base_twist, base_acceleration);
    for i in 0..N {
        drift = twist.cross_motion(axes[i]).scale_add(rate[i], drift);
        twist = axes[i].scale_add(rate[i], twist);
        let link = &links[i];
        force[i] = inertial_force(masses[i], link.com, link.inertia, twist, drift);
    }
    force
}

/// Inwards: articulated inertia and force of everything outboard, carried from joint to joint.
///
/// `armature` is inertia that only the joint's own acceleration feels (a rotor behind its gear); `tip` the spatial
/// force on the last link.
#[inline(always)]
pub(crate) fn fold<R: Real, const N: usize>(
    masses: &[R; N],
    links: &[PlacedLink<R>; N],
    axes: [Spatial<R>; N],
    force: &[Spatial<R>; N],
    torque: &[R; N],
    armature: Option<&[R; N]>,
    tip: Spatial<R>,
) -> Folded<R, N> {
    let zero = R::lit(0.0);
    let mut chain = Folded {
        axes,
        resist: axes,
        inverse_d: [zero; N],
        drive: [zero; N],
        outboard: Articulated::zero(),
        load: Spatial { angular: -tip.angular, linear: -tip.linear },
    };
    for i in (0..N).rev() {
        let link = &links[i];
        chain.outboard = chain.outboard.plus_rigid(masses[i], link.com, link.inertia);
        chain.load = chain.load.plus(force[i]);
        chain.resist[i] = chain.outboard.times(axes[i]);
        let mut inertia = axes[i].dot(chain.resist[i]);
        if let Some(armature) = armature {
            inertia = inertia + armature[i];
        }
        chain.inverse_d[i] = R::lit(1.0) / inertia;
        chain.drive[i] = torque[i] - axes[i].dot(chain.load);
        chain.outboard = chain.outboard.released(chain.resist[i], chain.inverse_d[i]);
        chain.load = chain.resist[i].scale_add(chain.drive[i] * chain.inverse_d[i], chain.load);
    }
    chain
}

impl<R: Real, const N: usize> Folded<R, N> {
    /// Acceleration of a carriage under the chain that can move along a direction: its own mass and the force on it.
    #[inline(always)]
    pub(crate) fn slide(&self, along: Vec3<R>, mass: R, force: R) -> R {
        let felt = self.outboard.translation.times(along).dot(along) + mass;
        (force - self.load.linear.dot(along)) / felt
    }

    /// [`accelerations`](Self::accelerations) when the base does not turn.
    #[inline(always)]
    pub(crate) fn accelerations_on(&self, base: Vec3<R>) -> [R; N] {
        self.accelerations(Spatial { angular: Vec3::zero(), linear: base })
    }

    /// Outwards again: the joints' accelerations when the base accelerates so, beyond what `drift_forces` was given.
    #[inline(always)]
    pub(crate) fn accelerations(&self, base: Spatial<R>) -> [R; N] {
        let (mut joint, mut acceleration) = ([R::lit(0.0); N], base);
        for (i, joint) in joint.iter_mut().enumerate() {
            *joint = (self.drive[i] - self.resist[i].dot(acceleration)) * self.inverse_d[i];
            acceleration = self.axes[i].scale_add(*joint, acceleration);
        }
        joint
    }
}
