//! A body tossed onto a plane: what is known of it, and how well.

use super::{missing, with_effects};
use crate::check::Checker;
use crate::written::Quantity;
use crate::written::rig::{RigFile, ToleranceTable, TossTable};
use softdock_kernels::block::toss::TossValues;
use softdock_kernels::manipulator::GRAVITY;
use softdock_kernels::range::{INERTIA, LENGTH, MASS, Range, STIFFNESS};
use softdock_kernels::vector::{Vec3, vec3};

/// A tossed body.
#[derive(Clone, Debug)]
pub struct TossRig {
    /// The body and its contact as far as they are known.
    pub values: TossValues<f64>,
    /// Standard deviations of what may differ, by field of [`TossValues`], in the field's unit.
    pub tolerance: Vec<(&'static str, f64)>,
}

/// Signals of a tossed body: name, unit, meaning; z points up.
pub const TOSS_SIGNALS: [(&str, &str, &str); 9] = [
    ("t", "s", "time since the release, or since any other moment of a toss"),
    ("experiment", "1", "number of the toss, where one file holds several"),
    ("position.x", "m", "middle of the body in the world, along x"),
    ("position.y", "m", "middle of the body in the world, along y"),
    ("position.z", "m", "middle of the body in the world, along z"),
    ("orientation.w", "1", "quaternion from body to world axes, w"),
    ("orientation.x", "1", "quaternion from body to world axes, x"),
    ("orientation.y", "1", "quaternion from body to world axes, y"),
    ("orientation.z", "1", "quaternion from body to world axes, z"),
];

/// Required signals.
const NEEDED: [&str; 8] =
    ["t", "position.x", "position.y", "position.z", "orientation.w", "orientation.x", "orientation.y", "orientation.z"];

pub(super) fn toss(c: &mut Checker, file: &RigFile) -> Option<TossRig> {
    let Some(written) = &file.toss else {
        c.refuse(
            &file.kind.span,
            "a rig of kind \"toss\" needs the table [toss]",
            "add [toss] with mass and half_width",
        );
        return None;
    };
    missing(c, file, &NEEDED);
    let values = values(c, &written.value);
    let tolerance = tolerance(c, &file.tolerance, &values);
    let values = with_effects(c, false, file, values);
    Some(TossRig { values, tolerance })
}

fn values(c: &mut Checker, t: &TossTable) -> TossValues<f64> {
    let half_width = c.number(&t.half_width, "m", Range::above(0.0, LENGTH));
    let gravity = c.number_or(&t.gravity, GRAVITY, "m/s^2", Range::within(0.0, 100.0));
    TossValues {
        mass: c.number(&t.mass, "kg", Range::above(0.0, MASS)),
        inertia: Vec3::splat(c.number(&t.inertia, "kg m^2", Range::above(0.0, INERTIA))),
        half_width,
        corner_radius: c.number_or(&t.corner_radius, 0.0, "m", Range::within(0.0, half_width)),
        gravity: vec3(0.0, 0.0, -gravity),
        stiffness: c.number(&t.stiffness, "N/m", Range::above(0.0, STIFFNESS)),
        restitution: c.number(&t.restitution, "1", Range::within(0.0, 1.0)),
        friction: c.number(&t.friction, "1", Range::within(0.0, 10.0)),
        ..TossValues::null()
    }
}

/// Shares become sizes by the values that they belong to; what is known exactly is left out.
fn tolerance(c: &mut Checker, t: &ToleranceTable, values: &TossValues<f64>) -> Vec<(&'static str, f64)> {
    let mut share = |written: &Option<Quantity>, of: f64| of * c.number_or(written, 0.0, "1", Range::within(0.0, 1.0));
    let inertia = share(&t.inertia, values.inertia.x);
    let mut all = vec![
        ("stiffness", share(&t.stiffness, values.stiffness)),
        ("restitution", share(&t.restitution, values.restitution)),
        ("friction", share(&t.friction, values.friction)),
        ("inertia_x", inertia),
        ("inertia_y", inertia),
        ("inertia_z", inertia),
    ];
    let centre = c.number_or(&t.centre, 0.0, "m", Range::within(0.0, 1.0));
    all.extend([("centre_x", centre), ("centre_y", centre), ("centre_z", centre)]);
    all.push(("surface", c.number_or(&t.surface, 0.0, "m", Range::within(0.0, 1.0))));
    all.retain(|(_, sd)| *sd > 0.0);
    all
}
