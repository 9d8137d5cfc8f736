//! Hidden effects of the robot, all in its shoulder, with plausible sizes.

use crate::catalogue::EffectCase;

/// Effects of the catalogue.
pub(crate) const EFFECTS: &[EffectCase] = &[
    EffectCase::growing("J1_coulomb", ("level", 6.0, "N m"), "dFc sgn v").up_to(60.0),
    EffectCase::growing("J2_viscous", ("viscous", 8.0, "N m s/rad"), "db v"),
    EffectCase::growing("J3_stribeck", ("level", 12.0, "N m"), "dFs exp(-|v/v_s|) sgn v"),
    EffectCase::growing("J5_load_friction", ("share", 0.1, ""), "f |static load of the gear| sgn v").up_to(1.0),
    EffectCase::growing(
        "J8_elasticity",
        ("compliance", 5e-6, "rad/(N m)"),
        "compliance of the gear beyond the model's",
    ),
    EffectCase::growing("J11_torque_constant", ("share", 0.05, ""), "(1 + share) tau").up_to(0.5),
    EffectCase::growing("J15_link_inertia", ("inertia", 2.0, "kg m^2"), "dJ a about the shoulder"),
    EffectCase::growing("J16_gravity_compensation", ("torque", 12.0, "N m"), "dG cos q"),
    EffectCase::growing("J17_cable", ("stiffness", 25.0, "N m/rad"), "k (q - q_0) with q_0 = 0"),
    EffectCase::growing(
        "J18_direction_friction",
        ("half_difference", 4.0, "N m"),
        "Fc + d for v > 0, Fc - d for v < 0",
    )
    .up_to(20.0),
];

/// Forms outside the catalogue.
pub(crate) const OUTSIDE: &[EffectCase] = &[
    EffectCase::growing("quadratic_drag", ("coefficient", 30.0, "N m s^2/rad^2"), "-c v |v|"),
    EffectCase::growing("friction_map", ("deviation", 7.0, "N m"), "Coulomb friction that changes with the angle")
        .up_to(25.0),
];
