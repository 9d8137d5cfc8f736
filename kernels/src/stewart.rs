//! Kinematics of a Stewart mechanism, a ring on six legs, and the constants of a soft capture ring.
//!
//! Stewart, Proc. IMechE 180 (1965) 371. Joints of both ends are given in part B's frame at the start, when the ring's frame is
//! the mount's.

use crate::vector::{Pose, Sym3, Vec3, vec3};

/// Number of legs.
pub const LEGS: usize = 6;

/// A ring with its legs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CaptureRing {
    /// Mass of all that moves with the ring \[kg\].
    pub mass: f64,
    /// Inertia about its centre of mass, part B's axes \[kg m^2\].
    pub inertia: Sym3<f64>,
    /// Its centre of mass, part B's frame \[m\].
    pub centre: Vec3<f64>,
    /// The legs.
    pub legs: [Leg; LEGS],
    /// Commanded force per shortening of a leg \[N/m\].
    pub stiffness: f64,
    /// Commanded force per rate of shortening of a leg \[N s/m\].
    pub damping: f64,
    /// Greatest commanded force of a leg, infinite without a limit \[N\].
    pub force_limit: f64,
    /// Time constant with which a leg's force follows its command; 0 = at once \[s\].
    pub lag: f64,
    /// Shortening and lengthening of a leg from the start at which its stops are met \[m\].
    pub strokes: [f64; 2],
    /// Stiffness of the stops \[N/m\].
    pub stop_stiffness: f64,
}

/// A ring with what follows from it.
#[derive(Clone, Copy, Debug)]
pub struct PreparedRing {
    /// The ring.
    pub ring: CaptureRing,
    /// Inverse of its inertia.
    pub(crate) inverse_inertia: Sym3<f64>,
    /// Lengths of the legs at the start \[m\].
    pub(crate) start_lengths: [f64; LEGS],
}

impl PreparedRing {
    /// Prepares a ring.
    pub(crate) fn new(ring: CaptureRing) -> Self {
        let start_lengths = ring.legs.map(|leg| leg.start_length());
        Self { ring, inverse_inertia: ring.inertia.inverse(), start_lengths }
    }
}

/// The two joints of a leg, part B's frame at the start \[m\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leg {
    /// Joint on the mount.
    pub mount: Vec3<f64>,
    /// Joint on the ring.
    pub ring: Vec3<f64>,
}

impl Leg {
    /// Length at the start \[m\].
    pub fn start_length(&self) -> f64 {
        (self.ring - self.mount).norm()
    }

    /// From the mount's joint to the ring's, for the ring's pose in the mount's frame, mount's axes \[m\].
    fn reach(&self, ring: Pose<f64>) -> Vec3<f64> {
        ring.position + ring.attitude.rotate(self.ring) - self.mount
    }
}

/// Inverse kinematics: lengths of the legs for the ring's pose in the mount's frame \[m\].
///
/// ```
/// use softdock_kernels::stewart::{leg_lengths, stewart_legs};
/// use softdock_kernels::vector::Pose;
/// let legs = stewart_legs([0.4, 0.45], [0.1, 0.1], [0.0, 0.3]);
/// assert!((leg_lengths(&legs, Pose::identity())[0] - legs[0].start_length()).abs() < 1e-15);
/// ```
pub fn leg_lengths(legs: &[Leg; LEGS], ring: Pose<f64>) -> [f64; LEGS] {
    legs.map(|leg| leg.reach(ring).norm())
}

/// Rates of the legs per twist of the ring: row i has the derivatives of length i by the velocity of the ring's origin and by
/// its angular velocity, mount's axes \[1, m\].
pub fn leg_jacobian(legs: &[Leg; LEGS], ring: Pose<f64>) -> [[f64; 6]; LEGS] {
    legs.map(|leg| {
        let reach = leg.reach(ring);
        let along = reach * (1.0 / reach.norm());
        let turning = ring.attitude.rotate(leg.ring).cross(along);
        [along.x, along.y, along.z, turning.x, turning.y, turning.z]
    })
}

/// Most steps of the forward kinematics, and the greatest change of a step at which it has converged \[m, rad\].
const MOST_STEPS: usize = 50;
const CONVERGED: f64 = 1e-13;

/// Forward kinematics: the ring's pose in the mount's frame for the lengths of the legs \[m\], by Newton's method from a pose
/// near it. `None` in a singular pose, or where the method does not converge.
pub fn pose_of_lengths(legs: &[Leg; LEGS], lengths: &[f64; LEGS], near: Pose<f64>) -> Option<Pose<f64>> {
    let mut pose = near;
    for _ in 0..MOST_STEPS {
        let now = leg_lengths(legs, pose);
        let missing: [f64; LEGS] = std::array::from_fn(|i| lengths[i] - now[i]);
        let step = solved(leg_jacobian(legs, pose), missing)?;
        let turn = vec3(step[3], step[4], step[5]);
        // Rotation vectors are exact below half a radian.
        let scale = (0.4 / turn.norm().max(1e-300)).min(1.0);
        pose.position = pose.position + vec3(step[0], step[1], step[2]) * scale;
        pose.attitude = pose.attitude.turned(turn * scale);
        if step.iter().all(|part| part.abs() < CONVERGED) {
            return Some(pose);
        }
    }
    None
}

/// Solves a system of six linear equations by elimination with row pivots; `None` if it is singular.
fn solved(mut rows: [[f64; 6]; 6], mut right: [f64; 6]) -> Option<[f64; 6]> {
    for column in 0..6 {
        let size = |row: &usize| rows[*row][column].abs();
        let pivot = (column..6).max_by(|a, b| size(a).total_cmp(&size(b)))?;
        if size(&pivot) < 1e-12 {
            return None;
        }
        rows.swap(column, pivot);
        right.swap(column, pivot);
        // Left of the pivot its row has zeros.
        let above = rows[column];
        for row in column + 1..6 {
            let factor = rows[row][column] / above[column];
            rows[row].iter_mut().zip(&above).for_each(|(own, above)| *own -= factor * above);
            right[row] -= factor * right[column];
        }
    }
    for row in (0..6).rev() {
        let known: f64 = (row + 1..6).map(|k| rows[row][k] * right[k]).sum();
        right[row] = (right[row] - known) / rows[row][row];
    }
    Some(right)
}

/// Legs of a Stewart mechanism about part B's x axis: three pairs of joints on each side, the pairs of the mount between
/// those of the ring.
///
/// `radii` \[m\], half angles of a pair \[rad\] and places along x \[m\], each of the ring and of the mount. The first pair of the
/// ring is about part B's y axis.
pub fn stewart_legs(radii: [f64; 2], half_angles: [f64; 2], places: [f64; 2]) -> [Leg; LEGS] {
    let third = std::f64::consts::TAU / 3.0;
    let at = |side: usize, angle: f64| vec3(places[side], radii[side] * angle.cos(), radii[side] * angle.sin());
    std::array::from_fn(|i| {
        let (pair, sign) = ((i / 2) as f64, if i % 2 == 0 { -1.0 } else { 1.0 });
        let middle = pair * third;
        Leg {
            ring: at(0, middle + sign * half_angles[0]),
            mount: at(1, middle + sign * (0.5 * third - half_angles[1])),
        }
    })
}
