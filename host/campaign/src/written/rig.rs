//! The model file of a bench rig as written: what is measured on it, what is known of it, and how well.

use super::effect::EffectTable;
use super::robot::LogTable;
use super::{At, Quantity};
use schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeMap;

mod body;
mod command;
mod contact;
mod robot;
mod sensor;
mod toss;

pub(crate) use body::BodyTable;
pub(crate) use command::CommandTable;
pub(crate) use contact::ContactTable;
pub(crate) use robot::RobotTable;
pub(crate) use sensor::SensorTable;
pub(crate) use toss::TossTable;

/// The model of a bench rig, for diagnosis.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "softdock rig")]
pub(crate) struct RigFile {
    /// Format and version of this file: "rig/1".
    pub(crate) schema: At<String>,
    /// What the rig is: "drive", "robot", "sensor", "contact", "command", "body" or "toss".
    pub(crate) kind: At<String>,
    /// Name of the rig: letters, digits, - and _.
    pub(crate) id: At<String>,
    /// One line for people.
    pub(crate) title: Option<At<String>>,
    /// The joint's drive, on a rig of kind "drive".
    pub(crate) drive: Option<At<DriveTable>>,
    /// The drive's controller, if its law is known.
    pub(crate) controller: Option<At<ControllerTable>>,
    /// The robot, on a rig of kind "robot".
    pub(crate) robot: Option<At<RobotTable>>,
    /// The force/torque sensor with its tool, on a rig of kind "sensor".
    pub(crate) sensor: Option<At<SensorTable>>,
    /// The contact, on a rig of kind "contact".
    pub(crate) contact: Option<At<ContactTable>>,
    /// The command's way, on a rig of kind "command".
    pub(crate) command: Option<At<CommandTable>>,
    /// The free body, on a rig of kind "body".
    pub(crate) body: Option<At<BodyTable>>,
    /// The tossed body, on a rig of kind "toss".
    pub(crate) toss: Option<At<TossTable>>,
    /// One standard deviation of what may differ from the model unnoticed; what is not named is known exactly.
    #[serde(default)]
    pub(crate) tolerance: ToleranceTable,
    /// Effects that a diagnosis found, and that the model has from now on.
    #[serde(default)]
    pub(crate) effect: Vec<EffectTable>,
    /// Columns of a recording by signal: `"q" = { column = "...", unit = "deg" }`.
    #[serde(default)]
    pub(crate) log: BTreeMap<String, At<LogTable>>,
}

/// One joint with its drive, all at the joint's side of the gear; a prismatic joint has m, N and kg.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct DriveTable {
    /// "revolute" or "prismatic".
    pub(crate) motion: At<String>,
    /// Inertia of rotor and gear input.
    pub(crate) motor_inertia: Quantity,
    /// Inertia of the link; default none.
    pub(crate) link_inertia: Option<Quantity>,
    /// Coulomb friction; default none.
    pub(crate) coulomb: Option<Quantity>,
    /// Viscous friction; default none.
    pub(crate) viscous: Option<Quantity>,
    /// Static friction beyond Coulomb's; default none.
    pub(crate) stribeck: Option<Quantity>,
    /// Speed at which the static part has fallen to 1/e; default a hundredth of the greatest measured.
    pub(crate) stribeck_speed: Option<Quantity>,
    /// Travel in which friction comes 1/e closer to sliding; default 1e-4.
    pub(crate) presliding_travel: Option<Quantity>,
    /// Weight: this torque times the cosine of the angle from `gravity_angle` (of a prismatic joint: a constant force).
    pub(crate) gravity_torque: Option<Quantity>,
    /// Angle at which the weight's torque is greatest; default zero.
    pub(crate) gravity_angle: Option<Quantity>,
    /// Distance of the payload from the axis; default 1 m.
    pub(crate) payload_radius: Option<Quantity>,
    /// Stiffness of the gear; default rigid.
    pub(crate) gear_stiffness: Option<Quantity>,
    /// Damping ratio of the link on its gear; default 5 %.
    pub(crate) gear_damping: Option<Quantity>,
    /// Whole backlash of the gear; default none.
    pub(crate) backlash: Option<Quantity>,
    /// Time constant of the current loop; default none.
    pub(crate) current_lag: Option<Quantity>,
    /// Greatest torque of the motor; default unlimited.
    pub(crate) torque_limit: Option<Quantity>,
    /// Torque that the drive reports without giving it; default zero.
    pub(crate) offset: Option<Quantity>,
}

/// Proportional and derivative control with feedforward, sampled.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ControllerTable {
    /// Period.
    pub(crate) period: Quantity,
    /// Torque per position error.
    pub(crate) position_gain: Quantity,
    /// Torque per rate error.
    pub(crate) velocity_gain: Quantity,
    /// Cut-off of the low-pass on the measured rate; default none.
    pub(crate) derivative_filter: Option<Quantity>,
    /// Greatest commanded torque; default unlimited.
    pub(crate) torque_limit: Option<Quantity>,
    /// What is added from the reference's motion; default nothing.
    pub(crate) feedforward: Option<FeedforwardTable>,
}

/// `inertia ref'' + viscous ref' + coulomb tanh(ref' / coulomb_speed) + gravity_torque cos(ref - gravity_angle)`.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct FeedforwardTable {
    /// Torque per acceleration.
    pub(crate) inertia: Option<Quantity>,
    /// Torque per rate.
    pub(crate) viscous: Option<Quantity>,
    /// Torque against Coulomb friction.
    pub(crate) coulomb: Option<Quantity>,
    /// Speed over which it changes its sign; default at once.
    pub(crate) coulomb_speed: Option<Quantity>,
    /// Torque against the weight.
    pub(crate) gravity_torque: Option<Quantity>,
    /// Angle at which that is greatest.
    pub(crate) gravity_angle: Option<Quantity>,
}

/// Standard deviations; a drive's sizes as a share of the value, the rest in the value's unit.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ToleranceTable {
    /// Sensor or contact: force read without any, each axis.
    pub(crate) bias_force: Option<Quantity>,
    /// Sensor: moment read without any, each axis.
    pub(crate) bias_moment: Option<Quantity>,
    /// Sensor: gain of all channels alike.
    pub(crate) gain: Option<Quantity>,
    /// Sensor: mass of the tool.
    pub(crate) tool_mass: Option<Quantity>,
    /// Sensor or command: share of the noise; default 10 %.
    pub(crate) noise: Option<Quantity>,
    /// Contact or toss: share of the stiffness.
    pub(crate) stiffness: Option<Quantity>,
    /// Contact: share of the damping.
    pub(crate) damping: Option<Quantity>,
    /// Contact: share of the depth over which the damping sets in.
    pub(crate) damping_onset: Option<Quantity>,
    /// Toss: share of the restitution.
    pub(crate) restitution: Option<Quantity>,
    /// Contact or toss: share of the friction coefficient.
    pub(crate) friction: Option<Quantity>,
    /// Contact or toss: height of the surface.
    pub(crate) surface: Option<Quantity>,
    /// Command: standard deviation of the healthy delay's own restlessness; if it is not known no jitter is too much.
    pub(crate) delay_noise: Option<Quantity>,
    /// Body: share of the mass.
    pub(crate) mass: Option<Quantity>,
    /// Body or toss: share of the moments of inertia, each axis.
    pub(crate) inertia: Option<Quantity>,
    /// Body or toss: centre of mass, each axis.
    pub(crate) centre: Option<Quantity>,
    /// Body: acceleration read without any, each axis.
    pub(crate) accelerometer_bias: Option<Quantity>,
    /// Body: rate read without any, each axis.
    pub(crate) gyroscope_bias: Option<Quantity>,
    /// Share of the motor's inertia.
    pub(crate) motor_inertia: Option<Quantity>,
    /// Share of the link's inertia.
    pub(crate) link_inertia: Option<Quantity>,
    /// Share of the Coulomb friction.
    pub(crate) coulomb: Option<Quantity>,
    /// Share of the viscous friction.
    pub(crate) viscous: Option<Quantity>,
    /// Share of the torque constant.
    pub(crate) torque_constant: Option<Quantity>,
    /// Share of the travel before sliding.
    pub(crate) presliding_travel: Option<Quantity>,
    /// Share of the gear's compliance.
    pub(crate) compliance: Option<Quantity>,
    /// Torque offset.
    pub(crate) offset: Option<Quantity>,
    /// Clock of one channel against the other's.
    pub(crate) clock_offset: Option<Quantity>,
}

impl ToleranceTable {
    /// Everything that may be written, by name.
    pub(crate) fn named(&self) -> [(&'static str, &Option<Quantity>); 26] {
        [
            ("bias_force", &self.bias_force),
            ("bias_moment", &self.bias_moment),
            ("gain", &self.gain),
            ("tool_mass", &self.tool_mass),
            ("noise", &self.noise),
            ("stiffness", &self.stiffness),
            ("damping", &self.damping),
            ("damping_onset", &self.damping_onset),
            ("restitution", &self.restitution),
            ("friction", &self.friction),
            ("surface", &self.surface),
            ("delay_noise", &self.delay_noise),
            ("mass", &self.mass),
            ("inertia", &self.inertia),
            ("centre", &self.centre),
            ("accelerometer_bias", &self.accelerometer_bias),
            ("gyroscope_bias", &self.gyroscope_bias),
            ("motor_inertia", &self.motor_inertia),
            ("link_inertia", &self.link_inertia),
            ("coulomb", &self.coulomb),
            ("viscous", &self.viscous),
            ("torque_constant", &self.torque_constant),
            ("presliding_travel", &self.presliding_travel),
            ("compliance", &self.compliance),
            ("offset", &self.offset),
            ("clock_offset", &self.clock_offset),
        ]
    }
}
