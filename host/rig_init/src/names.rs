//! Meaning of a column by its name: one table of the words that tools use.
//!
//! Covered: UR RTDE (`actual_qd_0`), ROS 2 (`/joint_states/position[0]`), KUKA RSI (`AIPos.A1`), Staubli (`J1`), dSPACE
//! (`Model/Out/q1[rad]`) and names with a unit at their end (`ref_pos_deg_1`).

/// Physical quantity of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Meaning {
    Time,
    Position,
    Rate,
    Acceleration,
    Torque,
    Current,
    Voltage,
    Force,
    Moment,
    Place,
    Orientation,
    Speed,
    BodyRate,
    BodyAcceleration,
    Event,
    Experiment,
    Frame,
}

/// Origin of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Origin {
    /// Stated to be measured.
    Measured,
    /// Nothing is stated.
    Plain,
    /// Measured behind the gear.
    Link,
    /// Commanded, or wanted by a controller.
    Reference,
    /// A part or a model output (feedforward, feedback part, error).
    Derived,
    /// Without its sign.
    Magnitude,
}

/// Words and the quantity that they name.
const QUANTITIES: [(Meaning, &[&str]); 13] = [
    (Meaning::Time, &["t", "time", "times", "stamp", "timestamp", "secs", "clock", "zeit", "uhrzeit"]),
    (Meaning::Acceleration, &["qdd", "ddq", "acc", "accel", "acceleration", "accelerations", "qddot"]),
    (Meaning::Rate, &["qd", "dq", "vel", "velocity", "velocities", "speed", "qdot", "omega", "rate", "aivel"]),
    (
        Meaning::Position,
        &["q", "pos", "position", "positions", "angle", "angles", "theta", "phi", "aipos", "aspos", "jpos", "encoder"],
    ),
    (Meaning::Torque, &["tau", "torque", "torques", "effort", "efforts", "moment", "trq", "tq"]),
    (Meaning::Current, &["i", "cur", "current", "currents", "macur", "iq", "amps"]),
    (Meaning::Voltage, &["u", "voltage", "voltages"]),
    (Meaning::Force, &["force", "forces", "kraft"]),
    (Meaning::Orientation, &["orientation", "quat", "quaternion", "attitude"]),
    (Meaning::Experiment, &["toss", "experiment", "trial", "episode"]),
    (Meaning::Frame, &["k", "frame", "index", "sample"]),
    (Meaning::Event, &["event", "flag"]),
    (Meaning::Place, &["translation"]),
];

/// Words and the origin that they name.
const ORIGINS: [(Origin, &[&str]); 5] = [
    (
        Origin::Reference,
        &[
            "ref",
            "reference",
            "target",
            "desired",
            "des",
            "cmd",
            "command",
            "commands",
            "commanded",
            "set",
            "setpoint",
            "sp",
            "soll",
            "goal",
            "aspos",
            "sent",
            "demand",
            "known",
        ],
    ),
    (Origin::Derived, &["ff", "feedforward", "rel", "error", "err", "residual", "friction"]),
    (Origin::Magnitude, &["magnitude"]),
    (Origin::Link, &["link", "load", "secondary"]),
    (Origin::Measured, &["act", "actual", "meas", "measured", "mot", "motor", "ist", "feedback", "aipos", "macur"]),
];

/// Two letters that name a component of a vector: letter, quantity.
const VECTORS: [(char, Meaning); 8] = [
    ('f', Meaning::Force),
    ('t', Meaning::Moment),
    ('m', Meaning::Moment),
    ('p', Meaning::Place),
    ('v', Meaning::Speed),
    ('w', Meaning::BodyRate),
    ('a', Meaning::BodyAcceleration),
    ('q', Meaning::Orientation),
];

/// Spellings of units, the longer ones first, as rig files write them.
const UNITS: [(&str, &str); 32] = [
    ("rad_s2", "rad/s^2"),
    ("deg_s2", "deg/s^2"),
    ("m_s2", "m/s^2"),
    ("mm_s2", "mm/s^2"),
    ("rad_s", "rad/s"),
    ("deg_s", "deg/s"),
    ("mm_s", "mm/s"),
    ("m_s", "m/s"),
    ("rad", "rad"),
    ("deg", "deg"),
    ("degrees", "deg"),
    ("mm", "mm"),
    ("nm", "N m"),
    ("n_m", "N m"),
    ("n", "N"),
    ("m", "m"),
    ("a", "A"),
    ("amp", "A"),
    ("v", "V"),
    ("volt", "V"),
    ("volts", "V"),
    ("s", "s"),
    ("sec", "s"),
    ("seconds", "s"),
    ("ms", "ms"),
    ("msec", "ms"),
    ("us", "us"),
    ("usec", "us"),
    ("ns", "ns"),
    ("nsec", "ns"),
    ("g", "g"),
    ("kn", "kN"),
];

/// Words in front of an axis' number that mean no quantity.
const AXES: [&str; 8] = ["a", "j", "axis", "joint", "ax", "drive", "servo", "motor"];

/// Meaning of a column by its name.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ColumnName {
    /// The quantity, if a word names it.
    pub(crate) meaning: Option<Meaning>,
    /// Origin of the value.
    pub(crate) origin: Origin,
    /// Number of the axis as written.
    pub(crate) axis: Option<u32>,
    /// Component of a vector or a quaternion.
    pub(crate) component: Option<char>,
    /// Unit, as a rig file writes it.
    pub(crate) unit: Option<&'static str>,
}

impl ColumnName {
    /// Parses a name.
    pub(crate) fn of(name: &str) -> Self {
        let (name, bracket) = bracketed(name);
        let mut words: Vec<String> = name
            .split(|c: char| !c.is_ascii_alphanumeric())
            .filter(|word| !word.is_empty())
            .map(str::to_ascii_lowercase)
            .collect();
        let mut axis = None;
        // The unit may stand before or behind the number of the axis.
        let mut unit = bracket.or_else(|| unit_at_end(&mut words));
        if let Some(number) = words.last().and_then(|word| word.parse().ok()) {
            axis = Some(number);
            words.pop();
        }
        words = words.into_iter().flat_map(|word| without_number(word, &mut axis)).collect();
        unit = unit.or_else(|| unit_at_end(&mut words));
        let origin = ORIGINS
            .iter()
            .find(|(_, known)| words.iter().any(|word| known.contains(&word.as_str())))
            .map_or(Origin::Plain, |row| row.0);
        let mut component = None;
        let mut meaning = words.iter().find_map(|word| vector(word)).map(|(meaning, axis)| {
            component = Some(axis);
            meaning
        });
        if meaning.is_none() {
            component = words.iter().rev().find_map(|word| single(word));
            meaning = quantity(&words, component);
        }
        let is_bare = words.iter().all(|word| AXES.contains(&word.as_str()));
        if meaning.is_none() {
            meaning = match unit {
                Some("rad" | "deg") => Some(Meaning::Position),
                Some("m" | "mm") if component.is_none() => Some(Meaning::Position),
                Some("rad/s" | "deg/s") => Some(Meaning::Rate),
                Some("N m") => Some(Meaning::Torque),
                Some("A") => Some(Meaning::Current),
                Some("V") => Some(Meaning::Voltage),
                // `J1`: the angle of axis 1.
                None if is_bare && axis.is_some() => Some(Meaning::Position),
                _ => None,
            };
        }
        // A force of axes 0 to 5 is a wrench (RTDE: actual_TCP_force_0).
        if let (Some(Meaning::Force), None, Some(number @ 0..=5)) = (meaning, component, axis) {
            let is_moment = number > 2;
            meaning = Some(if is_moment { Meaning::Moment } else { Meaning::Force });
            component = ['x', 'y', 'z'].get((number % 3) as usize).copied();
            axis = None;
        }
        if meaning == Some(Meaning::Event) || (origin == Origin::Reference && meaning.is_none()) {
            meaning = Some(Meaning::Event);
        }
        Self { meaning, origin, axis, component, unit }
    }
}

/// The quantity that words name; a component of a vector decides between those of a joint and of a body.
fn quantity(words: &[String], component: Option<char>) -> Option<Meaning> {
    let named = |wanted: &str| words.iter().any(|word| word == wanted);
    let found = QUANTITIES.iter().find(|(meaning, known)| {
        // The word of a position also stands in "force at position"; the most specific row comes first.
        words.iter().any(|word| known.contains(&word.as_str())) && !(*meaning == Meaning::Time && component.is_some())
    });
    let meaning = found.map(|row| row.0);
    match (meaning, component) {
        (None, Some('x' | 'y' | 'z')) if words.len() == 1 || named("tcp") || named("pose") => Some(Meaning::Place),
        (Some(Meaning::Position), Some('x' | 'y' | 'z')) => {
            Some(if named("orientation") { Meaning::Orientation } else { Meaning::Place })
        }
        (Some(Meaning::Torque), Some(_)) => Some(Meaning::Moment),
        (Some(Meaning::Acceleration), Some(_)) => Some(Meaning::BodyAcceleration),
        (Some(Meaning::Rate), Some(_)) if named("angular") || named("gyro") || named("omega") || named("rate") => {
            Some(Meaning::BodyRate)
        }
        (Some(Meaning::Rate), Some(_)) => Some(Meaning::Speed),
        (meaning, _) => meaning,
    }
}

/// `fx`: the force along x.
fn vector(word: &str) -> Option<(Meaning, char)> {
    let letters: Vec<char> = word.chars().collect();
    let [letter, component] = letters[..] else { return None };
    let row = VECTORS.iter().find(|row| row.0 == letter)?;
    let is_known = "xyz".contains(component) || (component == 'w' && row.1 == Meaning::Orientation);
    is_known.then_some((row.1, component))
}

/// A component alone.
fn single(word: &str) -> Option<char> {
    matches!(word, "x" | "y" | "z" | "w").then(|| word.chars().next()).flatten()
}

/// Splits off the number at the end of a word; `a1` is axis 1, `q1` is q of axis 1.
fn without_number(word: String, axis: &mut Option<u32>) -> Option<String> {
    let text = word.trim_end_matches(|c: char| c.is_ascii_digit());
    let Ok(number) = word[text.len()..].parse() else { return Some(word) };
    let is_known = |text: &str| QUANTITIES.iter().any(|row| row.1.contains(&text));
    if AXES.contains(&text) {
        *axis = Some(number);
        return None;
    }
    if is_known(text) {
        *axis = Some(number);
        return Some(text.to_owned());
    }
    Some(word)
}

/// Removes a unit at the end of the words; a name is never a unit alone.
fn unit_at_end(words: &mut Vec<String>) -> Option<&'static str> {
    for count in [2, 1] {
        if words.len() > count {
            let tail = words[words.len() - count..].join("_");
            if let Some(row) = UNITS.iter().find(|row| row.0 == tail) {
                words.truncate(words.len() - count);
                return Some(row.1);
            }
        }
    }
    None
}

/// Splits off a unit in brackets (`q1[rad]`, `q1 (deg/s)`); an index in brackets stays.
fn bracketed(name: &str) -> (String, Option<&'static str>) {
    for (open, close) in [('[', ']'), ('(', ')')] {
        let Some(start) = name.rfind(open) else { continue };
        let Some(end) = name[start..].find(close).map(|at| start + at) else { continue };
        let tail = name[start + 1..end].to_ascii_lowercase().replace('\u{b0}', "deg");
        let key: String = tail.replace(['/', ' ', '*', '.'], "_").replace('^', "");
        if let Some(row) = UNITS.iter().find(|row| row.0 == key) {
            return (format!("{} {}", &name[..start], &name[end + 1..]), Some(row.1));
        }
    }
    (name.to_owned(), None)
}

#[cfg(test)]
mod tests;
