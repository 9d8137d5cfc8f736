//! Forms outside the catalogue that the torque of a drive may have: the dictionary that a regression picks from.

use crate::bundle;
use crate::real::Real;

bundle! {
    /// Coefficients of the forms, v the joint's rate, q its angle; a form with zero is not there.
    Forms {
        drag_square: R, "N m s^2/rad^2", "torque against the motion over v |v|";
        drag_cube: R, "N m s^3/rad^3", "torque against the motion over v^3";
        drag_even: R, "N m s^2/rad^2", "torque against positive angles over v^2";
        drag_slope: R, "N m s/rad^2", "torque against the motion over q v";
        spring_square: R, "N m/rad^2", "torque against positive angles over q^2";
        spring_cube: R, "N m/rad^3", "torque against positive angles over q^3";
        friction_slope: R, "N m/rad", "dry friction over q";
        friction_square: R, "N m/rad^2", "dry friction over q^2";
        torque_square: R, "1/(N m)", "missing torque over T |T|, T the commanded torque";
    }
}

impl<R: Real> Forms<R> {
    /// Torque against positive angles.
    #[inline(always)]
    pub(super) fn resisting(&self, angle: R, rate: R) -> R {
        let drag = self.drag_cube.mul_add(rate, self.drag_even) * rate;
        let drag = rate.abs().mul_add(self.drag_square, angle.mul_add(self.drag_slope, drag)) * rate;
        let spring = self.spring_cube.mul_add(angle, self.spring_square) * angle * angle;
        drag + spring
    }

    /// Dry friction beyond the model's at an angle.
    #[inline(always)]
    pub(super) fn dry(&self, angle: R) -> R {
        self.friction_square.mul_add(angle, self.friction_slope) * angle
    }

    /// Actual torque for a commanded one.
    #[inline(always)]
    pub(super) fn given(&self, torque: R) -> R {
        torque - self.torque_square * torque * torque.abs()
    }
}
