//! The joint level of the facility's robots: model file, places, loads, controllers and drives.

use crate::check::Checker;
use crate::inertia::fault;
use crate::ranges::{DAMPING, LENGTH, MASS, Range};
use crate::robot::Robot;
use crate::source::Source;
use crate::written::At;
use crate::written::joint_level::{DrivesTable, JointLevelTable, MountTable, PayloadTable};
use softdock_kernels::manipulator::cell::{Feedforward, Misplaced, Mount, Payload, Servo};
use softdock_kernels::manipulator::{DriveParams, VelocityLoop};
use softdock_kernels::model::{JointLevel, Model};
use softdock_kernels::params::Params;
use softdock_kernels::plant::{Plant, place};
use softdock_kernels::vector::{Sym3, Vec3};
use std::f64::consts::TAU;

/// Bandwidth of a current loop unless the scenario says otherwise \[Hz\].
const CURRENT_LOOP: f64 = 600.0;

/// Joints of a robot with a spherical wrist.
const JOINTS: usize = 6;

const WORDS: [(&str, Feedforward); 3] =
    [("off", Feedforward::Off), ("gravity", Feedforward::Gravity), ("full", Feedforward::Full)];

/// The joint level and the robot model's file; nothing if the file cannot be read, which is noted.
pub(crate) fn read(c: &mut Checker, table: &JointLevelTable, p: &mut Params<f64>) -> Option<(JointLevel, Source)> {
    let gains = c.list(&table.servo.velocity_gain, JOINTS, "N m s/rad", Range::within(0.0, DAMPING));
    let integral_time = c.number_or(&table.servo.integral_time, f64::INFINITY, "s", Range::above(0.0, 1e3));
    let feedforward = table.feedforward.as_ref().map_or(Feedforward::Off, |word| c.choice(word, &WORDS));
    for robot in ["robot1", "robot2"] {
        let drives = drives(c, table, robot);
        *(if robot == "robot1" { &mut p.robot1 } else { &mut p.robot2 }) = drives;
    }
    let mounts = [&table.robot1, &table.robot2].map(|table| mount(c, &table.value));
    let path = c.source.sibling(&table.robot.value);
    let source = match Source::read(&path, Some((&c.source, table.robot.span.clone()))) {
        Ok(source) => source,
        Err(problems) => {
            c.problems.extend(problems);
            return None;
        }
    };
    let robot = match Robot::from_source(source.clone()) {
        Ok(robot) => robot.model,
        Err(problems) => {
            c.problems.extend(problems);
            return None;
        }
    };
    let velocity = std::array::from_fn(|i| VelocityLoop { gain: gains.get(i).copied().unwrap_or(0.0), integral_time });
    Some((JointLevel { robot, mounts, servo: Servo { velocity, feedforward } }, source))
}

/// Refuses robots that cannot reach the start from where they stand.
pub(crate) fn check_places(c: &mut Checker, table: &JointLevelTable, model: &mut Model) {
    let Some(level) = model.facility.joint_level.take() else {
        return;
    };
    match place(&Plant::new(model.clone()), &level) {
        Ok(_) => model.facility.joint_level = Some(level),
        Err((_, Misplaced::NoWrist)) => {
            let remedy = "take a robot of six joints whose last three axes meet in a point";
            c.refuse(&table.robot.span, "this robot has no spherical wrist", remedy);
        }
        Err((robot, Misplaced::OutOfReach)) => {
            let span = if robot == 1 { &table.robot1.span } else { &table.robot2.span };
            let message = format!("robot {robot} cannot hold its part at the start from here");
            let remedy = "move or turn its base, or the part on its flange: no posture inside the ranges of its joints \
                          reaches the start";
            c.refuse(span, message, remedy);
        }
    }
}

fn drives(c: &mut Checker, table: &JointLevelTable, robot: &str) -> DriveParams<f64> {
    let (servo, t): (_, &DrivesTable) = (&table.servo, &table.drives);
    let name = |field: &str| format!("{robot}_{field}");
    let mut or = |written, field: &str, default| c.parameter_or(written, &name(field), default);
    DriveParams {
        velocity_feedforward: or(&servo.velocity_feedforward, "velocity_feedforward", 0.0),
        velocity_gain: or(&t.velocity_gain, "velocity_gain", 1.0),
        gear_ratio: or(&t.gear_ratio, "gear_ratio", 1.0),
        coulomb_error: or(&t.coulomb_error, "coulomb_error", 0.0),
        viscous_error: or(&t.viscous_error, "viscous_error", 0.0),
        stribeck: or(&t.stribeck, "stribeck", 1.0),
        presliding: or(&t.presliding, "presliding", 1.0),
        load_friction: or(&t.load_friction, "load_friction", 0.0),
        gear_compliance: or(&t.gear_compliance, "gear_compliance", 1.0),
        backlash: or(&t.backlash, "backlash", 1.0),
        transmission_error: or(&t.transmission_error, "transmission_error", 0.0),
        torque_ripple: or(&t.torque_ripple, "torque_ripple", 0.0),
        torque_constant_error: or(&t.torque_constant_error, "torque_constant_error", 0.0),
        current_lag: or(&t.current_lag, "current_lag", 1.0 / (TAU * CURRENT_LOOP)),
        model_inertia_error: or(&t.model_inertia_error, "model_inertia_error", 0.0),
        model_gravity_error: or(&t.model_gravity_error, "model_gravity_error", 0.0),
        model_friction_error: or(&t.model_friction_error, "model_friction_error", 0.0),
        position_gain: c.parameter(&servo.position_gain, &name("position_gain")),
    }
}

fn mount(c: &mut Checker, table: &MountTable) -> Mount {
    let base = c.pose(&Some(table.position.clone()), &table.rotation);
    let tool = c.pose(&table.part_position, &table.part_rotation);
    let nothing = Payload { mass: 0.0, com: Vec3::zero(), inertia: Sym3::splat(0.0) };
    let payload = table.payload.as_ref().map_or(nothing, |table| payload(c, table));
    Mount { base, tool, payload }
}

fn payload(c: &mut Checker, table: &At<PayloadTable>) -> Payload {
    let t = &table.value;
    let noted = c.problems.len();
    let inertia = c.inertia(&t.inertia);
    if c.problems.len() == noted
        && let Some(fault) = fault(inertia)
    {
        let remedy = "take the tensor about the centre of mass from its source again";
        c.refuse(&table.span, format!("no rigid body has this inertia: {fault}"), remedy);
    }
    Payload {
        mass: c.number(&t.mass, "kg", Range::within(0.0, MASS)),
        com: c.vector(&t.com, "m", Range::size(LENGTH)),
        inertia,
    }
}
