//! Rig file of one drive.

use crate::clock::Clock;
use crate::drive_fit::{DriveFit, Load, StartValue};
use crate::figures::short;
use crate::joints::{JointColumns, TorqueColumn};
use crate::toml_text::TomlText;
use softdock_campaign::FILL_IN;

/// Units of a joint's quantities.
pub(crate) struct JointUnits {
    pub(crate) angle: &'static str,
    pub(crate) torque: &'static str,
    pub(crate) inertia: &'static str,
    pub(crate) viscous: &'static str,
    pub(crate) stiffness: &'static str,
}

impl JointUnits {
    pub(crate) fn of(prismatic: bool) -> Self {
        if prismatic {
            return Self { angle: "m", torque: "N", inertia: "kg", viscous: "N s/m", stiffness: "N/m" };
        }
        Self { angle: "rad", torque: "N m", inertia: "kg m^2", viscous: "N m s/rad", stiffness: "N m/rad" }
    }
}

/// Fits a joint as a drive alone; none without torque, without its scale, or without an inertia.
pub(crate) fn fit(joint: &JointColumns, clock: &Clock) -> Option<DriveFit> {
    fit_scaled(joint, clock, joint.torque.as_ref()?.scale?)
}

fn fit_scaled(joint: &JointColumns, clock: &Clock, scale: f64) -> Option<DriveFit> {
    let column = joint.torque.as_ref()?;
    let torque: Vec<f64> = column.values.iter().map(|value| value * scale).collect();
    DriveFit::of(&Load {
        time: &clock.time,
        step: clock.step,
        motion: &joint.motion,
        torque: &torque,
        prismatic: joint.prismatic == Some(true),
        model: None,
    })
}

/// Writes `[drive]`, `[tolerance]` and `[log]`.
pub(crate) fn write(out: &mut TomlText, joint: &JointColumns, clock: &Clock, many: bool) {
    let units = JointUnits::of(joint.prismatic == Some(true));
    let fit = fit(joint, clock);
    out.table("drive");
    match joint.prismatic {
        Some(prismatic) => {
            let motion = if prismatic { "\"prismatic\"" } else { "\"revolute\"" };
            out.key("motion", motion, &format!("by the unit and the name of `{}`", joint.position));
        }
        None => out.key("motion", &format!("\"{FILL_IN}\""), "revolute (rad, N m) or prismatic (m, N)"),
    }
    // Without the kind of motion its units are open too.
    match fit.as_ref().filter(|_| joint.prismatic.is_some()) {
        Some(fit) => fitted(out, fit, &units, many, joint.prismatic == Some(true)),
        None => {
            let of_scale =
                fit_scaled(joint, clock, 1.0).filter(|_| joint.torque.as_ref().is_some_and(|t| t.scale.is_none()));
            let of_scale = of_scale.map_or(String::new(), |fit| {
                let share = short(100.0 * fit.unexplained);
                let inertia = short(fit.inertia.value);
                format!("; the log shows {inertia} times the scale of tau ({share} % unexplained): --torque-scale derives it")
            });
            let meaning = format!(
                "inertia of rotor and gear input at the joint's side, with the link's unless link_inertia is written; above \
                 0{of_scale}"
            );
            out.open("motor_inertia", units.inertia, &meaning);
            out.optional("coulomb", &format!("1 {}", units.torque), "Coulomb friction; default none");
            out.optional("viscous", &format!("1 {}", units.viscous), "viscous friction; default none");
            out.optional("offset", &format!("0 {}", units.torque), "torque reported without giving it; default 0");
            let weight = "greatest torque of the weight; default none";
            out.optional("gravity_torque", &format!("1 {}", units.torque), weight);
        }
    }
    out.comment("Further keys, if they are known (a missing key means rigid, without backlash, unlimited):");
    out.optional("link_inertia", &format!("1 {}", units.inertia), "inertia of the link, to be taken off motor_inertia");
    out.optional("gear_stiffness", &format!("1e5 {}", units.stiffness), "above 0");
    out.optional("backlash", &format!("1e-4 {}", units.angle), "whole backlash, 0 to 1");
    out.optional("torque_limit", &format!("100 {}", units.torque), "greatest torque of the motor, above 0");
    tolerance(out, fit.as_ref().filter(|_| joint.prismatic.is_some()), clock, &units);
    log(out, joint, clock, &units);
}

fn fitted(out: &mut TomlText, fit: &DriveFit, units: &JointUnits, many: bool, prismatic: bool) {
    let others = if many { "; the motion of the other joints counts as unexplained" } else { "" };
    let basis = format!(
        "Start values by least squares over this log: inertia, friction, offset and weight leave {} % of the torque \
         unexplained{others}. Replace them by values of the data sheet where you have them.",
        short(100.0 * fit.unexplained)
    );
    out.comment(&basis);
    let scatter =
        |value: &StartValue| format!("standard error over parts of the log: {} %", short(100.0 * value.scatter));
    out.quantity("motor_inertia", fit.inertia.value, units.inertia, &scatter(&fit.inertia));
    for (key, value, unit) in [("coulomb", &fit.coulomb, units.torque), ("viscous", &fit.viscous, units.viscous)] {
        match value {
            Some(value) => out.quantity(key, value.value, unit, &scatter(value)),
            None => out.optional(key, &format!("1 {unit}"), "the log does not show it; default none"),
        }
    }
    match (fit.weight, prismatic) {
        (Some((torque, angle)), false) => {
            out.quantity("gravity_torque", torque, units.torque, "");
            out.quantity("gravity_angle", angle, "rad", "");
        }
        _ => out.optional("gravity_torque", &format!("1 {}", units.torque), "the log shows no weight; default none"),
    }
    out.quantity("offset", fit.offset, units.torque, "");
}

fn tolerance(out: &mut TomlText, fit: Option<&DriveFit>, clock: &Clock, units: &JointUnits) {
    out.table("tolerance");
    out.remark("One standard deviation of what may differ unnoticed; a parameter that is not named is known exactly.");
    let share = |out: &mut TomlText, key: &str, value: &StartValue| {
        let percent = (100.0 * value.scatter).ceil();
        out.key(key, &format!("\"{percent} %\""), "standard error of the start value over parts of the log");
    };
    match fit {
        Some(fit) => {
            share(out, "motor_inertia", &fit.inertia);
            fit.coulomb.iter().for_each(|value| share(out, "coulomb", value));
            fit.viscous.iter().for_each(|value| share(out, "viscous", value));
            let error = "standard error of the start value over parts of the log";
            out.quantity("offset", fit.offset_error, units.torque, error);
            if fit.coulomb.is_some() {
                out.key(
                    "presliding_travel",
                    "\"50 %\"",
                    "the log does not show it; the model file's default is a guess",
                );
            }
            if fit.weight.is_some() {
                out.quantity("gravity_torque", fit.weight_error, units.torque, error);
            }
        }
        None => out.open("motor_inertia", "%", "how well motor_inertia is known, as a share of it; 0 to 100 %"),
    }
    let half = short(500.0 * clock.step);
    out.key("clock_offset", &format!("\"{half} ms\""), "half a step of the log, between the channels");
}

fn log(out: &mut TomlText, joint: &JointColumns, clock: &Clock, units: &JointUnits) {
    out.table("log");
    write_clock(out, clock);
    out.column("q", &joint.position, joint.unit.value, "", &joint.unit.basis);
    if let Some((column, unit)) = &joint.reference {
        out.column("ref", column, unit, "", "");
    }
    if let Some((column, unit)) = &joint.link {
        out.column("q_link", column, unit, "", "");
    }
    match &joint.torque {
        Some(torque) => write_torque(out, "tau", torque, units.torque, torque.scale),
        None => out.column("tau", FILL_IN, units.torque, "", "no column is the torque of this joint"),
    }
}

/// Writes the torque of a joint; `scale` is open where it is unknown.
pub(crate) fn write_torque(out: &mut TomlText, signal: &str, torque: &TorqueColumn, unit: &str, scale: Option<f64>) {
    let unit = if torque.recorded == "N" { "N" } else { unit };
    match scale {
        Some(1.0) => out.column(signal, &torque.name, unit, "", &torque.basis),
        Some(scale) => out.column(signal, &torque.name, unit, &format!(", scale = {scale:?}"), &torque.basis),
        None => {
            let per = torque.recorded;
            let basis = format!("{}; scale: {unit} at the joint's side per {per}, with the gear ratio", torque.basis);
            out.column(signal, &torque.name, unit, &format!(", scale = \"{FILL_IN}\""), &basis);
        }
    }
}

/// Writes the line of the time.
pub(crate) fn write_clock(out: &mut TomlText, clock: &Clock) {
    match (&clock.column, clock.frame) {
        // Rig files have no nanosecond.
        (Some((column, "ns")), None) => out.column("t", column, "s", ", scale = 1e-9", &clock.basis),
        (Some((column, unit)), None) => out.column("t", column, unit, "", &clock.basis),
        (Some((column, unit)), Some(step)) if step > 0.0 => {
            out.column("t", column, unit, &format!(", scale = {step:?}"), &clock.basis);
        }
        (Some((column, unit)), Some(_)) => {
            let basis = format!("{}; scale: seconds per frame", clock.basis);
            out.column("t", column, unit, &format!(", scale = \"{FILL_IN}\""), &basis);
        }
        (None, _) => out.column("t", FILL_IN, "s", "", &clock.basis),
    }
}
