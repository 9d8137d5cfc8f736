//! Symmetric matrices and matrices by columns.

use super::{Vec3, vec3};
use crate::real::Real;
use std::ops::Add;

/// A symmetric 3 x 3 matrix (an inertia).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sym3<R> {
    /// Diagonal xx.
    pub xx: R,
    /// Diagonal yy.
    pub yy: R,
    /// Diagonal zz.
    pub zz: R,
    /// Off-diagonal xy (the matrix element, not the product of inertia with its sign changed).
    pub xy: R,
    /// Off-diagonal xz.
    pub xz: R,
    /// Off-diagonal yz.
    pub yz: R,
}

/// A 3 x 3 matrix by columns; as a rotation, column i is the image of axis i.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mat3<R> {
    /// First column.
    pub x: Vec3<R>,
    /// Second column.
    pub y: Vec3<R>,
    /// Third column.
    pub z: Vec3<R>,
}

impl<R: Copy> Sym3<R> {
    /// All six elements equal.
    #[inline(always)]
    pub fn splat(value: R) -> Self {
        Self { xx: value, yy: value, zz: value, xy: value, xz: value, yz: value }
    }

    /// Applies `f` to each element.
    #[inline(always)]
    pub fn map<S>(self, mut f: impl FnMut(R) -> S) -> Sym3<S> {
        Sym3 { xx: f(self.xx), yy: f(self.yy), zz: f(self.zz), xy: f(self.xy), xz: f(self.xz), yz: f(self.yz) }
    }

    /// Applies `f` to each pair of elements.
    #[inline(always)]
    pub fn zip(self, o: Self, mut f: impl FnMut(R, R) -> R) -> Self {
        Self {
            xx: f(self.xx, o.xx),
            yy: f(self.yy, o.yy),
            zz: f(self.zz, o.zz),
            xy: f(self.xy, o.xy),
            xz: f(self.xz, o.xz),
            yz: f(self.yz, o.yz),
        }
    }
}

impl<R: Real> Sym3<R> {
    /// A constant of the model as a matrix of this scalar.
    #[inline(always)]
    pub fn lit(m: Sym3<f64>) -> Self {
        m.map(R::lit)
    }

    /// A diagonal matrix.
    #[inline(always)]
    pub fn diagonal(d: Vec3<R>) -> Self {
        let o = R::lit(0.0);
        Self { xx: d.x, yy: d.y, zz: d.z, xy: o, xz: o, yz: o }
    }

    /// Matrix times vector.
    #[inline(always)]
    pub fn times(self, v: Vec3<R>) -> Vec3<R> {
        vec3(
            vec3(self.xx, self.xy, self.xz).dot(v),
            vec3(self.xy, self.yy, self.yz).dot(v),
            vec3(self.xz, self.yz, self.zz).dot(v),
        )
    }

    /// The same tensor with y called x, z called y, and x called z.
    #[inline(always)]
    pub(crate) fn cycled(self) -> Self {
        Self { xx: self.yy, yy: self.zz, zz: self.xx, xy: self.yz, xz: self.xy, yz: self.xz }
    }

    /// `R I R^T`: the same tensor in the axes that `rotation` leads to.
    #[inline(always)]
    pub fn rotated(self, rotation: Mat3<R>) -> Self {
        // Rows of the rotation are what the result's elements are made of.
        let rows = rotation.transposed();
        let (a, b, c) = (self.times(rows.x), self.times(rows.y), self.times(rows.z));
        Self {
            xx: rows.x.dot(a),
            yy: rows.y.dot(b),
            zz: rows.z.dot(c),
            xy: rows.x.dot(b),
            xz: rows.x.dot(c),
            yz: rows.y.dot(c),
        }
    }

    /// `self + a b^T` for vectors whose outer product is symmetric.
    #[inline(always)]
    pub fn plus_outer(self, a: Vec3<R>, b: Vec3<R>) -> Self {
        Self {
            xx: a.x.mul_add(b.x, self.xx),
            yy: a.y.mul_add(b.y, self.yy),
            zz: a.z.mul_add(b.z, self.zz),
            xy: a.x.mul_add(b.y, self.xy),
            xz: a.x.mul_add(b.z, self.xz),
            yz: a.y.mul_add(b.z, self.yz),
        }
    }

    /// Inertia of a point mass at `r`: `m (|r|^2 1 - r r^T)`.
    #[inline(always)]
    pub fn point_mass(mass: R, r: Vec3<R>) -> Self {
        let m = r * mass;
        let (xx, yy, zz) = (r.x * m.x, r.y * m.y, r.z * m.z);
        Self { xx: yy + zz, yy: xx + zz, zz: xx + yy, xy: -(r.x * m.y), xz: -(r.x * m.z), yz: -(r.y * m.z) }
    }

    /// The inverse of a positive definite matrix, by cofactors.
    #[inline(always)]
    pub fn inverse(self) -> Self {
        let c = Self {
            xx: self.yy.mul_add(self.zz, -(self.yz * self.yz)),
            yy: self.xx.mul_add(self.zz, -(self.xz * self.xz)),
            zz: self.xx.mul_add(self.yy, -(self.xy * self.xy)),
            xy: self.xz.mul_add(self.yz, -(self.xy * self.zz)),
            xz: self.xy.mul_add(self.yz, -(self.xz * self.yy)),
            yz: self.xy.mul_add(self.xz, -(self.xx * self.yz)),
        };
        let det = vec3(self.xx, self.xy, self.xz).dot(vec3(c.xx, c.xy, c.xz));
        let scale = R::lit(1.0) / det;
        c.map(|e| e * scale)
    }
}

impl<R: Real> Add for Sym3<R> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        self.zip(o, |a, b| a + b)
    }
}

impl<R: Copy> Mat3<R> {
    /// All nine elements equal.
    #[inline(always)]
    pub fn splat(value: R) -> Self {
        let column = Vec3::splat(value);
        Self { x: column, y: column, z: column }
    }
}

impl<R: Real> Mat3<R> {
    /// Matrix times vector.
    #[inline(always)]
    pub fn times(self, v: Vec3<R>) -> Vec3<R> {
        self.z.scale_add(v.z, self.y.scale_add(v.y, self.x * v.x))
    }

    /// The same matrix with y called x, z called y, and x called z.
    #[inline(always)]
    pub(crate) fn cycled(self) -> Self {
        Self { x: self.y.cycled(), y: self.z.cycled(), z: self.x.cycled() }
    }

    /// Matrix times a constant vector of the model, whose zeros cost nothing, added to a vector.
    #[inline(always)]
    pub(crate) fn times_onto(self, v: Vec3<f64>, onto: Vec3<R>) -> Vec3<R> {
        let mut sum = onto;
        if v.x != 0.0 {
            sum = self.x.scale_add(R::lit(v.x), sum);
        }
        if v.y != 0.0 {
            sum = self.y.scale_add(R::lit(v.y), sum);
        }
        if v.z != 0.0 {
            sum = self.z.scale_add(R::lit(v.z), sum);
        }
        sum
    }

    /// Transposed matrix times vector.
    #[inline(always)]
    pub fn transposed_times(self, v: Vec3<R>) -> Vec3<R> {
        vec3(self.x.dot(v), self.y.dot(v), self.z.dot(v))
    }

    /// Matrix product.
    #[inline(always)]
    pub fn compose(self, o: Self) -> Self {
        Self { x: self.times(o.x), y: self.times(o.y), z: self.times(o.z) }
    }

    /// The transposed matrix.
    #[inline(always)]
    pub fn transposed(self) -> Self {
        Self {
            x: vec3(self.x.x, self.y.x, self.z.x),
            y: vec3(self.x.y, self.y.y, self.z.y),
            z: vec3(self.x.z, self.y.z, self.z.z),
        }
    }

    /// A constant of the model as a matrix of this scalar.
    #[inline(always)]
    pub fn lit(m: Mat3<f64>) -> Self {
        Self { x: Vec3::lit(m.x), y: Vec3::lit(m.y), z: Vec3::lit(m.z) }
    }
}
