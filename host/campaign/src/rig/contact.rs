//! A contact bench: what is known of the contact's law, and how well.

use super::{missing, with_effects};
use crate::check::Checker;
use crate::written::Quantity;
use crate::written::rig::{ContactTable, RigFile, ToleranceTable};
use softdock_kernels::block::contact::ContactValues;
use softdock_kernels::range::{DAMPING, FORCE, Range, STIFFNESS};

/// A point on a body against a plate.
#[derive(Clone, Debug)]
pub struct ContactRig {
    /// The contact as far as it is known.
    pub values: ContactValues<f64>,
    /// Standard deviations of what may differ, by field of [`ContactValues`], in the field's unit.
    pub tolerance: Vec<(&'static str, f64)>,
}

/// Signals of a contact bench: name, unit, meaning; z is the plate's normal, out of it.
pub const CONTACT_SIGNALS: [(&str, &str, &str); 11] = [
    ("t", "s", "time"),
    ("push", "N", "push of the body towards the plate"),
    ("carriage.x", "m", "carriage that slides the body, along x"),
    ("carriage.y", "m", "carriage that slides the body, along y"),
    ("position.x", "m", "contact point over the plate, along x"),
    ("position.y", "m", "contact point over the plate, along y"),
    ("position.z", "m", "contact point over the plate, along z"),
    ("rate.z", "m/s", "rate of position.z, if it is measured; for the identification"),
    ("force.x", "N", "force of the plate on the body, along x"),
    ("force.y", "N", "force of the plate on the body, along y"),
    ("force.z", "N", "force of the plate on the body, along z"),
];

/// Required signals. Of an impact along the normal alone, the lateral ones may be missing.
const NEEDED: [&str; 3] = ["t", "position.z", "force.z"];
/// Lateral forces with the motion that they come from.
const LATERAL: [[&str; 2]; 2] = [["force.x", "position.x"], ["force.y", "position.y"]];

pub(super) fn contact(c: &mut Checker, file: &RigFile) -> Option<ContactRig> {
    let Some(written) = &file.contact else {
        c.refuse(
            &file.kind.span,
            "a rig of kind \"contact\" needs the table [contact]",
            "add [contact] with stiffness",
        );
        return None;
    };
    missing(c, file, &NEEDED);
    for [force, position] in LATERAL {
        if file.log.contains_key(force) {
            missing(c, file, &[position]);
        }
    }
    let values = values(c, &written.value);
    let tolerance = tolerance(c, &file.tolerance, &values);
    let values = with_effects(c, false, file, values);
    Some(ContactRig { values, tolerance })
}

fn values(c: &mut Checker, t: &ContactTable) -> ContactValues<f64> {
    let none = ContactValues::null();
    let length = Range::above(0.0, 1.0);
    ContactValues {
        stiffness: c.number(&t.stiffness, "N/m", Range::above(0.0, STIFFNESS)),
        exponent: c.number_or(&t.exponent, none.exponent, "1", Range::within(0.5, 3.0)),
        damping: c.number_or(&t.damping, 0.0, "N s/m", Range::within(0.0, DAMPING)),
        damping_onset: c.number_or(&t.damping_onset, 0.0, "m", Range::within(0.0, 1.0)),
        friction: c.number_or(&t.friction, 0.0, "1", Range::within(0.0, 10.0)),
        presliding_travel: c.number_or(&t.presliding_travel, none.presliding_travel, "m", length),
        adhesion: c.number_or(&t.adhesion, 0.0, "N", Range::within(0.0, FORCE)),
        adhesion_range: c.number_or(&t.adhesion_range, none.adhesion_range, "m", length),
        fixture_compliance: c.number_or(&t.fixture_compliance, 0.0, "m/N", Range::within(0.0, 1.0)),
        fixture_frequency: c.number_or(&t.fixture_frequency, none.fixture_frequency, "Hz", Range::above(0.0, 1e3)),
        fixture_damping: c.number_or(&t.fixture_damping, none.fixture_damping, "1", Range::within(0.0, 1.0)),
        lag: c.number_or(&t.sensor_lag, 0.0, "s", Range::within(0.0, 1.0)),
        ..none
    }
}

/// Shares become sizes by the values that they belong to; what is known exactly is left out.
fn tolerance(c: &mut Checker, t: &ToleranceTable, values: &ContactValues<f64>) -> Vec<(&'static str, f64)> {
    let mut share = |written: &Option<Quantity>, of: f64| of * c.number_or(written, 0.0, "1", Range::within(0.0, 1.0));
    let mut all = vec![
        ("stiffness", share(&t.stiffness, values.stiffness)),
        ("damping", share(&t.damping, values.damping)),
        ("damping_onset", share(&t.damping_onset, values.damping_onset)),
        ("friction", share(&t.friction, values.friction)),
        ("presliding_travel", share(&t.presliding_travel, values.presliding_travel)),
    ];
    let bias = c.number_or(&t.bias_force, 0.0, "N", Range::within(0.0, FORCE));
    all.extend([("bias_x", bias), ("bias_y", bias), ("bias_z", bias)]);
    all.push(("surface", c.number_or(&t.surface, 0.0, "m", Range::within(0.0, 1.0))));
    all.push(("clock_offset", c.number_or(&t.clock_offset, 0.0, "s", Range::within(0.0, 1.0))));
    all.retain(|(_, sd)| *sd > 0.0);
    all
}
