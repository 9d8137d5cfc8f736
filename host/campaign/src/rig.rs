//! A bench rig's model file, checked: what is measured, what is known of it, and how well.

use crate::check::Checker;
use crate::columns::RecordedColumn;
pub use crate::identified::sliding;
use crate::identified::{is_known, with_parameters};
use crate::problem::Problems;
use crate::read;
use crate::source::Source;
use crate::suggest::suggestion;
use crate::written::rig::RigFile;
use softdock_kernels::effects::{BENCH_EFFECTS, EFFECTS};
use softdock_kernels::fields::Bundle;
use std::collections::BTreeMap;
use std::path::Path;

mod body;
mod command;
mod contact;
mod drive;
mod robot;
mod sensor;
#[cfg(test)]
mod tests;
mod toss;

pub use body::{BODY_SIGNALS, BodyRig};
pub use command::{COMMAND_SIGNALS, CommandRig};
pub use contact::{CONTACT_SIGNALS, ContactRig};
pub use drive::{ControllerRig, DRIVE_SIGNALS, DriveRig, FeedforwardModel};
pub use robot::{AXIS_SIGNALS, COUPLING_EFFECT, LOAD_EFFECT, RobotRig, TILT_EFFECT};
pub use sensor::{SENSOR_SIGNALS, SensorRig};
pub use toss::{TOSS_SIGNALS, TossRig};

/// Format that this version reads.
pub(crate) const FORMAT: &str = "rig/1";

/// A bench rig.
#[derive(Clone, Debug)]
pub struct Rig {
    /// Name.
    pub id: String,
    /// One line for people.
    pub title: String,
    /// What it is.
    pub plant: RigModel,
    /// Columns of its recordings by signal.
    pub log: BTreeMap<String, RecordedColumn>,
    /// Names of these columns, each once, in the order in which the file lists them.
    pub column_order: Vec<String>,
    /// The model file's name, without its folder.
    pub file: String,
    source: Source,
    /// The model file of a robot, which is a file of its own.
    robot: Option<Source>,
}

/// What a rig is.
#[derive(Clone, Debug)]
pub enum RigModel {
    /// One joint with its drive.
    Drive(Box<DriveRig>),
    /// A robot, axis by axis.
    Robot(Box<RobotRig>),
    /// A force/torque sensor under known loads.
    Sensor(Box<SensorRig>),
    /// A contact.
    Contact(Box<ContactRig>),
    /// A command's way from sender to receiver.
    Command(Box<CommandRig>),
    /// A free body under known wrenches.
    Body(Box<BodyRig>),
    /// A body tossed onto a plane.
    Toss(Box<TossRig>),
}

impl Rig {
    /// Reads a rig's model file.
    ///
    /// # Errors
    /// Everything that is wrong with the file, with places and remedies.
    pub fn load(path: &Path) -> Result<Self, Problems> {
        let source = Source::read(path, None)?;
        let file: RigFile = read::parse(&source, FORMAT)?;
        let mut c = Checker::new(source);
        c.problems.extend(read::check_format(&c.source, &file.schema, FORMAT));
        let id = c.name(&file.id);
        let kind = c.choice(&file.kind, &KINDS);
        check_tolerance(&mut c, &file, kind);
        let mut beside = None;
        let (plant, log) = match kind {
            Kind::Drive => {
                let rig = drive::drive(&mut c, &file);
                let prismatic = rig.as_ref().is_some_and(|rig| rig.prismatic);
                let unit = |row: &(&'static str, &'static str, &'static str, _)| if prismatic { row.2 } else { row.1 };
                let known: Vec<_> = DRIVE_SIGNALS.iter().map(|row| (row.0, unit(row))).collect();
                (rig.map(|rig| RigModel::Drive(Box::new(rig))), columns(&mut c, &file, &known))
            }
            Kind::Robot => {
                let read = robot::robot(&mut c, &file);
                let (rig, log, source) = read.map_or_else(Default::default, |(rig, log, source)| {
                    (Some(RigModel::Robot(Box::new(rig))), log, Some(source))
                });
                beside = source;
                (rig, log)
            }
            Kind::Sensor => {
                let rig = sensor::sensor(&mut c, &file);
                let known: Vec<_> = SENSOR_SIGNALS.iter().map(|row| (row.0, row.1)).collect();
                (rig.map(|rig| RigModel::Sensor(Box::new(rig))), columns(&mut c, &file, &known))
            }
            Kind::Contact => {
                let rig = contact::contact(&mut c, &file);
                let known: Vec<_> = CONTACT_SIGNALS.iter().map(|row| (row.0, row.1)).collect();
                (rig.map(|rig| RigModel::Contact(Box::new(rig))), columns(&mut c, &file, &known))
            }
            Kind::Command => {
                let rig = command::command(&mut c, &file);
                let known = CommandRig::signals(rig.as_ref().is_some_and(|rig| rig.prismatic));
                (rig.map(|rig| RigModel::Command(Box::new(rig))), columns(&mut c, &file, &known))
            }
            Kind::Body => {
                let rig = body::body(&mut c, &file);
                let known: Vec<_> = BODY_SIGNALS.iter().map(|row| (row.0, row.1)).collect();
                (rig.map(|rig| RigModel::Body(Box::new(rig))), columns(&mut c, &file, &known))
            }
            Kind::Toss => {
                let rig = toss::toss(&mut c, &file);
                let known: Vec<_> = TOSS_SIGNALS.iter().map(|row| (row.0, row.1)).collect();
                (rig.map(|rig| RigModel::Toss(Box::new(rig))), columns(&mut c, &file, &known))
            }
        };
        Problems::check(std::mem::take(&mut c.problems))?;
        let plant = plant.expect("a missing table is a problem");
        let column_order = column_order(&file);
        let title = file.title.map_or_else(|| id.clone(), |title| title.value);
        let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        Ok(Self { id, title, plant, log, column_order, file: name, source: c.source, robot: beside })
    }

    /// The file's text with the file that it names beside it: the text, and name and text of the other.
    pub fn gathered(&self) -> (String, Vec<(String, String)>) {
        let text = self.source.text();
        let Some(robot) = &self.robot else {
            return (text.to_owned(), Vec::new());
        };
        let name = robot.path().file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        let written = &text[self.source.span_of("robot.model")];
        (text.replacen(written, &format!("\"{name}\""), 1), vec![(name, robot.text().to_owned())])
    }
}

/// What a rig is, before its tables are read.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Drive,
    Robot,
    Sensor,
    Contact,
    Command,
    Body,
    Toss,
}

/// Kinds by the names that a model file gives them.
const KINDS: [(&str, Kind); 7] = [
    ("drive", Kind::Drive),
    ("robot", Kind::Robot),
    ("sensor", Kind::Sensor),
    ("contact", Kind::Contact),
    ("command", Kind::Command),
    ("body", Kind::Body),
    ("toss", Kind::Toss),
];

const DRIVE_TOLERANCES: &[&str] = &[
    "motor_inertia",
    "link_inertia",
    "coulomb",
    "viscous",
    "torque_constant",
    "presliding_travel",
    "compliance",
    "offset",
    "gravity_torque",
    "clock_offset",
];

/// Tolerances that a rig of each kind may name.
const TOLERANCES: [(Kind, &[&str]); 7] = [
    (Kind::Command, &["delay_noise", "noise", "clock_offset"]),
    (Kind::Toss, &["stiffness", "restitution", "friction", "inertia", "centre", "surface"]),
    (Kind::Body, &["mass", "inertia", "centre", "accelerometer_bias", "gyroscope_bias", "clock_offset"]),
    (Kind::Drive, DRIVE_TOLERANCES),
    (Kind::Robot, DRIVE_TOLERANCES),
    (Kind::Sensor, &["bias_force", "bias_moment", "gain", "tool_mass", "noise", "clock_offset"]),
    (
        Kind::Contact,
        &[
            "stiffness",
            "damping",
            "damping_onset",
            "friction",
            "presliding_travel",
            "bias_force",
            "surface",
            "clock_offset",
        ],
    ),
];

/// Refuses tolerances of what a rig of this kind does not have.
fn check_tolerance(c: &mut Checker, file: &RigFile, kind: Kind) {
    let known = TOLERANCES.iter().find(|row| row.0 == kind).expect("a row for every kind").1;
    for (name, written) in file.tolerance.named() {
        if let (Some(written), false) = (written, known.contains(&name)) {
            let message = format!("a rig of kind \"{}\" has no tolerance `{name}`", file.kind.value);
            c.refuse(&written.span, message, suggestion(name, known));
        }
    }
}

/// Refuses a rig whose `[log]` lacks a required signal.
fn missing(c: &mut Checker, file: &RigFile, needed: &[&str]) {
    let lacking: Vec<String> =
        needed.iter().filter(|name| !file.log.contains_key(**name)).map(|name| format!("`{name}`")).collect();
    if let Some(first) = lacking.first() {
        let message = format!("[log] names no column for {}", lacking.join(", "));
        let remedy =
            format!("add a line for each: {} = {{ column = \"...\", unit = \"...\" }}", first.replace('`', "\""));
        c.refuse(&file.kind.span, message, remedy);
    }
}

/// Names of the columns of `[log]` in the order of the file.
fn column_order(file: &RigFile) -> Vec<String> {
    let mut places: Vec<(usize, &String)> =
        file.log.values().map(|written| (written.value.column.span.start, &written.value.column.value)).collect();
    places.sort_unstable();
    let mut names: Vec<String> = Vec::new();
    for (_, name) in places {
        if !names.contains(name) {
            names.push(name.clone());
        }
    }
    names
}

fn columns(
    c: &mut Checker,
    file: &RigFile,
    known: &[(&'static str, &'static str)],
) -> BTreeMap<String, RecordedColumn> {
    let mut columns = BTreeMap::new();
    for (name, written) in &file.log {
        let Some((_, unit)) = known.iter().find(|row| row.0 == name) else {
            let names: Vec<&str> = known.iter().map(|row| row.0).collect();
            let message = format!("there is no signal `{name}` on a rig of kind \"{}\"", file.kind.value);
            c.refuse(&written.span, message, suggestion(name, &names));
            continue;
        };
        if let Some(column) = RecordedColumn::read(c, written, unit) {
            columns.insert(name.clone(), column);
        }
    }
    columns
}

/// A block's values with those that the effects of its model file name; what has no mean changes none of them.
fn with_effects<B: Bundle<f64>>(c: &mut Checker, prismatic: bool, file: &RigFile, mut values: B) -> B {
    for written in &file.effect {
        let row = EFFECTS.iter().chain(BENCH_EFFECTS).find(|effect| effect.id == written.id.value);
        if is_known(c, written) && row.is_some_and(|effect| effect.groups[0] != RANDOM) {
            values = with_parameters(c, prismatic, written, &values);
        }
    }
    values
}

/// The group of effects without a mean.
const RANDOM: &str = "G9";
