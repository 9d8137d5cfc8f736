//! A free body under known wrenches: what is known of it, and how well.

use super::{missing, with_effects};
use crate::check::Checker;
use crate::written::rig::{BodyTable, RigFile, ToleranceTable};
use softdock_kernels::block::body::BodyValues;
use softdock_kernels::range::{INERTIA, LENGTH, MASS, RATE, Range};
use softdock_kernels::vector::vec3;

/// A free body.
#[derive(Clone, Debug)]
pub struct BodyRig {
    /// The body as far as it is known.
    pub values: BodyValues<f64>,
    /// Standard deviations of what may differ, by field of [`BodyValues`], in the field's unit.
    pub tolerance: Vec<(&'static str, f64)>,
}

/// Signals of a free body: name, unit, meaning; vectors in body axes unless stated otherwise.
pub const BODY_SIGNALS: [(&str, &str, &str); 20] = [
    ("t", "s", "time"),
    ("force.x", "N", "force on the body from this stamp to the next, along x"),
    ("force.y", "N", "force on the body, along y"),
    ("force.z", "N", "force on the body, along z"),
    ("moment.x", "N m", "moment about the origin, along x"),
    ("moment.y", "N m", "moment about the origin, along y"),
    ("moment.z", "N m", "moment about the origin, along z"),
    ("position.x", "m", "origin in the world, along x; not judged"),
    ("position.y", "m", "origin in the world, along y; not judged"),
    ("position.z", "m", "origin in the world, along z; not judged"),
    ("orientation.w", "1", "quaternion from body to world axes, w; not judged"),
    ("orientation.x", "1", "quaternion from body to world axes, x; not judged"),
    ("orientation.y", "1", "quaternion from body to world axes, y; not judged"),
    ("orientation.z", "1", "quaternion from body to world axes, z; not judged"),
    ("acceleration.x", "m/s^2", "acceleration of the origin, along x"),
    ("acceleration.y", "m/s^2", "acceleration of the origin, along y"),
    ("acceleration.z", "m/s^2", "acceleration of the origin, along z"),
    ("rate.x", "rad/s", "angular rate, along x"),
    ("rate.y", "rad/s", "angular rate, along y"),
    ("rate.z", "rad/s", "angular rate, along z"),
];

/// Required signals.
const NEEDED: [&str; 13] = [
    "t",
    "force.x",
    "force.y",
    "force.z",
    "moment.x",
    "moment.y",
    "moment.z",
    "acceleration.x",
    "acceleration.y",
    "acceleration.z",
    "rate.x",
    "rate.y",
    "rate.z",
];

pub(super) fn body(c: &mut Checker, file: &RigFile) -> Option<BodyRig> {
    let Some(written) = &file.body else {
        c.refuse(&file.kind.span, "a rig of kind \"body\" needs the table [body]", "add [body] with mass and inertia");
        return None;
    };
    missing(c, file, &NEEDED);
    let values = values(c, &written.value);
    let tolerance = tolerance(c, &file.tolerance, &values);
    let values = with_effects(c, false, file, values);
    Some(BodyRig { values, tolerance })
}

fn values(c: &mut Checker, t: &BodyTable) -> BodyValues<f64> {
    let mut centre = |written| c.number_or(written, 0.0, "m", Range::size(LENGTH));
    let centre = vec3(centre(&t.centre_x), centre(&t.centre_y), centre(&t.centre_z));
    let mut moment = |written| c.number(written, "kg m^2", Range::above(0.0, INERTIA));
    let inertia = vec3(moment(&t.inertia_x), moment(&t.inertia_y), moment(&t.inertia_z));
    let mass = c.number(&t.mass, "kg", Range::above(0.0, MASS));
    BodyValues { mass, centre, inertia, ..BodyValues::null() }
}

/// Shares become sizes by the values that they belong to; what is known exactly is left out.
fn tolerance(c: &mut Checker, t: &ToleranceTable, values: &BodyValues<f64>) -> Vec<(&'static str, f64)> {
    let share = Range::within(0.0, 1.0);
    let (mass, inertia) = (c.number_or(&t.mass, 0.0, "1", share), c.number_or(&t.inertia, 0.0, "1", share));
    let centre = c.number_or(&t.centre, 0.0, "m", share);
    let accelerometer = c.number_or(&t.accelerometer_bias, 0.0, "m/s^2", Range::within(0.0, 100.0));
    let gyroscope = c.number_or(&t.gyroscope_bias, 0.0, "rad/s", Range::within(0.0, RATE));
    let mut all = vec![
        ("mass", mass * values.mass),
        ("centre_x", centre),
        ("centre_y", centre),
        ("centre_z", centre),
        ("inertia_x", inertia * values.inertia.x),
        ("inertia_y", inertia * values.inertia.y),
        ("inertia_z", inertia * values.inertia.z),
        ("accelerometer_bias_x", accelerometer),
        ("accelerometer_bias_y", accelerometer),
        ("accelerometer_bias_z", accelerometer),
        ("gyroscope_bias_x", gyroscope),
        ("gyroscope_bias_y", gyroscope),
        ("gyroscope_bias_z", gyroscope),
        ("clock_offset", c.number_or(&t.clock_offset, 0.0, "s", Range::within(0.0, 1.0))),
    ];
    all.retain(|(_, sd)| *sd > 0.0);
    all
}
