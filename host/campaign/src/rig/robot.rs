//! A robot for diagnosis: each axis a drive against the load that the others and gravity put on it.

use super::drive::{DriveRig, REVOLUTE, tolerance};
use crate::check::Checker;
use crate::columns::RecordedColumn;
use crate::identified::{is_known_at, with_parameters};
use crate::robot::{Quantity, Robot};
use crate::source::Source;
use crate::written::rig::{RigFile, RobotTable};
use softdock_kernels::block::drive::DriveValues;
use softdock_kernels::manipulator::{AxisCoupling, Joint, Manipulator, RobotErrors, rigid_torques};
use softdock_kernels::range::Range;
use softdock_kernels::vector::Vec3;
use softdock_kernels::with_joints;
use std::collections::BTreeMap;

/// A robot, axis by axis.
#[derive(Clone, Debug)]
pub struct RobotRig {
    /// Kinematics, links and counterbalances, which load the drives; with the errors of the robot as a whole that the
    /// rig's effects name.
    pub model: Manipulator,
    /// Coupling of each axis to the one before.
    pub couplings: Vec<AxisCoupling<f64>>,
    /// The drive of each axis as far as it is known; its load is the model's.
    pub drives: Vec<DriveRig>,
}

/// Effects of a robot as a whole, which name no axis.
pub const LOAD_EFFECT: &str = "J14_payload";
/// The same: a tilted base.
pub const TILT_EFFECT: &str = "J21_base_tilt";
/// Effect that couples an axis to the one before.
pub const COUPLING_EFFECT: &str = "J22_axis_coupling";

/// Signals of one axis; in the columns of a robot the axis' number from 1 follows (`tau.3`).
pub const AXIS_SIGNALS: [&str; 4] = ["ref", "q", "q_link", "tau"];

/// Reads the table `[robot]`: the rig, the columns of its recordings by signal, and the robot's model file.
pub(super) fn robot(c: &mut Checker, file: &RigFile) -> Option<(RobotRig, BTreeMap<String, RecordedColumn>, Source)> {
    let Some(written) = &file.robot else {
        let message = "a rig of kind \"robot\" needs the table [robot]";
        c.refuse(&file.kind.span, message, "add [robot] with model, a robot's file");
        return None;
    };
    if let Some(column) = file.log.values().next() {
        let message = "a robot's columns belong in the [log] of its own model file";
        c.refuse(&column.span, message, "remove this [log], and write \"r1.q.1\" and so on there");
    }
    let (robot, source) = model(c, &written.value)?;
    let before = c.problems.len();
    let mut drives = Vec::new();
    for axis in 0..robot.model.joints.len() {
        drives.push(drive(c, file, &written.value, &robot.model, axis));
        // What is wrong with a tolerance is wrong for every axis, and said once.
        if c.problems.len() > before {
            return None;
        }
    }
    let mut rig = RobotRig { couplings: vec![AxisCoupling::null(); drives.len()], model: robot.model.clone(), drives };
    for effect in &file.effect {
        let id = effect.id.value.as_str();
        // What the model has already is part of it: a further load adds to the first.
        if [LOAD_EFFECT, TILT_EFFECT].contains(&id) && effect.joint.is_none() {
            rig.model = rig.model.with_errors(&with_parameters(c, false, effect, &RobotErrors::null()));
            continue;
        }
        let Some(axis) = is_known_at(c, effect, rig.drives.len()) else { continue };
        match id {
            COUPLING_EFFECT => rig.couplings[axis] = with_parameters(c, false, effect, &rig.couplings[axis]),
            _ => rig.drives[axis].values = with_parameters(c, false, effect, &rig.drives[axis].values),
        }
    }
    Some((rig, columns(&robot), source))
}

/// The robot's model; nothing if its file cannot be read, which is noted.
fn model(c: &mut Checker, written: &RobotTable) -> Option<(Robot, Source)> {
    let path = c.source.sibling(&written.model.value);
    let read = Source::read(&path, Some((&c.source, written.model.span.clone())))
        .and_then(|source| Ok((Robot::from_source(source.clone())?, source)));
    read.map_err(|problems| c.problems.extend(problems)).ok()
}

fn drive(c: &mut Checker, file: &RigFile, written: &RobotTable, robot: &Manipulator, axis: usize) -> DriveRig {
    let given = |flag: &Option<crate::written::At<bool>>| flag.as_ref().is_some_and(|flag| flag.value);
    let link_inertia = with_joints!(robot.joints.len(), inertia_in_the_middle(robot, axis));
    let mut values = values(&robot.joints[axis], link_inertia);
    // A torque that is held over a period acts half a period later on the average.
    values.clock_offset = 0.5 * c.number_or(&written.period, 0.0, "s", Range::within(0.0, 1.0));
    if given(&written.rigid_gears) {
        (values.compliance, values.half_backlash) = (0.0, 0.0);
    }
    if given(&written.plain_friction) {
        (values.stribeck, values.load_coefficient) = (0.0, 0.0);
    }
    DriveRig {
        prismatic: false,
        tolerance: tolerance(c, REVOLUTE, &file.tolerance, &values, link_inertia),
        values,
        link_inertia,
        gravity_torque: 0.0,
        gravity_angle: 0.0,
        payload_radius: 1.0,
        controller: None,
    }
}

/// A drive as a robot's model file has it.
fn values(joint: &Joint, link_inertia: f64) -> DriveValues<f64> {
    let (drive, friction) = (&joint.drive, &joint.friction);
    let motor_inertia = drive.reflected_inertia();
    let reduced = motor_inertia * link_inertia / (motor_inertia + link_inertia);
    let critical = 2.0 * (drive.gear_stiffness * reduced).sqrt();
    DriveValues {
        motor_inertia,
        coulomb: friction.coulomb,
        viscous: friction.viscous,
        stribeck: friction.stribeck,
        stribeck_speed: friction.stribeck_speed,
        presliding_travel: friction.presliding_travel(),
        load_coefficient: friction.load_coefficient,
        compliance: 1.0 / drive.gear_stiffness,
        gear_damping: (drive.gear_damping / critical).clamp(0.01, 0.99),
        half_backlash: 0.5 * drive.backlash,
        offset: drive.torque_offset,
        ..DriveValues::null()
    }
}

/// Inertia of the links about an axis with every joint in the middle of its range \[kg m^2\].
fn inertia_in_the_middle<const N: usize>(robot: &Manipulator, axis: usize) -> f64 {
    let middle = std::array::from_fn(|i| 0.5 * (robot.joints[i].limits.lower + robot.joints[i].limits.upper));
    let unit: [f64; N] = std::array::from_fn(|i| if i == axis { 1.0 } else { 0.0 });
    let weightless = Manipulator { gravity: Vec3::zero(), ..robot.clone() };
    rigid_torques(&weightless, middle, [0.0; N], unit)[axis]
}

/// The columns of a recording; torques at the motor's side count at the joint's.
fn columns(robot: &Robot) -> BTreeMap<String, RecordedColumn> {
    let mut columns = BTreeMap::new();
    // Torques at the joints come last and stay, where both are recorded.
    for channel in &robot.log {
        let (joint, mut column) = (channel.signal.joint, channel.column.clone());
        let name = match channel.signal.quantity {
            Quantity::Time => "t".to_owned(),
            Quantity::Reference => format!("ref.{}", joint + 1),
            Quantity::Angle => format!("q.{}", joint + 1),
            Quantity::LinkAngle => format!("q_link.{}", joint + 1),
            Quantity::MotorTorque | Quantity::JointTorque => format!("tau.{}", joint + 1),
        };
        if channel.signal.quantity == Quantity::MotorTorque {
            column.factor *= robot.model.joints[joint].drive.gear_ratio;
            column.offset *= robot.model.joints[joint].drive.gear_ratio;
        }
        columns.insert(name, column);
    }
    columns
}
