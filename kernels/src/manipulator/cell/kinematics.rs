//! A robot in its place as the drive path needs it: axes in the robot's own angles, and the part that they hold.

use super::controller::{course, weight};
use super::reach::{Reach, tool_pose};
use super::{AXES, Cell, JOINTS, RAIL, joints};
use crate::manipulator::link_frames;
use crate::space::Motion;
use crate::vector::{Pose, Vec3};

/// Positions and rates of the axes: the joints in the model's own angles \[rad, rad/s\], then the rail \[m, m/s\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axes {
    /// Positions.
    pub position: [f64; AXES],
    /// Rates.
    pub rate: [f64; AXES],
}

impl Cell {
    /// The axes that hold the part in a motion (laboratory), and whether that is within reach and ranges.
    pub fn axes_for(&self, reference: &Motion<f64>) -> (Axes, bool) {
        let course = course(self, reference);
        let mut position = course.angle;
        position.iter_mut().zip(self.start).for_each(|(angle, start)| *angle += start);
        (Axes { position, rate: course.rate }, course.limited <= 0.0)
    }

    /// Motion of the part that the axes hold, laboratory, the rail's included.
    pub fn part_on(&self, axes: &Axes) -> Motion<f64> {
        let angle = self.angles_from_start(&axes.position);
        let pose = tool_pose(self, angle);
        let (velocity, omega) = Reach::at(self, angle).twist(joints(axes.rate));
        let along = self.rail.as_ref().map_or(Vec3::zero(), |(rail, _)| rail.axis);
        let to_laboratory = self.to_chain.conjugate();
        Motion {
            position: along.scale_add(axes.position[RAIL], pose.position),
            attitude: pose.attitude,
            velocity: along.scale_add(axes.rate[RAIL], to_laboratory.rotate(velocity)),
            omega: to_laboratory.rotate(omega),
        }
    }

    /// Pose of the flange in the robot's base, whatever the rail does.
    pub fn flange(&self, position: &[f64; AXES]) -> Pose<f64> {
        let frames = link_frames(&self.robot, self.angles_from_start(position));
        frames[JOINTS - 1].compose(self.robot.flange)
    }

    /// Torques that the gears carry of the robot's weight and its load's, less the counterbalances \[N m\].
    pub fn weight_torques(&self, position: &[f64; AXES]) -> [f64; JOINTS] {
        let mut angle = [0.0; AXES];
        angle[..JOINTS].copy_from_slice(&self.angles_from_start(position));
        joints(weight(self, angle))
    }

    /// Limits of an axis in the robot's own angles; the rail's if there is one.
    pub fn limits(&self, index: usize) -> Option<crate::manipulator::JointLimits> {
        (index < self.axes()).then(|| self.axis(index).joint.limits)
    }

    /// The axes at the start of an undispersed run.
    pub fn home(&self) -> [f64; AXES] {
        let mut home = [0.0; AXES];
        home[..JOINTS].copy_from_slice(&self.start);
        home
    }

    /// Joint angles counted from the start posture.
    pub(super) fn angles_from_start(&self, position: &[f64; AXES]) -> [f64; JOINTS] {
        std::array::from_fn(|i| position[i] - self.start[i])
    }
}
