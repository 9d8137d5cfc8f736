//! Unit quaternions and poses.

use super::{Mat3, Vec3, vec3};
use crate::real::Real;

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

    /// Rotation vector of a small rotation, the short way: twice the vector part, short by a 24th of its cube.
    #[inline(always)]
    pub fn small_rotation_vector(self) -> Vec3<R> {
        self.v * R::select(self.w.lt(R::lit(0.0)), R::lit(-2.0), R::lit(2.0))
    }

    /// Rotation vector of the small rotation from this attitude to another one, as [`Self::small_rotation_vector`].
    ///
    /// The numbers of the two are subtracted first, which is exact: the rotation is as accurate as they are, and what
    /// they are rounded by cancels along a chain of attitudes.
    #[inline(always)]
    pub fn small_rotation_to(self, to: Self) -> Vec3<R> {
        let sign = R::select(self.w.mul_add(to.w, self.v.dot(to.v)).lt(R::lit(0.0)), R::lit(-1.0), R::lit(1.0));
        let difference = Self { w: to.w * sign - self.w, v: to.v * sign - self.v };
        difference.compose(self.conjugate()).v * R::lit(2.0)
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
