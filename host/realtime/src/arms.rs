//! The robots of a facility: kinematics between controller axes and the parts that the robots hold.

use crate::signals::{AXES, RAIL};
use softdock_campaign::Station;
use softdock_campaign::station::AxisLimits;
use softdock_kernels::manipulator::cell::{Axes, Cell, Misplaced};
use softdock_kernels::model::Rail;
use softdock_kernels::plant::{Plant, place};
use softdock_kernels::space::{Motion, Parts, Wrench};
use softdock_kernels::vector::Pose;

/// Both robots, with the zeros of their controllers.
#[derive(Clone, Debug)]
pub struct Arms {
    cells: [Cell; 2],
    /// Model axes at the controllers' zeros.
    zero: [[f64; AXES]; 2],
    tools: [Pose<f64>; 2],
    /// The rail under robot 1.
    rail: Option<Rail>,
}

impl Arms {
    /// Creates the robots of a facility for a scenario's parts.
    ///
    /// # Errors
    /// Robot (1 or 2) that cannot hold its part at the scenario's start, and the reason.
    pub fn new(plant: &Plant, station: &Station) -> Result<Self, (usize, Misplaced)> {
        let level = station.joint_level();
        let tools = [station.robots[0].tool, station.robots[1].tool];
        // Only robot 1 has the rail.
        let mut second = station.zero;
        second[RAIL] = 0.0;
        Ok(Self { cells: place(plant, &level)?, zero: [station.zero, second], tools, rail: plant.facility.rail })
    }

    /// Returns the controller axes of robot 0 or 1 that hold its part in a motion, and whether the pose is reachable.
    pub fn axes_for(&self, robot: usize, motion: &Motion<f64>) -> (Axes, bool) {
        let (axes, reachable) = self.cells[robot].axes_for(motion);
        (Axes { position: std::array::from_fn(|i| axes.position[i] - self.zero[robot][i]), ..axes }, reachable)
    }

    /// Returns the controller axes of robot 0 or 1 that hold its part in a motion with its rail at a position \[m\], in
    /// the posture of the scenario's start. `None` where the rail makes the whole motion.
    pub fn axes_on_rail(&self, robot: usize, motion: &Motion<f64>, place: f64) -> Option<[f64; AXES]> {
        let Some(Rail { axis, share }) = self.rail.filter(|_| robot == 0) else {
            return Some(self.axes_for(robot, motion).0.position);
        };
        let (along, on_rail) = (axis.dot(motion.position), place + self.zero[robot][RAIL]);
        // The controller of a run gives its rail a share of the motion; for this other pose of the part, the share is
        // this.
        let asked = (along - on_rail) / (1.0 - share);
        if !asked.is_finite() {
            return None;
        }
        let motion = Motion { position: axis.scale_add(asked - along, motion.position), ..*motion };
        let mut found = self.axes_for(robot, &motion).0.position;
        found[RAIL] = place;
        Some(found)
    }

    /// Returns the axes of both robots.
    pub fn positions_for(&self, parts: &Parts<f64>) -> ([[f64; AXES]; 2], bool) {
        let ((a, first), (b, second)) = (self.axes_for(0, &parts.a), self.axes_for(1, &parts.b));
        ([a.position, b.position], first && second)
    }

    /// Returns the motion of a robot's part, laboratory.
    pub fn part_on(&self, robot: usize, position: &[f64; AXES], rate: &[f64; AXES]) -> Motion<f64> {
        self.cells[robot].part_on(&Axes { position: self.in_model(robot, position), rate: *rate })
    }

    /// Returns the motions of both parts.
    pub fn parts_on(&self, position: &[[f64; AXES]; 2], rate: &[[f64; AXES]; 2]) -> Parts<f64> {
        Parts { a: self.part_on(0, &position[0], &rate[0]), b: self.part_on(1, &position[1], &rate[1]) }
    }

    /// Returns the pose of the controller's tool frame in the robot's base, as the robot itself should report it.
    pub fn tool_pose(&self, robot: usize, position: &[f64; AXES]) -> Pose<f64> {
        self.cells[robot].flange(&self.in_model(robot, position)).compose(self.tools[robot])
    }

    /// Returns the joint torques of a robot at rest from its weight and a wrench on its part (about the part's origin,
    /// laboratory axes) \[N m\].
    ///
    /// The contact's share is virtual work: the power of the wrench on the part's motion at unit rate of a joint.
    pub fn torques(&self, robot: usize, position: &[f64; AXES], on_part: Wrench<f64>) -> [f64; RAIL] {
        let weight = self.cells[robot].weight_torques(&self.in_model(robot, position));
        std::array::from_fn(|i| {
            let mut rate = [0.0; AXES];
            rate[i] = 1.0;
            let motion = self.part_on(robot, position, &rate);
            weight[i] - on_part.force.dot(motion.velocity) - on_part.moment.dot(motion.omega)
        })
    }

    /// Returns the limits in controller coordinates; the rail is robot 1's.
    pub fn limits(&self, station: &Station) -> [AxisLimits; AXES] {
        std::array::from_fn(|i| {
            let model = station.limits[i];
            AxisLimits { lower: model.lower - self.zero[0][i], upper: model.upper - self.zero[0][i], ..model }
        })
    }

    /// Returns the model axes at a robot's controller zeros.
    pub fn zero(&self, robot: usize) -> [f64; AXES] {
        self.zero[robot]
    }

    /// Converts controller axes of a robot to model axes.
    pub fn in_model(&self, robot: usize, position: &[f64; AXES]) -> [f64; AXES] {
        std::array::from_fn(|i| position[i] + self.zero[robot][i])
    }
}
