//! A robot from its URDF: modified Denavit-Hartenberg rows, links in the rows' frames, limits and friction.

use crate::arm::{self, Arm, BaseMass};
use crate::inertia::matrix;
use crate::problem::Problems;
use crate::source::Source;
use nalgebra::{Matrix3, Vector3};
use softdock_kernels::manipulator::{DhRow, Drive, Friction, GRAVITY, Joint, JointLimits, Manipulator, RobotRating};
use softdock_kernels::model::Link;
use softdock_kernels::vector::{Pose, Sym3, Vec3, vec3};
use std::path::Path;

/// A robot as its URDF describes it; joints from the base outwards.
#[derive(Clone, Debug)]
pub struct UrdfRobot {
    /// Name of the robot.
    pub name: String,
    /// Its moving joints.
    pub joints: Vec<UrdfJoint>,
    /// Sliding joints beyond the last turning one (fingers of a gripper), which are fixed at their zero.
    pub fixed: Vec<String>,
    /// Origin of the Denavit-Hartenberg base in the axes of the URDF's root link \[m\]; both have z upwards.
    pub base: [f64; 3],
    /// Angle of its x axis about the vertical, in the axes of the root link \[rad\].
    pub base_turn: f64,
}

/// A moving joint of a URDF with the link behind it.
#[derive(Clone, Debug)]
pub struct UrdfJoint {
    /// Name of the joint.
    pub name: String,
    /// Row of the modified Denavit-Hartenberg table.
    pub row: DhRow,
    /// The link in the frame of the row.
    pub link: Link,
    /// Least and greatest angle \[rad\]; none for a joint without a stop.
    pub range: Option<(f64, f64)>,
    /// Greatest torque \[N m\]; none if the URDF states 0.
    pub effort: Option<f64>,
    /// Greatest speed \[rad/s\]; none if the URDF states 0.
    pub speed: Option<f64>,
    /// Viscous friction \[N m s/rad\]; none without `<dynamics>`.
    pub damping: Option<f64>,
    /// Coulomb friction \[N m\]; none without `<dynamics>`.
    pub friction: Option<f64>,
}

impl UrdfRobot {
    /// Reads the serial chain of a URDF; the mass of the root link is ignored.
    ///
    /// # Errors
    /// What is wrong with the URDF, with line, element and remedy.
    pub fn load(path: &Path) -> Result<Self, Problems> {
        Self::of(&Source::read(path, None)?)
    }

    /// Reads a URDF from its text; messages name `path`.
    ///
    /// # Errors
    /// As [`UrdfRobot::load`].
    pub fn from_text(path: &Path, text: &str) -> Result<Self, Problems> {
        Self::of(&Source::new(path.to_owned(), text.to_owned()))
    }

    fn of(source: &Source) -> Result<Self, Problems> {
        let arm = match arm::read(source, Pose::identity(), BaseMass::Ignored, arm::Stated::default()) {
            Ok(arm) => arm,
            Err(problems) => return Err(Problems::check(problems).expect_err("a chain without problems is read")),
        };
        if arm.links.is_empty() {
            let problem = crate::problem::Problem::at(source, 0..0, "the URDF has no joint that moves");
            let remedy = "name the URDF of the robot, with joints of type revolute or continuous";
            return Err(Problems::check(vec![problem.key("robot").remedy(remedy)]).expect_err("one problem"));
        }
        let robot = urdf_rs::read_from_string(source.text()).expect("the chain has been read from the same text");
        let fixed = arm::grippers(&robot).map(|joint| robot.joints[joint].name.clone()).collect();
        let chain = Chain::of(&arm);
        let joints = (0..arm.links.len()).map(|i| chain.joint(&arm, &robot, i)).collect();
        let (base, x) = (chain.frames[0].origin, chain.frames[0].x);
        Ok(Self { name: robot.name.clone(), joints, fixed, base: [base.x, base.y, base.z], base_turn: x.y.atan2(x.x) })
    }

    /// The constants of the robot for rigid-body dynamics: without friction, with rigid drives without inertia.
    pub fn rigid(&self) -> Manipulator {
        let drive = Drive::ideal();
        let friction = Friction::none();
        let joints = self.joints.iter().map(|joint| {
            let (lower, upper) = joint.range.unwrap_or((-std::f64::consts::PI, std::f64::consts::PI));
            let limits = JointLimits { lower, upper, speed: f64::INFINITY, acceleration: f64::INFINITY };
            Joint { link: joint.link, sign: joint.row.sign, drive, friction, counterweight: None, limits }
        });
        Manipulator {
            joints: joints.collect(),
            flange: Pose::identity(),
            gravity: vec3(0.0, 0.0, -GRAVITY),
            workspace: RobotRating { reach: 0.0, payload: 0.0, repeatability: 0.0 },
            capsules: Vec::new(),
        }
    }

    /// Upper bound of the horizontal distance of the last frame from axis 1 \[m\]: the sum of the table's lengths
    /// beyond joint 1.
    pub fn reach_bound(&self) -> f64 {
        self.joints.iter().skip(1).map(|joint| joint.row.a.hypot(joint.row.d)).sum()
    }
}

/// Directions whose sine is smaller count as parallel, and distances \[m\] as none.
const PARALLEL: f64 = 1e-7;
const NO_DISTANCE: f64 = 1e-9;

/// A frame of the table at joint angles 0, in axes of the root link.
#[derive(Clone, Copy, Debug)]
struct Frame {
    origin: Vector3<f64>,
    x: Vector3<f64>,
    z: Vector3<f64>,
}

impl Frame {
    /// Rows: its axes.
    fn axes(&self) -> Matrix3<f64> {
        Matrix3::from_rows(&[self.x.transpose(), self.z.cross(&self.x).transpose(), self.z.transpose()])
    }
}

/// Frames of the table, from the base on, and the rows between them.
struct Chain {
    /// Poses of the arm's link frames at joint angles 0, in axes of the root link.
    links: Vec<Pose<f64>>,
    frames: Vec<Frame>,
    rows: Vec<DhRow>,
}

impl Chain {
    fn of(arm: &Arm) -> Self {
        let mut at = Pose::identity();
        let mut links = Vec::new();
        for link in &arm.links {
            at = at.compose(link.origin);
            links.push(at);
        }
        let axes: Vec<(Vector3<f64>, Vector3<f64>)> = links
            .iter()
            .map(|pose| (vector(pose.position), vector(pose.attitude.rotate(vec3(0.0, 0.0, 1.0))).normalize()))
            .collect();
        let mut frames = vec![base(axes[0])];
        let mut rows = Vec::new();
        for (i, (point, z)) in axes.iter().enumerate() {
            let before = frames[i];
            let alpha = before.x.dot(&before.z.cross(z)).atan2(before.z.dot(z));
            // The foot of the common normal on this axis; the base frame stands on axis 1.
            let a = if i == 0 { 0.0 } else { (point - before.origin).dot(&before.x) };
            let foot = before.origin + a * before.x;
            let (origin, x) = match axes.get(i + 1) {
                Some(next) => normal((*point, *z), *next, foot, before.x),
                None => last(&links[i], (*point, *z), before.x),
            };
            let offset = z.dot(&before.x.cross(&x)).atan2(before.x.dot(&x));
            rows.push(DhRow { a, alpha, d: (origin - foot).dot(z), offset, sign: 1.0 });
            frames.push(Frame { origin, x, z: *z });
        }
        Self { links, frames, rows }
    }

    fn joint(&self, arm: &Arm, robot: &urdf_rs::Robot, i: usize) -> UrdfJoint {
        let (link, pose, frame) = (&arm.links[i], &self.links[i], &self.frames[i + 1]);
        let com = vector(pose.compose(Pose { position: link.com, attitude: Pose::identity().attitude }).position);
        let com = frame.axes() * (com - frame.origin);
        let axes = ["x", "y", "z"].map(|axis| {
            let unit = vec3(f64::from(axis == "x"), f64::from(axis == "y"), f64::from(axis == "z"));
            vector(pose.attitude.rotate(unit))
        });
        let turn = frame.axes() * Matrix3::from_columns(&axes);
        let tensor = turn * matrix(link.inertia) * turn.transpose();
        let written = robot.joints.iter().find(|joint| joint.name == arm.joints[i]);
        let stated = |value: f64| (value.is_finite() && value > 0.0).then_some(value);
        let limit = written.map(|joint| joint.limit.clone()).unwrap_or_default();
        let dynamics = written.and_then(|joint| joint.dynamics.clone());
        let (lower, upper) = arm.limits[i];
        let row = self.rows[i];
        let inertia = Sym3 {
            xx: tensor[(0, 0)],
            yy: tensor[(1, 1)],
            zz: tensor[(2, 2)],
            xy: tensor[(0, 1)],
            xz: tensor[(0, 2)],
            yz: tensor[(1, 2)],
        };
        UrdfJoint {
            name: arm.joints[i].clone(),
            row,
            link: Link { origin: row.origin(), mass: link.mass, com: vec3(com.x, com.y, com.z), inertia },
            range: (lower.is_finite() && upper.is_finite()).then_some((lower, upper)),
            effort: stated(limit.effort),
            speed: stated(limit.velocity),
            damping: dynamics.as_ref().map(|dynamics| dynamics.damping).filter(|value| value.is_finite()),
            friction: dynamics.as_ref().map(|dynamics| dynamics.friction).filter(|value| value.is_finite()),
        }
    }
}

/// The base frame of the table: z upwards, its origin on axis 1.
fn base((point, z): (Vector3<f64>, Vector3<f64>)) -> Frame {
    let up = Vector3::z();
    let across = up.cross(&z);
    if across.norm() < PARALLEL {
        // Axis 1 is vertical: the base stays at the height and in the heading of the root link.
        return Frame { origin: Vector3::new(point.x, point.y, 0.0), x: Vector3::x(), z: up };
    }
    Frame { origin: point - z * point.dot(&z), x: across.normalize(), z: up }
}

/// Origin and x axis of a frame: the common normal of its axis and the next one.
fn normal(
    (point, z): (Vector3<f64>, Vector3<f64>),
    (next, z_next): (Vector3<f64>, Vector3<f64>),
    foot: Vector3<f64>,
    x: Vector3<f64>,
) -> (Vector3<f64>, Vector3<f64>) {
    let across = z.cross(&z_next);
    let between = next - point;
    if across.norm() > PARALLEL {
        let along = between.cross(&z_next).dot(&across) / across.norm_squared();
        let direction = across.normalize();
        let distance = between.dot(&direction);
        let turned = if distance.abs() > NO_DISTANCE { distance < 0.0 } else { direction.dot(&x) < 0.0 };
        return (point + along * z, if turned { -direction } else { direction });
    }
    let between = next - foot;
    let offset = between - z * between.dot(&z);
    (foot, if offset.norm() > NO_DISTANCE { offset.normalize() } else { x })
}

/// Origin and x axis of the last frame: those of the last link, as far as the axis admits.
fn last(link: &Pose<f64>, (point, z): (Vector3<f64>, Vector3<f64>), x: Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let own = vector(link.attitude.rotate(vec3(1.0, 0.0, 0.0)));
    let own = own - z * own.dot(&z);
    (point, if own.norm() > PARALLEL { own.normalize() } else { x })
}

fn vector(v: Vec3<f64>) -> Vector3<f64> {
    Vector3::new(v.x, v.y, v.z)
}

#[cfg(test)]
mod tests;
