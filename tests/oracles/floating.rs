//! The free-floating arm against a dense mass matrix: Jacobians of every body, assembled and solved as one system.

use super::bench::{at, inertia, two_bodies};
use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, UnitQuaternion, Vector3};
use softdock_kernels::fields::from_slice;
use softdock_kernels::manipulator::{ArmDrive, Drive, Friction};
use softdock_kernels::model::{Link, Model};
use softdock_kernels::params::Params;
use softdock_kernels::philox;
use softdock_kernels::plant::Plant;
use softdock_kernels::space::{Actuation, Bodies, Masses, Wrench, advance, kinematics, space_masses};
use softdock_kernels::vector::{Pose, Quat, Sym3, Vec3, vec3};

type V = Vector3<f64>;

fn v(a: Vec3<f64>) -> V {
    V::new(a.x, a.y, a.z)
}

fn q(a: Quat<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(a.w, a.v.x, a.v.y, a.v.z))
}

fn tensor(m: Sym3<f64>) -> Matrix3<f64> {
    Matrix3::new(m.xx, m.xy, m.xz, m.xy, m.yy, m.yz, m.xz, m.yz, m.zz)
}

/// One body: mass, inertia in inertial axes, place of its centre, and its Jacobians to (base velocity, base rate, joints).
struct Part {
    mass: f64,
    inertia: Matrix3<f64>,
    linear: DMatrix<f64>,
    angular: DMatrix<f64>,
}

/// The chaser of a state: its bodies, the tool, and where all that is; places count from the base's centre of mass.
pub(super) struct Dense {
    parts: Vec<Part>,
    tool: V,
    tool_linear: DMatrix<f64>,
    tool_angular: DMatrix<f64>,
    /// Base velocity, base rate and joint rates.
    velocity: DVector<f64>,
    joints: Vec<Joint>,
    centres: Vec<V>,
    /// Acceleration of the field on every body.
    field: V,
    /// The base stands still.
    is_held: bool,
}

/// A joint: its origin, its axis, and whether it slides along the axis.
type Joint = (V, V, bool);

/// Jacobians of a point fixed to the body behind the given joints.
fn jacobians(point: V, joints: &[Joint], size: usize) -> (DMatrix<f64>, DMatrix<f64>) {
    let (mut linear, mut angular) = (DMatrix::zeros(3, size), DMatrix::zeros(3, size));
    linear.fixed_view_mut::<3, 3>(0, 0).fill_with_identity();
    angular.fixed_view_mut::<3, 3>(0, 3).fill_with_identity();
    linear.fixed_view_mut::<3, 3>(0, 3).copy_from(&-point.cross_matrix());
    for (i, (origin, axis, slides)) in joints.iter().enumerate() {
        let (moved, turned) = if *slides { (*axis, V::zeros()) } else { (axis.cross(&(point - origin)), *axis) };
        linear.fixed_view_mut::<3, 1>(0, 6 + i).copy_from(&moved);
        angular.fixed_view_mut::<3, 1>(0, 6 + i).copy_from(&turned);
    }
    (linear, angular)
}

impl Dense {
    pub(super) fn new<const N: usize>(m: &Model, masses: Masses<f64>, s: &Bodies<f64, N>) -> Self {
        let mut attitude = q(s.chaser.attitude);
        let turned = |inertia: Sym3<f64>, by: &UnitQuaternion<f64>| {
            let r = by.to_rotation_matrix();
            r.matrix() * tensor(inertia) * r.matrix().transpose()
        };
        let (linear, angular) = jacobians(V::zeros(), &[], 6 + N);
        let inertia = turned(m.base_inertia, &attitude) * masses.base_inertia_scale;
        let mut parts = vec![Part { mass: masses.base_mass, inertia, linear, angular }];
        let (mut origin, mut joints, mut centres) = (V::zeros(), Vec::new(), vec![V::zeros()]);
        for (i, link) in m.links.iter().enumerate() {
            origin += attitude * v(link.origin.position);
            attitude *= q(link.origin.attitude);
            let axis = attitude * V::z();
            let place = m.start_angles[i] + s.arm.angle[i];
            if m.slides(i) {
                origin += axis * place;
            } else {
                attitude *= UnitQuaternion::from(Rotation3::from_axis_angle(&V::z_axis(), place));
            }
            joints.push((origin, axis, m.slides(i)));
            let com = origin + attitude * v(link.com);
            let (linear, angular) = jacobians(com, &joints, 6 + N);
            parts.push(Part { mass: link.mass, inertia: turned(link.inertia, &attitude), linear, angular });
            centres.push(com);
        }
        let tool = origin + attitude * v(m.tool.position);
        let (tool_linear, tool_angular) = jacobians(tool, &joints, 6 + N);
        let velocity = DVector::zeros(6 + N);
        let (field, is_held) = (v(m.field), m.held.base);
        let mut dense = Self { parts, tool, tool_linear, tool_angular, velocity, joints, centres, field, is_held };
        dense.velocity = match is_held {
            true => DVector::from_iterator(6 + N, [0.0; 6].into_iter().chain(s.arm.rate)),
            false => dense.velocities(s),
        };
        dense
    }

    /// Generalised velocities that the momenta and the joint rates of a state imply.
    fn velocities<const N: usize>(&self, s: &Bodies<f64, N>) -> DVector<f64> {
        let (h, joints) = (self.mass_matrix(), DVector::from_column_slice(&s.arm.rate));
        let mass: f64 = self.parts.iter().map(|part| part.mass).sum();
        let com = self.parts.iter().zip(&self.centres).fold(V::zeros(), |sum, (part, at)| sum + at * part.mass) / mass;
        let (p, spin) = (v(s.chaser.momentum), v(s.chaser.spin));
        let mut momentum = DVector::zeros(6);
        momentum.fixed_rows_mut::<3>(0).copy_from(&p);
        momentum.fixed_rows_mut::<3>(3).copy_from(&(spin + com.cross(&p)));
        let base = h.view((0, 0), (6, 6)).clone_owned().lu().solve(&(momentum - h.view((0, 6), (6, N)) * &joints));
        DVector::from_iterator(6 + N, base.expect("regular").iter().chain(joints.iter()).copied())
    }

    fn mass_matrix(&self) -> DMatrix<f64> {
        let size = self.tool_linear.ncols();
        self.parts.iter().fold(DMatrix::zeros(size, size), |sum, part| {
            sum + part.linear.transpose() * part.mass * &part.linear
                + part.angular.transpose() * part.inertia * &part.angular
        })
    }

    pub(super) fn kinetic_energy(&self) -> f64 {
        0.5 * self.velocity.dot(&(self.mass_matrix() * &self.velocity))
    }

    /// Generalised forces that hold all velocities constant.
    fn bias(&self) -> DVector<f64> {
        let mut sum = DVector::zeros(self.velocity.len());
        let mut rate = self.velocity.fixed_rows::<3>(3).into_owned();
        let (mut turning, mut origin, mut at_origin) = (V::zeros(), V::zeros(), V::zeros());
        let moved = |from: V, to: V, rate: V, turning: V| {
            let lever = to - from;
            turning.cross(&lever) + rate.cross(&rate.cross(&lever))
        };
        for (i, part) in self.parts.iter().enumerate() {
            if i > 0 {
                let (joint, axis, slides) = self.joints[i - 1];
                at_origin += moved(origin, joint, rate, turning);
                let spin = axis * self.velocity[5 + i];
                if slides {
                    at_origin += rate.cross(&spin) * 2.0;
                } else {
                    turning += rate.cross(&spin);
                    rate += spin;
                }
                origin = joint;
            }
            let acceleration = at_origin + moved(origin, self.centres[i], rate, turning);
            let moment = part.inertia * turning + rate.cross(&(part.inertia * rate));
            sum += part.linear.transpose() * (acceleration * part.mass) + part.angular.transpose() * moment;
        }
        sum
    }

    /// Place of the tool from the base's centre of mass.
    pub(super) fn tool(&self) -> Vec3<f64> {
        vec3(self.tool.x, self.tool.y, self.tool.z)
    }

    /// Place of the tool from the centre of mass of the chaser.
    pub(super) fn tool_from_com(&self) -> Vec3<f64> {
        let mass: f64 = self.parts.iter().map(|part| part.mass).sum();
        let com = self.parts.iter().zip(&self.centres).fold(V::zeros(), |sum, (part, at)| sum + at * part.mass) / mass;
        let tool = self.tool - com;
        vec3(tool.x, tool.y, tool.z)
    }

    /// Angular velocity of the base, inertial axes.
    pub(super) fn base_rate(&self) -> Vec3<f64> {
        vec3(self.velocity[3], self.velocity[4], self.velocity[5])
    }

    /// Accelerations of base and joints under actuation and a wrench on the tool.
    pub(super) fn accelerations<const N: usize>(&self, u: &Actuation<f64, N>, w: Wrench<f64>) -> DVector<f64> {
        self.geared_accelerations(0.0, u, w)
    }

    /// The same where each joint has a rotor of this inertia \[kg m^2, kg\] behind a rigid gear.
    fn geared_accelerations<const N: usize>(&self, rotor: f64, u: &Actuation<f64, N>, w: Wrench<f64>) -> DVector<f64> {
        let mut force = self.tool_linear.transpose() * v(w.force) + self.tool_angular.transpose() * v(w.moment);
        let applied = [u.thrust, u.torque].into_iter().flat_map(|a| [a.x, a.y, a.z]).chain(u.joint);
        applied.enumerate().for_each(|(i, push)| force[i] += push);
        self.parts.iter().for_each(|part| force += part.linear.transpose() * (self.field * part.mass));
        if self.is_held {
            let (count, rest) = (N, force - self.bias());
            let joints = self.mass_matrix().view((6, 6), (count, count)).clone_owned();
            let gain = joints.lu().solve(&rest.rows(6, count).clone_owned()).expect("regular");
            return DVector::from_iterator(6 + N, [0.0; 6].into_iter().chain(gain.iter().copied()));
        }
        let mut mass = self.mass_matrix();
        (6..6 + N).for_each(|i| mass[(i, i)] += rotor);
        mass.lu().solve(&(force - self.bias())).expect("regular")
    }
}

/// Numbers in -1..1, by their place in a stream.
fn drawn(stream: u32) -> impl FnMut() -> f64 {
    let mut count = 0;
    move || {
        count += 1;
        f64::from(philox::philox4x32([count, stream, 0, 0], [1, 2])[0]) / f64::from(1u32 << 31) - 1.0
    }
}

/// An arm of eight links that look nowhere in particular; every second pair of axes is parallel in the first case.
fn crooked(draw: &mut impl FnMut() -> f64, parallel: bool) -> Model {
    let mut model = two_bodies(1e-3, 1.0, 0.0);
    model.links = (0..8)
        .map(|i| {
            let axis = vec3(draw(), draw(), draw());
            let attitude = if parallel && i % 2 == 0 { axis * 0.0 } else { axis * 2.0 };
            let skew = vec3(draw(), draw(), draw()) * 0.05;
            Link {
                origin: Pose { attitude: Quat::from_rotation_vector(attitude), position: vec3(draw(), draw(), draw()) },
                mass: 12.0 + 5.0 * draw(),
                com: vec3(draw(), draw(), draw()) * 0.2,
                inertia: Sym3 { xy: skew.x, xz: skew.y, yz: skew.z, ..inertia(0.3, 0.4, 0.5) },
            }
        })
        .collect();
    model.start_angles = (0..8).map(|_| 2.0 * draw()).collect();
    model.tool = Pose { attitude: Quat::from_rotation_vector(vec3(draw(), draw(), draw())), ..at(0.2, -0.1, 0.3) };
    model.base_inertia = Sym3 { xy: 4.0, xz: -3.0, yz: 2.0, ..inertia(60.0, 50.0, 70.0) };
    model
}

/// A drive without friction, limits, stops and brake.
fn free_drive() -> ArmDrive {
    ArmDrive {
        drive: Drive::ideal(),
        friction: Friction::none(),
        presliding_travel: 1e-4,
        speed_limit: f64::INFINITY,
        stops: None,
        brake: 0.0,
    }
}

#[test]
fn free_floating_arm_accelerates_as_the_dense_mass_matrix() {
    for case in 0..36 {
        let mut draw = drawn(case);
        let mut model = crooked(&mut draw, case % 3 == 0);
        // In the first twelve cases all joints turn, then some slide, with and without drives.
        if case >= 12 {
            model.slides = (0..8).map(|i| (case >> (i % 5)) & 1 == 1).collect();
        }
        if case >= 24 {
            let drive = Drive { rotor_inertia: 1.5, ..Drive::ideal() };
            model.drives = vec![ArmDrive { drive, ..free_drive() }; 8];
        }
        let m = Plant::new(model);
        let params = Params { base_mass: 120.0, base_inertia_scale: 1.1, ..Params::null() };
        let masses = space_masses(&params);
        let mut s: Bodies<f64, 8> = softdock_kernels::start::start(&m, &params, &masses);
        s.chaser.attitude = Quat::from_rotation_vector(vec3(draw(), draw(), draw()) * 2.0);
        (s.chaser.momentum, s.chaser.spin) = (vec3(draw(), draw(), draw()) * 20.0, vec3(draw(), draw(), draw()) * 30.0);
        s.arm.angle = std::array::from_fn(|_| 3.0 * draw());
        s.arm.rate = std::array::from_fn(|_| draw());
        let mut u: Actuation<f64, 8> = from_slice(&(0..15).map(|_| 20.0 * draw()).collect::<Vec<_>>());
        u.braked = 0.0;
        let w: Wrench<f64> = from_slice(&(0..6).map(|_| 50.0 * draw()).collect::<Vec<_>>());

        let k = kinematics(&m, &masses, &s);
        let dense = Dense::new(&m, masses, &s);
        let tool = k.axes.times(k.reach.position);
        assert!((v(tool) - dense.tool).norm() < 1e-13, "case {case}: the tool is elsewhere");
        let twist = &dense.tool_linear * &dense.velocity;
        assert!((v(k.parts.a.velocity) - twist).norm() < 1e-12, "case {case}: the tool moves otherwise");
        let turning = &dense.tool_angular * &dense.velocity;
        assert!((v(k.parts.a.omega) - turning).norm() < 1e-12, "case {case}: the tool turns otherwise");

        s.drives.motor_rate = s.arm.rate;
        let next = advance(&m, &masses, &s, &k, &u, w);
        let found: Vec<f64> = (0..8).map(|i| (next.arm.rate[i] - s.arm.rate[i]) / m.timing.substep).collect();
        let exact: Vec<f64> = match m.drives.is_empty() {
            true => dense.accelerations(&u, w).iter().skip(6).copied().collect(),
            // A rotor behind a rigid gear resists its joint alone.
            false => dense.geared_accelerations(1.5, &u, w).iter().skip(6).copied().collect(),
        };
        let size = exact.iter().fold(0.0, |sum: f64, a| sum.max(a.abs()));
        for (found, exact) in found.iter().zip(&exact) {
            assert!((found - exact).abs() < 1e-9 * size, "case {case}: {found} and not {exact} rad/s^2");
        }
    }
}
