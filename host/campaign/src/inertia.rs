//! Inertia tensors: which ones a rigid body can have, and how bodies are joined into one.

use nalgebra::{Matrix3, SymmetricEigen};
use softdock_kernels::vector::{Pose, Sym3, Vec3};

/// Why no rigid body has this inertia about its centre of mass, or `None` if one can.
pub(crate) fn fault(inertia: Sym3<f64>) -> Option<String> {
    let matrix = matrix(inertia);
    if !matrix.iter().all(|element| element.is_finite()) {
        return Some("it is not finite".to_owned());
    }
    let mut moments: Vec<f64> = SymmetricEigen::new(matrix).eigenvalues.iter().copied().collect();
    moments.sort_by(f64::total_cmp);
    let shown = format!("{:.4}, {:.4}, {:.4} kg m^2", moments[0], moments[1], moments[2]);
    if moments[0] <= 0.0 {
        return Some(format!("it is not positive definite: its principal moments are {shown}"));
    }
    // Published tables are rounded: a thin rod or plate stands exactly on the limit.
    (moments[0] + moments[1] < moments[2] * (1.0 - 1e-4)).then(|| {
        format!("it breaks the triangle inequality: the greatest of {shown} is more than the sum of the others")
    })
}

/// The tensor as a matrix.
pub(crate) fn matrix(i: Sym3<f64>) -> Matrix3<f64> {
    Matrix3::new(i.xx, i.xy, i.xz, i.xy, i.yy, i.yz, i.xz, i.yz, i.zz)
}

/// Mass properties of bodies that are fixed to one another, in one frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Joined {
    pub(crate) mass: f64,
    /// Mass times centre of mass.
    moment: Vec3<f64>,
    /// Inertia about the frame's origin.
    inertia: Sym3<f64>,
}

impl Joined {
    pub(crate) fn nothing() -> Self {
        Self { mass: 0.0, moment: Vec3::zero(), inertia: Sym3::splat(0.0) }
    }

    /// Adds a body; `frame` is the place of its centre of mass and inertia axes.
    pub(crate) fn add(&mut self, mass: f64, inertia: Sym3<f64>, frame: Pose<f64>) {
        self.mass += mass;
        self.moment = self.moment + frame.position * mass;
        let about_com = inertia.rotated(frame.attitude.matrix());
        self.inertia = self.inertia + about_com + Sym3::point_mass(mass, frame.position);
    }

    /// Centre of mass and the inertia about it.
    pub(crate) fn about_com(&self) -> (Vec3<f64>, Sym3<f64>) {
        let com = self.moment * (1.0 / self.mass);
        (com, self.inertia + Sym3::point_mass(-self.mass, com))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use softdock_kernels::vector::{Quat, vec3};

    fn diagonal(x: f64, y: f64, z: f64) -> Sym3<f64> {
        Sym3::diagonal(vec3(x, y, z))
    }

    #[test]
    fn impossible_tensors_are_told() {
        assert!(fault(diagonal(1.0, 2.0, 3.0)).is_none(), "a plate stands on the limit");
        assert!(fault(diagonal(0.25, 0.25, 1.69)).expect("ETS-VII link 1").contains("triangle"));
        assert!(fault(diagonal(-1.0, 2.0, 2.0)).expect("negative").contains("positive definite"));
        let twisted = Sym3 { xy: 5.0, ..diagonal(1.0, 2.0, 2.5) };
        assert!(fault(twisted).expect("large off-diagonal").contains("positive definite"));
        assert!(fault(diagonal(f64::NAN, 1.0, 1.0)).is_some());
    }

    /// Two balls on a rod: the parallel-axis theorem, worked by hand.
    #[test]
    fn bodies_join_by_the_parallel_axis_theorem() {
        let at = |x: f64| Pose { position: vec3(x, 0.0, 0.0), attitude: Quat::identity() };
        let mut joined = Joined::nothing();
        joined.add(1.0, diagonal(0.1, 0.1, 0.1), at(0.0));
        joined.add(3.0, diagonal(0.2, 0.2, 0.2), at(4.0));
        let (com, inertia) = joined.about_com();
        assert_eq!((joined.mass, com.x), (4.0, 3.0));
        // Reduced mass 3/4, distance 4: 12 across the rod.
        assert!((inertia.xx - 0.3).abs() < 1e-12 && (inertia.yy - 12.3).abs() < 1e-12);
    }
}
