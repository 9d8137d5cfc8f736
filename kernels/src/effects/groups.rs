//! Groups of effects that look alike in data: why they do, and the experiment that splits them.

/// Effects that look alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Group {
    /// `G1`..`G11`, or `own` for effects that look like no other.
    pub id: &'static str,
    /// What they are about.
    pub name: &'static str,
    /// Ids of the members; an effect may be in more than one group.
    pub members: &'static [&'static str],
    /// Why they look alike.
    pub why: &'static str,
    /// The experiment that splits them.
    pub splits: &'static str,
}

/// All groups.
pub const GROUPS: &[Group] = &[
    Group {
        id: "G1",
        name: "timing",
        members: &[
            "C1_transport_delay",
            "C2_lag",
            "C5_clock_skew",
            "C6_hold",
            "J2_viscous",
            "J12_current_loop",
            "J15_link_inertia",
            "S5_low_pass",
            "K7_surface_offset",
        ],
        why: "to first order each is the commanded rate times a time",
        splits: "sines up to a phase of half a radian: a delay keeps the gain, a lag lowers it, an inertia goes with the \
                 square of the frequency; the echo of the received command shows delays alone; a long recording shows \
                 a skew",
    },
    Group {
        id: "G2",
        name: "modes",
        members: &["J8_elasticity", "K10_fixture", "P2_slosh", "P3_appendage"],
        why: "each adds a resonance",
        splits: "the same hammer blow in another posture (gears), on another fixture (fixture), at another fill or force \
                 (slosh); with the appendage or the link locked",
    },
    Group {
        id: "G3",
        name: "friction",
        members: &[
            "J1_coulomb",
            "J2_viscous",
            "J3_stribeck",
            "J4_presliding",
            "J5_load_friction",
            "J6_temperature",
            "J18_drive_offset",
            "J19_friction_compensation",
            "K4_friction",
            "K5_stribeck",
            "K6_anisotropy",
        ],
        why: "each resists the motion and turns with its direction",
        splits: "constant speeds over three decades, slower than the Stribeck speed too; reversals of two sizes; two \
                 loads; cold and warm; sliding in four directions",
    },
    Group {
        id: "G4",
        name: "reversal",
        members: &["J4_presliding", "J7_backlash", "J8_elasticity", "J17_cable_drag"],
        why: "each shows after a reversal",
        splits: "reverse the speed under a constant load, and the load at a constant speed: backlash goes with the \
                 gear's torque, presliding with the speed",
    },
    Group {
        id: "G5",
        name: "scale",
        members: &[
            "J5_load_friction",
            "J11_torque_constant",
            "J14_payload",
            "J15_link_inertia",
            "J16_gravity_compensation",
            "J17_cable_drag",
            "S3_gain",
            "P1_mass",
        ],
        why: "each is proportional to a torque or force that is there already",
        splits: "a fast motion in a vertical posture (inertia alone), a slow one in a horizontal posture (weight alone), \
                 and a known mass added",
    },
    Group {
        id: "G6",
        name: "offset",
        members: &[
            "J16_gravity_compensation",
            "J17_cable_drag",
            "J18_drive_offset",
            "S1_bias",
            "S2_drift",
            "S4_crosstalk",
            "S8_load",
            "S9_tare",
            "K7_surface_offset",
        ],
        why: "each is nearly constant in one posture",
        splits: "a tare in six poses, motions without contact, and the same pose early and late",
    },
    Group {
        id: "G7",
        name: "periodic",
        members: &["J9_torque_ripple", "J10_transmission_error"],
        why: "both repeat with the motor's angle",
        splits: "two speeds: the ripple's torque stays, the torque of a transmission error grows with the square",
    },
    Group {
        id: "G8",
        name: "varying in time",
        members: &["C5_clock_skew", "J6_temperature", "S2_drift"],
        why: "each grows or decays slowly",
        splits: "the runs in random order, and the first one repeated at the end",
    },
    Group {
        id: "G9",
        name: "random",
        members: &["C3_jitter", "C4_drops", "S7_noise"],
        why: "none has a mean",
        splits: "repeats: variance against the square of the commanded rate, and the packets' counters",
    },
    Group {
        id: "G10",
        name: "contact law",
        members: &["K1_stiffness", "K2_exponent", "K3_damping", "K10_fixture", "S3_gain", "S5_low_pass"],
        why: "each bends the curve of force over depth",
        splits: "a slow press (gain, stiffness, exponent), a ladder of speeds (damping), a hammer blow on the sensor",
    },
    Group {
        id: "G11",
        name: "sliding",
        members: &["K4_friction", "S3_gain"],
        why: "while surfaces slide, each scales the force along them and the moments that it makes",
        splits: "a touch that holds without sliding, or a known weight hung sideways from the sensor (gain), and slides in \
                 several directions (friction)",
    },
    Group {
        id: "own",
        name: "alone",
        members: &["C7_rate_limit", "J13_saturation", "S6_quantisation", "K8_adhesion"],
        why: "each has a form of its own: ramps, plateaus, stairs, tension",
        splits: "a motion or load beyond the limit, and one far below it",
    },
];
