//! Hidden effects of the contact rig, with plausible sizes.

use crate::catalogue::EffectCase;

/// Effects of the catalogue.
pub(crate) const EFFECTS: &[EffectCase] = &[
    EffectCase::growing("K1_stiffness", ("stiffness", 1.5e4, "N/m"), "dk d"),
    EffectCase::growing("K2_exponent", ("exponent_excess", 0.2, ""), "k d_0 (d/d_0)^(1 + excess) with d_0 = 1 mm")
        .up_to(1.0),
    EffectCase::growing("K3_damping", ("coefficient", 3e5, "N s/m^2"), "lambda d d'"),
    EffectCase::growing("K4_friction", ("coefficient", 0.04, ""), "dmu N").up_to(0.8),
    EffectCase::growing("K5_stick_slip", ("coefficient", 0.08, ""), "dmu exp(-|v|/v_s) N").up_to(0.8),
    EffectCase::growing("K6_anisotropy", ("share", 0.15, ""), "mu (1 + a) along x, mu (1 - a) along y").up_to(0.9),
    EffectCase::growing("K7_surface_offset", ("offset", 1e-4, "m"), "plate nearer than it should be"),
    EffectCase::growing("K8_adhesion", ("force", 10.0, "N"), "tension, gone 0.1 mm from the plate"),
    EffectCase::growing("K9_plastic", ("share", 0.15, ""), "unloading slope k / (1 - share), dent share x deepest")
        .up_to(0.9),
    EffectCase::growing("K10_fixture", ("compliance", 7.5e-7, "m/N"), "plate of 1.5 kg on a spring").from(1e-9),
    EffectCase::growing("S5_low_pass", ("time_constant", 0.001, "s"), "1/(T s + 1) on the force")
        .from(3e-5)
        .up_to(0.02),
];

/// Forms outside the catalogue.
pub(crate) const OUTSIDE: &[EffectCase] = &[
    EffectCase::growing(
        "contact_memory",
        ("stiffness", 3e4, "N/m"),
        "a spring that relaxes in 50 ms beside the contact's",
    ),
    EffectCase::growing("friction_map", ("deviation", 0.05, ""), "friction that changes over the plate").up_to(0.15),
    EffectCase::growing("quadratic_damping", ("coefficient", 5e3, "N s^2/m^2"), "c d' |d'|"),
];
