//! A force/torque sensor bench: what is known of the sensor and its tool, and how well.

use super::{missing, with_effects};
use crate::check::Checker;
use crate::written::rig::{RigFile, SensorTable, ToleranceTable};
use softdock_kernels::block::sensor::SensorValues;
use softdock_kernels::manipulator::GRAVITY;
use softdock_kernels::range::{FORCE, INERTIA, LENGTH, MASS, Range, UNLIMITED};

/// A force/torque sensor with a tool, under known loads.
#[derive(Clone, Debug)]
pub struct SensorRig {
    /// The sensor as far as it is known.
    pub values: SensorValues<f64>,
    /// Gravity along -z of the world \[m/s^2\].
    pub gravity: f64,
    /// Standard deviation of the noise of force \[N\] and moment \[N m\] at rest, if it is known.
    pub noise: Option<[f64; 2]>,
    /// Standard deviation of what that is known to, as a share of it.
    pub noise_share: f64,
    /// Standard deviations of what may differ, by field of [`SensorValues`], in the field's unit.
    pub tolerance: Vec<(&'static str, f64)>,
}

/// Signals of a sensor bench: name, unit, meaning; vectors in sensor axes.
pub const SENSOR_SIGNALS: [(&str, &str, &str); 23] = [
    ("t", "s", "time"),
    ("reference.force.x", "N", "known force on the sensor, along x"),
    ("reference.force.y", "N", "known force on the sensor, along y"),
    ("reference.force.z", "N", "known force on the sensor, along z"),
    ("reference.moment.x", "N m", "known moment about its origin, along x"),
    ("reference.moment.y", "N m", "known moment about its origin, along y"),
    ("reference.moment.z", "N m", "known moment about its origin, along z"),
    ("orientation.w", "1", "quaternion from sensor to world axes, w"),
    ("orientation.x", "1", "quaternion from sensor to world axes, x"),
    ("orientation.y", "1", "quaternion from sensor to world axes, y"),
    ("orientation.z", "1", "quaternion from sensor to world axes, z"),
    ("acceleration.x", "m/s^2", "acceleration of the sensor's origin without gravity, along x"),
    ("acceleration.y", "m/s^2", "acceleration of the sensor's origin without gravity, along y"),
    ("acceleration.z", "m/s^2", "acceleration of the sensor's origin without gravity, along z"),
    ("rate.x", "rad/s", "angular rate, along x"),
    ("rate.y", "rad/s", "angular rate, along y"),
    ("rate.z", "rad/s", "angular rate, along z"),
    ("force.x", "N", "force that the sensor reads, along x"),
    ("force.y", "N", "force that the sensor reads, along y"),
    ("force.z", "N", "force that the sensor reads, along z"),
    ("moment.x", "N m", "moment that it reads, along x"),
    ("moment.y", "N m", "moment that it reads, along y"),
    ("moment.z", "N m", "moment that it reads, along z"),
];

/// Required signals.
const NEEDED: [&str; 17] = [
    "t",
    "reference.force.x",
    "reference.force.y",
    "reference.force.z",
    "reference.moment.x",
    "reference.moment.y",
    "reference.moment.z",
    "orientation.w",
    "orientation.x",
    "orientation.y",
    "orientation.z",
    "force.x",
    "force.y",
    "force.z",
    "moment.x",
    "moment.y",
    "moment.z",
];

/// Default ratio of moments to forces \[m\].
const LEVER: f64 = 0.1;

pub(super) fn sensor(c: &mut Checker, file: &RigFile) -> Option<SensorRig> {
    let Some(written) = &file.sensor else {
        c.refuse(&file.kind.span, "a rig of kind \"sensor\" needs the table [sensor]", "add [sensor] with tool_mass");
        return None;
    };
    missing(c, file, &NEEDED);
    let t = &written.value;
    let size = Range::above(0.0, FORCE);
    let range = c.number_or(&t.range_force, UNLIMITED, "N", size);
    let lever = match &t.range_moment {
        Some(moment) if t.range_force.is_some() => c.number(moment, "N m", size) / range,
        Some(moment) => {
            c.refuse(&moment.span, "`range_moment` needs `range_force`", "write both, as on the data sheet");
            LEVER
        }
        None => LEVER,
    };
    let noise = t.noise_force.as_ref().map(|force| {
        let force = c.number(force, "N", size);
        [force, c.number_or(&t.noise_moment, force * lever, "N m", size)]
    });
    let values = SensorValues { range, lever, ..tool(c, t) };
    let values = with_effects(c, false, file, values);
    Some(SensorRig {
        values,
        gravity: c.number_or(&t.gravity, GRAVITY, "m/s^2", Range::within(0.0, 100.0)),
        noise,
        noise_share: c.number_or(&file.tolerance.noise, 0.1, "1", Range::within(0.0, 1.0)),
        tolerance: tolerance(c, &file.tolerance),
    })
}

fn tool(c: &mut Checker, t: &SensorTable) -> SensorValues<f64> {
    SensorValues {
        tool_mass: c.number_or(&t.tool_mass, 0.0, "kg", Range::within(0.0, MASS)),
        tool_centre: c.vector_or_zero(&t.tool_centre, "m", Range::size(LENGTH)),
        tool_inertia: c.vector_or_zero(&t.tool_inertia, "kg m^2", Range::within(0.0, INERTIA)),
        ..SensorValues::null()
    }
}

/// What is known exactly is left out.
fn tolerance(c: &mut Checker, t: &ToleranceTable) -> Vec<(&'static str, f64)> {
    let force = c.number_or(&t.bias_force, 0.0, "N", Range::within(0.0, FORCE));
    let moment = c.number_or(&t.bias_moment, 0.0, "N m", Range::within(0.0, FORCE));
    let mut all: Vec<(&'static str, f64)> = vec![
        ("bias_force_x", force),
        ("bias_force_y", force),
        ("bias_force_z", force),
        ("bias_moment_x", moment),
        ("bias_moment_y", moment),
        ("bias_moment_z", moment),
        ("gain", c.number_or(&t.gain, 0.0, "1", Range::within(0.0, 1.0))),
        ("tool_mass", c.number_or(&t.tool_mass, 0.0, "kg", Range::within(0.0, MASS))),
        ("clock_offset", c.number_or(&t.clock_offset, 0.0, "s", Range::within(0.0, 1.0))),
    ];
    all.retain(|(_, sd)| *sd > 0.0);
    all
}
