//! Hidden effects of the sensor rig, with plausible sizes.

use crate::catalogue::EffectCase;

/// Effects of the catalogue.
pub(crate) const EFFECTS: &[EffectCase] = &[
    EffectCase::growing("S1_bias", ("force", 2.0, "N"), "constant wrench; moments 0.1 m times the force"),
    EffectCase::growing(
        "S2_drift",
        ("rate", 0.02, "N/s"),
        "wrench growing over the session; moments 0.1 m times the force",
    ),
    EffectCase::growing("S3_gain", ("share", 0.02, ""), "(1 + share) of every channel").up_to(0.5),
    EffectCase::growing("S4_crosstalk", ("share", 0.02, ""), "a share of f_z in f_x").up_to(0.5),
    EffectCase::growing("S5_low_pass", ("time_constant", 0.001, "s"), "1/(T s + 1) on every channel").up_to(0.02),
    EffectCase::growing("S6_quantisation", ("quantum", 4.0, "N"), "rounding; moments to 0.1 m times the force"),
    EffectCase::growing(
        "S7_noise",
        ("deviation", 1.0, "N"),
        "noise of 50 ms correlation time; moments 0.1 m times the force",
    ),
    EffectCase::growing("S8_load", ("mass", 0.15, "kg"), "tool heavier than what is compensated").up_to(3.0),
];

/// Forms outside the catalogue.
pub(crate) const OUTSIDE: &[EffectCase] = &[
    EffectCase::growing("hysteresis", ("half_width", 2.0, "N"), "a force that came from above reads higher"),
    EffectCase::limit("soft_saturation", ("force", 3000.0, "N"), "F / (1 + |F| / force)"),
    EffectCase::growing("temperature_gain", ("share", 0.04, ""), "a gain error that comes with warming up").up_to(0.5),
];
