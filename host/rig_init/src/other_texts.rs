//! Rig files of commands, sensors, contacts, free bodies and tosses.

use crate::clock::Clock;
use crate::drive_text::write_clock;
use crate::figures::{rms, short};
use crate::joints::JointColumns;
use crate::names::{Meaning, Origin};
use crate::recorded_table::{LogColumn, RecordedTable};
use crate::toml_text::TomlText;
use softdock_campaign::FILL_IN;

/// Meaning of a tolerance that is a share.
const SHARE: &str = "how well it is known, as a share of it; 0 to 100 %";

/// Signals of vectors: name, quantity, components, unit, whether the values are known ones.
type Vectors = [(&'static str, Meaning, &'static str, &'static str, bool)];

const WRENCH: &Vectors =
    &[("force", Meaning::Force, "xyz", "N", false), ("moment", Meaning::Moment, "xyz", "N m", false)];
const KNOWN: &Vectors =
    &[("reference.force", Meaning::Force, "xyz", "N", true), ("reference.moment", Meaning::Moment, "xyz", "N m", true)];
const ORIENTATION: &Vectors = &[("orientation", Meaning::Orientation, "wxyz", "1", false)];
const PLACE: &Vectors = &[("position", Meaning::Place, "xyz", "m", false)];
const MOTION: &Vectors = &[
    ("acceleration", Meaning::BodyAcceleration, "xyz", "m/s^2", false),
    ("rate", Meaning::BodyRate, "xyz", "rad/s", false),
];

fn vectors(out: &mut TomlText, table: &RecordedTable, rows: &Vectors, needed: bool) {
    for (signal, meaning, components, unit, reference) in rows {
        for component in components.chars() {
            let name = format!("{signal}.{component}");
            match table.component(*meaning, component, *reference) {
                Some(column) => {
                    let unit = column.parsed.unit.filter(|_| *unit != "1").unwrap_or(unit);
                    let basis =
                        if column.parsed.unit.is_some() || unit == "1" { "" } else { "unit not in the name: check it" };
                    out.column(&name, &column.name, unit, "", basis);
                }
                None if needed => out.column(&name, FILL_IN, unit, "", ""),
                None => {}
            }
        }
    }
}

/// A command's way: an event and what it moved, or command and position of a servo.
pub(crate) fn command(out: &mut TomlText, table: &RecordedTable, clock: &Clock, joint: Option<&JointColumns>) {
    out.table("command");
    let prismatic = joint.is_some_and(|joint| joint.prismatic == Some(true));
    out.key("motion", if prismatic { "\"prismatic\"" } else { "\"revolute\"" }, "by the units of the log");
    let period = format!("one row of the log ({}); correct it if commands are sent at another rate", clock.basis);
    match clock.column {
        Some(_) => out.quantity("period", 1e3 * clock.step, "ms", &period),
        None => out.open("period", "s", "from one packet to the next; above 0, at most 1 s"),
    }
    out.optional("transport_delay", "0 ms", "known delay from sender to receiver; default none");
    if joint.is_some() && event(table).is_none() {
        out.key("received", "\"position\"", "the log has the position of the servo, no echo of the command");
    }
    out.table("tolerance");
    let meaning = "standard deviation of the healthy delay's jitter, above 0; without it no jitter is too much";
    out.optional("delay_noise", "1 ms", meaning);
    out.table("log");
    write_clock(out, clock);
    if let Some((column, unit)) = &clock.other {
        let (unit, scale) = if *unit == "ns" { ("s", ", scale = 1e-9") } else { (*unit, "") };
        out.column("received.t", column, unit, scale, "the second clock of the log");
    }
    let angle = if prismatic { "m" } else { "rad" };
    match (event(table), joint) {
        (Some(event), _) => {
            let basis = "0 and 1 only: 1 from the row in which the command left";
            out.column("sent.event", &event.name, "1", "", basis);
            let axis = joint.and_then(|joint| joint.axis);
            for (signal, origins) in
                [("target.rate", &[Origin::Reference][..]), ("motion.rate", &[Origin::Measured, Origin::Plain])]
            {
                if let Some(column) = table.joint(Meaning::Rate, axis, origins) {
                    let unit = column.parsed.unit.unwrap_or(if prismatic { "m/s" } else { "rad/s" });
                    let basis = joint.map_or(String::new(), |joint| format!("{} moves most", joint.title()));
                    out.column(signal, &column.name, unit, "", &basis);
                }
            }
        }
        (None, Some(joint)) => {
            let (sent, unit) = joint.reference.clone().unwrap_or((FILL_IN.to_owned(), angle));
            out.column("sent", &sent, unit, "", "command of the position");
            let basis = format!("measured position; {}", joint.unit.basis);
            out.column("received", &joint.position, joint.unit.value, "", &basis);
        }
        (None, None) => {
            out.column("sent", FILL_IN, angle, "", "command as it was sent");
            out.column("received", FILL_IN, angle, "", "command in force at the receiver");
        }
    }
}

/// A flag of 0 and 1 that changes.
pub(crate) fn event(table: &RecordedTable) -> Option<&LogColumn> {
    table.of(Meaning::Event).find(|column| {
        let is_flag = column.values.iter().all(|value| *value == 0.0 || *value == 1.0);
        is_flag && column.extent() == (0.0, 1.0)
    })
}

/// A force/torque sensor under known loads.
pub(crate) fn sensor(out: &mut TomlText, table: &RecordedTable, clock: &Clock) {
    out.table("sensor");
    out.open(
        "tool_mass",
        "kg",
        "mass of the tool between sensor and load, as the compensation has it; 0 kg without a tool",
    );
    out.optional("noise_force", "0.1 N", &noise(table, Meaning::Force));
    out.optional("noise_moment", "0.01 N m", &noise(table, Meaning::Moment));
    out.optional("range_force", "1000 N", "greatest force that is read; default unlimited");
    out.table("tolerance");
    out.open("bias_force", "N", "force read without any, each axis: standard deviation; 0 or more");
    out.open("bias_moment", "N m", "moment read without any, each axis: standard deviation; 0 or more");
    out.open("gain", "%", "gain of all channels alike: standard deviation; 0 to 100 %");
    out.table("log");
    write_clock(out, clock);
    vectors(out, table, KNOWN, true);
    vectors(out, table, ORIENTATION, false);
    vectors(out, table, MOTION, false);
    vectors(out, table, WRENCH, true);
}

/// White noise of a channel by its second differences.
fn noise(table: &RecordedTable, meaning: Meaning) -> String {
    let Some(column) = table.component(meaning, 'x', false) else { return "noise at rest".to_owned() };
    let second: Vec<f64> = column.values.windows(3).map(|row| row[0] - 2.0 * row[1] + row[2]).collect();
    format!("noise at rest; second differences of `{}` give at most {}", column.name, short(rms(&second) / 6f64.sqrt()))
}

/// A body against a plate.
pub(crate) fn contact(out: &mut TomlText, table: &RecordedTable, clock: &Clock) {
    out.table("contact");
    out.open("stiffness", "N/m", "normal stiffness at a depth of 1 mm; above 0");
    out.optional("damping", "100 N s/m", "default none");
    out.optional("friction", "0.2", "friction coefficient; default none");
    out.optional("exponent", "1", "exponent of force over depth, 0.5 to 3; default 1");
    out.table("tolerance");
    out.open("stiffness", "%", SHARE);
    out.open("surface", "mm", "height of the surface z = 0: standard deviation; 0 or more");
    out.open("bias_force", "N", "force read without any, each axis: standard deviation; 0 or more");
    out.table("log");
    write_clock(out, clock);
    out.comment("z is the normal of the plate, out of it; z = 0 is its surface. Forces act on the body.");
    vectors(out, table, PLACE, true);
    vectors(out, table, &WRENCH[..1], true);
}

/// A free body under known wrenches.
pub(crate) fn body(out: &mut TomlText, table: &RecordedTable, clock: &Clock) {
    out.table("body");
    out.open("mass", "kg", "mass of the whole; above 0");
    for axis in ["x", "y", "z"] {
        out.open(&format!("inertia_{axis}"), "kg m^2", &format!("about the centre of mass, about {axis}; above 0"));
    }
    out.optional("centre_x", "0 m", "centre of mass in body axes; default the origin; also centre_y, centre_z");
    out.table("tolerance");
    out.open("mass", "%", SHARE);
    out.open("inertia", "%", "how well the moments of inertia are known, each axis; 0 to 100 %");
    out.open("centre", "mm", "how well the centre of mass is known, each axis; 0 or more");
    out.table("log");
    write_clock(out, clock);
    vectors(out, table, WRENCH, true);
    vectors(out, table, MOTION, true);
    vectors(out, table, PLACE, false);
    vectors(out, table, ORIENTATION, false);
}

/// A body tossed onto a plane.
pub(crate) fn toss(out: &mut TomlText, table: &RecordedTable, clock: &Clock) {
    out.table("toss");
    out.open("mass", "kg", "mass; above 0");
    out.open("inertia", "kg m^2", "moment of inertia about the middle, about every axis; above 0");
    out.open("half_width", "m", "half the edge of the box; above 0");
    out.open("restitution", "", "speed after a blow over that before; 0 to 1");
    out.open("friction", "", "friction coefficient; 0 or more");
    out.key("stiffness", "\"100 N/mm\"", "of a corner; assumed: a blow is to be shorter than a frame");
    out.table("tolerance");
    out.remark(
        "A parameter that is not named is known exactly. Further keys: restitution, stiffness, surface, centre.",
    );
    out.open("friction", "%", SHARE);
    out.open("inertia", "%", SHARE);
    out.table("log");
    write_clock(out, clock);
    if let Some(column) = table.of(Meaning::Experiment).next() {
        out.column("experiment", &column.name, "1", "", "number of the toss");
    }
    out.comment("World axes with z upwards; the plane is z = 0. Quaternion from body to world axes.");
    vectors(out, table, PLACE, true);
    vectors(out, table, ORIENTATION, true);
}

/// The joint with the largest speed.
pub(crate) fn fastest(joints: &[JointColumns]) -> Option<&JointColumns> {
    let speed = |joint: &JointColumns| rms(&joint.motion.rate);
    joints.iter().max_by(|a, b| speed(a).total_cmp(&speed(b)))
}
