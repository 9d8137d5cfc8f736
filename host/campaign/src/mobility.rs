//! How easily the bodies move at the start posture: inverse inertias at a point, about a part, at the joints.
//!
//! The arm's joints are free: within the time of a contact their controllers hold nothing.

use crate::inertia::matrix;
use crate::placement::link_frames;
use nalgebra::{DMatrix, Matrix3, Matrix6, Vector3};
use softdock_kernels::model::Model;
use softdock_kernels::stewart::{CaptureRing, leg_jacobian};
use softdock_kernels::vector::{Mat3, Pose, Sym3, Vec3, vec3};

/// Share of the greatest mobility below which a direction does not move.
const STIFF: f64 = 1e-9;

/// The chaser (base and arm) as one matrix: motions of base and joints to momenta, inverted.
pub(crate) struct Chaser {
    inverse: DMatrix<f64>,
    /// Base's centre of mass, contact frame.
    centre: Vec3<f64>,
    /// Joint origins and axes, contact frame, and whether they slide.
    joints: Vec<(Vec3<f64>, Vec3<f64>, bool)>,
    /// Origin of part A, contact frame.
    pub(crate) part_a: Vec3<f64>,
    /// Axes of part A, contact frame.
    pub(crate) axes: Mat3<f64>,
}

impl Chaser {
    /// `None` if the mass matrix cannot be inverted.
    pub(crate) fn new(m: &Model, base_mass: f64, base_inertia_scale: f64) -> Option<Self> {
        let frames: Vec<_> =
            link_frames(&m.links, &m.slides, &m.start_angles).iter().map(|frame| m.base_pose.compose(*frame)).collect();
        let axis = |frame: &Pose<f64>| frame.attitude.rotate(vec3(0.0, 0.0, 1.0));
        let joints = frames.iter().enumerate().map(|(i, f)| (f.position, axis(f), m.slides(i))).collect();
        let tool = frames.last().copied().unwrap_or(m.base_pose).compose(m.tool);
        let mut chaser = Self {
            inverse: DMatrix::zeros(0, 0),
            centre: m.base_pose.position,
            joints,
            part_a: tool.position,
            axes: tool.attitude.matrix(),
        };
        let base_inertia = m.base_inertia.map(|element| element * base_inertia_scale);
        let mut mass = chaser.body(0, base_mass, chaser.centre, base_inertia.rotated(m.base_pose.attitude.matrix()));
        for (index, (link, frame)) in m.links.iter().zip(&frames).enumerate() {
            let com = frame.position + frame.attitude.rotate(link.com);
            mass += chaser.body(index + 1, link.mass, com, link.inertia.rotated(frame.attitude.matrix()));
        }
        chaser.inverse = match m.held.base {
            false => mass.cholesky()?.inverse(),
            true => chaser.on_held_base(&mass)?,
        };
        Some(chaser)
    }

    /// The inverse where only the joints can move: nothing moves the base.
    fn on_held_base(&self, mass: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        let count = self.joints.len();
        let mut inverse = DMatrix::zeros(6 + count, 6 + count);
        if count > 0 {
            let joints = mass.view((6, 6), (count, count)).into_owned().cholesky()?.inverse();
            inverse.view_mut((6, 6), (count, count)).copy_from(&joints);
        }
        Some(inverse)
    }

    /// Velocity of a point and angular velocity that base and the first `moving` joints give, as rows of six.
    fn jacobian(&self, moving: usize, point: Vec3<f64>) -> DMatrix<f64> {
        let mut jacobian = DMatrix::zeros(6, 6 + self.joints.len());
        let mut column = |index: usize, linear: Vec3<f64>, angular: Vec3<f64>| {
            for (row, value) in [linear.x, linear.y, linear.z, angular.x, angular.y, angular.z].into_iter().enumerate()
            {
                jacobian[(row, index)] = value;
            }
        };
        let units = [vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0), vec3(0.0, 0.0, 1.0)];
        for (index, unit) in units.into_iter().enumerate() {
            column(index, unit, Vec3::zero());
            column(3 + index, unit.cross(point - self.centre), unit);
        }
        for (index, (origin, axis, slides)) in self.joints.iter().take(moving).enumerate() {
            match slides {
                true => column(6 + index, *axis, Vec3::zero()),
                false => column(6 + index, axis.cross(point - *origin), *axis),
            }
        }
        jacobian
    }

    /// A body's share of the mass matrix.
    fn body(&self, moving: usize, mass: f64, com: Vec3<f64>, inertia: Sym3<f64>) -> DMatrix<f64> {
        let jacobian = self.jacobian(moving, com);
        let mut spatial = DMatrix::zeros(6, 6);
        spatial.view_mut((0, 0), (3, 3)).copy_from(&(Matrix3::identity() * mass));
        spatial.view_mut((3, 3), (3, 3)).copy_from(&matrix(inertia));
        jacobian.transpose() * spatial * jacobian
    }

    /// Inverse of the inertia that a wrench on the end-effector at `point` feels: 3 x 3 blocks force, moment.
    fn end(&self, point: Vec3<f64>) -> DMatrix<f64> {
        let jacobian = self.jacobian(self.joints.len(), point);
        &jacobian * &self.inverse * jacobian.transpose()
    }

    /// Inverse of the inertia that a wrench on the base's centre of mass feels: force, moment.
    pub(crate) fn at_base(&self) -> (Matrix3<f64>, Matrix3<f64>) {
        let block = |start| self.inverse.fixed_view::<3, 3>(start, start).into_owned();
        (block(0), block(3))
    }

    /// Acceleration of a point of the end-effector by a force on it \[1/kg\].
    pub(crate) fn at_point(&self, point: Vec3<f64>) -> Matrix3<f64> {
        self.end(point).fixed_view::<3, 3>(0, 0).into_owned()
    }

    /// Angular acceleration of the end-effector by a moment \[1/(kg m^2)\].
    pub(crate) fn about_part_a(&self) -> Matrix3<f64> {
        self.end(self.part_a).fixed_view::<3, 3>(3, 3).into_owned()
    }

    /// Acceleration of each joint by each joint torque \[1/(kg m^2)\], or force where they slide \[1/kg\].
    pub(crate) fn at_joints(&self) -> DMatrix<f64> {
        let count = self.joints.len();
        self.inverse.view((6, 6), (count, count)).into_owned()
    }
}

/// Acceleration of a point of the target by a force on it \[1/kg\]; `point` in the contact frame. None of a held target.
///
/// Behind a soft capture ring it is the ring that accelerates at once.
pub(crate) fn target_at_point(m: &Model, mass: f64, inertia_scale: f64, point: Vec3<f64>) -> Matrix3<f64> {
    if let Some(ring) = &m.ring {
        return at_point(ring.mass, &matrix(ring.inertia.inverse()), point - ring.centre);
    }
    if m.held.target {
        return Matrix3::zeros();
    }
    at_point(mass, &target_about_com(m, inertia_scale), point - m.target_pose.position)
}

/// Acceleration of a point of a free body, at `arm` from its centre of mass, by a force there \[1/kg\].
fn at_point(mass: f64, about_com: &Matrix3<f64>, arm: Vec3<f64>) -> Matrix3<f64> {
    let skew = Vector3::new(arm.x, arm.y, arm.z).cross_matrix();
    Matrix3::identity() * (1.0 / mass) - skew * about_com * skew
}

/// Angular acceleration of the target by a moment \[1/(kg m^2)\].
pub(crate) fn target_about_com(m: &Model, inertia_scale: f64) -> Matrix3<f64> {
    if let Some(ring) = &m.ring {
        return matrix(ring.inertia.inverse());
    }
    if m.held.target {
        return Matrix3::zeros();
    }
    let inertia = m.target_inertia.map(|element| element * inertia_scale);
    matrix(inertia.rotated(m.target_pose.attitude.matrix()).inverse())
}

/// Squares of the natural angular frequencies of a ring on its legs, the mount held, per stiffness of a leg \[1/kg\],
/// ascending.
pub(crate) fn leg_mobilities(ring: &CaptureRing) -> [f64; 6] {
    let jacobian = Matrix6::from_fn(|leg, axis| leg_jacobian(&ring.legs, Pose::identity())[leg][axis]);
    let mut spatial = Matrix6::zeros();
    let lever = ring.centre;
    let skew = Vector3::new(lever.x, lever.y, lever.z).cross_matrix() * ring.mass;
    spatial.fixed_view_mut::<3, 3>(0, 0).copy_from(&(Matrix3::identity() * ring.mass));
    spatial.fixed_view_mut::<3, 3>(0, 3).copy_from(&-skew);
    spatial.fixed_view_mut::<3, 3>(3, 0).copy_from(&skew);
    spatial.fixed_view_mut::<3, 3>(3, 3).copy_from(&(matrix(ring.inertia) - skew * skew / ring.mass));
    let Some(inverse) = spatial.try_inverse() else { return [f64::INFINITY; 6] };
    let mut squares: [f64; 6] = (jacobian * inverse * jacobian.transpose()).symmetric_eigenvalues().into();
    squares.sort_by(f64::total_cmp);
    squares
}

/// The greatest eigenvalue of a symmetric matrix: the direction that is easiest to move.
pub(crate) fn greatest(mobility: &Matrix3<f64>) -> f64 {
    mobility.symmetric_eigenvalues().max()
}

/// Effective mass of the pair along the approach axis where the nominal contact is \[kg\]; none where nothing gives way, which
/// takes a held target and an arm on a held base.
pub(crate) fn effective_mass(m: &Model, base_mass: f64, target_mass: f64) -> Option<f64> {
    let chaser = Chaser::new(m, base_mass, 1.0)?;
    let mobility = chaser.at_point(chaser.part_a) + target_at_point(m, target_mass, 1.0, Vec3::zero());
    let is_stiff = m.held.base && m.held.target && mobility[(0, 0)] <= STIFF * greatest(&mobility);
    (!is_stiff).then(|| 1.0 / mobility[(0, 0)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::tests::free_body;
    use softdock_kernels::model::Link;

    /// A free body: 1/m_eff = 1/m1 + 1/m2 through the centres of mass, + (r x n)^2 / I beside them.
    #[test]
    fn a_free_body_has_the_textbook_effective_mass() {
        let mut m = free_body();
        let mass = effective_mass(&m, 400.0, 400.0).expect("invertible");
        assert!((mass - 200.0).abs() < 1e-9, "{mass}");
        m.tool.position.y += 0.5;
        m.base_pose.position.y -= 0.5;
        let expected = 1.0 / (1.0 / 400.0 + 0.25 / m.base_inertia.zz + 1.0 / 400.0);
        let mass = effective_mass(&m, 400.0, 400.0).expect("invertible");
        assert!((mass - expected).abs() < 1e-9 * expected, "{mass} {expected}");
    }

    /// The planar free-floating arm: with the joint free, the reduced inertia of pin and link.
    #[test]
    fn a_joint_feels_the_reduced_inertia_of_both_sides() {
        let mut m = free_body();
        // Link's centre of mass on the pin, pin on the base's centre of mass: pure rotations.
        let inertia = Sym3::diagonal(vec3(3.0, 4.0, 5.0));
        m.links = vec![Link { origin: Pose::identity(), mass: 10.0, com: Vec3::zero(), inertia }];
        m.start_angles = vec![0.0];
        let chaser = Chaser::new(&m, 400.0, 1.0).expect("invertible");
        let expected = 1.0 / 5.0 + 1.0 / m.base_inertia.zz;
        assert!((chaser.at_joints()[(0, 0)] - expected).abs() < 1e-12);
    }
}
