//! Groups of effects that look alike in data: why they do, and the experiment that splits them.

use super::{EFFECTS, code};

/// Effects that look alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Group {
    /// `G1`..`G11`, or `own` for effects that look like no other.
    pub id: &'static str,
    /// What they are about.
    pub name: &'static str,
    /// Why they look alike.
    pub why: &'static str,
    /// The experiment that splits them.
    pub splits: &'static str,
}

impl Group {
    /// Whether an effect belongs to the group, by its number in the catalogue; an effect may belong to several.
    pub fn has(&self, id: &str) -> bool {
        EFFECTS.iter().any(|effect| code(effect.id) == code(id) && effect.groups.contains(&self.id))
    }
}

/// All groups; the rows of the effects name theirs.
pub const GROUPS: &[Group] = &[
    Group {
        id: "G1",
        name: "timing",
        why: "to first order each is the commanded rate times a time",
        splits: "sines up to a phase of half a radian: a delay keeps the gain, a lag lowers it, an inertia goes with the \
                 square of the frequency; the echo of the received command shows delays alone; a long recording shows \
                 a skew",
    },
    Group {
        id: "G2",
        name: "modes",
        why: "each adds a resonance",
        splits: "the same hammer blow in another posture (gears), on another fixture (fixture), at another fill or force \
                 (slosh); with the appendage or the link locked",
    },
    Group {
        id: "G3",
        name: "friction",
        why: "each resists the motion and turns with its direction",
        splits: "constant speeds over three decades, slower than the Stribeck speed too; reversals of two sizes; two \
                 loads; cold and warm; sliding in four directions",
    },
    Group {
        id: "G4",
        name: "reversal",
        why: "each shows after a reversal",
        splits: "reverse the speed under a constant load, and the load at a constant speed: backlash goes with the \
                 gear's torque, presliding with the speed",
    },
    Group {
        id: "G5",
        name: "scale",
        why: "each is proportional to a torque or force that is there already",
        splits: "a fast motion in a vertical posture (inertia alone), a slow one in a horizontal posture (weight alone), \
                 and a known mass added",
    },
    Group {
        id: "G6",
        name: "offset",
        why: "each is nearly constant in one posture",
        splits: "a tare in six poses, motions without contact, and the same pose early and late",
    },
    Group {
        id: "G7",
        name: "periodic",
        why: "both repeat with the motor's angle",
        splits: "two speeds: the ripple's torque stays, the torque of a transmission error grows with the square",
    },
    Group {
        id: "G8",
        name: "varying in time",
        why: "each grows or decays slowly",
        splits: "the runs in random order, and the first one repeated at the end",
    },
    Group {
        id: "G9",
        name: "random",
        why: "none has a mean",
        splits: "repeats: variance against the square of the commanded rate, and the packets' counters",
    },
    Group {
        id: "G10",
        name: "contact law",
        why: "each bends the curve of force over depth",
        splits: "a slow press (gain, stiffness, exponent), a ladder of speeds (damping), a hammer blow on the sensor",
    },
    Group {
        id: "G11",
        name: "sliding",
        why: "while surfaces slide, each scales the force along them and the moments that it makes",
        splits: "a touch that holds without sliding, or a known weight hung sideways from the sensor (gain), and slides in \
                 several directions (friction)",
    },
    Group {
        id: "own",
        name: "alone",
        why: "each has a form of its own: ramps, plateaus, stairs, tension",
        splits: "a motion or load beyond the limit, and one far below it",
    },
];
