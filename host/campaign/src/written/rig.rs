//! The model file of a bench rig as written: what is measured on it, what is known of it, and how well.

use super::effect::EffectTable;
use super::robot::LogTable;
use super::{At, Quantities, Quantity};
use schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeMap;

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
    /// Torque of the weight, in the cosine and the sine of the angle each.
    pub(crate) gravity_torque: Option<Quantity>,
    /// Clock of one channel against the other's.
    pub(crate) clock_offset: Option<Quantity>,
}

impl ToleranceTable {
    /// Everything that may be written, by name.
    pub(crate) fn named(&self) -> [(&'static str, &Option<Quantity>); 27] {
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
            ("gravity_torque", &self.gravity_torque),
            ("clock_offset", &self.clock_offset),
        ]
    }
}

/// A free body without gravity under known wrenches, a recorded wrench acting from its stamp to the next. Wrench,
/// acceleration of the origin and rate in body axes, moments about their origin.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct BodyTable {
    /// Mass of the whole.
    pub(crate) mass: Quantity,
    /// Its centre of mass along x; default the origin.
    pub(crate) centre_x: Option<Quantity>,
    /// Its centre of mass along y; default the origin.
    pub(crate) centre_y: Option<Quantity>,
    /// Its centre of mass along z; default the origin.
    pub(crate) centre_z: Option<Quantity>,
    /// Moment of inertia about the centre of mass, about x.
    pub(crate) inertia_x: Quantity,
    /// Moment of inertia about the centre of mass, about y.
    pub(crate) inertia_y: Quantity,
    /// Moment of inertia about the centre of mass, about z.
    pub(crate) inertia_z: Quantity,
}

/// Commands of one axis, sent at equal steps and echoed by the receiver at its own: a row is one tick of each clock. Or,
/// without an echo, a flag of the row in which a command was sent, and the motion then.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct CommandTable {
    /// "revolute" or "prismatic"; default revolute. A prismatic axis has m for rad.
    pub(crate) motion: Option<At<String>>,
    /// From one packet to the next.
    pub(crate) period: Quantity,
    /// Delay from sender to receiver; default none.
    pub(crate) transport_delay: Option<Quantity>,
    /// Step in which a command is written into a packet; default none.
    pub(crate) quantum: Option<Quantity>,
    /// What `received` is: "echo", the command in force at the receiver, or "position", the position of the servo that
    /// follows it, recorded by the clock of the command; default "echo".
    pub(crate) received: Option<At<String>>,
}

/// A point on a body against a plate; z is the plate's normal, out of the plate, and z = 0 its surface. Force of the
/// plate on the body: `stiffness d (d / 1 mm)^(exponent - 1) + damping d'` at a depth d > 0, never pulling; friction
/// against the sliding, up to `friction` times the normal force.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ContactTable {
    /// Normal stiffness, at a depth of 1 mm.
    pub(crate) stiffness: Quantity,
    /// Exponent of force over depth; default 1.
    pub(crate) exponent: Option<Quantity>,
    /// Normal damping; default none.
    pub(crate) damping: Option<Quantity>,
    /// Depth over which the damping sets in; default at once.
    pub(crate) damping_onset: Option<Quantity>,
    /// Friction coefficient; default none.
    pub(crate) friction: Option<Quantity>,
    /// Travel in which friction comes 1/e closer to sliding; default 0.1 mm.
    pub(crate) presliding_travel: Option<Quantity>,
    /// Tension that the parts bear before they part; default none.
    pub(crate) adhesion: Option<Quantity>,
    /// Distance at which it has gone; default 0.1 mm.
    pub(crate) adhesion_range: Option<Quantity>,
    /// Compliance of the plate's mount; default rigid.
    pub(crate) fixture_compliance: Option<Quantity>,
    /// Frequency of the plate on its mount; default 100 Hz.
    pub(crate) fixture_frequency: Option<Quantity>,
    /// Its damping ratio; default 2 %.
    pub(crate) fixture_damping: Option<Quantity>,
    /// Time constant of the force sensor's low-pass; default none.
    pub(crate) sensor_lag: Option<Quantity>,
}

/// A robot, axis by axis; the columns of its recordings stand in its own model file.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct RobotTable {
    /// The robot's model file, as `softdock identify robot` writes it.
    pub(crate) model: At<String>,
    /// Period over which the controllers hold a torque, which so acts half of it later on the average; default 0 s.
    pub(crate) period: Option<Quantity>,
    /// Treats the gears as rigid and without backlash, whatever that file states; default false.
    pub(crate) rigid_gears: Option<At<bool>>,
    /// Treats friction as Coulomb and viscous, whatever that file states; default false.
    pub(crate) plain_friction: Option<At<bool>>,
}

/// A six-axis force/torque sensor under known loads. All vectors in sensor axes; wrenches act on the sensor, moments
/// about its origin. The recorded wrench is what is left when the tool's weight and inertia are taken off.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct SensorTable {
    /// Mass of the tool between sensor and load, as the compensation has it; default none.
    pub(crate) tool_mass: Option<Quantity>,
    /// Its centre of mass; default the origin.
    pub(crate) tool_centre: Option<Quantities>,
    /// Its moments of inertia about the centre of mass, along the sensor's axes; default none.
    pub(crate) tool_inertia: Option<Quantities>,
    /// Gravity along -z of the world; default standard gravity.
    pub(crate) gravity: Option<Quantity>,
    /// Greatest force that is read; default unlimited.
    pub(crate) range_force: Option<Quantity>,
    /// Greatest moment that is read; default a tenth of a metre times `range_force`.
    pub(crate) range_moment: Option<Quantity>,
    /// Standard deviation of the noise of a force at rest, healthy; if it is not known no noise is called too much.
    pub(crate) noise_force: Option<Quantity>,
    /// The same of a moment.
    pub(crate) noise_moment: Option<Quantity>,
}

/// A box that is tossed onto a plane: pose of its middle in world axes, z up, the plane at z = 0. Each corner is a spring
/// that gives back the square of the restitution of the work done on it, with Coulomb friction.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct TossTable {
    /// Mass.
    pub(crate) mass: Quantity,
    /// Moment of inertia about the middle, about every axis.
    pub(crate) inertia: Quantity,
    /// Half the edge of the box.
    pub(crate) half_width: Quantity,
    /// Radius of its corners; default sharp.
    pub(crate) corner_radius: Option<Quantity>,
    /// Speed after a blow over that before.
    pub(crate) restitution: Quantity,
    /// Friction coefficient.
    pub(crate) friction: Quantity,
    /// Stiffness of a corner against the plane, at a depth of 1 mm: stiff, so that a blow is short.
    pub(crate) stiffness: Quantity,
    /// Gravity along -z of the world; default standard gravity.
    pub(crate) gravity: Option<Quantity>,
}
