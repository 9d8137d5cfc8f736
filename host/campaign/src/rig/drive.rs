//! One joint with its drive and its controller: what is known of them, and how well.

use crate::check::Checker;
use crate::identified::{is_known, with_parameters};
use crate::written::Quantity;
use crate::written::effect::EffectTable;
use crate::written::rig::{ControllerTable, DriveTable, FeedforwardTable, RigFile, ToleranceTable};
use softdock_kernels::block::controller::ControllerValues;
use softdock_kernels::block::drive::DriveValues;
use softdock_kernels::range::{ANGLE, DAMPING, FORCE, INERTIA, LENGTH, RATE, Range, STIFFNESS, UNLIMITED};

/// One joint with its drive.
#[derive(Clone, Debug)]
pub struct DriveRig {
    /// Whether the joint is prismatic: then read m for rad, N for N m and kg for kg m^2.
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
    pub feedforward: FeedforwardModel,
}

/// Feedforward of a reference's place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FeedforwardModel {
    /// Torque against the weight \[N m\].
    pub gravity_torque: f64,
    /// Angle at which that is greatest \[rad\].
    pub gravity_angle: f64,
}

/// Signals of a rig of one drive: name, unit of a revolute and of a prismatic joint, meaning.
pub const DRIVE_SIGNALS: [(&str, &str, &str, &str); 5] = [
    ("t", "s", "s", "time"),
    ("ref", "rad", "m", "reference position of the controller"),
    ("q", "rad", "m", "position by the motor's encoder, at the joint's side of the gear"),
    ("q_link", "rad", "m", "position by an encoder behind the gear"),
    ("tau", "N m", "N", "commanded torque or force, at the joint's side of the gear"),
];

/// Units of a joint's quantities.
#[derive(Clone, Copy)]
pub(super) struct Units {
    angle: &'static str,
    rate: &'static str,
    torque: &'static str,
    inertia: &'static str,
    viscous: &'static str,
    stiffness: &'static str,
}

pub(super) const REVOLUTE: Units =
    Units { angle: "rad", rate: "rad/s", torque: "N m", inertia: "kg m^2", viscous: "N m s/rad", stiffness: "N m/rad" };

const PRISMATIC: Units =
    Units { angle: "m", rate: "m/s", torque: "N", inertia: "kg", viscous: "N s/m", stiffness: "N/m" };

pub(super) fn drive(c: &mut Checker, file: &RigFile) -> Option<DriveRig> {
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
        feedforward: FeedforwardModel {
            gravity_torque: c.number_or(&f.gravity_torque, 0.0, u.torque, Range::size(FORCE)),
            gravity_angle: c.number_or(&f.gravity_angle, 0.0, u.angle, Range::size(ANGLE)),
        },
    }
}

/// Shares become sizes by the values that they belong to; what is known exactly is left out.
pub(super) fn tolerance(
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
    let gravity = c.number_or(&t.gravity_torque, 0.0, u.torque, Range::within(0.0, FORCE));
    all.extend([("gravity_cos", gravity), ("gravity_sin", gravity)]);
    all.push(("offset", c.number_or(&t.offset, 0.0, u.torque, Range::within(0.0, FORCE))));
    all.push(("clock_offset", c.number_or(&t.clock_offset, 0.0, "s", Range::within(0.0, 1.0))));
    all.retain(|(_, sd)| *sd > 0.0);
    all
}
