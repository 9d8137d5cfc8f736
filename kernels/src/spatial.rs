//! Spatial vectors about one point O: motions (angular, linear) and forces (moment, force).
//!
//! Featherstone, Rigid Body Dynamics Algorithms (2008), chapter 2.

use crate::real::Real;
use crate::vector::{Sym3, Vec3};

/// A spatial vector: motion (angular, linear) or force (moment, force) at O.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spatial<R> {
    pub(crate) angular: Vec3<R>,
    pub(crate) linear: Vec3<R>,
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
