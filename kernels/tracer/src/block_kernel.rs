//! The WGSL module that steps a block through a recording: structs and access from the field tables, traced functions,
//! the frame.

use crate::stages::{structure, traced};
use crate::trace::Sym;
use crate::wgsl::{Function, Struct};
use softdock_kernels::block::Block;
use softdock_kernels::fields::Field;
use softdock_kernels::stage;
use std::fmt::Write;

/// The hand-written parts.
const FRAME: &str = concat!(include_str!("../../wgsl/math.wgsl"), "\n", include_str!("../../wgsl/replay.wgsl"));

/// The module for recordings with a step \[s\]; its storage bindings are the batch (lanes, instants, stride), inputs, late
/// inputs, parameters field by field for all lanes, and outputs number by number for all lanes.
pub fn kernel<B: Block>(block: &B, step: f64) -> String {
    let names = [
        ("Params", structure::<B::Params<Sym>>()),
        ("State", structure::<B::State<Sym>>()),
        ("Input", structure::<B::Input<Sym>>()),
        ("Late", structure::<B::Late<Sym>>()),
        ("Output", structure::<B::Output<Sym>>()),
    ];
    let mut text = format!("const STEP = {:?}f;\n\n", step as f32);
    text.push_str("@group(0) @binding(0) var<storage, read_write> batch: array<u32, 3>;\n");
    for (binding, buffer) in (1..).zip(["inputs", "lates", "sets", "outputs"]) {
        let _ = writeln!(text, "@group(0) @binding({binding}) var<storage, read_write> {buffer}: array<f32>;");
    }
    let mut declared: Vec<&str> = Vec::new();
    let functions = functions(block, step);
    let used = functions.iter().flat_map(|f| f.arguments.iter().map(|(_, s)| s).chain([&f.result]));
    for structure in names.iter().map(|(_, structure)| structure).chain(used) {
        if !declared.contains(&structure.name.as_str()) {
            text.push_str(&structure.declaration());
            declared.push(&structure.name);
        }
    }
    for (alias, structure) in &names {
        let _ = writeln!(text, "alias {alias} = {};", structure.name);
    }
    let fields = |name: &str| -> &[Field] { &names.iter().find(|row| row.0 == name).expect("listed above").1.fields };
    text.push_str(&reader("input_at(instant: u32) -> Input", "Input", fields("Input"), |i, n| {
        format!("inputs[instant * {n}u + {i}u]")
    }));
    text.push_str(&reader("params_of(lane: u32) -> Params", "Params", fields("Params"), |i, _| {
        format!("sets[{i}u * lanes() + lane]")
    }));
    text.push_str(&reader(
        "late_between(newer: u32, older: u32, share: f32) -> Late",
        "Late",
        fields("Late"),
        |i, n| format!("mix(lates[newer * {n}u + {i}u], lates[older * {n}u + {i}u], share)"),
    ));
    text.push_str(&writer(&names[4].1));
    text.push_str(FRAME);
    for function in &functions {
        text.push('\n');
        text.push_str(&function.listing());
    }
    text
}

/// The block's functions, traced for a step \[s\].
pub fn functions<B: Block>(block: &B, step: f64) -> Vec<Function> {
    type P<B> = <B as Block>::Params<Sym>;
    type S<B> = <B as Block>::State<Sym>;
    type U<B> = <B as Block>::Input<Sym>;
    type V<B> = <B as Block>::Late<Sym>;
    type O<B> = <B as Block>::Output<Sym>;
    let rows = [
        stage!(Sym; lateness(p: P<B>, time: Sym) -> Sym => block.lateness(&p, time)),
        stage!(Sym; start(p: P<B>, u: U<B>, late: V<B>) -> S<B> => block.start(&p, &u, &late)),
        stage!(Sym; advance(p: P<B>, s: S<B>, u: U<B>, late: V<B>) -> S<B> => block.advance(step, &p, &s, &u, &late)),
        stage!(Sym; output(p: P<B>, s: S<B>, u: U<B>, late: V<B>) -> O<B> => block.output(&p, &s, &u, &late)),
    ];
    rows.map(traced).into()
}

/// A function that makes a struct of numbers from a buffer.
fn reader(head: &str, name: &str, fields: &[Field], number: impl Fn(usize, usize) -> String) -> String {
    let numbers: Vec<String> = (0..fields.len()).map(|i| number(i, fields.len())).collect();
    format!("\nfn {head} {{\n    return {name}(\n        {}\n    );\n}}\n", numbers.join(",\n        "))
}

/// The function that stores a sample's outputs.
fn writer(output: &Struct) -> String {
    let mut out = "\nfn put_output(lane: u32, sample: u32, value: Output) {\n".to_owned();
    let count = output.fields.len();
    for (i, field) in output.fields.iter().enumerate() {
        let _ = writeln!(out, "    outputs[(sample * {count}u + {i}u) * lanes() + lane] = value.{};", field.name);
    }
    out + "}\n\n"
}
