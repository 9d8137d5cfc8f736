//! The robots of a facility for viewers: a URDF, and the transforms of robots, sensor and parts in the laboratory.
//!
//! Joints are in controller coordinates, so that the positions of a JointState are those of the URDF. The root of the
//! tree is the laboratory; `robot_1_part` and `robot_2_part` are the parts as held by the robots.

use crate::arms::Arms;
use crate::signals::{AXES, RAIL};
use softdock_campaign::Station;
use softdock_campaign::station::AxisLimits;
use softdock_kernels::manipulator::cell::Misplaced;
use softdock_kernels::plant::Plant;
use softdock_kernels::segment::Segment;
use softdock_kernels::vector::{Pose, Quat, Vec3, vec3};
use std::fmt::Write;

/// The root frame.
pub const LABORATORY_FRAME: &str = "laboratory";
/// The sensor's frame.
pub const SENSOR_FRAME: &str = "ft_sensor";

/// Robots, sensor and parts of a session, as described in a log.
#[derive(Clone, Debug, PartialEq)]
pub struct LoggedScene {
    /// Both robots as one tree.
    pub urdf: String,
    /// Frames fixed in their parents.
    pub(crate) fixed: Vec<Fixed>,
    /// Frames of the axes of robots 1 and 2: the rail's carriage, then the links.
    pub(crate) moving: [Vec<Moving>; 2],
    /// Pose of robot 1's base in the carriage, and of part A in the last link.
    ends: [Pose<f64>; 2],
}

/// A frame fixed in its parent.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Fixed {
    pub(crate) parent: String,
    pub(crate) child: String,
    pub(crate) pose: Pose<f64>,
}

/// A frame moved by an axis.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Moving {
    pub(crate) parent: String,
    pub(crate) child: String,
    /// Index of the axis in a record: joints from 0, the rail last.
    pub(crate) axis: usize,
    /// Pose at the controller's zero.
    origin: Pose<f64>,
    /// Axis of rotation or translation, in its own axes; zero for a missing rail.
    direction: Vec3<f64>,
}

impl Moving {
    /// Returns the pose in the parent at a position of the axis \[rad\], \[m\].
    pub(crate) fn pose(&self, position: f64) -> Pose<f64> {
        let way = if self.axis == RAIL {
            Pose { position: self.direction * position, attitude: Quat::identity() }
        } else {
            let (sin, cos) = (0.5 * position).sin_cos();
            Pose { position: Vec3::zero(), attitude: Quat { w: cos, v: self.direction * sin } }
        };
        self.origin.compose(way)
    }
}

impl LoggedScene {
    /// Describes the robots of a facility for a scenario's parts; `names` are those of their axes, rail last.
    ///
    /// # Errors
    /// Robot (1 or 2) that cannot hold its part at the scenario's start, and the reason.
    pub fn new(plant: &Plant, station: &Station, names: &[[String; AXES]; 2]) -> Result<Self, (usize, Misplaced)> {
        let arms = Arms::new(plant, station)?;
        let mut urdf = format!("<?xml version=\"1.0\"?>\n<robot name=\"{}\">\n", station.id);
        link(&mut urdf, LABORATORY_FRAME, "");
        let (mut fixed, mut moving) = (Vec::new(), [Vec::new(), Vec::new()]);
        for robot in 0..2 {
            let rail = plant.facility.rail.filter(|_| robot == 0 && station.rail).map(|rail| rail.axis);
            let frames = Robot { station, number: robot, zero: arms.zero(robot), limits: arms.limits(station), rail };
            moving[robot] = frames.moving();
            let of_robot = frames.fixed();
            frames.describe(&mut urdf, &moving[robot], &of_robot, &names[robot]);
            fixed.extend(of_robot);
        }
        urdf += "</robot>\n";
        let mount = &station.robots[0].mount;
        Ok(Self { urdf, fixed, moving, ends: [mount.base, mount.tool] })
    }

    /// Returns part A in the laboratory, from the axes of robot 1.
    pub(crate) fn part_a(&self, position: impl Fn(usize) -> f64) -> Pose<f64> {
        let [base, part] = self.ends;
        let links = self.moving[0].iter().enumerate().fold(Pose::identity(), |at, (place, frame)| {
            let at = at.compose(frame.pose(position(frame.axis)));
            if place == 0 { at.compose(base) } else { at }
        });
        links.compose(part)
    }
}

/// One robot during the construction of a description.
struct Robot<'a> {
    station: &'a Station,
    number: usize,
    zero: [f64; AXES],
    limits: [AxisLimits; AXES],
    /// Direction of its rail in the laboratory.
    rail: Option<Vec3<f64>>,
}

impl Robot<'_> {
    fn name(&self, frame: &str) -> String {
        format!("robot_{}_{frame}", self.number + 1)
    }

    fn moving(&self) -> Vec<Moving> {
        let direction = self.rail.unwrap_or(Vec3::zero());
        let origin = Pose { position: direction * self.zero[RAIL], attitude: Quat::identity() };
        let (parent, child) = (LABORATORY_FRAME.to_owned(), self.name("carriage"));
        let mut moving = vec![Moving { parent, child, axis: RAIL, origin, direction }];
        for (axis, joint) in self.station.model.joints.iter().enumerate() {
            let (sin, cos) = (0.5 * joint.sign * self.zero[axis]).sin_cos();
            let to_zero = Quat { w: cos, v: vec3(0.0, 0.0, sin) };
            let origin = Pose { attitude: joint.link.origin.attitude.compose(to_zero), ..joint.link.origin };
            let parent = if axis == 0 { self.name("base") } else { self.name(&format!("link_{axis}")) };
            let child = self.name(&format!("link_{}", axis + 1));
            moving.push(Moving { parent, child, axis, origin, direction: vec3(0.0, 0.0, joint.sign) });
        }
        moving
    }

    fn fixed(&self) -> Vec<Fixed> {
        let robot = &self.station.robots[self.number];
        let last = self.name(&format!("link_{}", self.station.model.joints.len()));
        let mut rows = vec![
            (self.name("carriage"), self.name("base"), robot.mount.base),
            (last.clone(), self.name("flange"), self.station.model.flange),
            (self.name("flange"), self.name("tool"), robot.tool),
            (last, self.name("part"), robot.mount.tool),
        ];
        if self.number == 0 {
            rows.push((self.name("part"), SENSOR_FRAME.to_owned(), self.station.sensor.frame));
        }
        rows.into_iter().map(|(parent, child, pose)| Fixed { parent, child, pose }).collect()
    }

    /// Writes links and joints.
    fn describe(&self, out: &mut String, moving: &[Moving], fixed: &[Fixed], names: &[String; AXES]) {
        for frame in moving {
            let capsules = self.station.model.capsules.iter().filter(|capsule| capsule.joint == frame.axis);
            let mut visual = capsules.map(|capsule| capsule_visual(&capsule.axis, capsule.radius)).collect::<String>();
            if frame.axis + 1 == self.station.model.joints.len() {
                let robot = &self.station.robots[self.number];
                let axis = Segment { from: Vec3::zero(), to: robot.mount.tool.position };
                visual += &capsule_visual(&axis, robot.tool_radius);
            }
            link(out, &frame.child, &visual);
            self.joint(out, frame, &names[frame.axis]);
        }
        for Fixed { parent, child, pose } in fixed {
            link(out, child, "");
            fixed_joint(out, &format!("{child}_joint"), parent, child, pose);
        }
    }

    fn joint(&self, out: &mut String, frame: &Moving, name: &str) {
        let Moving { parent, child, axis, origin, direction } = frame;
        let slides = *axis == RAIL;
        if slides && self.rail.is_none() {
            // A JointState names seven axes: a robot without a rail has a fixed one.
            return fixed_joint(out, name, parent, child, origin);
        }
        let effort = self.station.model.joints.get(*axis).map_or(0.0, |joint| joint.drive.torque_limit);
        let limit = self.limits[*axis];
        let _ = writeln!(
            out,
            "  <joint name=\"{name}\" type=\"{}\">\n    {}\n    <parent link=\"{parent}\"/>\n    <child link=\"{child}\"/>\n    \
             <axis xyz=\"{}\"/>\n    <limit lower=\"{}\" upper=\"{}\" velocity=\"{}\" effort=\"{effort}\"/>\n  </joint>",
            if slides { "prismatic" } else { "revolute" },
            origin_element(origin),
            numbers(*direction),
            limit.lower,
            limit.upper,
            limit.speed
        );
    }
}

/// Writes a fixed joint.
fn fixed_joint(out: &mut String, name: &str, parent: &str, child: &str, pose: &Pose<f64>) {
    let _ = writeln!(
        out,
        "  <joint name=\"{name}\" type=\"fixed\">\n    {}\n    <parent link=\"{parent}\"/>\n    <child link=\"{child}\"/>\n  \
         </joint>",
        origin_element(pose)
    );
}

/// Writes a link.
fn link(out: &mut String, name: &str, visual: &str) {
    let _ = if visual.is_empty() {
        writeln!(out, "  <link name=\"{name}\"/>")
    } else {
        writeln!(out, "  <link name=\"{name}\">\n{visual}  </link>")
    };
}

/// Returns a capsule as a cylinder with a sphere at each end; empty without a radius.
fn capsule_visual(axis: &Segment<f64>, radius: f64) -> String {
    if radius <= 0.0 {
        return String::new();
    }
    let (way, middle) = (axis.to - axis.from, (axis.from + axis.to) * 0.5);
    let part = |at: Pose<f64>, geometry: String| {
        format!("    <visual>\n      {}\n      <geometry>{geometry}</geometry>\n    </visual>\n", origin_element(&at))
    };
    let sphere =
        |position| part(Pose { position, attitude: Quat::identity() }, format!("<sphere radius=\"{radius}\"/>"));
    if way.norm() < 1e-6 {
        return sphere(middle);
    }
    let cylinder = format!("<cylinder radius=\"{radius}\" length=\"{}\"/>", way.norm());
    part(Pose { position: middle, attitude: z_towards(way) }, cylinder) + &sphere(axis.from) + &sphere(axis.to)
}

/// Returns a rotation of the z axis to a direction.
pub fn z_towards(direction: Vec3<f64>) -> Quat<f64> {
    let to = direction * (1.0 / direction.norm());
    // The half-way rotation; straight down is half a turn about x.
    let (w, v) = (1.0 + to.z, vec3(-to.y, to.x, 0.0));
    if w < 1e-9 { Quat { w: 0.0, v: vec3(1.0, 0.0, 0.0) } } else { Quat { w, v }.normalized() }
}

fn numbers(v: Vec3<f64>) -> String {
    format!("{} {} {}", v.x, v.y, v.z)
}

/// Returns the element `origin` of a pose.
fn origin_element(pose: &Pose<f64>) -> String {
    format!("<origin xyz=\"{}\" rpy=\"{}\"/>", numbers(pose.position), numbers(roll_pitch_yaw(pose.attitude)))
}

/// Returns roll, pitch and yaw about fixed axes, as in URDF \[rad\].
pub fn roll_pitch_yaw(attitude: Quat<f64>) -> Vec3<f64> {
    let m = attitude.normalized().matrix();
    let level = m.x.x.hypot(m.x.y);
    let pitch = (-m.x.z).atan2(level);
    // Straight up or down, roll and yaw have one axis: all of the rotation is roll.
    if level < 1e-9 {
        return vec3((-m.z.y).atan2(m.y.y), pitch, 0.0);
    }
    vec3(m.y.z.atan2(m.z.z), pitch, m.x.y.atan2(m.x.x))
}

#[cfg(test)]
mod tests;
