//! An industrial robot: its constants (plain f64 in SI), its kinematics and its dynamics.
//!
//! World axes are the robot base's: z up, origin on the floor under axis 1. A joint is a [`Link`] whose frame turns
//! about its own z axis by `sign * q`, so that modified (Craig) Denavit-Hartenberg tables fit as they are.

mod arm;
mod arm_drive;
pub mod cell;
mod drive;
mod friction;
mod inverse_dynamics;
mod inverse_kinematics;
mod kinematics;
pub mod sample;
mod whole;

pub use crate::params::DriveParams;
pub(crate) use arm::Arm;
pub use arm_drive::{ArmDrive, ArmDrives, Stops};
pub(crate) use arm_drive::{carried_on, driven};
pub use cell::{drive, drives_at, set_point};
pub use drive::{JointState, VelocityLoop};
pub use friction::{Levels, bristle};
pub use inverse_dynamics::{counterweight_torque, inverse_dynamics, rigid_torques};
pub use inverse_kinematics::{Branch, Posture, SphericalWrist, best_posture, nearest_turn};
pub use kinematics::{flange, joint_axis, link_frames};
pub use whole::{AxisCoupling, RobotErrors};

use crate::model::Link;
use crate::segment::Segment;
use crate::vector::{Pose, Quat, Vec3, vec3};

/// Standard gravity \[m/s^2\].
pub const GRAVITY: f64 = 9.80665;

/// The constants of one robot.
#[derive(Clone, Debug, PartialEq)]
pub struct Manipulator {
    /// Joints from the base outwards, each with the link that it moves.
    pub joints: Vec<Joint>,
    /// Pose of the flange in the last link's frame.
    pub flange: Pose<f64>,
    /// Acceleration of free fall in base axes \[m/s^2\].
    pub gravity: Vec3<f64>,
    /// What the robot as a whole may do.
    pub workspace: RobotRating,
    /// Capsules that enclose its links, in the order of their joints; at most [`MAX_CAPSULES`].
    pub capsules: Vec<Capsule>,
}

/// The most capsules that a robot may have.
pub const MAX_CAPSULES: usize = 8;

/// All points within a radius of a segment that a link moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capsule {
    /// The joint that moves the link, from 0.
    pub joint: usize,
    /// Its axis in the link's frame \[m\].
    pub axis: Segment<f64>,
    /// Radius \[m\].
    pub radius: f64,
}

/// What a robot as a whole may do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RobotRating {
    /// Greatest horizontal distance of the tool from axis 1 \[m\].
    pub reach: f64,
    /// Rated load \[kg\].
    pub payload: f64,
    /// Repeatability, plus or minus \[m\].
    pub repeatability: f64,
}

/// One joint with its link and its drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joint {
    /// The link behind the joint; `origin` holds the whole fixed transform, the angle offset of the table included.
    pub link: Link,
    /// +1 or -1: the link turns about its z axis by `sign * q`.
    pub sign: f64,
    /// Motor and gear.
    pub drive: Drive,
    /// Friction at the joint's side of the gear.
    pub friction: Friction,
    /// Spring or gas cylinder that carries a part of the load, if there is one.
    pub counterweight: Option<Counterweight>,
    /// What the joint may do.
    pub limits: JointLimits,
}

/// Motor and gear of a joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drive {
    /// Motor angle per joint angle, > 0.
    pub gear_ratio: f64,
    /// Inertia of rotor and gear input at the motor's side \[kg m^2\]; the joint feels `gear_ratio^2` times it.
    pub rotor_inertia: f64,
    /// Torsional stiffness of the gear at the joint's side \[N m/rad\].
    pub gear_stiffness: f64,
    /// Torsional damping of the gear at the joint's side \[N m s/rad\].
    pub gear_damping: f64,
    /// Whole backlash at the joint's side \[rad\].
    pub backlash: f64,
    /// Torque that the drive reports at rest without load, at the joint's side \[N m\].
    pub torque_offset: f64,
    /// Greatest torque of the motor, at the joint's side \[N m\].
    pub torque_limit: f64,
    /// Rated gravity torque at the joint \[N m\]; 0 if the joint carries none.
    pub static_torque: f64,
}

impl Drive {
    /// A drive without inertia, losses or limits, on a rigid gear of ratio 1: only the geometry of its joint counts.
    pub const fn ideal() -> Self {
        Self {
            gear_ratio: 1.0,
            rotor_inertia: 0.0,
            gear_stiffness: f64::INFINITY,
            gear_damping: 0.0,
            backlash: 0.0,
            torque_offset: 0.0,
            torque_limit: f64::INFINITY,
            static_torque: 0.0,
        }
    }

    /// Rotor inertia as the joint feels it \[kg m^2\].
    pub fn reflected_inertia(&self) -> f64 {
        self.gear_ratio * self.gear_ratio * self.rotor_inertia
    }
}

/// Friction of a joint, all at the joint's side of the gear.
///
/// `z (F_c + F_s exp(-|v| / v_s) + mu |load|) + F_v v` with the presliding state z in [-1, 1] of [`bristle`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Friction {
    /// Coulomb friction F_c \[N m\].
    pub coulomb: f64,
    /// Viscous friction F_v \[N m s/rad\].
    pub viscous: f64,
    /// Static friction beyond Coulomb's, F_s \[N m\].
    pub stribeck: f64,
    /// Speed at which the static part has fallen to 1/e, v_s \[rad/s\].
    pub stribeck_speed: f64,
    /// Stiffness before sliding \[N m/rad\]: `(F_c + F_s)` over the travel after which friction is nearly complete.
    pub presliding_stiffness: f64,
    /// Coulomb friction per transmitted torque, mu.
    pub load_coefficient: f64,
}

impl Friction {
    /// A joint without friction.
    pub const fn none() -> Self {
        Self {
            coulomb: 0.0,
            viscous: 0.0,
            stribeck: 0.0,
            stribeck_speed: 1.0,
            presliding_stiffness: 1.0,
            load_coefficient: 0.0,
        }
    }

    /// Travel in which the presliding state comes 1/e closer to sliding \[rad\].
    pub fn presliding_travel(&self) -> f64 {
        (self.coulomb + self.stribeck) / self.presliding_stiffness
    }
}

/// A counterbalance: torque on the joint `-torque * sin(q - angle)`, against the load that leans away from `angle`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Counterweight {
    /// Greatest torque \[N m\].
    pub torque: f64,
    /// Joint angle at which it pushes neither way \[rad\].
    pub angle: f64,
}

/// Limits of a joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointLimits {
    /// Least angle \[rad\].
    pub lower: f64,
    /// Greatest angle \[rad\].
    pub upper: f64,
    /// Greatest speed \[rad/s\].
    pub speed: f64,
    /// Greatest acceleration \[rad/s^2\].
    pub acceleration: f64,
}

/// One row of a modified (Craig) Denavit-Hartenberg table: `T = Rx(alpha) Tx(a) Rz(sign q + offset) Tz(d)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DhRow {
    /// Offset along the previous x axis \[m\].
    pub a: f64,
    /// Turn about the previous x axis \[rad\].
    pub alpha: f64,
    /// Offset along the joint's axis \[m\].
    pub d: f64,
    /// Angle of the frame at `q = 0` \[rad\].
    pub offset: f64,
    /// +1 or -1.
    pub sign: f64,
}

impl DhRow {
    /// The fixed part of the transform: `Rx(alpha) Tx(a) Tz(d) Rz(offset)`; Rz and Tz about one axis commute.
    pub fn origin(&self) -> Pose<f64> {
        let tilt = turn(vec3(1.0, 0.0, 0.0), self.alpha);
        let position = tilt.rotate(vec3(self.a, 0.0, self.d));
        Pose { position, attitude: tilt.compose(turn(vec3(0.0, 0.0, 1.0), self.offset)) }
    }
}

/// The rotation by an angle about a unit vector.
fn turn(axis: Vec3<f64>, angle: f64) -> Quat<f64> {
    let (sin, cos) = (0.5 * angle).sin_cos();
    Quat { w: cos, v: axis * sin }
}

#[cfg(test)]
mod tests;

#[cfg(test)]
mod cell_tests;

#[cfg(test)]
mod effects_tests;
