//! Hidden effects of the facility, with plausible sizes.

use crate::catalogue::EffectCase;

/// Effects of the catalogue.
pub(crate) const EFFECTS: &[EffectCase] = &[
    EffectCase::growing("C1_transport_delay", ("delay", 3e-3, "s"), "commands later by this"),
    EffectCase::growing("C2_lag", ("lag", 4e-3, "s"), "1/w of robot 1 longer by this"),
    EffectCase::growing("S3_gain", ("share", 0.04, ""), "(1 + share) of the force along the approach").up_to(0.5),
    EffectCase::growing("S4_crosstalk", ("share", 0.02, ""), "a share of every force in both others, likewise moments")
        .up_to(0.3),
    EffectCase::growing("S5_low_pass", ("time_constant", 2e-3, "s"), "T of 1/(T s + 1) longer by this"),
    EffectCase::growing("S5_delay", ("delay", 2e-3, "s"), "wrench later by this"),
    EffectCase::growing("K1_stiffness", ("share", 0.1, ""), "(1 + share) K"),
    EffectCase::growing("K2_exponent", ("excess", 0.1, ""), "K d^n (d / 1 mm)^excess").up_to(0.6),
    EffectCase::growing("K3_damping", ("share", 0.5, ""), "(1 + share) a of K d^n (1 + a d')").up_to(4.0),
    EffectCase::growing("K4_friction", ("share", 0.2, ""), "(1 + share) mu").up_to(2.0),
    EffectCase::growing("K7_surface_offset", ("offset", 1e-4, "m"), "plate nearer than measured by the robots"),
    EffectCase::growing("K10_fixture", ("compliance", 1e-6, "m/N"), "plate on a spring and damper").from(1e-9),
];

/// Forms outside the catalogue.
pub(crate) const OUTSIDE: &[EffectCase] = &[
    EffectCase::growing("robot_compliance", ("compliance", 1e-6, "m/N"), "robot 2 gives way to the contact's force"),
    EffectCase::growing("robot_tilt", ("angle", 2e-3, "rad"), "robot 1 moves aside as it moves ahead").up_to(0.1),
    EffectCase::growing("sensor_hysteresis", ("half_width", 1.0, "N"), "a force that came from above reads higher"),
    EffectCase::growing("stiffness_map", ("deviation", 0.1, ""), "stiffness that changes over the plate").up_to(0.6),
    EffectCase::growing(
        "contact_memory",
        ("share", 0.1, ""),
        "a spring that relaxes in 50 ms beside the contact's, as a share of K",
    )
    .up_to(1.0),
];
