//! Rotations of any angle as rotation vectors, and back; small ones have cheaper functions in [`crate::vector`].

use crate::math::{atan2, sin_cos};
use crate::real::Real;
use crate::vector::{Quat, Vec3};

/// An angle below which a rotation is its own vector, also in f32 \[rad\].
const TINY: f64 = 1e-12;

/// The rotation by a rotation vector \[rad\].
#[inline(always)]
pub fn from_turn<R: Real>(turn: Vec3<R>) -> Quat<R> {
    let angle = turn.dot(turn).max(R::lit(TINY * TINY)).sqrt();
    let (sin, cos) = sin_cos(angle * R::lit(0.5));
    Quat { w: cos, v: turn * (sin / angle) }.normalized()
}

/// Rotation vector of a rotation, the short way \[rad\].
#[inline(always)]
pub fn rotation_vector<R: Real>(q: Quat<R>) -> Vec3<R> {
    let sign = R::select(q.w.lt(R::lit(0.0)), R::lit(-1.0), R::lit(1.0));
    let sin = q.v.dot(q.v).max(R::lit(TINY * TINY)).sqrt();
    let angle = atan2(sin, q.w * sign) * R::lit(2.0);
    q.v * (sign * (angle / sin))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vector::vec3;

    #[test]
    fn a_rotation_comes_back_from_its_vector() {
        for size in [0.0, 1e-13, 1e-9, 1e-3, 0.4, 1.5, 3.1] {
            let turn = vec3(0.48, -0.6, 0.64) * size;
            let back = rotation_vector(from_turn(turn));
            assert!((back - turn).norm() <= 1e-14 * (1.0 + size), "{size}: {back:?}");
            assert!((from_turn(turn).rotate(turn) - turn).norm() < 1e-14, "about its own axis");
        }
    }
}
