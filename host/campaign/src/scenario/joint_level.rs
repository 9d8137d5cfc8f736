//! The joint level of the facility's robots: model file, places, loads, controllers and drives.

use crate::check::Checker;
use crate::mount::mount;
use crate::robot::Robot;
use crate::source::Source;
use crate::written::joint_level::{DrivesTable, JointLevelTable, RailDriveTable};
use softdock_kernels::manipulator::cell::{Carriage, Feedforward, Misplaced, Servo};
use softdock_kernels::manipulator::{Drive, DriveParams, Friction, Joint, JointLimits, VelocityLoop};
use softdock_kernels::model::{JointLevel, Link, Model, Rail};
use softdock_kernels::params::Params;
use softdock_kernels::plant::{Plant, place};
use softdock_kernels::range::{DAMPING, FORCE, LENGTH, MASS, Range, SPEED, STIFFNESS};
use softdock_kernels::vector::{Pose, Sym3, Vec3};
use std::f64::consts::TAU;

/// Bandwidth of a current loop unless the scenario states another \[Hz\].
const CURRENT_LOOP: f64 = 600.0;

/// Joints of a robot with a spherical wrist.
const JOINTS: usize = 6;

/// A rail that climbs less than this, as a sine, is level.
const LEVEL: f64 = 1e-3;

/// Stribeck speed of a rail whose table states none \[m/s\].
const STRIBECK_SPEED: f64 = 0.02;

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
    let source = match c.read_beside(&table.robot) {
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
    for (place, mount) in [&table.robot1, &table.robot2].into_iter().zip(&mounts) {
        let (load, rated) = (mount.payload.mass, robot.workspace.payload);
        if load > rated {
            let message = format!("a load of {load} kg is more than the {rated} kg that this robot is rated for");
            let remedy = "lighten it, or take another robot: the rating is workspace.payload of its model file";
            c.refuse(&place.span, message, remedy);
        }
    }
    let velocity = std::array::from_fn(|i| VelocityLoop { gain: gains.get(i).copied().unwrap_or(0.0), integral_time });
    let carriage = table.rail.as_ref().map(|rail| carriage(c, &rail.value, integral_time));
    Some((JointLevel { robot, mounts, servo: Servo { velocity, feedforward }, carriage }, source))
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
    // What a robot's file states is there unless a factor takes it away.
    let mut p =
        DriveParams { stribeck: 1.0, presliding: 1.0, gear_compliance: 1.0, backlash: 1.0, ..Params::null().robot1 };
    p.current_lag = 1.0 / (TAU * CURRENT_LOOP);
    c.take_of(robot, servo.parameters(0), &mut p);
    c.take_of(robot, t.parameters(0), &mut p);
    p
}

/// The rail's drive as a joint's: metres for radians, newtons for newton metres.
fn carriage(c: &mut Checker, t: &RailDriveTable, integral_time: f64) -> Carriage {
    let (force, speed) = (Range::within(0.0, FORCE), Range::above(0.0, SPEED));
    let damping = Range::within(0.0, DAMPING);
    let link = Link {
        origin: Pose::identity(),
        mass: c.number(&t.mass, "kg", Range::within(0.0, MASS)),
        com: Vec3::zero(),
        inertia: Sym3::splat(0.0),
    };
    let drive = Drive {
        gear_ratio: TAU / c.number(&t.travel_per_turn, "m", Range::above(0.0, LENGTH)),
        rotor_inertia: c.number(&t.rotor_inertia, "kg m^2", Range::within(0.0, 1e3)),
        gear_stiffness: c.number(&t.stiffness, "N/m", Range::above(0.0, STIFFNESS)),
        gear_damping: c.number(&t.damping, "N s/m", damping),
        backlash: c.number_or(&t.backlash, 0.0, "m", Range::within(0.0, 0.1)),
        torque_offset: 0.0,
        torque_limit: c.number(&t.force_limit, "N", Range::above(0.0, FORCE)),
        static_torque: 0.0,
    };
    let friction = Friction {
        coulomb: c.number(&t.coulomb, "N", force),
        viscous: c.number(&t.viscous, "N s/m", damping),
        stribeck: c.number_or(&t.stribeck, 0.0, "N", force),
        stribeck_speed: c.number_or(&t.stribeck_speed, STRIBECK_SPEED, "m/s", speed),
        presliding_stiffness: c.number(&t.presliding_stiffness, "N/m", Range::above(0.0, STIFFNESS)),
        load_coefficient: 0.0,
    };
    let limits = JointLimits {
        lower: c.number(&t.lower, "m", Range::within(-LENGTH, 0.0)),
        upper: c.number(&t.upper, "m", Range::within(0.0, LENGTH)),
        speed: c.number(&t.speed, "m/s", speed),
        acceleration: c.number(&t.acceleration, "m/s^2", Range::above(0.0, 1e4)),
    };
    let velocity = VelocityLoop { gain: c.number(&t.velocity_gain, "N s/m", damping), integral_time };
    Carriage { joint: Joint { link, sign: 1.0, drive, friction, counterweight: None, limits }, velocity }
}

/// Refuses a rail without a drive, a drive without a rail, and a rail that climbs.
pub(crate) fn check_rail(c: &mut Checker, table: &JointLevelTable, rail: Option<&Rail>, level: &JointLevel) {
    match (rail, &table.rail) {
        (Some(_), None) => {
            let remedy = "add a table [facility.joint_level.rail]: mass, drive, friction and limits of the carriage";
            c.refuse(&table.robot.span, "at the joint level a rail needs a drive", remedy);
        }
        (None, Some(drive)) => {
            let remedy = "remove it, or add a table [facility.rail] with axis and share";
            c.refuse(&drive.span, "this drive has no rail", remedy);
        }
        _ => {}
    }
    let down = level.mounts[0].base.attitude.rotate(level.robot.gravity);
    if let (Some(rail), Some(drive)) = (rail, &table.rail)
        && down.dot(rail.axis).abs() > LEVEL * down.norm()
    {
        let remedy = "turn facility.rail.axis, or the base of robot 1: its z axis points up";
        c.refuse(&drive.span, "a rail is level: this one climbs", remedy);
    }
}
