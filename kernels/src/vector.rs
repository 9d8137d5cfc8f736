//! Small linear algebra over any scalar: vectors, symmetric matrices, quaternions, poses.
//!
//! Products are written with `mul_add`, in one fixed order, so that every backend with a fused
//! multiply-add gives the same bits.

use crate::real::Real;
use std::ops::{Add, Mul, Neg, Sub};

mod matrix;
mod rotation;

pub use matrix::{Mat3, Sym3};
pub use rotation::{Pose, Quat};

/// A vector of three components.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vec3<R> {
    /// First component.
    pub x: R,
    /// Second component.
    pub y: R,
    /// Third component.
    pub z: R,
}

/// A vector from its components.
#[inline(always)]
pub const fn vec3<R>(x: R, y: R, z: R) -> Vec3<R> {
    Vec3 { x, y, z }
}

impl<R: Copy> Vec3<R> {
    /// All components equal.
    #[inline(always)]
    pub fn splat(value: R) -> Self {
        vec3(value, value, value)
    }

    /// Applies `f` to each component.
    #[inline(always)]
    pub fn map<S>(self, mut f: impl FnMut(R) -> S) -> Vec3<S> {
        vec3(f(self.x), f(self.y), f(self.z))
    }

    /// Applies `f` to each pair of components.
    #[inline(always)]
    pub fn zip<S: Copy, T>(self, other: Vec3<S>, mut f: impl FnMut(R, S) -> T) -> Vec3<T> {
        vec3(f(self.x, other.x), f(self.y, other.y), f(self.z, other.z))
    }
}

impl<R: Real> Vec3<R> {
    /// The zero vector.
    #[inline(always)]
    pub fn zero() -> Self {
        Self::splat(R::lit(0.0))
    }

    /// A constant of the model as a vector of this scalar.
    #[inline(always)]
    pub fn lit(value: Vec3<f64>) -> Self {
        value.map(R::lit)
    }

    /// Scalar product.
    #[inline(always)]
    pub fn dot(self, o: Self) -> R {
        self.z.mul_add(o.z, self.y.mul_add(o.y, self.x * o.x))
    }

    /// Vector product.
    #[inline(always)]
    pub fn cross(self, o: Self) -> Self {
        vec3(
            self.y.mul_add(o.z, -(self.z * o.y)),
            self.z.mul_add(o.x, -(self.x * o.z)),
            self.x.mul_add(o.y, -(self.y * o.x)),
        )
    }

    /// `self * s + o`, fused.
    #[inline(always)]
    pub fn scale_add(self, s: R, o: Self) -> Self {
        self.zip(o, |a, b| a.mul_add(s, b))
    }

    /// The same vector with y called x, z called y, and x called z.
    #[inline(always)]
    pub(crate) fn cycled(self) -> Self {
        vec3(self.y, self.z, self.x)
    }

    /// Euclidean length.
    #[inline(always)]
    pub fn norm(self) -> R {
        self.dot(self).sqrt()
    }

    /// Componentwise choice.
    #[inline(always)]
    pub fn select(mask: R::Mask, then: Self, other: Self) -> Self {
        then.zip(other, |a, b| R::select(mask, a, b))
    }

    /// Componentwise clamp to [-limit, limit].
    #[inline(always)]
    pub fn clamp(self, limit: R) -> Self {
        let low = -limit;
        vec3(self.x.min(limit).max(low), self.y.min(limit).max(low), self.z.min(limit).max(low))
    }
}

impl Vec3<f64> {
    /// Vector product of a constant of the model, whose zeros cost nothing, and a vector, added to another one.
    #[inline(always)]
    pub(crate) fn cross_onto<R: Real>(self, v: Vec3<R>, onto: Vec3<R>) -> Vec3<R> {
        let (Vec3 { x, y, z }, mut sum) = (Vec3::<R>::lit(self), onto);
        if self.x != 0.0 {
            sum = vec3(sum.x, v.z.mul_add(-x, sum.y), v.y.mul_add(x, sum.z));
        }
        if self.y != 0.0 {
            sum = vec3(v.z.mul_add(y, sum.x), sum.y, v.x.mul_add(-y, sum.z));
        }
        if self.z != 0.0 {
            sum = vec3(v.y.mul_add(-z, sum.x), v.x.mul_add(z, sum.y), sum.z);
        }
        sum
    }
}

impl<R: Real> Add for Vec3<R> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        self.zip(o, |a, b| a + b)
    }
}

impl<R: Real> Sub for Vec3<R> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        self.zip(o, |a, b| a - b)
    }
}

impl<R: Real> Neg for Vec3<R> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|a| -a)
    }
}

impl<R: Real> Mul<R> for Vec3<R> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, s: R) -> Self {
        self.map(|a| a * s)
    }
}
