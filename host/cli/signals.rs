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
    /// Where it is found.
    pub(crate) of: Box<dyn Fn(&Signals) -> f64>,
}

/// A wrench on part A about its origin: force and moment, magnitude and components.
struct WrenchRow {
    /// Name before `_force` and `_moment`.
    name: &'static str,
    frame: &'static str,
    includes: &'static str,
    filter: &'static str,
    of: fn(&Signals) -> Wrench<f64>,
}

const NO_FILTER: &str = "none: the value of the physics";

const WRENCHES: [WrenchRow; 8] = [
    WrenchRow {
        name: "space_contact",
        frame: "inertial axes",
        includes: "contact of the parts in space, latch excluded",
        filter: NO_FILTER,
        of: |s| s.contact[0],
    },
    WrenchRow {
        name: "space_latch",
        frame: "inertial axes",
        includes: "latch in space, contact excluded",
        filter: NO_FILTER,
        of: |s| s.latch[0],
    },
    WrenchRow {
        name: "space_interface",
        frame: "inertial axes",
        includes: "contact and latch in space: what a load cell at the interface carries",
        filter: NO_FILTER,
        of: |s| s.contact[0] + s.latch[0],
    },
    WrenchRow {
        name: "hil_contact",
        frame: "laboratory axes",
        includes: "contact of the parts on the robots, latch excluded",
        filter: NO_FILTER,
        of: |s| s.contact[1],
    },
    WrenchRow {
        name: "hil_latch",
        frame: "laboratory axes",
        includes: "latch on the robots, contact excluded",
        filter: NO_FILTER,
        of: |s| s.latch[1],
    },
    WrenchRow {
        name: "hil_interface",
        frame: "laboratory axes",
        includes: "contact and latch on the robots: what a load cell at the interface carries",
        filter: NO_FILTER,
        of: |s| s.contact[1] + s.latch[1],
    },
    WrenchRow {
        name: "measured",
        frame: "part A's axes",
        includes: "what the sensor reads of the interface, the tool's load subtracted: with gain, bias, noise and quantisation",
        filter: "the sensor's low-pass",
        of: |s| s.measured,
    },
    WrenchRow {
        name: "fed_back",
        frame: "part A's axes",
        includes: "what acts on the simulated part A: the measured wrench after delay and compensator",
        filter: "the sensor's low-pass, the compensator",
        of: |s| s.fed_back,
    },
];

/// All signals of a trace.
pub(crate) fn signals() -> Vec<Channel> {
    let mut all = Vec::new();
    WRENCHES.iter().for_each(|row| wrench(&mut all, row));
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
    }
    let energy = "energy injected by the facility: space port minus hardware port".to_owned();
    push(&mut all, "hil_injected_energy_j".to_owned(), "J", energy, |s| s.injected_energy);
    all
}

/// Force or moment of a wrench.
type Pick = fn(&Wrench<f64>) -> Vec3<f64>;

/// Magnitude and components of a wrench's force and moment.
fn wrench(all: &mut Vec<Channel>, row: &'static WrenchRow) {
    let parts: [(&str, &str, Pick); 2] = [("force", "N", |w| w.force), ("moment", "N m", |w| w.moment)];
    for (part, unit, pick) in parts {
        let suffix = if unit == "N" { "n" } else { "n_m" };
        let about = if part == "moment" { " about its origin" } else { "" };
        let rest = format!("frame: {}; includes: {}; filter: {}", row.frame, row.includes, row.filter);
        let magnitude = move |s: &Signals| pick(&(row.of)(s)).norm();
        let name = format!("{}_{part}", row.name);
        let description = format!("magnitude of the {part} on part A{about}; {rest}");
        push(all, format!("{name}_{suffix}"), unit, description, magnitude);
        for (axis, letter) in ["x", "y", "z"].into_iter().enumerate() {
            let description = format!("{letter} of the {part} on part A{about}; {rest}");
            push(all, format!("{name}_{letter}_{suffix}"), unit, description, move |s| {
                component(pick(&(row.of)(s)), axis)
            });
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
