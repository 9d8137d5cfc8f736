//! The facility file of the drive path, as written: the real robots, their limits, the sensor, when to stop.

use super::joint_level::MountTable;
use super::{At, Quantities, Quantity};
use schemars::JsonSchema;
use serde::Deserialize;

/// The real robots and the sensor of a facility, and what they may do when softdock drives them.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "softdock facility")]
pub(crate) struct StationFile {
    /// Format and version of this file: "facility/2".
    pub(crate) schema: At<String>,
    /// Name of the facility: letters, digits, - and _.
    pub(crate) id: At<String>,
    /// One line for people.
    pub(crate) title: At<String>,
    /// Robot model file of both robots, relative to this file.
    pub(crate) robot: At<String>,
    /// The joints of both robots.
    pub(crate) joints: JointsTable,
    /// The rail under robot 1, if there is one.
    pub(crate) rail: Option<RailTable>,
    /// Robot 1, which holds part A and the sensor.
    pub(crate) robot1: RobotTable,
    /// Robot 2, which holds part B.
    pub(crate) robot2: RobotTable,
    /// The force/torque sensor between robot 1's flange and part A.
    pub(crate) sensor: SensorTable,
    /// When a session is stopped or over.
    pub(crate) safety: SafetyTable,
}

/// How the controllers count joint angles, and how fast the joints may move; lists from joint 1 to 6.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct JointsTable {
    /// Angle of the robot model at the controller's zero; default zero.
    pub(crate) zero: Option<Quantities>,
    /// Distance that is kept from the ends of the model's ranges; default 1 degree.
    pub(crate) margin: Option<Quantity>,
    /// Greatest speeds; at most the model's.
    pub(crate) speed: Quantities,
    /// Greatest accelerations.
    pub(crate) acceleration: Quantities,
    /// Greatest jerks.
    pub(crate) jerk: Quantities,
}

/// The rail's place on its controller and its limits.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct RailTable {
    /// Position on the rail, in its controller's count, at which robot 1's base is as stated; default zero.
    pub(crate) zero: Option<Quantity>,
    /// Least place, counted from there.
    pub(crate) lower: Quantity,
    /// Greatest place, counted from there.
    pub(crate) upper: Quantity,
    /// Greatest speed.
    pub(crate) speed: Quantity,
    /// Greatest acceleration.
    pub(crate) acceleration: Quantity,
    /// Greatest jerk.
    pub(crate) jerk: Quantity,
}

/// One robot: its identity and its place.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct RobotTable {
    /// Name or serial number, as on its plate.
    pub(crate) name: At<String>,
    /// IP address that its controller sends from, or the network interface of its EtherCAT segment.
    pub(crate) address: Option<At<String>>,
    /// Its base and its part.
    pub(crate) mount: At<MountTable>,
    /// Tool frame of its controller, in the flange: the pose that it reports is this frame's in its base.
    pub(crate) tool_position: Option<Quantities>,
    /// Rotation of that frame, as roll, pitch, yaw.
    pub(crate) tool_rotation: Option<Quantities>,
    /// Greatest way of a joint from where the session begins; default 30 degrees.
    pub(crate) correction: Option<Quantity>,
    /// Radius of what it holds, about the line from its last link's frame to the part's origin; default zero: that line alone.
    pub(crate) tool_radius: Option<Quantity>,
    /// Its drives, if it is an EtherCAT segment.
    pub(crate) ethercat: Option<EtherCatTable>,
}

/// The drives of an EtherCAT segment; lists from axis 1 on, a seventh entry is the rail.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct EtherCatTable {
    /// Counts of the drives' positions per radian of the joint, per metre of the rail; negative where they count backwards.
    pub(crate) counts: At<Vec<f64>>,
    /// Counts where the controller's angle is zero; default 0.
    pub(crate) zero: Option<At<Vec<i32>>>,
}

/// The sensor's frame and load.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct SensorTable {
    /// Serial number that the sensor must state; without it any sensor is taken.
    pub(crate) serial: Option<At<String>>,
    /// Origin of the sensor's frame in part A's frame.
    pub(crate) position: Option<Quantities>,
    /// Rotation of the sensor's axes in part A's frame, as roll, pitch, yaw.
    pub(crate) rotation: Option<Quantities>,
    /// Mass that hangs on the sensor: part A and its holder.
    pub(crate) tool_mass: Quantity,
    /// Its centre of mass in the sensor's frame.
    pub(crate) tool_centre: Quantities,
    /// Greatest force that the sensor may read at rest beside the tool's weight; default 100 N.
    pub(crate) bias: Option<Quantity>,
    /// Greatest moment that it may read at rest beside the tool's weight; default 10 N m.
    pub(crate) bias_moment: Option<Quantity>,
    /// Angle by which a session on the robots turns the tool to weigh it in a second attitude, 0 for never; default 15 deg.
    pub(crate) weighing_turn: Option<Quantity>,
    /// Greatest change of the force there beyond that of the tool's weight; default 5 N.
    pub(crate) weighing: Option<Quantity>,
    /// Greatest change of the moment there beyond that of the tool's weight; default 1 N m.
    pub(crate) weighing_moment: Option<Quantity>,
    /// Measured force above which the parts count as touching; default 5 N.
    pub(crate) touch_force: Option<Quantity>,
}

/// When a session is stopped or over. Its rules up to `clamp_time` have no default: each can decide what a session answers.
/// Those of the workspace behind it are off unless they are written.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct SafetyTable {
    /// Cycles in a row, lost or with an answer that the robot has not taken, over which the last command is held; default 3.
    pub(crate) hold_cycles: Option<At<u64>>,
    /// Lost cycles in a row after which the link counts as dead; default 10.
    pub(crate) stop_cycles: Option<At<u64>>,
    /// Span in which such cycles are counted; default 1 s.
    pub(crate) window: Option<Quantity>,
    /// Most of them in a window; default 10.
    pub(crate) window_cycles: Option<At<u64>>,
    /// Longest time for which a robot is led back to its commands after such cycles; default 0.1 s.
    pub(crate) catch_up: Option<Quantity>,
    /// Greatest distance of a robot's tool from its command at rest; default 3 mm.
    pub(crate) tracking: Option<Quantity>,
    /// Greatest angle between a robot's tool and its command at rest; default 0.5 deg.
    pub(crate) tracking_rotation: Option<Quantity>,
    /// How late a robot may be: what both may grow by for each unit of commanded speed; default 0.25 s.
    pub(crate) tracking_time: Option<Quantity>,
    /// Greatest overlap of the parts, by the robots' own reports, without a touch force; default 4 mm.
    pub(crate) blind_overlap: Option<Quantity>,
    /// Distance of the parts from which on no more than `free_force` is plausible; default 20 mm.
    pub(crate) free_distance: Option<Quantity>,
    /// Greatest force that is plausible while the parts are apart; default 50 N.
    pub(crate) free_force: Option<Quantity>,
    /// Torque of each joint beyond what weight and measured force explain, at which a session stops; without it torques are
    /// not compared. Above twice the Coulomb friction of the joint.
    pub(crate) torque: Option<Quantities>,
    /// Time for which a torque may be beyond that; default 50 ms.
    pub(crate) torque_time: Option<Quantity>,
    /// Greatest age of a sensor sample; default 5 ms.
    pub(crate) sensor_age: Option<Quantity>,
    /// Whether a session ends with a controlled stop when the latch closes.
    pub(crate) end_at_capture: bool,
    /// Greatest measured force.
    pub(crate) force: Quantity,
    /// Greatest measured moment about part A's origin.
    pub(crate) moment: Quantity,
    /// Greatest change of the measured force from cycle to cycle.
    pub(crate) force_rate: Quantity,
    /// Whether a saturated channel of the sensor stops the session.
    pub(crate) sensor_saturation: bool,
    /// Greatest energy injected by the facility.
    pub(crate) injected_energy: Quantity,
    /// Greatest distance of a tool from its command.
    pub(crate) following_error: Quantity,
    /// Greatest angle between a tool and its command.
    pub(crate) following_rotation: Quantity,
    /// Greatest distance of a commanded tool from the start of the run.
    pub(crate) tool_reach: Quantity,
    /// Greatest angle of a commanded tool from the start of the run.
    pub(crate) tool_rotation: Quantity,
    /// Time during which commands may be cut without a pause.
    pub(crate) clamp_time: Quantity,
    /// Greatest speed of a commanded tool.
    pub(crate) tool_speed: Option<Quantity>,
    /// Least distance between the arms, by the capsules of their robot model, without the links that hold the parts.
    pub(crate) arm_distance: Option<Quantity>,
    /// Least angle of a commanded posture from the singular ones: bend of the wrist (axis 5), bend of the elbow, and the angle
    /// from axis 1 at which the stretched arm would have the wrist's centre as far from that axis.
    pub(crate) singularity: Option<Quantity>,
    /// Boxes of the laboratory that no link and no tool may enter; 4 at most.
    #[serde(default)]
    pub(crate) keep_out: Vec<At<KeepOutTable>>,
}

/// A box, by two corners along the laboratory's axes, or by centre, size and rotation.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct KeepOutTable {
    /// Its name: letters, digits, - and _.
    pub(crate) name: At<String>,
    /// The corner with the least coordinates.
    pub(crate) min: Option<Quantities>,
    /// The corner with the greatest ones.
    pub(crate) max: Option<Quantities>,
    /// Its centre, in the place of corners.
    pub(crate) centre: Option<Quantities>,
    /// Its edge lengths.
    pub(crate) size: Option<Quantities>,
    /// Its rotation, as roll, pitch, yaw; default none.
    pub(crate) rotation: Option<Quantities>,
}
