//! The signals of a trace: one row each with name, unit, frame, what is included and which filter lies before it.

use softdock_kernels::manipulator::cell::{Cell, RAIL};
use softdock_kernels::model::Model;
use softdock_kernels::outcome::Signals;
use softdock_kernels::plant::Plant;
use softdock_kernels::space::{Motion, Wrench};
use softdock_kernels::vector::{Pose, Vec3};
use std::sync::Arc;

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

/// All signals of a trace of a plant.
pub(crate) fn signals(plant: &Plant) -> Vec<Channel> {
    let mut all = signals_of_every_plant();
    poses(&mut all, plant);
    all
}

fn signals_of_every_plant() -> Vec<Channel> {
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

/// Name, unit and description of the signals of a trace: those of every plant, with those of one plant behind them.
pub fn signal_rows(plant: Option<&Plant>) -> Vec<(String, &'static str, String)> {
    let all = plant.map_or_else(signals_of_every_plant, signals);
    all.into_iter().map(|signal| (signal.name, signal.unit, signal.description)).collect()
}

/// Where everything stands: in both loops the base, the arm's joints and part B; on the robots both parts and the axes.
///
/// Part A and the arm's links follow from base and joints, the target from part B, the robots' links from their axes.
fn poses(all: &mut Vec<Channel>, plant: &Plant) {
    let model: Arc<Model> = Arc::new((**plant).clone());
    for (side, (prefix, place)) in
        [("space", "in space"), ("hil", "in the facility's simulation")].into_iter().enumerate()
    {
        let rest = format!("frame: inertial axes; {place}");
        let arm = Arc::clone(&model);
        pose(all, &format!("{prefix}_base"), &format!("base's centre of mass, {rest}"), move |s| base(&arm, s, side));
        pose(all, &format!("{prefix}_part_b"), &format!("part B, {rest}"), move |s| placed(&s.parts[side].b));
        for joint in 0..model.links.len() {
            let (unit, what) = if model.slides(joint) { ("m", "travel") } else { ("rad", "angle") };
            let description = format!("{what} of the arm's joint {}, {place}", joint + 1);
            push(all, format!("{prefix}_joint_{}_{unit}", joint + 1), unit, description, move |s| {
                s.joints[side][joint]
            });
        }
    }
    let held = "as the robots hold it; frame: laboratory axes";
    pose(all, "robots_part_a", &format!("part A, {held}"), |s| placed(&s.mounted.a));
    pose(all, "robots_part_b", &format!("part B, {held}"), |s| placed(&s.mounted.b));
    let driven = plant.session_robots.as_ref().map(|robots| robots.each_ref().map(|robot| robot.cell.clone()));
    let Some(cells) = plant.cells.clone().or(driven) else { return };
    let pick: [fn(&Signals) -> Motion<f64>; 2] = [|s| s.mounted.a, |s| s.mounted.b];
    for (robot, (cell, pick)) in (1..).zip(cells.into_iter().zip(pick)) {
        let cell: Arc<Cell> = Arc::new(cell);
        for axis in 0..RAIL {
            let own = Arc::clone(&cell);
            let description = format!("angle of axis {} of robot {robot} that holds its part there", axis + 1);
            let angle = move |s: &Signals| own.axes_for(&pick(s)).0.position[axis];
            push(all, format!("robot{robot}_axis_{}_rad", axis + 1), "rad", description, angle);
        }
        if cell.limits(RAIL).is_some() {
            let description = format!("place of robot {robot} on its rail that holds its part there");
            let place = move |s: &Signals| cell.axes_for(&pick(s)).0.position[RAIL];
            push(all, format!("robot{robot}_rail_m"), "m", description, place);
        }
    }
}

fn placed(motion: &Motion<f64>) -> Pose<f64> {
    Pose { position: motion.position, attitude: motion.attitude }
}

/// Pose of the base: from part A back along the arm.
fn base(model: &Model, s: &Signals, side: usize) -> Pose<f64> {
    let link = |arm: Pose<f64>, joint: usize| arm.compose(model.link_pose(joint, s.joints[side][joint]));
    let arm = (0..model.links.len()).fold(Pose::identity(), link).compose(model.tool);
    placed(&s.parts[side].a).compose(arm.inverse())
}

/// Position and attitude quaternion of a frame.
fn pose(all: &mut Vec<Channel>, name: &str, rest: &str, of: impl Fn(&Signals) -> Pose<f64> + Clone + 'static) {
    for (axis, letter) in ["x", "y", "z"].into_iter().enumerate() {
        let (of, description) = (of.clone(), format!("position {letter} of the {rest}"));
        push(all, format!("{name}_position_{letter}_m"), "m", description, move |s| component(of(s).position, axis));
    }
    for (at, letter) in ["w", "x", "y", "z"].into_iter().enumerate() {
        let (of, description) = (of.clone(), format!("attitude quaternion {letter} of the {rest}"));
        let value = move |s: &Signals| {
            let attitude = of(s).attitude;
            [attitude.w, attitude.v.x, attitude.v.y, attitude.v.z][at]
        };
        push(all, format!("{name}_attitude_{letter}"), "1", description, value);
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rows::RowBuilder;
    use crate::traces::record;
    use softdock_engine::RunInput;
    use softdock_kernels::manipulator::cell::{AXES, Axes};
    use softdock_kernels::vector::{Quat, vec3};

    #[test]
    fn poses_of_a_trace_agree_with_its_relative_positions() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../campaigns/probe_drogue.toml");
        let campaign = softdock_campaign::load(&path).expect("a shipped campaign");
        let builder = RowBuilder::new(&campaign);
        let input = RunInput::new(0, campaign.draw(0).expect("a draw").params);
        let (_, trace) = record(&builder, 100, input, "test".to_owned());
        let model = &campaign.scenario.model;
        assert!(trace.time.len() > 10 && !model.links.is_empty());
        let at = |name: &str, instant: usize| {
            trace.signal(name).unwrap_or_else(|| panic!("no signal {name}"))[instant].expect("a value")
        };
        let pose = |name: &str, instant: usize| {
            let place = ["x", "y", "z"].map(|axis| at(&format!("{name}_position_{axis}_m"), instant));
            let [w, x, y, z] = ["w", "x", "y", "z"].map(|part| at(&format!("{name}_attitude_{part}"), instant));
            assert!((w * w + x * x + y * y + z * z - 1.0).abs() < 1e-9, "{name} has a unit quaternion");
            Pose { position: vec3(place[0], place[1], place[2]), attitude: Quat { w, v: vec3(x, y, z) } }
        };
        for side in ["space", "hil"] {
            for instant in 0..trace.time.len() {
                let link = |frame: Pose<f64>, joint: usize| {
                    frame.compose(model.link_pose(joint, at(&format!("{side}_joint_{}_rad", joint + 1), instant)))
                };
                let arm = (0..model.links.len()).fold(pose(&format!("{side}_base"), instant), link);
                let gap = arm.compose(model.tool).position - pose(&format!("{side}_part_b"), instant).position;
                let stated = ["x", "y", "z"].map(|axis| at(&format!("{side}_relative_position_{axis}_m"), instant));
                let error = (gap - vec3(stated[0], stated[1], stated[2])).norm();
                assert!(error < 1e-9, "{side} at {} s: {error} m", trace.time[instant]);
            }
        }
        // The axes hold the parts where the robots have them.
        let [robot1, robot2] = builder.job.plant.session_robots.as_ref().expect("the reference facility's robots");
        for (number, robot, part) in [(1, robot1, "robots_part_a"), (2, robot2, "robots_part_b")] {
            let mut position = [0.0; AXES];
            for (axis, value) in position.iter_mut().enumerate().take(RAIL) {
                *value = at(&format!("robot{number}_axis_{}_rad", axis + 1), 0);
            }
            if number == 1 {
                position[RAIL] = at("robot1_rail_m", 0);
            }
            let held = robot.cell.part_on(&Axes { position, rate: [0.0; AXES] });
            let error = (held.position - pose(part, 0).position).norm();
            assert!(error < 1e-6, "robot {number}: {error} m");
        }
    }
}
