//! Conversion of attitudes to three angles, as used by KUKA (A, B, C) and FANUC (R, P, W): rotations about z, the new
//! y, the new x.

use softdock_kernels::vector::{Quat, vec3};

/// Returns the attitude of rotations about z, the new y and the new x \[rad\].
pub(crate) fn from_zyx([z, y, x]: [f64; 3]) -> Quat<f64> {
    let turn = |angle: f64, axis| {
        let (sin, cos) = (0.5 * angle).sin_cos();
        Quat { w: cos, v: axis * sin }
    };
    turn(z, vec3(0.0, 0.0, 1.0)).compose(turn(y, vec3(0.0, 1.0, 0.0))).compose(turn(x, vec3(1.0, 0.0, 0.0)))
}

/// Returns the rotations about z, the new y and the new x of an attitude \[rad\]. At y = +-90 deg only the difference
/// of the other two is defined, and x is 0.
pub(crate) fn to_zyx(attitude: Quat<f64>) -> [f64; 3] {
    let m = attitude.normalized().matrix();
    let across = m.x.x.hypot(m.x.y);
    let y = (-m.x.z).atan2(across);
    if across < 1e-9 {
        return [(-m.y.x).atan2(m.y.y), y, 0.0];
    }
    [m.x.y.atan2(m.x.x), y, m.y.z.atan2(m.z.z)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::FRAC_PI_2;

    proptest! {
        #[test]
        fn angles_return(z in -3.1..3.1f64, y in -1.57..1.57f64, x in -3.1..3.1f64) {
            let back = to_zyx(from_zyx([z, y, x]));
            prop_assert!((back[0] - z).abs() < 1e-9 && (back[1] - y).abs() < 1e-9 && (back[2] - x).abs() < 1e-9);
        }
    }

    #[test]
    fn a_quarter_turn_of_y_keeps_the_attitude() {
        for y in [FRAC_PI_2, -FRAC_PI_2] {
            let attitude = from_zyx([0.3, y, -0.8]);
            let again = from_zyx(to_zyx(attitude));
            let dot = attitude.w * again.w + attitude.v.dot(again.v);
            assert!(dot.abs() > 1.0 - 1e-12, "{attitude:?} {again:?}");
        }
    }
}
