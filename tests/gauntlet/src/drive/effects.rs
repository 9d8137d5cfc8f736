//! Hidden effects of the drive, with plausible sizes.

use crate::catalogue::EffectCase;

/// Effects of the catalogue.
pub(crate) const EFFECTS: &[EffectCase] = &[
    EffectCase::growing("J1_coulomb", ("level", 4.0, "N m"), "dFc sgn v"),
    EffectCase::growing("J2_viscous", ("viscous", 6.0, "N m s/rad"), "db v"),
    EffectCase::growing("J3_stribeck", ("level", 8.0, "N m"), "dFs exp(-|v/v_s|) sgn v"),
    EffectCase::growing("J4_presliding", ("travel", 0.0008, "rad"), "bristle travel beyond the model's"),
    EffectCase::growing("J5_load_friction", ("share", 0.15, ""), "f |static load of the gear| sgn v").up_to(1.0),
    EffectCase::growing("J6_warm_up", ("loss", 0.4, ""), "viscous friction b exp(-loss (1 - exp(-t/T)))").up_to(5.0),
    EffectCase::growing("J7_backlash", ("half_gap", 0.0005, "rad"), "dead zone between motor and link"),
    EffectCase::growing("J8_elasticity", ("compliance", 1.17e-5, "rad/(N m)"), "linear spring between motor and link")
        .from(2e-9),
    EffectCase::growing("J9_torque_ripple", ("amplitude", 3.0, "N m"), "A sin(n q + phase)"),
    EffectCase::growing("J10_transmission_error", ("amplitude", 0.0003, "rad"), "q_l = q + e sin(n q + phase)")
        .up_to(0.01),
    EffectCase::growing("J11_torque_constant", ("share", 0.05, ""), "(1 + share) tau").up_to(0.5),
    EffectCase::growing("J12_current_loop", ("time_constant", 0.002, "s"), "1/(T s + 1) on the torque")
        .from(5e-5)
        .up_to(0.01),
    EffectCase::limit("J13_saturation", ("limit", 230.0, "N m"), "torque cut at the limit"),
    EffectCase::growing("J14_payload", ("mass", 1.5, "kg"), "m (r^2 a + g r cos q) at the payload's radius"),
    EffectCase::growing("J15_link_inertia", ("inertia", 1.5, "kg m^2"), "dJ a"),
    EffectCase::growing("J16_gravity_compensation", ("torque", 5.0, "N m"), "dG cos q"),
    EffectCase::growing("J17_cable", ("stiffness", 10.0, "N m/rad"), "k (q - q_0) with q_0 = 0"),
    EffectCase::growing(
        "J18_direction_friction",
        ("half_difference", 3.0, "N m"),
        "Fc + d for v > 0, Fc - d for v < 0",
    )
    .up_to(15.0),
    EffectCase::growing("C1_transport_delay", ("delay", 0.003, "s"), "reference received T later"),
    EffectCase::growing("C2_lag", ("time_constant", 0.003, "s"), "1/(T s + 1) on the reference"),
    EffectCase::growing("C5_skew", ("skew", 0.0005, ""), "reference's clock slow by a share").up_to(0.02),
    EffectCase::growing("C6_hold", ("period", 0.004, "s"), "reference held over a period").up_to(0.04),
    EffectCase::limit("C7_rate_limit", ("rate", 0.9, "rad/s"), "|d ref/dt| <= rate"),
];

/// Forms outside the catalogue. `stribeck_squared` is the catalogue's J3 with another exponent: naming J3 is right there.
pub(crate) const OUTSIDE: &[EffectCase] = &[
    EffectCase::growing("quadratic_drag", ("coefficient", 25.0, "N m s^2/rad^2"), "-c v |v|"),
    EffectCase::growing("cubic_drag", ("coefficient", 30.0, "N m s^3/rad^3"), "-c v^3"),
    EffectCase::growing("friction_map", ("deviation", 5.0, "N m"), "Coulomb friction that changes with the angle")
        .up_to(18.0),
    EffectCase::growing(
        "second_resonance",
        ("compliance", 3.0e-5, "rad/(N m)"),
        "an elastic part of the link's inertia",
    )
    .from(1e-9),
    EffectCase::growing("asymmetric_backlash", ("gap", 0.0005, "rad"), "one flank loose, six times softer"),
    EffectCase::growing("load_dependent_delay", ("delay", 0.003, "s"), "reference received T |tau| / 100 N m later")
        .up_to(0.02),
    EffectCase::growing("table_kinematics", ("amplitude", 0.0008, "rad"), "periodic error of triangular shape")
        .up_to(0.005),
    EffectCase::growing("temperature_load", ("share", 0.2, ""), "f |static load| sgn v that comes with warming up")
        .up_to(1.0),
    EffectCase::growing("stribeck_squared", ("level", 8.0, "N m"), "dFs exp(-(v/v_s)^2) sgn v"),
];
