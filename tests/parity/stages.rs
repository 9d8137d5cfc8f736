//! Depth one: every traced stage function on sampled inputs, against its Rust text in f64.

use super::rounding::{F32, evaluate};
use super::samples::{CASES, Case, MESHED, OBSERVED, SAMPLES, arguments};
use super::table::STAGES;
use super::{POISON, WORKGROUP, adapters, words, written};
use softdock_engine::gpu::GpuEngine;
use softdock_kernels::fields::Field;
use softdock_kernels::stages::{StageRow, base_name, stages};
use softdock_test_size::is_full;
use softdock_tracer::kernel::{Kernel, TABLES, kernel};
use softdock_tracer::wgsl::Function;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

/// An output whose enclosure is wider than this share of its size lies on a discontinuity, or is badly conditioned.
const UNDECIDED: f64 = 1e-4;
/// Drivers re-associate sums (lavapipe does, for the centre of mass, its step and the lever to a part, and for the
/// velocity of a turning part's point): roundings then fall on other intermediate values than those of the enclosure.
const ASSOCIATION: f64 = 2.0;
/// A bound larger than this many times the observed error would detect nothing.
pub(crate) const SLACK: f64 = 100.0;
/// So many outputs of a function may be beyond what is allowed for that reason.
const UNDECIDED_SHARE: f64 = 0.02;
/// Cases of the short check: between them they have every stage, an arm, robots with joints, a compensator, and meshes.
const SHORT: [&str; 4] = ["smoke_joint", "computed torque, Power law, box and ball", OBSERVED, MESHED];

/// Largest errors of a function's outputs.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Seen {
    /// Over the field's largest size among the samples, in f32 roundings.
    pub(crate) scaled: f64,
    /// Over the bound that rounding alone sets, sample by sample; beyond [`ASSOCIATION`] it is a fault.
    pub(crate) of_bound: f64,
    /// Share of the outputs beyond what is allowed, on a discontinuity.
    pub(crate) undecided: f64,
}

impl Seen {
    pub(crate) fn or(self, o: Self) -> Self {
        Self {
            scaled: self.scaled.max(o.scaled),
            of_bound: self.of_bound.max(o.of_bound),
            undecided: self.undecided.max(o.undecided),
        }
    }
}

/// What the scenarios of one adapter show.
#[derive(Default)]
struct Found {
    /// Largest errors by function.
    seen: BTreeMap<String, Seen>,
    faults: Vec<String>,
    /// Texts of the functions that have been run.
    run: BTreeSet<String>,
}

/// So many outputs go into one entry point: a software driver compiles each store as a loop over its lanes, and long
/// chains of loops slowly.
const OUTPUTS: usize = 120;

/// Functions in groups that are compiled together.
fn groups(functions: &[Function]) -> Vec<&[Function]> {
    let (mut out, mut begin, mut outputs) = (Vec::new(), 0, 0);
    for (index, function) in functions.iter().enumerate() {
        let more = function.result.fields.len();
        if index > begin && outputs + more > OUTPUTS {
            out.push(&functions[begin..index]);
            (begin, outputs) = (index, 0);
        }
        outputs += more;
    }
    out.push(&functions[begin..]);
    out
}

/// Returns an entry point that calls every function once on inputs and stores the concatenated results.
fn module(kernel: &Kernel, functions: &[Function]) -> String {
    // Bindings have no gaps: the tables take the place of the inputs, which no stage reads.
    let inputs = "@binding(2) var<storage, read> inputs";
    let mut text = kernel.text.replace(inputs, &inputs.replace('2', "7"));
    text = text.replace(TABLES, &TABLES.replace("binding(6)", "binding(2)"));
    text += "\n@group(0) @binding(0) var<storage, read_write> given: array<f32>;\n\
             @group(0) @binding(1) var<storage, read_write> results: array<f32>;\n\n\
             @compute @workgroup_size(64)\nfn try_stages(@builtin(global_invocation_id) id: vec3u) {\n    _ = given[0];\n";
    let (mut input, mut output) = (0, 0);
    for (number, function) in functions.iter().enumerate() {
        let mut names = Vec::new();
        for (argument, structure) in &function.arguments {
            let read: Vec<_> = structure.fields.iter().enumerate().map(|(i, _)| given(input + i)).collect();
            let _ = writeln!(text, "    let a{number}_{argument} = {}({});", structure.name, read.join(", "));
            names.push(format!("a{number}_{argument}"));
            input += structure.fields.len();
        }
        let _ = writeln!(text, "    let r{number} = {}({});", function.name, names.join(", "));
        for field in &function.result.fields {
            let value = function.result.access(&format!("r{number}"), field);
            let _ = writeln!(text, "    results[{output}u * {SAMPLES}u + id.x] = {value};");
            output += 1;
        }
    }
    text + "}\n"
}

fn given(index: usize) -> String {
    format!("given[{index}u * {SAMPLES}u + id.x]")
}

/// Runs every function of a scenario on one adapter and compares.
///
/// In the short check a function whose text an earlier scenario has, too, is not run again.
fn compare<const N: usize>(gpu: &GpuEngine, case: &Case, found: &mut Found) {
    let mut kernel = kernel(&case.plant, case.batch);
    let functions = std::mem::take(&mut kernel.functions);
    let is_new = |own: &Function| found.run.insert(own.listing()) || is_full();
    let functions: Vec<Function> = functions.into_iter().filter(is_new).collect();
    let rows = stages::<f64, N>(&case.plant);
    for functions in groups(&functions) {
        let lists: Vec<_> = functions.iter().map(|function| arguments::<N>(case, function)).collect();
        let columns = lists.iter().flat_map(|samples| {
            (0..samples[0].len()).flat_map(move |field| samples.iter().map(move |sample| sample[field]))
        });
        let outputs: usize = functions.iter().map(|f| f.result.fields.len()).sum();
        // A binding must not be empty, even where no function takes anything.
        let given = words(columns.chain([0.0]));
        let mut buffers = vec![given, vec![POISON; outputs * SAMPLES]];
        // A binding that no function uses is not there.
        if functions.iter().any(|function| function.listing().contains("tables[")) {
            buffers.push(words(kernel.tables.iter().map(|number| f64::from(*number))));
        }
        let buffers = gpu
            .compute(&module(&kernel, functions), "try_stages", (SAMPLES / WORKGROUP) as u32, &buffers)
            .unwrap_or_else(|error| panic!("{}: {error}", case.name));
        let mut results = buffers[1].chunks(SAMPLES);
        for (function, samples) in functions.iter().zip(&lists) {
            let row =
                rows.iter().find(|row| row.name == function.name).expect("the list has the scalar alone as its type");
            let columns: Vec<&[u32]> = results.by_ref().take(function.result.fields.len()).collect();
            let errors = check(case, row, function, samples, &columns, &mut found.faults);
            let entry = found.seen.entry(base_name(&function.name).to_owned()).or_default();
            *entry = entry.or(errors);
        }
    }
}

/// What the table allows a function.
fn allowed(name: &str) -> f64 {
    let row = STAGES.iter().find(|stage| stage.0 == base_name(name));
    row.expect("no orphan: the table's own test").1
}

/// One function's outputs against its Rust text, and the bounds of rounding from its trace.
fn check(
    case: &Case,
    row: &StageRow<'_, f64>,
    function: &Function,
    samples: &[Vec<f64>],
    columns: &[&[u32]],
    faults: &mut Vec<String>,
) -> Seen {
    let truths: Vec<Vec<f64>> = samples.iter().map(|sample| (row.call)(sample)).collect();
    let allowed_of_table = allowed(&function.name);
    let scales = scales(&function.result.fields, &truths);
    let mut seen = Seen::default();
    for (sample, (inputs, truth)) in samples.iter().zip(&truths).enumerate() {
        let bounds = evaluate(&function.graph, inputs);
        for (index, (bound, field)) in bounds.iter().zip(&function.result.fields).enumerate() {
            let what = || format!("{}: {}.{} of sample {sample}", case.name, function.name, field.name);
            let value = written(columns[index][sample], what);
            // The trace folds constants: its f64 may differ from the text's by f64 rounding, no more.
            let (traced, allowed) = ((bound.value - truth[index]).abs(), bound.error());
            if traced > 1e-5 * allowed {
                faults.push(format!("{}: {bound:?} traced for {}", what(), truth[index]));
            }
            let error = (value - truth[index]).abs();
            if error > 0.0 {
                if error > ASSOCIATION * allowed {
                    faults.push(format!("{}: {value} for {}, bound {bound:?}", what(), truth[index]));
                }
                seen.of_bound = seen.of_bound.max(error / allowed);
            }
            let scaled = error / scales[index] / F32;
            // Too close to a discontinuity to say which side is right: only the enclosure holds.
            if scaled > allowed_of_table && allowed > UNDECIDED * scales[index] {
                seen.undecided += 1.0 / (samples.len() * columns.len()) as f64;
            } else {
                seen.scaled = seen.scaled.max(scaled);
            }
        }
    }
    seen
}

/// The largest size of each field's group (all components of a vector, all joints) among the samples.
pub(crate) fn scales(fields: &[Field], samples: &[Vec<f64>]) -> Vec<f64> {
    let mut groups: BTreeMap<&str, f64> = BTreeMap::new();
    for (index, field) in fields.iter().enumerate() {
        let size = groups.entry(group(&field.name)).or_insert_with(|| least(field.unit));
        *size = samples.iter().map(|sample| sample[index].abs()).fold(*size, f64::max);
    }
    fields.iter().map(|field| groups[group(&field.name)]).collect()
}

/// Sizes that matter to nobody: what is zero but for rounding is not compared with itself.
fn least(unit: &str) -> f64 {
    match unit {
        "N" | "N m" | "kg m/s" | "kg m^2/s" => 1e-2,
        "m" | "rad" | "s" | "J" | "N s" => 1e-5,
        _ => 1e-3,
    }
}

/// A field's name without its component.
pub(crate) fn group(name: &str) -> &str {
    let (head, tail) = name.rsplit_once('_').unwrap_or(("", name));
    let component = matches!(tail, "x" | "y" | "z" | "w" | "xx" | "yy" | "zz" | "xy" | "xz" | "yz" | "cos" | "sin");
    if component || tail.parse::<u32>().is_ok() { head } else { name }
}

#[test]
fn stage_functions_match_their_rust_functions() {
    for gpu in adapters() {
        let mut found = Found::default();
        let in_short = |case: &&Case| is_full() || SHORT.contains(&case.name);
        for case in CASES.iter().filter(in_short) {
            match case.plant.joints() {
                0 => compare::<0>(&gpu, case, &mut found),
                _ => compare::<6>(&gpu, case, &mut found),
            }
        }
        let Found { seen, mut faults, .. } = found;
        println!("{:<14} {:>9} {:>8} {:>8} {:>9}  reason", "stage", "roundings", "allowed", "of bound", "undecided");
        for &(name, allowed, reason) in STAGES {
            let s = seen[name];
            println!("{name:<14} {:>9.2} {allowed:>8} {:>8.3} {:>9.4}  {reason}", s.scaled, s.of_bound, s.undecided);
            // Only all cases together come near to what is allowed.
            let is_loose = is_full() && allowed > SLACK * s.scaled;
            if s.scaled > allowed || s.undecided > UNDECIDED_SHARE || is_loose {
                faults.push(format!("{name}: {s:?}, allowed {allowed}"));
            }
        }
        assert!(faults.is_empty(), "{} faults: {:#?}", faults.len(), &faults[..faults.len().min(20)]);
    }
}
