//! Soft capture ring: part B rides on a rigid ring, and six legs with load control join the ring to its mount on the target.
//!
//! A Stewart mechanism (Stewart, Proc. IMechE 180 (1965) 371): each leg runs from a joint of the mount to a joint of the ring,
//! and its force acts along it, with opposite signs on both. A leg commands stiffness times shortening plus damping times its
//! rate, within a force limit; its actuator follows with a first-order lag. A stop beyond either end of its stroke pushes back.
//!
//! Frames: joints of both ends in part B's frame at the start, when the ring's frame is the mount's. In space the mount is part
//! B's place on the target; on the facility robot 2 holds the mount, and the ring is hardware.

use crate::bundle;
use crate::plant::Plant;
use crate::real::Real;
use crate::space::{Body, Motion, Parts, Wrench};
use crate::vector::{Mat3, Pose, Sym3, Vec3, vec3};

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
    inverse_inertia: Sym3<f64>,
    /// Lengths of the legs at the start \[m\].
    start_lengths: [f64; LEGS],
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

bundle! {
    /// A soft capture ring in motion; written every substep.
    Ring {
        body: Body<R>, "1", "the ring, its axes those of part B";
        force: [R; LEGS], "N", "forces of the legs without stops; positive pushes ring and mount apart";
        back: Wrench<R>, "1", "wrench of the legs on the ring about part A's origin, inertial axes; its negative acts on the mount";
        impulse: Vec3<R>, "N s", "momentum at the start, for the account of momentum";
        moment_impulse: Vec3<R>, "kg m^2/s", "angular momentum about the origin at the start, likewise";
        peak_force: R, "N", "greatest force of a leg, stops included";
        peak_stroke: R, "m", "greatest change of a leg's length since the start";
        work: R, "J", "work of the legs on ring and mount";
    }
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
/// use softdock_kernels::capture_ring::{leg_lengths, stewart};
/// use softdock_kernels::vector::Pose;
/// let legs = stewart([0.4, 0.45], [0.1, 0.1], [0.0, 0.3]);
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
        for row in column + 1..6 {
            let factor = rows[row][column] / rows[column][column];
            for k in column..6 {
                rows[row][k] -= factor * rows[column][k];
            }
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
pub fn stewart(radii: [f64; 2], half_angles: [f64; 2], places: [f64; 2]) -> [Leg; LEGS] {
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

/// Whether part B rides on a ring.
#[inline(always)]
pub fn has_ring(m: &Plant) -> bool {
    m.capture_ring.is_some()
}

/// No ring, or one before its run.
#[inline(always)]
pub fn no_ring<R: Real>() -> Ring<R> {
    crate::fields::filled(R::lit(0.0))
}

/// The ring at rest on its mount, which has the motion of part B in `parts`; legs without force.
#[inline(always)]
pub fn ring_at<R: Real>(m: &Plant, parts: &Parts<R>) -> Ring<R> {
    let Some(PreparedRing { ring, .. }) = &m.capture_ring else { return no_ring() };
    let mount = parts.b;
    let axes = mount.attitude.matrix();
    let lever = axes.times(Vec3::lit(ring.centre));
    let com = mount.position + lever;
    let momentum = (mount.velocity + mount.omega.cross(lever)) * R::lit(ring.mass);
    let spin = axes.times(Sym3::lit(ring.inertia).times(axes.transposed_times(mount.omega)));
    Ring {
        body: Body { com, com_step: Vec3::zero(), attitude: mount.attitude, momentum, spin },
        impulse: momentum,
        moment_impulse: spin + com.cross(momentum),
        ..no_ring()
    }
}

/// Angular velocity of the ring, inertial axes.
#[inline(always)]
fn ring_rate<R: Real>(of: &PreparedRing, axes: Mat3<R>, spin: Vec3<R>) -> Vec3<R> {
    axes.times(Sym3::lit(of.inverse_inertia).times(axes.transposed_times(spin)))
}

/// Motion of part B on its ring.
#[inline(always)]
fn ring_motion<R: Real>(of: &PreparedRing, body: &Body<R>, axes: Mat3<R>) -> Motion<R> {
    let (lever, omega) = (axes.times(Vec3::lit(of.ring.centre)), ring_rate(of, axes, body.spin));
    Motion {
        position: body.com + (body.com_step - lever),
        attitude: body.attitude,
        velocity: body.momentum.scale_add(R::lit(1.0 / of.ring.mass), lever.cross(omega)),
        omega,
    }
}

/// The parts with part B on the ring, from those with part B's mount.
#[inline(always)]
pub fn on_ring<R: Real>(m: &Plant, s: &Ring<R>, parts: &Parts<R>) -> Parts<R> {
    match &m.capture_ring {
        Some(of) => Parts { b: ring_motion(of, &s.body, s.body.attitude.matrix()), ..*parts },
        None => *parts,
    }
}

/// One substep of the ring: part B of `parts` is its mount, and `w` the wrench on part A about A's origin, whose negative acts
/// on the ring.
#[inline(always)]
pub fn push_ring<R: Real>(m: &Plant, s: &Ring<R>, parts: &Parts<R>, w: Wrench<R>) -> Ring<R> {
    let Some(of) = &m.capture_ring else { return *s };
    let ring = &of.ring;
    let (zero, dt) = (R::lit(0.0), R::lit(m.timing.substep));
    let (a, mount) = (parts.a, parts.b);
    let (mount_axes, axes) = (mount.attitude.matrix(), s.body.attitude.matrix());
    let b = ring_motion(of, &s.body, axes);
    // Implicit Euler: stable for any lag.
    let follow = R::lit(m.timing.substep / (ring.lag + m.timing.substep));
    let gap = b.position - mount.position;
    let (mut next, mut sum) = (*s, Wrench::zero());
    for i in 0..LEGS {
        let leg = &ring.legs[i];
        let (near, far) = (mount_axes.times(Vec3::lit(leg.mount)), axes.times(Vec3::lit(leg.ring)));
        let reach = gap + (far - near);
        let length = reach.norm();
        let along = reach * (R::lit(1.0) / length);
        let rate = along.dot((b.velocity - mount.velocity) + (b.omega.cross(far) - mount.omega.cross(near)));
        let stretch = length - R::lit(of.start_lengths[i]);
        let mut wanted = stretch * R::lit(-ring.stiffness) - rate * R::lit(ring.damping);
        if ring.force_limit.is_finite() {
            wanted = wanted.min(R::lit(ring.force_limit)).max(R::lit(-ring.force_limit));
        }
        let force = if ring.lag > 0.0 { (wanted - s.force[i]).mul_add(follow, s.force[i]) } else { wanted };
        let [shorter, longer] = ring.strokes;
        let beyond = (R::lit(-shorter) - stretch).max(zero) - (stretch - R::lit(longer)).max(zero);
        let push = beyond.mul_add(R::lit(ring.stop_stiffness), force);
        sum = Wrench { force: along.scale_add(push, sum.force), moment: far.cross(along * push) + sum.moment };
        next.force[i] = force;
        next.peak_force = next.peak_force.max(push.abs());
        next.peak_stroke = next.peak_stroke.max(stretch.abs());
        next.work = (push * rate).mul_add(dt, next.work);
    }
    let from_a = b.position - a.position;
    next.back = Wrench { force: sum.force, moment: sum.moment + from_a.cross(sum.force) };
    let body = &mut next.body;
    let lever = a.position - (body.com + body.com_step);
    let net = next.back - w;
    body.momentum = net.force.scale_add(dt, body.momentum);
    body.spin = (net.moment + lever.cross(net.force)).scale_add(dt, body.spin);
    body.com_step = body.momentum.scale_add(dt * R::lit(1.0 / ring.mass), body.com_step);
    // Midpoint rule, as of the target.
    let half = body.attitude.turned(ring_rate(of, axes, body.spin) * (dt * R::lit(0.5)));
    body.attitude = body.attitude.turned(ring_rate(of, half.matrix(), body.spin) * dt);
    next
}

/// Closes a tick: the centre of mass takes over its step.
#[inline(always)]
pub fn settle_ring<R: Real>(s: &Ring<R>) -> Ring<R> {
    let body = Body { com: s.body.com + s.body.com_step, com_step: Vec3::zero(), ..s.body };
    Ring { body, ..*s }
}

/// What the ring adds to the linear momentum and to the angular momentum about the origin since the start.
#[inline(always)]
pub(crate) fn ring_momenta<R: Real>(s: &Ring<R>) -> (Vec3<R>, Vec3<R>) {
    let (body, place) = (&s.body, s.body.com + s.body.com_step);
    (body.momentum - s.impulse, (body.spin + place.cross(body.momentum)) - s.moment_impulse)
}

impl Ring<f64> {
    /// Pose of part B on the ring in the frame of its mount.
    pub fn pose_on(&self, m: &Plant, parts: &Parts<f64>) -> Pose<f64> {
        let (b, mount) = (on_ring(m, self, parts).b, parts.b);
        let at = |motion: Motion<f64>| Pose { position: motion.position, attitude: motion.attitude };
        at(mount).inverse().compose(at(b))
    }
}
