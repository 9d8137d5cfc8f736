//! The robot model file as written.

use super::scenario::InertiaTable;
use super::{At, Quantities, Quantity};
use schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeMap;

/// An industrial robot: kinematics, links, drives, friction and limits, each with the source of its values.
///
/// The servo loops' gains get a table of their own.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "softdock robot")]
pub(crate) struct RobotFile {
    /// Format and version of this file: "robot/1".
    pub(crate) schema: At<String>,
    /// Name of the robot: letters, digits, - and _.
    pub(crate) id: At<String>,
    /// One line for people.
    pub(crate) title: At<String>,
    /// What the robot as a whole may do.
    pub(crate) workspace: WorkspaceTable,
    /// Joints from the base outwards.
    pub(crate) joint: At<Vec<At<JointTable>>>,
    /// Capsules that enclose the links; default none.
    #[serde(default)]
    pub(crate) capsule: Vec<At<CapsuleTable>>,
    /// Columns of a recording by signal: `"r1.q.1" = { column = "...", unit = "deg" }`.
    #[serde(default)]
    pub(crate) log: BTreeMap<String, At<LogTable>>,
}

/// Limits at the tool.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct WorkspaceTable {
    /// Greatest horizontal distance of the flange from axis 1.
    pub(crate) reach: Quantity,
    /// Rated load at the flange.
    pub(crate) payload: Quantity,
    /// Repeatability, plus or minus.
    pub(crate) repeatability: Quantity,
    /// Where the values come from.
    pub(crate) source: At<String>,
}

/// One joint and the link behind it.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct JointTable {
    /// Name of the joint.
    pub(crate) name: At<String>,
    /// Row of the modified (Craig) Denavit-Hartenberg table.
    pub(crate) kinematics: KinematicsTable,
    /// Mass properties of the link.
    pub(crate) link: At<LinkTable>,
    /// Motor and gear.
    pub(crate) drive: DriveTable,
    /// Friction at the joint's side of the gear.
    pub(crate) friction: FrictionTable,
    /// Counterbalance, if there is one.
    pub(crate) counterweight: Option<CounterweightTable>,
    /// What the joint may do.
    pub(crate) limits: LimitsTable,
}

/// All points within a radius of a line that a link moves.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct CapsuleTable {
    /// Number of the joint that moves the link, from 1.
    pub(crate) joint: At<u64>,
    /// One end of the line, in the link's frame.
    pub(crate) from: Quantities,
    /// The other end.
    pub(crate) to: Quantities,
    /// Radius.
    pub(crate) radius: Quantity,
    /// Where the values come from.
    pub(crate) source: At<String>,
}

/// T = Rx(alpha) Tx(a) Rz(sign q + offset) Tz(d).
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct KinematicsTable {
    /// Along the previous x axis.
    pub(crate) a: Quantity,
    /// About the previous x axis.
    pub(crate) alpha: Quantity,
    /// Along the joint's axis.
    pub(crate) d: Quantity,
    /// Angle of the frame at q = 0.
    pub(crate) offset: Quantity,
    /// 1 or -1.
    pub(crate) sign: Quantity,
    /// Where the values come from.
    pub(crate) source: At<String>,
}

/// Mass properties in the link's frame.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct LinkTable {
    /// Mass.
    pub(crate) mass: Quantity,
    /// Centre of mass in the link's frame.
    pub(crate) com: Quantities,
    /// Inertia about the centre of mass, link axes.
    pub(crate) inertia: At<InertiaTable>,
    /// Where the values come from.
    pub(crate) source: At<String>,
}

/// Motor and gear; stiffness, damping, backlash and torques at the joint's side.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct DriveTable {
    /// Motor angle per joint angle.
    pub(crate) gear_ratio: Quantity,
    /// Inertia of rotor and gear input at the motor's side.
    pub(crate) rotor_inertia: Quantity,
    /// Torsional stiffness of the gear.
    pub(crate) gear_stiffness: Quantity,
    /// Torsional damping of the gear.
    pub(crate) gear_damping: Quantity,
    /// Whole backlash; default zero.
    pub(crate) backlash: Option<Quantity>,
    /// Torque reported at rest without load; default zero.
    pub(crate) torque_offset: Option<Quantity>,
    /// Greatest torque of the motor.
    pub(crate) torque_limit: Quantity,
    /// Rated gravity torque; zero without one.
    pub(crate) static_torque: Quantity,
    /// Where the values come from.
    pub(crate) source: At<String>,
}

/// z (F_c + F_s exp(-|v| / v_s) + mu |load|) + F_v v, with the presliding state z.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct FrictionTable {
    /// Coulomb friction.
    pub(crate) coulomb: Quantity,
    /// Viscous friction.
    pub(crate) viscous: Quantity,
    /// Static friction beyond Coulomb's; default zero.
    pub(crate) stribeck: Option<Quantity>,
    /// Speed at which the static part has fallen to 1/e; default "0.02 rad/s".
    pub(crate) stribeck_speed: Option<Quantity>,
    /// Stiffness before sliding.
    pub(crate) presliding_stiffness: Quantity,
    /// Coulomb friction per transmitted torque; default zero.
    pub(crate) load_coefficient: Option<Quantity>,
    /// Where the values come from.
    pub(crate) source: At<String>,
}

/// Torque on the joint: -torque sin(q - angle).
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct CounterweightTable {
    /// Greatest torque.
    pub(crate) torque: Quantity,
    /// Joint angle at which it pushes neither way.
    pub(crate) angle: Quantity,
    /// Where the values come from.
    pub(crate) source: At<String>,
}

/// Limits of a joint.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct LimitsTable {
    /// Least angle.
    pub(crate) lower: Quantity,
    /// Greatest angle.
    pub(crate) upper: Quantity,
    /// Greatest speed.
    pub(crate) speed: Quantity,
    /// Greatest acceleration.
    pub(crate) acceleration: Quantity,
    /// Where the values come from.
    pub(crate) source: At<String>,
}

/// A column of a recording: value = scale * column + offset.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct LogTable {
    /// Name of the column.
    pub(crate) column: At<String>,
    /// Unit of the column.
    pub(crate) unit: At<String>,
    /// Factor on the column; default 1.
    pub(crate) scale: Option<Quantity>,
    /// Added after the factor, with its own unit; default zero.
    pub(crate) offset: Option<Quantity>,
}
