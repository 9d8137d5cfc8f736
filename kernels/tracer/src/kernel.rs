//! The whole WGSL module of a scenario: structs and buffer access from the field tables, traced stages, the frame.

use crate::stages::{functions, structures};
use crate::wgsl::{Function, Struct};
use softdock_kernels::capture_ring::has_ring;
use softdock_kernels::compensator::compensates;
use softdock_kernels::contact::PointState;
use softdock_kernels::contact::mesh::{SHELL_WORDS, ShellPoint};
use softdock_kernels::fields::{Field, fields};
use softdock_kernels::fixture::is_compliant;
use softdock_kernels::frame::lane_state::{StateVariable, contact_names, end_state_members, state_variables};
use softdock_kernels::frame::{Batch, Loops, has_noisy_camera, has_plan};
use softdock_kernels::load::loaded;
use softdock_kernels::model::CompensatorKind;
use softdock_kernels::noise::{CAMERA, LINK, SENSOR};
use softdock_kernels::plant::{Plant, ShellOfPair};
use softdock_kernels::quads::{quads, read, reads, stores, words};
use softdock_kernels::robot::commands_poses;
use softdock_kernels::session::supervised;
use softdock_kernels::stages::{of_law, of_shell};
use std::collections::BTreeSet;
use std::fmt::Write;

/// The hand-written part of the robots: those that lag, and those of the joint level.
const ROBOTS: [&str; 2] = [include_str!("../../wgsl/robots_lag.wgsl"), include_str!("../../wgsl/robots_joint.wgsl")];

/// The hand-written parts.
const FRAME: &str = concat!(
    include_str!("../../wgsl/math.wgsl"),
    "\n",
    include_str!("../../wgsl/philox.wgsl"),
    "\n",
    include_str!("../../wgsl/frame.wgsl")
);

/// A scenario's kernel: its text and its buffers; inputs, state and delay lines lie in [`softdock_kernels::quads`].
#[derive(Clone, Debug)]
pub struct Kernel {
    /// The WGSL module.
    pub text: String,
    /// Structs made from the field tables.
    pub structs: Vec<Struct>,
    /// Traced stage functions.
    pub functions: Vec<Function>,
    /// Fields of the parameters that something reads, in the order of the input buffer.
    pub inputs: Vec<usize>,
    /// Numbers per lane in the state buffer.
    pub state: usize,
    /// Numbers per lane in the delay lines, see [`softdock_kernels::delay_line::line_places`].
    pub lines: usize,
    /// f32 per lane in the outcome buffer.
    pub outcome: usize,
    /// Numbers that the stages read by computed indices; empty without meshes, and then without a buffer.
    pub tables: Vec<f32>,
}

/// Declaration of the buffer with the tables.
pub const TABLES: &str = "@group(0) @binding(6) var<storage, read> tables: array<f32>;\n";

/// The kernel of a plant for batches of one kind: what a batch never does is not in it.
pub fn kernel(plant: &Plant, batch: Batch) -> Kernel {
    softdock_kernels::with_joints!(plant.joints(), build(plant, batch))
}

/// Names behind a `p.`, with their members: `offset.x`.
fn read_parameters(text: &str) -> impl Iterator<Item = &str> {
    let is_end = |letter: char| !(letter.is_ascii_alphanumeric() || letter == '_' || letter == '.');
    text.match_indices("p.").map(move |(at, head)| {
        let name = &text[at + head.len()..];
        &name[..name.find(is_end).unwrap_or(name.len())]
    })
}

fn build<const N: usize>(plant: &Plant, batch: Batch) -> Kernel {
    let functions = functions::<N>(plant);
    let structs = structures(&functions);
    let fields = |name: &str| -> &[Field] {
        &structs.iter().find(|s| s.name == name).expect("the frame names only structs of the tables").fields
    };
    let slots = softdock_kernels::delay_line::line_slots(plant);
    let mut text = constants(plant, batch, slots);
    structs.iter().for_each(|s| text.push_str(&s.declaration()));
    let variables = state_variables::<N>(plant);
    let declared = variables.iter().filter(|variable| structs.iter().any(|s| s.name == variable.structure));
    declared.for_each(|variable| {
        let _ = writeln!(text, "var<private> {}: {};", variable.name, variable.structure);
    });
    text.push('\n');
    text.push_str(FRAME);
    text.push('\n');
    let tables = plant.tables();
    if !tables.is_empty() {
        text.push_str(TABLES);
    }
    text.push_str(ROBOTS[usize::from(plant.cells.is_some())]);

    let listings: Vec<String> = functions.iter().map(Function::listing).collect();
    // A driver compiles loads and stores slowly: only parameters that something reads are loaded.
    let texts = listings.iter().map(String::as_str).chain([FRAME]);
    let read: BTreeSet<&str> = texts.flat_map(read_parameters).collect();
    let is_read =
        |field: &Field| read.range(field.name.as_str()..).next().is_some_and(|name| name.starts_with(&*field.name));
    let inputs: Vec<usize> =
        fields("Params").iter().enumerate().filter(|(_, field)| is_read(field)).map(|(index, _)| index).collect();
    let member = |(variable, field): (&str, &Field)| format!("{variable}.{}", field.name);
    let params: Vec<String> = inputs.iter().map(|index| member(("p", &fields("Params")[*index]))).collect();
    let kept = |variable: &StateVariable| -> Vec<String> {
        let kept = variable.fields.iter().filter(|(is_kept, _)| *is_kept);
        kept.map(|(_, field)| member((&variable.name, field))).collect()
    };
    let state: Vec<String> = variables.iter().flat_map(kept).collect();
    let metrics = || fields("Metrics").iter();
    let in_space = metrics().map(|field| member(("in_space", field)));
    let on_facility = metrics().map(|field| member(("on_facility", field)));
    let outcomes: Vec<String> = in_space.chain(on_facility).chain(end_state_members()).collect();
    let size = outcomes.len();
    let stored = |(index, value): (usize, String)| format!("    outcomes[{index}u * batch.lanes + lane] = {value};\n");
    let outcome: String = outcomes.into_iter().enumerate().map(stored).collect();
    let _ = write!(
        text,
        "\nfn load_params() {{\n{}}}\n\nfn load_state() {{\n{}}}\n\nfn store_state() {{\n{}}}\n\n\
         fn store_outcome(in_space: Metrics, on_facility: Metrics) {{\n{outcome}}}\n",
        loads("inputs", &params),
        loads("states", &state),
        stores("states", &state, in_order),
    );
    let (command, wrench) = (fields("Parts"), fields("Wrench"));
    text.push_str(&line("command", "Parts", command, 0));
    text.push_str(&line("wrench", "Wrench", wrench, slots * quads(command.len())));
    text.push_str(&touches(plant));
    listings.iter().for_each(|listing| {
        text.push('\n');
        text.push_str(listing);
    });
    let lines = slots * (words(command.len()) + words(wrench.len()));
    Kernel { text, functions, inputs, state: state.len(), lines, outcome: size, structs, tables }
}

/// The scenario's numbers that the frame needs.
fn constants(plant: &Plant, batch: Batch, slots: usize) -> String {
    let t = &plant.timing;
    format!(
        "const SUBSTEP = {:?}f;\nconst SUBSTEPS = {}u;\nconst MAX_TICKS = {}u;\nconst SLOTS = {slots}u;\n\
         const SENSOR_SUBSTEPS = {}u;\nconst LINK = {LINK}u;\nconst SENSOR_A = {}u;\nconst SENSOR_B = {}u;\n\
         const CAMERA_A = {}u;\nconst CAMERA_B = {}u;\nconst NOISY_CAMERA = {};\nconst PLANNED = {};\nconst FIRES = {};\nconst RINGED = {};\n\
         const NOISY = {};\nconst FACILITY = {};\nconst COMPENSATED = {};\nconst PREDICTED = {};\nconst LOADED = {};\n\
         const COMPLIANT_FIXTURE = {};\nconst POSES = {};\nconst SUPERVISED = {};\n\n",
        t.substep as f32,
        t.substeps,
        t.max_ticks,
        plant.facility.sensor_substeps.min(t.substeps),
        SENSOR[0],
        SENSOR[1],
        CAMERA[0],
        CAMERA[1],
        has_noisy_camera(plant),
        has_plan(plant),
        plant.guidance.thrusters.is_some(),
        has_ring(plant),
        batch.noisy,
        batch.loops == Loops::Both,
        compensates(plant),
        plant.facility.compensator.kind == CompensatorKind::Smith,
        loaded(plant),
        is_compliant(plant),
        commands_poses(plant),
        supervised(plant),
    )
}

/// All contacts of a pair of parts one after the other.
///
/// Written out one by one: a loop would have to keep their states in storage, which on some drivers costs more than the
/// contact itself.
fn touches(plant: &Plant) -> String {
    let mut out = String::from("\n");
    // Parts that never touch have no law, and a struct has a member.
    let listed = |none: &str, text: &dyn Fn(usize) -> String| {
        let all: Vec<String> = (0..plant.pairs.len()).map(text).collect();
        if all.is_empty() { none.to_owned() } else { all.join(", ") }
    };
    let _ = writeln!(out, "struct Pairs {{ {} }}", listed("none: f32", &|law| format!("p{law}: Pair")));
    for side in ["space", "hil"] {
        let pairs = listed("0.0", &|law| format!("{}(p)", of_law(&format!("{side}_pair"), law)));
        let _ = write!(out, "\nfn {side}_pairs(p: Params) -> Pairs {{\n    return Pairs({pairs});\n}}\n");
    }
    for (function, side) in [("touch_space", "space"), ("touch_facility", "hil")] {
        let _ = write!(
            out,
            "\nfn {function}(pairs: Pairs, parts: Parts, grip: Grip) -> Touch {{\n    var sum = no_touch();\n"
        );
        for finger in 0..plant.contact.fingers.len() {
            let _ = writeln!(out, "    let f{finger} = {}(parts, grip);", of_law("with_finger", finger));
        }
        for (index, contact) in plant.contacts.iter().enumerate() {
            let (point, state) = (&contact.point, format!("{side}_contact_{index}"));
            let (r, law) = (point.position, contact.pair);
            let [x, y, z, radius, share] = [r.x, r.y, r.z, point.radius, contact.share].map(crate::wgsl::literal);
            let stage = of_law("contact_point", law);
            let kept =
                fields::<f64, PointState<f64>>().into_iter().map(|field| format!("c{index}.state_{}", field.name));
            let kept: Vec<String> = kept.collect();
            let _ = write!(
                out,
                "    let c{index} = {stage}(pairs.p{law}, {}, Point({x}, {y}, {z}, {radius}, {share}), {state});\n    \
                 {state} = PointState({});\n    \
                 {}",
                parts_of(plant, law),
                kept.join(", "),
                gathered(plant, law, &format!("c{index}")),
            );
        }
        for (index, shell) in plant.shells.iter().enumerate() {
            let state = format!("{side}_contact_{}", plant.contacts.len() + index);
            out.push_str(&touch_shell(plant, index, shell, &state));
        }
        out.push_str("    return sum;\n}\n");
    }
    out.push_str("\nfn reset_contacts() {\n");
    let names = contact_names(plant.contact_states());
    names.iter().for_each(|name| out.push_str(&format!("    {name} = PointState();\n")));
    out + "}\n"
}

/// The parts as a law's members of part A have them, in the kernel's text.
fn parts_of(plant: &Plant, law: usize) -> String {
    plant.pairs[law].finger.map_or_else(|| "parts".to_owned(), |finger| format!("f{finger}"))
}

/// A contact of a law joins the sum, that of a finger about part A's origin and with the power on its motion.
fn gathered(plant: &Plant, law: usize, contact: &str) -> String {
    let Some(finger) = plant.pairs[law].finger else {
        return format!("sum = gather(sum, {contact});\n");
    };
    let [of_finger, power] = ["of_finger", "finger_power"].map(|stage| of_law(stage, finger));
    format!(
        "let {contact}_a = {of_finger}(parts, grip, {contact});\n    sum = gather(sum, {contact}_a);\n    \
         sum.finger_power += {power}(parts, grip, {contact}_a);\n"
    )
}

/// A shell: a loop over its points, whose table all lanes share, where it is near.
fn touch_shell(plant: &Plant, index: usize, shell: &ShellOfPair, state: &str) -> String {
    let [relative, point, contact] = ["relative", "shell_point", "shell_contact"].map(|stage| of_shell(stage, index));
    let law = shell.pair;
    let parts = parts_of(plant, law);
    let read = |word: usize| format!("tables[at + {word}u]");
    let words: Vec<String> = (0..fields::<f64, ShellPoint<f64>>().len()).map(read).collect();
    let names = fields::<f64, PointState<f64>>().into_iter().map(|field| format!("s{index}.state_{}", field.name));
    let kept: Vec<String> = names.collect();
    format!(
        "    let r{index} = {relative}({parts});\n    \
         var t{index} = no_shell_touch();\n    \
         if (r{index}.near > 0.0) {{\n        \
             var i = 0u;\n        \
             loop {{\n            \
                 let at = {}u + i * {SHELL_WORDS}u;\n            \
                 t{index} = {point}(pairs.p{law}, r{index}, ShellPoint({}), {state}.approach, t{index});\n            \
                 i++;\n            \
                 if (i == {}u) {{\n                \
                     break;\n            \
                 }}\n        \
             }}\n    \
         }}\n    \
         let s{index} = {contact}(pairs.p{law}, {parts}, r{index}, t{index}, {state});\n    \
         {state} = PointState({});\n    \
         {}",
        shell.offset,
        words.join(", "),
        shell.points.len(),
        kept.join(", "),
        gathered(plant, law, &format!("s{index}")),
    )
}

/// Vectors of a lane one behind the other.
fn in_order(quad: usize) -> String {
    format!("{quad}u")
}

/// Statements that read variables from a buffer laid out one number behind the other.
fn loads(buffer: &str, variables: &[String]) -> String {
    let given = variables.iter().enumerate().map(|(index, variable)| format!("    {variable} = {};\n", read(index)));
    reads(buffer, variables.len(), in_order) + &given.collect::<String>()
}

/// Access functions of one delay line that begins `offset` vectors into a lane's share.
fn line(name: &str, ty: &str, fields: &[Field], offset: usize) -> String {
    let place = |quad: usize| format!("{offset}u + slot * {}u + {quad}u", quads(fields.len()));
    let values: Vec<String> = fields.iter().map(|field| format!("value.{}", field.name)).collect();
    let numbers: Vec<String> = (0..fields.len()).map(read).collect();
    format!(
        "\nfn put_{name}(slot: u32, value: {ty}) {{\n{}}}\n\nfn get_{name}(slot: u32) -> {ty} {{\n{}    return {ty}({});\n}}\n",
        stores("lines", &values, place),
        reads("lines", fields.len(), place),
        numbers.join(", "),
    )
}
