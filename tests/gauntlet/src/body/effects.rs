//! Hidden effects of the free body, with plausible sizes.

use crate::catalogue::EffectCase;

/// Effects of the catalogue; the payload's error is one of mass, centre of mass or inertia.
pub(crate) const EFFECTS: &[EffectCase] = &[
    EffectCase::growing("P1_mass", ("mass", 9.0, "kg"), "heavier, inertia about the centre of mass as it was")
        .up_to(150.0),
    EffectCase::growing("P1_centre", ("offset", 0.02, "m"), "centre of mass off along x").up_to(0.3),
    EffectCase::growing("P1_inertia", ("share", 0.08, ""), "(1 + share) of all moments of inertia").up_to(1.0),
    EffectCase::growing("P2_slosh", ("mass", 12.0, "kg"), "part of the mass on soft springs").up_to(60.0),
    EffectCase::growing("P3_appendage", ("mass", 3.0, "kg"), "part of the mass on the tip of a flexible boom")
        .up_to(12.0),
];

/// Forms outside the catalogue.
pub(crate) const OUTSIDE: &[EffectCase] = &[
    EffectCase::growing("quadratic_drag", ("coefficient", 40.0, "N s^2/m^2"), "-c v |v|"),
    EffectCase::growing("umbilical", ("stiffness", 5.0, "N/m"), "-k x from where the record began"),
];
