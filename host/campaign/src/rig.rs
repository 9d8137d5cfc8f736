//! A bench rig's model file, checked: what is measured, what is known of it, and how well.

use crate::check::Checker;
use crate::columns::Column;
pub use crate::found::sliding;
use crate::found::{is_known, with_parameters};
use crate::problem::Problems;
use crate::ranges::{ANGLE, DAMPING, FORCE, INERTIA, LENGTH, RATE, Range, STIFFNESS};
use crate::read;
use crate::source::Source;
use crate::suggest::suggestion;
use crate::written::Quantity;
use crate::written::effect::EffectTable;
use crate::written::rig::{ControllerTable, DriveTable, FeedforwardTable, RigFile, ToleranceTable};
use softdock_kernels::block::controller::ControllerValues;
use softdock_kernels::block::drive::DriveValues;
use softdock_kernels::effects::{BENCH_EFFECTS, EFFECTS};
use softdock_kernels::fields::Bundle;
use softdock_kernels::params::UNLIMITED;
use std::collections::BTreeMap;
use std::path::Path;

mod body;
mod command;
mod contact;
mod sensor;
#[cfg(test)]
mod tests;
mod toss;

pub use body::{BODY_SIGNALS, BodyRig};
pub use command::{COMMAND_SIGNALS, CommandRig};
pub use contact::{CONTACT_SIGNALS, ContactRig};
pub use sensor::{SENSOR_SIGNALS, SensorRig};
pub use toss::{TOSS_SIGNALS, TossRig};

/// Format that this version reads.
const FORMAT: &str = "rig/1";

/// A bench rig.
#[derive(Clone, Debug)]
pub struct Rig {
    /// Name.
    pub id: String,
    /// One line for people.
    pub title: String,
    /// What it is.
    pub plant: Plant,
    /// Columns of its recordings by signal.
    pub log: BTreeMap<String, Column>,
    /// The model file's name, without its folder.
    pub file: String,
}

/// What a rig is.
#[derive(Clone, Debug)]
pub enum Plant {
    /// One joint with its drive.
    Drive(Box<DriveRig>),
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

/// One joint with its drive.
#[derive(Clone, Debug)]
pub struct DriveRig {
    /// Whether the joint slides: then m stands for rad, N for N m and kg for kg m^2.
    pub prismatic: bool,
    /// The drive as far as it is known; `clock_offset` is half the period over which a controller holds the torque.
    pub values: DriveValues<f64>,
    /// Inertia of the link \[kg m^2\].
    pub link_inertia: f64,
    /// Greatest torque of the weight \[N m\], at `gravity_angle` \[rad\].
    pub gravity_torque: f64,
    /// Angle at which the weight's torque is greatest \[rad\].
    pub gravity_angle: f64,
    /// Distance of the payload from the axis \[m\].
    pub payload_radius: f64,
    /// Its controller, if it is known.
    pub controller: Option<ControllerRig>,
    /// Standard deviations of what may differ, by field of [`DriveValues`], in the field's unit.
    pub tolerance: Vec<(&'static str, f64)>,
}

/// A known controller.
#[derive(Clone, Debug)]
pub struct ControllerRig {
    /// Period \[s\].
    pub period: f64,
    /// Gains and filters.
    pub values: ControllerValues<f64>,
    /// Feedforward of the weight.
    pub feedforward: Feedforward,
}

/// Feedforward of a reference's place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Feedforward {
    /// Torque against the weight \[N m\].
    pub gravity_torque: f64,
    /// Angle at which that is greatest \[rad\].
    pub gravity_angle: f64,
}

/// Signals of a rig of one drive: name, unit of a revolute and of a prismatic joint, meaning.
pub const DRIVE_SIGNALS: [(&str, &str, &str, &str); 5] = [
    ("t", "s", "s", "time"),
    ("ref", "rad", "m", "position that the controller was told"),
    ("q", "rad", "m", "position by the motor's encoder, at the joint's side of the gear"),
    ("q_link", "rad", "m", "position by an encoder behind the gear"),
    ("tau", "N m", "N", "torque or force that the drive was told, at the joint's side of the gear"),
];

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
        let (plant, log) = match kind {
            Kind::Drive => {
                let rig = drive(&mut c, &file);
                let prismatic = rig.as_ref().is_some_and(|rig| rig.prismatic);
                let unit = |row: &(&'static str, &'static str, &'static str, _)| if prismatic { row.2 } else { row.1 };
                let known: Vec<_> = DRIVE_SIGNALS.iter().map(|row| (row.0, unit(row))).collect();
                (rig.map(|rig| Plant::Drive(Box::new(rig))), columns(&mut c, &file, &known))
            }
            Kind::Sensor => {
                let rig = sensor::sensor(&mut c, &file);
                let known: Vec<_> = SENSOR_SIGNALS.iter().map(|row| (row.0, row.1)).collect();
                (rig.map(|rig| Plant::Sensor(Box::new(rig))), columns(&mut c, &file, &known))
            }
            Kind::Contact => {
                let rig = contact::contact(&mut c, &file);
                let known: Vec<_> = CONTACT_SIGNALS.iter().map(|row| (row.0, row.1)).collect();
                (rig.map(|rig| Plant::Contact(Box::new(rig))), columns(&mut c, &file, &known))
            }
            Kind::Command => {
                let rig = command::command(&mut c, &file);
                let known = CommandRig::signals(rig.as_ref().is_some_and(|rig| rig.prismatic));
                (rig.map(|rig| Plant::Command(Box::new(rig))), columns(&mut c, &file, &known))
            }
            Kind::Body => {
                let rig = body::body(&mut c, &file);
                let known: Vec<_> = BODY_SIGNALS.iter().map(|row| (row.0, row.1)).collect();
                (rig.map(|rig| Plant::Body(Box::new(rig))), columns(&mut c, &file, &known))
            }
            Kind::Toss => {
                let rig = toss::toss(&mut c, &file);
                let known: Vec<_> = TOSS_SIGNALS.iter().map(|row| (row.0, row.1)).collect();
                (rig.map(|rig| Plant::Toss(Box::new(rig))), columns(&mut c, &file, &known))
            }
        };
        Problems::check(std::mem::take(&mut c.problems))?;
        let plant = plant.expect("a missing table is a problem");
        let title = file.title.map_or_else(|| id.clone(), |title| title.value);
        let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        Ok(Self { id, title, plant, log, file: name })
    }
}

/// What a rig is, before its tables are read.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Drive,
    Sensor,
    Contact,
    Command,
    Body,
    Toss,
}

/// Kinds by the names that a model file gives them.
const KINDS: [(&str, Kind); 6] = [
    ("drive", Kind::Drive),
    ("sensor", Kind::Sensor),
    ("contact", Kind::Contact),
    ("command", Kind::Command),
    ("body", Kind::Body),
    ("toss", Kind::Toss),
];

/// Tolerances that a rig of each kind may name.
const TOLERANCES: [(Kind, &[&str]); 6] = [
    (Kind::Command, &["delay_noise", "noise", "clock_offset"]),
    (Kind::Toss, &["stiffness", "restitution", "friction", "inertia", "centre", "surface"]),
    (Kind::Body, &["mass", "inertia", "centre", "accelerometer_bias", "gyroscope_bias", "clock_offset"]),
    (
        Kind::Drive,
        &[
            "motor_inertia",
            "link_inertia",
            "coulomb",
            "viscous",
            "torque_constant",
            "presliding_travel",
            "compliance",
            "offset",
            "clock_offset",
        ],
    ),
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

/// Refuses a rig whose `[log]` lacks a signal without which nothing can be said.
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

fn columns(c: &mut Checker, file: &RigFile, known: &[(&'static str, &'static str)]) -> BTreeMap<String, Column> {
    let mut columns = BTreeMap::new();
    for (name, written) in &file.log {
        let Some((_, unit)) = known.iter().find(|row| row.0 == name) else {
            let names: Vec<&str> = known.iter().map(|row| row.0).collect();
            let message = format!("there is no signal `{name}` on a rig of kind \"{}\"", file.kind.value);
            c.refuse(&written.span, message, suggestion(name, &names));
            continue;
        };
        if let Some(column) = Column::read(c, written, unit) {
            columns.insert(name.clone(), column);
        }
    }
    columns
}

/// Units of a joint's quantities.
#[derive(Clone, Copy)]
struct Units {
    angle: &'static str,
    rate: &'static str,
    torque: &'static str,
    inertia: &'static str,
    viscous: &'static str,
    stiffness: &'static str,
}

const REVOLUTE: Units =
    Units { angle: "rad", rate: "rad/s", torque: "N m", inertia: "kg m^2", viscous: "N m s/rad", stiffness: "N m/rad" };

const PRISMATIC: Units =
    Units { angle: "m", rate: "m/s", torque: "N", inertia: "kg", viscous: "N s/m", stiffness: "N/m" };

fn drive(c: &mut Checker, file: &RigFile) -> Option<DriveRig> {
    let Some(written) = &file.drive else {
        c.refuse(&file.kind.span, "a rig of kind \"drive\" needs the table [drive]", "add [drive] with motor_inertia");
        return None;
    };
    let t = &written.value;
    let prismatic = c.choice(&t.motion, &[("revolute", false), ("prismatic", true)]);
    let u = if prismatic { PRISMATIC } else { REVOLUTE };
    let controller = file.controller.as_ref().map(|table| controller(c, u, &table.value));
    let mut values = drive_values(c, u, t);
    // A torque that is held over a period acts half a period later on the average.
    values.clock_offset = controller.as_ref().map_or(0.0, |controller| 0.5 * controller.period);
    let link_inertia = c.number_or(&t.link_inertia, 0.0, u.inertia, Range::within(0.0, INERTIA));
    let tolerance = tolerance(c, u, &file.tolerance, &values, link_inertia);
    let mut controller = controller;
    for effect in &file.effect {
        add_effect(c, prismatic, effect, &mut values, controller.as_mut());
    }
    Some(DriveRig {
        prismatic,
        values,
        link_inertia,
        gravity_torque: c.number_or(&t.gravity_torque, 0.0, u.torque, Range::size(FORCE)),
        gravity_angle: c.number_or(&t.gravity_angle, 0.0, u.angle, Range::size(ANGLE)),
        payload_radius: c.number_or(&t.payload_radius, 1.0, "m", Range::above(0.0, LENGTH)),
        controller,
        tolerance,
    })
}

/// Sets the parameters that an effect of the model file names, in the drive or on the way to the controller.
fn add_effect(
    c: &mut Checker,
    prismatic: bool,
    written: &EffectTable,
    drive: &mut DriveValues<f64>,
    controller: Option<&mut ControllerRig>,
) {
    let id = &written.id;
    if !is_known(c, written) {
        return;
    }
    match controller {
        Some(controller) if id.value.starts_with('C') => {
            controller.values = with_parameters(c, prismatic, written, &controller.values);
        }
        None if id.value.starts_with('C') => {
            let message = format!("`{}` acts on the way to a controller, and this rig has none", id.value);
            c.refuse(&id.span, message, "add the table [controller], or remove the effect");
        }
        _ => *drive = with_parameters(c, prismatic, written, drive),
    }
}

/// A block's values with those that the effects of its model file name; what has no mean changes none of them.
fn with_effects<B: Bundle<f64>>(c: &mut Checker, prismatic: bool, file: &RigFile, mut values: B) -> B {
    for written in &file.effect {
        let row = EFFECTS.iter().chain(BENCH_EFFECTS).find(|effect| effect.id == written.id.value);
        if is_known(c, written) && row.is_some_and(|effect| effect.group != RANDOM) {
            values = with_parameters(c, prismatic, written, &values);
        }
    }
    values
}

/// The group of effects without a mean.
const RANDOM: &str = "G9";

fn drive_values(c: &mut Checker, u: Units, t: &DriveTable) -> DriveValues<f64> {
    let size = Range::within(0.0, FORCE);
    let stiffness = c.number_or(&t.gear_stiffness, f64::INFINITY, u.stiffness, Range::above(0.0, STIFFNESS));
    DriveValues {
        motor_inertia: c.number(&t.motor_inertia, u.inertia, Range::above(0.0, INERTIA)),
        coulomb: c.number_or(&t.coulomb, 0.0, u.torque, size),
        viscous: c.number_or(&t.viscous, 0.0, u.viscous, Range::within(0.0, DAMPING)),
        stribeck: c.number_or(&t.stribeck, 0.0, u.torque, size),
        stribeck_speed: c.number_or(&t.stribeck_speed, 0.02, u.rate, Range::above(0.0, RATE)),
        presliding_travel: c.number_or(&t.presliding_travel, 1e-4, u.angle, Range::above(0.0, 1.0)),
        compliance: 1.0 / stiffness,
        gear_damping: c.number_or(&t.gear_damping, 0.05, "1", Range::within(0.0, 0.99)),
        half_backlash: 0.5 * c.number_or(&t.backlash, 0.0, u.angle, Range::within(0.0, 1.0)),
        current_lag: c.number_or(&t.current_lag, 0.0, "s", Range::within(0.0, 1.0)),
        torque_limit: c.number_or(&t.torque_limit, UNLIMITED, u.torque, Range::above(0.0, FORCE)),
        offset: c.number_or(&t.offset, 0.0, u.torque, Range::size(FORCE)),
        ..DriveValues::null()
    }
}

fn controller(c: &mut Checker, u: Units, t: &ControllerTable) -> ControllerRig {
    let none = FeedforwardTable::default();
    let f = t.feedforward.as_ref().unwrap_or(&none);
    let filter = c.number_or(&t.derivative_filter, f64::INFINITY, "Hz", Range::above(0.0, 1e6));
    let values = ControllerValues {
        position_gain: c.number(&t.position_gain, u.stiffness, Range::within(0.0, STIFFNESS)),
        velocity_gain: c.number(&t.velocity_gain, u.viscous, Range::within(0.0, DAMPING)),
        derivative_lag: 1.0 / (std::f64::consts::TAU * filter),
        inertia: c.number_or(&f.inertia, 0.0, u.inertia, Range::within(0.0, INERTIA)),
        viscous: c.number_or(&f.viscous, 0.0, u.viscous, Range::within(0.0, DAMPING)),
        coulomb: c.number_or(&f.coulomb, 0.0, u.torque, Range::within(0.0, FORCE)),
        coulomb_speed: c.number_or(&f.coulomb_speed, 1e-9, u.rate, Range::above(0.0, RATE)),
        torque_limit: c.number_or(&t.torque_limit, UNLIMITED, u.torque, Range::above(0.0, FORCE)),
        ..ControllerValues::null()
    };
    ControllerRig {
        period: c.number(&t.period, "s", Range::above(0.0, 1.0)),
        values,
        feedforward: Feedforward {
            gravity_torque: c.number_or(&f.gravity_torque, 0.0, u.torque, Range::size(FORCE)),
            gravity_angle: c.number_or(&f.gravity_angle, 0.0, u.angle, Range::size(ANGLE)),
        },
    }
}

/// Shares become sizes by the values that they belong to; what is known exactly is left out.
fn tolerance(
    c: &mut Checker,
    u: Units,
    t: &ToleranceTable,
    values: &DriveValues<f64>,
    link_inertia: f64,
) -> Vec<(&'static str, f64)> {
    let mut share =
        |written: &Option<Quantity>, of: f64| of.abs() * c.number_or(written, 0.0, "1", Range::within(0.0, 1.0));
    let mut all = vec![
        ("motor_inertia", share(&t.motor_inertia, values.motor_inertia)),
        ("inertia_error", share(&t.link_inertia, link_inertia)),
        ("coulomb", share(&t.coulomb, values.coulomb)),
        ("viscous", share(&t.viscous, values.viscous)),
        ("torque_constant_error", share(&t.torque_constant, 1.0)),
        ("presliding_travel", share(&t.presliding_travel, values.presliding_travel)),
        ("compliance", share(&t.compliance, values.compliance)),
    ];
    all.push(("offset", c.number_or(&t.offset, 0.0, u.torque, Range::within(0.0, FORCE))));
    all.push(("clock_offset", c.number_or(&t.clock_offset, 0.0, "s", Range::within(0.0, 1.0))));
    all.retain(|(_, sd)| *sd > 0.0);
    all
}
