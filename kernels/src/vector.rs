//! Small linear algebra over any scalar: vectors, symmetric matrices, quaternions, poses.
//!
//! Products are written with `mul_add`, in one fixed order, so that every backend with a fused
//! multiply-add gives the same bits.

use crate::real::Real;
use std::ops::{Add, Mul, Neg, Sub};

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

/// A unit quaternion, scalar part first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quat<R> {
    /// Scalar part.
    pub w: R,
    /// Vector part.
    pub v: Vec3<R>,
}

/// Position and attitude of a frame in another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose<R> {
    /// Origin of the frame.
    pub position: Vec3<R>,
    /// Rotation from the frame to the other.
    pub attitude: Quat<R>,
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

impl<R: Copy> Quat<R> {
    /// All four components equal (not a rotation: a start for reading one).
    #[inline(always)]
    pub fn splat(value: R) -> Self {
        Self { w: value, v: Vec3::splat(value) }
    }
}

impl<R: Real> Quat<R> {
    /// No rotation.
    #[inline(always)]
    pub fn identity() -> Self {
        Self { w: R::lit(1.0), v: Vec3::zero() }
    }

    /// A constant of the model as a quaternion of this scalar.
    #[inline(always)]
    pub fn lit(q: Quat<f64>) -> Self {
        Self { w: R::lit(q.w), v: Vec3::lit(q.v) }
    }

    /// The rotation by `self` after the rotation by `o`.
    #[inline(always)]
    pub fn compose(self, o: Self) -> Self {
        let w = self.w.mul_add(o.w, -self.v.dot(o.v));
        let v = o.v.scale_add(self.w, self.v.scale_add(o.w, self.v.cross(o.v)));
        Self { w, v }
    }

    /// The inverse rotation.
    #[inline(always)]
    pub fn conjugate(self) -> Self {
        Self { w: self.w, v: -self.v }
    }

    /// Rotates a vector.
    #[inline(always)]
    pub fn rotate(self, u: Vec3<R>) -> Vec3<R> {
        let t = self.v.cross(u) * R::lit(2.0);
        u + t.scale_add(self.w, self.v.cross(t))
    }

    /// Rotates a vector back.
    #[inline(always)]
    pub fn rotate_back(self, u: Vec3<R>) -> Vec3<R> {
        self.conjugate().rotate(u)
    }

    /// The rotation matrix.
    #[inline(always)]
    pub fn matrix(self) -> Mat3<R> {
        let (one, two) = (R::lit(1.0), R::lit(2.0));
        let d = self.v * two;
        let (xx, yy, zz) = (self.v.x * d.x, self.v.y * d.y, self.v.z * d.z);
        let (xy, xz, yz) = (self.v.x * d.y, self.v.x * d.z, self.v.y * d.z);
        let (wx, wy, wz) = (self.w * d.x, self.w * d.y, self.w * d.z);
        Mat3 {
            x: vec3(one - (yy + zz), xy + wz, xz - wy),
            y: vec3(xy - wz, one - (xx + zz), yz + wx),
            z: vec3(xz + wy, yz - wx, one - (xx + yy)),
        }
    }

    /// Scaled to unit length.
    #[inline(always)]
    pub fn normalized(self) -> Self {
        let scale = R::lit(1.0) / self.w.mul_add(self.w, self.v.dot(self.v)).sqrt();
        Self { w: self.w * scale, v: self.v * scale }
    }

    /// The rotation by the rotation vector `r`, exact to rounding for |r| < 0.5 rad and unit length for any.
    ///
    /// Taylor series in |r|^2 / 4 of cos and sinc of the half angle; steps turn by far less than 0.5 rad.
    #[inline(always)]
    pub fn from_rotation_vector(r: Vec3<R>) -> Self {
        let h = r * R::lit(0.5);
        let s = h.dot(h);
        let cos = s.polynomial(&[1.0, -1.0 / 2.0, 1.0 / 24.0, -1.0 / 720.0, 1.0 / 40320.0, -1.0 / 3628800.0]);
        let sinc = s.polynomial(&[1.0, -1.0 / 6.0, 1.0 / 120.0, -1.0 / 5040.0, 1.0 / 362880.0, -1.0 / 39916800.0]);
        Self { w: cos, v: h * sinc }.normalized()
    }

    /// This rotation and then the one by the rotation vector `r`, of unit length; exact to rounding for |r| < 0.5 rad.
    ///
    /// Of the half angle h only `h cot h` is needed, since the length is made 1 in any case.
    #[inline(always)]
    pub fn turned(self, r: Vec3<R>) -> Self {
        let v = r * R::lit(0.5);
        let w = v.dot(v).polynomial(&[
            1.0,
            -1.0 / 3.0,
            -1.0 / 45.0,
            -2.0 / 945.0,
            -1.0 / 4725.0,
            -2.0 / 93_555.0,
            -1_382.0 / 638_512_875.0,
        ]);
        Self { w, v }.compose(self).normalized()
    }

    /// Componentwise choice.
    #[inline(always)]
    pub fn select(mask: R::Mask, then: Self, other: Self) -> Self {
        Self { w: R::select(mask, then.w, other.w), v: Vec3::select(mask, then.v, other.v) }
    }
}

impl<R: Real> Pose<R> {
    /// The pose of a frame on itself.
    #[inline(always)]
    pub fn identity() -> Self {
        Self { position: Vec3::zero(), attitude: Quat::identity() }
    }

    /// A constant of the model as a pose of this scalar.
    #[inline(always)]
    pub fn lit(p: Pose<f64>) -> Self {
        Self { position: Vec3::lit(p.position), attitude: Quat::lit(p.attitude) }
    }

    /// The pose that undoes this one.
    #[inline(always)]
    pub fn inverse(self) -> Self {
        let attitude = self.attitude.conjugate();
        Self { position: -attitude.rotate(self.position), attitude }
    }

    /// The pose of a frame that is posed `o` in this one.
    #[inline(always)]
    pub fn compose(self, o: Self) -> Self {
        Self { position: self.position + self.attitude.rotate(o.position), attitude: self.attitude.compose(o.attitude) }
    }
}
