//! A robot model file: checked into the kernels' constants, with the column map of its recordings; and written again.

mod log;
mod write;

pub use log::{Channel, LogSignal, Quantity, SIGNALS};

use crate::check::Checker;
use crate::inertia::fault;
use crate::problem::Problems;
use crate::read;
use crate::source::Source;
use crate::written::robot::{
    CapsuleTable, DriveTable, FrictionTable, JointTable, KinematicsTable, LimitsTable, LinkTable, RobotFile,
};
use crate::written::{At, Quantity as Written};
use softdock_kernels::manipulator::{
    Capsule, Counterweight, DhRow, Drive, Friction, GRAVITY, Joint, JointLimits, MAX_CAPSULES, Manipulator, RobotRating,
};
use softdock_kernels::model::{Link, MAX_JOINTS};
use softdock_kernels::range::{ANGLE, DAMPING, FORCE, LENGTH, MASS, RATE, Range, STIFFNESS};
use softdock_kernels::segment::Segment;
use softdock_kernels::vector::{Pose, Sym3, Vec3, vec3};
use std::path::Path;

/// Format that this version reads and writes.
pub(crate) const FORMAT: &str = "robot/1";

/// Range of angles of a joint: several turns, for axes without a stop.
const TURNS: Range = Range::size(100.0);

/// A checked robot.
#[derive(Clone, Debug)]
pub struct Robot {
    /// Name.
    pub id: String,
    /// One line for people.
    pub title: String,
    /// What the kernels compute with.
    pub model: Manipulator,
    /// What the constants do not hold, joint by joint.
    pub joints: Vec<JointFacts>,
    /// Where the values of each capsule come from.
    pub capsule_sources: Vec<String>,
    /// Where the limits of the robot as a whole come from.
    pub workspace_source: String,
    /// Columns of a recording, by signal.
    pub log: Vec<Channel>,
    /// The file's name, for messages.
    pub file: String,
}

/// Name, table row and sources of a joint.
#[derive(Clone, Debug, PartialEq)]
pub struct JointFacts {
    /// Name of the joint.
    pub name: String,
    /// Its row of the kinematic table.
    pub row: DhRow,
    /// Where the values come from.
    pub sources: Sources,
}

/// Where the values of a joint come from, table by table.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sources {
    /// Kinematic row.
    pub kinematics: String,
    /// Mass properties.
    pub link: String,
    /// Motor and gear.
    pub drive: String,
    /// Friction.
    pub friction: String,
    /// Counterbalance; empty if there is none.
    pub counterweight: String,
    /// Limits.
    pub limits: String,
}

impl Robot {
    /// Reads a robot model file.
    pub fn load(path: &Path) -> Result<Self, Problems> {
        Self::from_source(Source::read(path, None)?)
    }

    /// Reads a robot model from its text; messages name `path`.
    pub fn from_text(path: &Path, text: &str) -> Result<Self, Problems> {
        Self::from_source(Source::new(path.to_owned(), text.to_owned()))
    }

    pub(crate) fn from_source(source: Source) -> Result<Self, Problems> {
        let file: RobotFile = read::parse(&source, FORMAT)?;
        let mut c = Checker::new(source);
        c.problems.extend(read::check_format(&c.source, &file.schema, FORMAT));
        let id = c.name(&file.id);
        let written = &file.joint.value;
        if !(1..=MAX_JOINTS).contains(&written.len()) {
            let message = format!("{} joints: a robot has 1 to {MAX_JOINTS}", written.len());
            c.refuse(&file.joint.span, message, "write one [[joint]] for each axis that moves");
        }
        let (joints, facts) = written.iter().map(|table| joint(&mut c, table)).unzip();
        let capsules = capsules(&mut c, &file.capsule, written.len());
        let capsule_sources = file.capsule.iter().map(|table| table.value.source.value.clone()).collect();
        let length = Range::above(0.0, LENGTH);
        let workspace = RobotRating {
            reach: c.number(&file.workspace.reach, "m", length),
            payload: c.number(&file.workspace.payload, "kg", Range::within(0.0, MASS)),
            repeatability: c.number(&file.workspace.repeatability, "m", Range::within(0.0, 1.0)),
        };
        let workspace_source = file.workspace.source.value.clone();
        let log = log::read(&mut c, &file.log, written.len());
        Problems::check(std::mem::take(&mut c.problems))?;
        let (flange, gravity) = (Pose::identity(), vec3(0.0, 0.0, -GRAVITY));
        let model = Manipulator { joints, flange, gravity, workspace, capsules };
        let name = c.source.path().file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        Ok(Self {
            id,
            title: file.title.value,
            model,
            joints: facts,
            capsule_sources,
            workspace_source,
            log,
            file: name,
        })
    }
}

fn joint(c: &mut Checker, table: &At<JointTable>) -> (Joint, JointFacts) {
    let t = &table.value;
    let row = row(c, &t.kinematics);
    let link = link(c, &t.link, &t.name.value, row.origin());
    let counterweight = t.counterweight.as_ref().map(|w| Counterweight {
        torque: c.number(&w.torque, "N m", Range::size(FORCE)),
        angle: c.number(&w.angle, "rad", Range::size(ANGLE)),
    });
    let joint = Joint {
        link,
        sign: row.sign,
        drive: drive(c, &t.drive),
        friction: friction(c, &t.friction),
        counterweight,
        limits: limits(c, &t.limits),
    };
    let sources = Sources {
        kinematics: t.kinematics.source.value.clone(),
        link: t.link.value.source.value.clone(),
        drive: t.drive.source.value.clone(),
        friction: t.friction.source.value.clone(),
        counterweight: t.counterweight.as_ref().map_or_else(String::new, |w| w.source.value.clone()),
        limits: t.limits.source.value.clone(),
    };
    (joint, JointFacts { name: t.name.value.clone(), row, sources })
}

/// The capsules in the order of their joints.
fn capsules(c: &mut Checker, tables: &[At<CapsuleTable>], joints: usize) -> Vec<Capsule> {
    if let Some(table) = tables.get(MAX_CAPSULES) {
        let message = format!("{} capsules: a robot has {MAX_CAPSULES} at most", tables.len());
        c.refuse(&table.span, message, "enclose a link by one capsule, and the longest links by two");
    }
    let mut capsules: Vec<Capsule> = Vec::new();
    for table in tables {
        let t = &table.value;
        let joint = c.count(&t.joint, 1, joints as u64) as usize - 1;
        if capsules.last().is_some_and(|before| before.joint > joint) {
            c.refuse(&t.joint.span, "a capsule of an outer link comes before this one", "sort the capsules by joint");
        }
        let (from, to) = (c.vector(&t.from, "m", Range::size(LENGTH)), c.vector(&t.to, "m", Range::size(LENGTH)));
        let radius = c.number(&t.radius, "m", Range::above(0.0, LENGTH));
        capsules.push(Capsule { joint, axis: Segment { from, to }, radius });
    }
    capsules
}

fn row(c: &mut Checker, t: &KinematicsTable) -> DhRow {
    let (length, angle) = (Range::size(LENGTH), Range::size(ANGLE));
    let sign = c.number(&t.sign, "1", Range::within(-1.0, 1.0));
    if sign.abs() != 1.0 {
        c.refuse(&t.sign.span, "this is not a sign", "write 1 or -1");
    }
    DhRow {
        a: c.number(&t.a, "m", length),
        alpha: c.number(&t.alpha, "rad", angle),
        d: c.number(&t.d, "m", length),
        offset: c.number(&t.offset, "rad", angle),
        sign,
    }
}

fn link(c: &mut Checker, table: &At<LinkTable>, name: &str, origin: Pose<f64>) -> Link {
    let t = &table.value;
    let mass = c.number(&t.mass, "kg", Range::above(0.0, MASS));
    let com: Vec3<f64> = c.vector(&t.com, "m", Range::size(LENGTH));
    let noted = c.problems.len();
    let inertia: Sym3<f64> = c.inertia(&t.inertia.value);
    if c.problems.len() == noted
        && let Some(fault) = fault(inertia)
    {
        let message = format!("no rigid body has the inertia of link `{name}`: {fault}");
        let remedy = "take the tensor about the centre of mass from its source again; a scaled or rounded one can be \
                      repaired by raising its smallest moments";
        c.refuse(&t.inertia.span, message, remedy);
    }
    Link { origin, mass, com, inertia }
}

fn drive(c: &mut Checker, t: &DriveTable) -> Drive {
    let torque = Range::above(0.0, FORCE);
    Drive {
        gear_ratio: c.number(&t.gear_ratio, "1", Range::above(0.0, 1e5)),
        rotor_inertia: c.number(&t.rotor_inertia, "kg m^2", Range::within(0.0, 1e3)),
        gear_stiffness: c.number(&t.gear_stiffness, "N m/rad", Range::above(0.0, STIFFNESS)),
        gear_damping: c.number(&t.gear_damping, "N m s/rad", Range::within(0.0, DAMPING)),
        backlash: c.number_or(&t.backlash, 0.0, "rad", Range::within(0.0, 0.1)),
        torque_offset: c.number_or(&t.torque_offset, 0.0, "N m", Range::size(FORCE)),
        torque_limit: c.number(&t.torque_limit, "N m", torque),
        static_torque: c.number(&t.static_torque, "N m", Range::within(0.0, FORCE)),
    }
}

/// Stribeck speed where the file states none \[rad/s\].
const STRIBECK_SPEED: f64 = 0.02;

fn friction(c: &mut Checker, t: &FrictionTable) -> Friction {
    let torque = Range::within(0.0, FORCE);
    let rate = Range::above(0.0, RATE);
    Friction {
        coulomb: c.number(&t.coulomb, "N m", torque),
        viscous: c.number(&t.viscous, "N m s/rad", Range::within(0.0, DAMPING)),
        stribeck: c.number_or(&t.stribeck, 0.0, "N m", torque),
        stribeck_speed: c.number_or(&t.stribeck_speed, STRIBECK_SPEED, "rad/s", rate),
        presliding_stiffness: c.number(&t.presliding_stiffness, "N m/rad", Range::above(0.0, STIFFNESS)),
        load_coefficient: c.number_or(&t.load_coefficient, 0.0, "1", Range::within(0.0, 1.0)),
    }
}

fn limits(c: &mut Checker, t: &LimitsTable) -> JointLimits {
    let (lower, upper) = (c.number(&t.lower, "rad", TURNS), c.number(&t.upper, "rad", TURNS));
    if lower >= upper {
        let remedy = "write a lower limit below the upper one";
        c.refuse(&t.lower.span, "the joint's lower limit is not below its upper one", remedy);
    }
    let speed: &Written = &t.speed;
    JointLimits {
        lower,
        upper,
        speed: c.number(speed, "rad/s", Range::above(0.0, RATE)),
        acceleration: c.number(&t.acceleration, "rad/s^2", Range::above(0.0, 1e4)),
    }
}

#[cfg(test)]
mod tests;
