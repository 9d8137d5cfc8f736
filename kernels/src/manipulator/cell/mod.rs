//! One industrial robot in its place in the laboratory: constants prepared, and the stages that command and drive it.
//!
//! Joint angles count from the start posture, and the tool's place from its start, so that f32 does not freeze: the
//! tool moves by a product of screws about the joint axes of the start posture, each written as a small change.

mod capsules;
mod controller;
mod drives;
mod kinematics;
mod reach;

pub(crate) use capsules::{Extent, Links, links, links_at, wrapped};
pub use controller::{Commanded, commanded, commanded_axes, first_set_point, set_point};
pub use drives::{drive, drives_at, held_part};
pub use kinematics::Axes;

use super::drive::Axis;
use super::{
    Arm, Branch, Joint, JointState, Manipulator, SphericalWrist, VelocityLoop, best_posture, joint_axis, link_frames,
    turn,
};
use crate::bundle;
use crate::chain::clean;
use crate::effects::EffectSet;
use crate::model::Rail;
use crate::vector::{Pose, Quat, Vec3, vec3};

/// Joints of a robot with a spherical wrist.
const JOINTS: usize = 6;
/// Axes that a controller drives: the joints and, last, the rail; a robot without a rail leaves that one at rest.
pub const AXES: usize = JOINTS + 1;
/// The rail among the axes; metres and newtons there.
pub const RAIL: usize = JOINTS;

bundle! {
    /// One robot's joints and its rail; written by the drive stage.
    Drives {
        axis: [JointState<R>; AXES], "1", "axis: the joints, then the rail (m and N for rad and N m)";
        limited: R, "1", "1 once a torque, speed, acceleration or range limit was met";
    }
}

bundle! {
    /// Set point of a robot's controller for a tick; written by the set-point stage.
    SetPoint {
        angle: [R; AXES], "rad", "commanded joint angles, from the start posture, and place on the rail (m)";
        rate: [R; AXES], "rad/s", "commanded rates";
        speed: [R; AXES], "rad/s", "motor speed that the position loops ask for";
        torque: [R; AXES], "N m", "torque of the feedforward";
        age: R, "s", "time since the drives were switched on, at the next set-point", of "J6_temperature";
        cold: R, "1", "remaining share of the cold drives' additional friction, 1 to 0", of "J6_temperature";
        sag: [R; AXES], "rad", "windup of the gears under the weight at the start, which the start's alignment takes out";
        limited: R, "1", "1 once a command was out of reach, near a singular posture or beyond a limit";
    }
}

/// What the controller adds to the velocity loop's torque.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feedforward {
    /// Nothing.
    Off,
    /// The torque that carries the robot's weight at the commanded posture.
    Gravity,
    /// All torques of the commanded motion: inertia, weight, friction.
    Full,
}

/// What a robot carries, fixed to its flange.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Payload {
    /// Mass \[kg\].
    pub mass: f64,
    /// Centre of mass in the part's frame \[m\].
    pub com: Vec3<f64>,
    /// Inertia about the centre of mass, part axes \[kg m^2\].
    pub inertia: crate::vector::Sym3<f64>,
}

/// Where a robot stands and what it holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mount {
    /// Pose of the robot's base in the laboratory.
    pub base: Pose<f64>,
    /// Pose of the contact part in the last link's frame.
    pub tool: Pose<f64>,
    /// The contact part and what holds it.
    pub payload: Payload,
}

/// The controllers of a robot's joints.
#[derive(Clone, Debug, PartialEq)]
pub struct Servo {
    /// Velocity loop of each joint.
    pub velocity: [VelocityLoop; JOINTS],
    /// What the controller adds.
    pub feedforward: Feedforward,
}

/// The carriage of a rail, driven as a joint is: metres for radians, newtons for newton metres.
#[derive(Clone, Debug, PartialEq)]
pub struct Carriage {
    /// Its mass without the robot as the link's, its drive, friction and limits.
    pub joint: Joint,
    /// Its velocity loop \[N s/m\].
    pub velocity: VelocityLoop,
}

/// A robot prepared for its stages.
#[derive(Clone, Debug)]
pub struct Cell {
    /// The robot with its payload; its link frames at joint angle 0 are those of the start posture.
    robot: Manipulator,
    /// The same as a chain.
    arm: Arm,
    wrist: SphericalWrist,
    branch: Branch,
    /// Start posture, in the robot's own angles \[rad\].
    pub start: [f64; JOINTS],
    servo: Servo,
    /// The rail under the robot, and what runs on it.
    rail: Option<(Rail, Carriage)>,
    base_inverse: Pose<f64>,
    /// From the laboratory's axes to the chain's at its base.
    to_chain: Quat<f64>,
    tool_inverse: Pose<f64>,
    /// Pose of the part at the start posture, laboratory.
    home: Pose<f64>,
    /// Joint axes at the start posture and the levers from them to the part, laboratory.
    screws: [(Vec3<f64>, Vec3<f64>); JOINTS],
    /// Command period and substep \[s\].
    tick: f64,
    substep: f64,
    /// The effects that a run may have.
    pub(crate) effects: EffectSet,
}

/// Why a robot cannot stand where it is put.
#[derive(Clone, Debug, PartialEq)]
pub enum Misplaced {
    /// Not six joints with a spherical wrist.
    NoWrist,
    /// No posture inside the joints' ranges reaches the start.
    OutOfReach,
}

impl Cell {
    /// A robot whose part starts at `home` (laboratory).
    ///
    /// # Errors
    /// If the robot's wrist is not spherical or its joints cannot reach the start.
    pub fn new(
        robot: &Manipulator,
        mount: &Mount,
        servo: &Servo,
        rail: Option<(Rail, Carriage)>,
        home: Pose<f64>,
        timing: &crate::model::Timing,
    ) -> Result<Self, Misplaced> {
        let wrist = SphericalWrist::of(robot).ok_or(Misplaced::NoWrist)?;
        let (base_inverse, tool_inverse) = (mount.base.inverse(), mount.tool.inverse());
        let frame6 = base_inverse.compose(home).compose(tool_inverse);
        let (branch, start) = best_posture(robot, &wrist, frame6).ok_or(Misplaced::OutOfReach)?;
        let mut robot = robot.clone();
        for (joint, angle) in robot.joints.iter_mut().zip(start) {
            let turned = turn(vec3(0.0, 0.0, 1.0), joint.sign * angle);
            joint.link.origin.attitude = joint.link.origin.attitude.compose(turned);
        }
        carry(&mut robot, mount);
        let frames = link_frames(&robot, [0.0; JOINTS]);
        let screws = std::array::from_fn(|i| {
            let axis = mount.base.attitude.rotate(joint_axis(frames[i], robot.joints[i].sign));
            (axis, home.position - mount.base.compose(frames[i]).position)
        });
        let arm = Arm::new(&robot, mount.tool);
        Ok(Self {
            robot,
            to_chain: arm.from_base.compose(base_inverse.attitude),
            arm,
            wrist,
            branch,
            start,
            servo: servo.clone(),
            rail,
            base_inverse,
            tool_inverse,
            home,
            screws,
            tick: timing.tick(),
            substep: timing.substep,
            effects: EffectSet::ALL,
        })
    }

    /// Torques that the gears carry of the robot's weight and its load's at the start posture \[N m\].
    pub fn start_torques(&self) -> [f64; JOINTS] {
        joints(controller::weight(self, [0.0; AXES]))
    }

    /// Horizontal distance of the tool from axis 1 at the start posture \[m\].
    pub fn start_distance(&self) -> f64 {
        let part = self.base_inverse.compose(self.home).position;
        part.x.hypot(part.y)
    }

    /// Angle of a joint's frame from the one before it, at an angle of the joint from the start posture \[rad\].
    pub(crate) fn frame_angle(&self, joint: usize, from_start: f64) -> f64 {
        self.wrist.frame_angle(joint, self.start[joint] + from_start)
    }

    /// How many axes there are: 6, or 7 on a rail.
    pub(crate) fn axes(&self) -> usize {
        JOINTS + usize::from(self.rail.is_some())
    }

    /// Constants of an axis.
    fn axis(&self, index: usize) -> Axis<'_> {
        let (joint, servo, start) = match &self.rail {
            Some((_, carriage)) if index == RAIL => (&carriage.joint, &carriage.velocity, 0.0),
            _ => (&self.robot.joints[index], &self.servo.velocity[index], self.start[index]),
        };
        Axis { joint, servo, start, substep: self.substep, effects: self.effects }
    }

    /// Direction of the rail in the chain's axes at its base, and the mass of its carriage \[kg\]; zero without a rail.
    fn track(&self) -> (Vec3<f64>, f64) {
        let still = (Vec3::splat(0.0), 0.0);
        let track = |(rail, carriage): &(Rail, Carriage)| {
            (self.to_chain.rotate(rail.axis).map(clean), carriage.joint.link.mass)
        };
        self.rail.as_ref().map_or(still, track)
    }
}

/// Adds the payload to the last link.
fn carry(robot: &mut Manipulator, mount: &Mount) {
    let last = &mut robot.joints.last_mut().expect("six joints").link;
    let (payload, tool) = (&mount.payload, mount.tool);
    let com = tool.position + tool.attitude.rotate(payload.com);
    let mass = last.mass + payload.mass;
    let middle = (last.com * last.mass + com * payload.mass) * (1.0 / mass);
    let own = last.inertia + crate::vector::Sym3::point_mass(last.mass, last.com - middle);
    let carried =
        payload.inertia.rotated(tool.attitude.matrix()) + crate::vector::Sym3::point_mass(payload.mass, com - middle);
    (last.mass, last.com, last.inertia) = (mass, middle, own + carried);
}

/// The joints among the axes; no closure, since in lanes the compiler need not inline one.
#[inline(always)]
fn joints<R>([a, b, c, d, e, f, _]: [R; AXES]) -> [R; JOINTS] {
    [a, b, c, d, e, f]
}
