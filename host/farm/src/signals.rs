//! The signals of a trace: one row each with name, unit, frame, what is included and which filter lies before it.

use softdock_kernels::outcome::Signals;
use softdock_kernels::space::Wrench;
use softdock_kernels::vector::Vec3;

/// A signal of a trace.
pub(crate) struct Channel {
    /// Column name with its unit as a suffix.
    pub(crate) name: String,
    /// SI unit.
    pub(crate) unit: &'static str,
    /// What it is, its frame, what is included, its filter.
    pub(crate) description: String,
    /// Its place.
    pub(crate) of: Box<dyn Fn(&Signals) -> f64>,
}

/// A wrench on part A about its origin that both loops have.
struct LoopRow {
    /// Name between the prefix of the loop and `_force` or `_moment`.
    name: &'static str,
    includes: &'static str,
    of: fn(&Signals, usize) -> Wrench<f64>,
}

const BOTH_LOOPS: [LoopRow; 3] = [
    LoopRow { name: "contact", includes: "contact of the parts, latch excluded", of: |s, side| s.contact[side] },
    LoopRow { name: "latch", includes: "latch, contact excluded", of: |s, side| s.latch[side] },
    LoopRow {
        name: "interface",
        includes: "contact and latch: the load of a cell at the interface",
        of: |s, side| s.contact[side] + s.latch[side],
    },
];

/// Prefix, frame and place of the two loops.
const LOOPS: [(&str, &str, &str); 2] =
    [("space", "inertial axes", "in space"), ("hil", "laboratory axes", "on the robots")];

/// A wrench on part A about its origin that the facility alone has.
struct FacilityRow {
    /// Name before `_force` and `_moment`.
    name: &'static str,
    includes: &'static str,
    filter: &'static str,
    of: fn(&Signals) -> Wrench<f64>,
}

const ON_THE_FACILITY: [FacilityRow; 2] = [
    FacilityRow {
        name: "measured",
        includes: "what the sensor reads of the interface, the tool's load subtracted: with gain, bias, noise and quantisation",
        filter: "the sensor's low-pass",
        of: |s| s.measured,
    },
    FacilityRow {
        name: "fed_back",
        includes: "what acts on the simulated part A: the measured wrench after delay and compensator",
        filter: "the sensor's low-pass, the compensator",
        of: |s| s.fed_back,
    },
];

/// All signals of a trace.
pub(crate) fn signals() -> Vec<Channel> {
    let mut all = Vec::new();
    for (side, (prefix, frame, place)) in LOOPS.into_iter().enumerate() {
        for row in &BOTH_LOOPS {
            let rest =
                format!("frame: {frame}; includes: {}, {place}; filter: none: the value of the physics", row.includes);
            wrench(&mut all, &format!("{prefix}_{}", row.name), &rest, move |s| (row.of)(s, side));
        }
    }
    for row in &ON_THE_FACILITY {
        let rest = format!("frame: part A's axes; includes: {}; filter: {}", row.includes, row.filter);
        wrench(&mut all, row.name, &rest, row.of);
    }
    for (index, (prefix, place)) in
        [("space", "in space"), ("hil", "in the facility's simulation")].into_iter().enumerate()
    {
        for (axis, letter) in ["x", "y", "z"].into_iter().enumerate() {
            let from = format!("part A's origin from part B's, {letter}; frame: inertial axes; {place}");
            let speed = format!("velocity of part A's origin less part B's, {letter}; frame: inertial axes; {place}");
            let position = move |s: &Signals| component(s.parts[index].a.position - s.parts[index].b.position, axis);
            let velocity = move |s: &Signals| component(s.parts[index].a.velocity - s.parts[index].b.velocity, axis);
            push(&mut all, format!("{prefix}_relative_position_{letter}_m"), "m", from, position);
            push(&mut all, format!("{prefix}_relative_velocity_{letter}_m_per_s"), "m/s", speed, velocity);
        }
        push(&mut all, format!("{prefix}_latched"), "1", format!("1 while the latch is closed, {place}"), move |s| {
            s.closed[index]
        });
        let phase = format!("phase of the arm's motion, from 1; 0 without phases; {place}");
        push(&mut all, format!("{prefix}_arm_phase"), "1", phase, move |s| s.phase[index]);
    }
    let energy = "energy injected by the facility: space port minus hardware port".to_owned();
    push(&mut all, "hil_injected_energy_j".to_owned(), "J", energy, |s| s.injected_energy);
    all
}

/// Name, unit and description of every signal of a trace.
pub fn signal_rows() -> Vec<(String, &'static str, String)> {
    signals().into_iter().map(|signal| (signal.name, signal.unit, signal.description)).collect()
}

/// Force or moment of a wrench.
type Pick = fn(&Wrench<f64>) -> Vec3<f64>;

/// Magnitude and components of a wrench's force and moment.
fn wrench(all: &mut Vec<Channel>, name: &str, rest: &str, of: impl Fn(&Signals) -> Wrench<f64> + Copy + 'static) {
    let parts: [(&str, &str, Pick); 2] = [("force", "N", |w| w.force), ("moment", "N m", |w| w.moment)];
    for (part, unit, pick) in parts {
        let suffix = if unit == "N" { "n" } else { "n_m" };
        let about = if part == "moment" { " about its origin" } else { "" };
        let magnitude = move |s: &Signals| pick(&of(s)).norm();
        let name = format!("{name}_{part}");
        let description = format!("magnitude of the {part} on part A{about}; {rest}");
        push(all, format!("{name}_{suffix}"), unit, description, magnitude);
        for (axis, letter) in ["x", "y", "z"].into_iter().enumerate() {
            let description = format!("{letter} of the {part} on part A{about}; {rest}");
            push(all, format!("{name}_{letter}_{suffix}"), unit, description, move |s| component(pick(&of(s)), axis));
        }
    }
}

fn component(v: Vec3<f64>, axis: usize) -> f64 {
    [v.x, v.y, v.z][axis]
}

fn push(
    all: &mut Vec<Channel>,
    name: String,
    unit: &'static str,
    description: String,
    of: impl Fn(&Signals) -> f64 + 'static,
) {
    all.push(Channel { name, unit, description, of: Box::new(of) });
}
