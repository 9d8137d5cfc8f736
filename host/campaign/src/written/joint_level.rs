//! The joint level of the facility's robots, as written.

use super::scenario::InertiaTable;
use super::{At, Quantities, Quantity, file_table};
use schemars::JsonSchema;
use serde::Deserialize;
use softdock_kernels::manipulator::DriveParams;

/// Both robots joint by joint: links, drives, controllers; contact pushes them.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct JointLevelTable {
    /// Robot model file of both robots, relative to this file.
    pub(crate) robot: At<String>,
    /// What the controllers add to the velocity loops' torque: "off" (default), "gravity" or "full".
    pub(crate) feedforward: Option<At<String>>,
    /// The controllers of the joints.
    pub(crate) servo: ServoTable,
    /// The drives, of both robots; what differs from run to run or from robot to robot is dispersed.
    #[serde(default)]
    pub(crate) drives: DrivesTable,
    /// What robot 1 runs on; with [facility.rail] alone.
    pub(crate) rail: Option<At<RailDriveTable>>,
    /// Base and part of robot 1 (part A).
    pub(crate) robot1: At<MountTable>,
    /// Base and part of robot 2 (part B).
    pub(crate) robot2: At<MountTable>,
}

file_table! {
    /// Position loops once a command period, velocity loops every substep.
    ServoTable of DriveParams {
        /// Gain of the position loops.
        position_gain: Quantity => position_gain,
        /// Share of the commanded joint rate that the position loops add; default 0.
        velocity_feedforward: Option<Quantity> => velocity_feedforward,
        /// Torque at the joint per error of the motor's speed behind the gear, joint by joint.
        velocity_gain: Quantities,
        /// Integral time of the velocity loops; without it they have no integral part.
        integral_time: Option<Quantity>,
    }
}

file_table! {
    /// Drives against the robot model file.
    #[derive(Default)]
    DrivesTable of DriveParams {
        /// Factor on the gains of the velocity loops; default 1.
        velocity_gain: Option<Quantity> => velocity_gain,
        /// Factor on all gear ratios; default 1.
        gear_ratio: Option<Quantity> => gear_ratio,
        /// Relative error of the Coulomb friction; default 0.
        coulomb_error: Option<Quantity> => coulomb_error,
        /// Relative error of the viscous friction; default 0.
        viscous_error: Option<Quantity> => viscous_error,
        /// Factor on the static friction beyond Coulomb's; default 1.
        stribeck: Option<Quantity> => stribeck,
        /// Factor on the travel before sliding; default 1.
        presliding: Option<Quantity> => presliding,
        /// Coulomb friction per transmitted torque, besides the model file's; default 0.
        load_friction: Option<Quantity> => load_friction,
        /// Relative difference of the Coulomb friction: forwards higher, backwards lower; default 0.
        coulomb_asymmetry: Option<Quantity> => coulomb_asymmetry,
        /// Share by which friction is higher at the start than when warm; default 0.
        cold_friction: Option<Quantity> => cold_friction,
        /// Time in which that share falls to 1/e; default 30 min.
        warm_up: Option<Quantity> => warm_up,
        /// Spring of cables and hoses, as a share of the joint's Coulomb friction per radian; default 0.
        cable_stiffness: Option<Quantity> => cable_stiffness,
        /// Hysteresis of cables and hoses, as a share of the joint's Coulomb friction; default 0.
        cable_hysteresis: Option<Quantity> => cable_hysteresis,
        /// Factor on the compliance of the gears; default 1, 0 is rigid.
        gear_compliance: Option<Quantity> => gear_compliance,
        /// Factor on the backlash of the gears; default 1.
        backlash: Option<Quantity> => backlash,
        /// Amplitude of the transmission error, once a turn of the motor; default 0.
        transmission_error: Option<Quantity> => transmission_error,
        /// Amplitude of the torque ripple as a share of the greatest torque; default 0.
        torque_ripple: Option<Quantity> => torque_ripple,
        /// Relative error of the torque constant; default 0.
        torque_constant_error: Option<Quantity> => torque_constant_error,
        /// Torque that the motors give unasked, as a share of their greatest torque; default 0.
        torque_offset: Option<Quantity> => torque_offset,
        /// Share by which the motors' greatest torque is lower; default 0.
        torque_limit_cut: Option<Quantity> => torque_limit_cut,
        /// Share by which the joints' greatest speed is lower; default 0.
        speed_limit_cut: Option<Quantity> => speed_limit_cut,
        /// Point mass on the part that the feedforward does not know; default none.
        payload_error: Option<Quantity> => payload_error,
        /// Place of that mass in the part's frame; default its origin.
        payload_place: Option<Quantities> => payload_place,
        /// Time constant of the current loops; default 1 / (2 pi 600 Hz).
        current_lag: Option<Quantity> => current_lag,
        /// Relative error of the feedforward's inertial torques; default 0.
        model_inertia_error: Option<Quantity> => model_inertia_error,
        /// Relative error of the feedforward's gravity torques; default 0.
        model_gravity_error: Option<Quantity> => model_gravity_error,
        /// Relative error of the feedforward's friction torques; default 0.
        model_friction_error: Option<Quantity> => model_friction_error,
    }
}

/// The carriage of the rail, a drive among the robot's own; direction and share stand in [facility.rail].
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct RailDriveTable {
    /// Mass of the carriage without the robot's moving links.
    pub(crate) mass: Quantity,
    /// Travel in a turn of the motor.
    pub(crate) travel_per_turn: Quantity,
    /// Inertia of rotor and gear input at the motor's side.
    pub(crate) rotor_inertia: Quantity,
    /// Stiffness between motor and carriage.
    pub(crate) stiffness: Quantity,
    /// Damping between motor and carriage.
    pub(crate) damping: Quantity,
    /// Whole backlash between motor and carriage; default none.
    pub(crate) backlash: Option<Quantity>,
    /// Greatest force of the motor at the carriage.
    pub(crate) force_limit: Quantity,
    /// Coulomb friction.
    pub(crate) coulomb: Quantity,
    /// Viscous friction.
    pub(crate) viscous: Quantity,
    /// Static friction beyond Coulomb's; default none.
    pub(crate) stribeck: Option<Quantity>,
    /// Speed at which the static part has fallen to 1/e; default 20 mm/s.
    pub(crate) stribeck_speed: Option<Quantity>,
    /// Stiffness before sliding.
    pub(crate) presliding_stiffness: Quantity,
    /// Greatest travel against the rail's direction, from the start, below zero.
    pub(crate) lower: Quantity,
    /// Greatest travel along the rail's direction, from the start.
    pub(crate) upper: Quantity,
    /// Greatest speed.
    pub(crate) speed: Quantity,
    /// Greatest acceleration.
    pub(crate) acceleration: Quantity,
    /// Force at the carriage per error of the motor's speed behind the gear.
    pub(crate) velocity_gain: Quantity,
}

/// One robot's place and load.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct MountTable {
    /// Position of the robot's base in the laboratory; its origin is where the parts meet.
    pub(crate) position: Quantities,
    /// Rotation of the robot's base, as roll, pitch, yaw.
    pub(crate) rotation: Option<Quantities>,
    /// Position of the part's frame in the last link's frame.
    pub(crate) part_position: Option<Quantities>,
    /// Rotation of the part's frame in the last link's frame, as roll, pitch, yaw.
    pub(crate) part_rotation: Option<Quantities>,
    /// The part and its mount; without it the robot has no load.
    pub(crate) payload: Option<At<PayloadTable>>,
}

/// Load of a robot.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct PayloadTable {
    /// Mass.
    pub(crate) mass: Quantity,
    /// Centre of mass in the part's frame.
    pub(crate) com: Quantities,
    /// Inertia about the centre of mass, axes of the part's frame.
    pub(crate) inertia: InertiaTable,
}
