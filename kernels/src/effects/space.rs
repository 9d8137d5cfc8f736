//! Effects of the simulated bodies.

use super::{Row, at, row, shape};

pub(super) const ROWS: &[Row] = &[
    row(
        "P1_mass",
        &["G5"],
        "body",
        "mass, inertia and centre of mass",
        &[
            at("mass_error", 0.05),
            at("inertia_error", 0.1),
            at("target_com_error_x", 0.02),
            at("target_com_error_y", 0.02),
            at("target_com_error_z", 0.02),
        ],
        "mass properties known to 5 %, the centre to 20 mm, engineering judgement",
    ),
    row(
        "P2_slosh",
        &["G2"],
        "tank",
        "propellant that sways",
        &[at("slosh_share", 0.1), shape("slosh_frequency", 0.5), shape("slosh_damping", 0.02)],
        "a tenth of the mass below 1 Hz, engineering judgement",
    ),
    row(
        "P3_appendage",
        &["G2"],
        "appendage",
        "flexibility",
        &[at("appendage_share", 0.05), shape("appendage_frequency", 3.0), shape("appendage_damping", 0.005)],
        "solar arrays of some hertz with little damping, engineering judgement",
    ),
];
