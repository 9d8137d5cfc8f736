//! Effects of the parts that are mounted on the robots.

use super::{Row, at, row, shape};

pub(super) const ROWS: &[Row] = &[
    row(
        "K1_stiffness",
        &["G10"],
        "surface",
        "stiffness error",
        &[at("contact_stiffness_error", 0.2)],
        "engineering judgement",
    ),
    row(
        "K2_exponent",
        &["G10"],
        "surface",
        "error of the exponent of force over depth; none at a depth of 1 mm",
        &[at("contact_exponent_error", 0.2)],
        "between a flat punch (1) and a sphere (1.5), engineering judgement",
    ),
    row(
        "K3_damping",
        &["G10"],
        "surface",
        "damping error",
        &[at("contact_damping_error", 0.3)],
        "engineering judgement",
    ),
    row(
        "K4_friction",
        &["G3", "G11"],
        "surface",
        "friction error",
        &[at("contact_friction_error", 0.3)],
        "MoS2 in air against dry nitrogen, 0.12-0.48 against 0.04-0.41",
    ),
    row(
        "K5_stribeck",
        &["G3"],
        "surface",
        "friction that falls with the sliding speed",
        &[at("contact_stribeck", 0.3), shape("contact_stribeck_speed", 0.01)],
        "static over sliding friction of dry metals, 1.2 to 1.5, engineering judgement",
    ),
    row(
        "K6_anisotropy",
        &["G3"],
        "surface",
        "friction that depends on the direction of sliding",
        &[at("contact_anisotropy", 0.2)],
        "along and across the marks of turning or grinding, engineering judgement",
    ),
    row(
        "K7_surface_offset",
        &["G6", "G1"],
        "mount",
        "place of the parts on the robots",
        &[at("place_error_x", 2e-4), at("place_error_y", 2e-4), at("place_error_z", 2e-4)],
        "reference facility: repeatability of a robot, plus or minus 0.2 mm",
    ),
    row(
        "K8_adhesion",
        &["own"],
        "surface",
        "tension before the parts separate",
        &[at("contact_adhesion", 2.0)],
        "newtons of grease or a detent, engineering judgement",
    ),
    row(
        "K10_fixture",
        &["G2", "G10"],
        "fixture",
        "compliance with a resonance",
        &[at("fixture_compliance", 1e-6), shape("fixture_frequency", 40.0), shape("fixture_damping", 0.02)],
        "plates and adapters on a robot's flange, 1 N/um at 40 Hz, engineering judgement",
    ),
];
