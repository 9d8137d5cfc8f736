//! Random programs as emitted WGSL on the device, against their f64 results.

use super::rounding::evaluate;
use super::samples::Stream;
use super::{POISON, WORKGROUP, adapters, words, written};
use crate::kernel::{Step, program};
use softdock_kernels::fields::Field;
use softdock_tracer::trace::{Sym, trace};
use softdock_tracer::wgsl::{Function, Struct};
use std::fmt::Write;

/// Programs in a module, each on this many inputs.
const PROGRAMS: usize = 96;
const INPUTS: usize = 128;
/// Beyond this an f32 intermediate may overflow.
const LARGE: f64 = 1e18;
/// A result with a wider bound is not informative: a floor or a comparison was too close to call.
const LOOSE: f64 = 1e-3;

fn random_program(number: usize) -> Function {
    let mut draws = Stream::new("programs", number);
    let mut whole = |below: f64| (draws.uniform() * below) as usize;
    let steps: Vec<Step> =
        (0..8 + whole(32.0)).map(|_| (whole(256.0) as u8, whole(1e6), whole(1e6), whole(1e6))).collect();
    let scalar = || Struct { name: "f32".to_owned(), fields: vec![Field::new("", "1", "")] };
    Function {
        name: format!("program{number}"),
        arguments: ["x", "y", "z"].map(|name| (name.to_owned(), scalar())).to_vec(),
        result: scalar(),
        graph: trace(3, |inputs: &[Sym]| vec![program(&steps, [inputs[0], inputs[1], inputs[2]])]),
    }
}

fn module(programs: &[Function]) -> String {
    let mut text = programs.iter().map(Function::listing).collect::<String>();
    text += "@group(0) @binding(0) var<storage, read_write> given: array<array<f32, 3>>;\n\
             @group(0) @binding(1) var<storage, read_write> results: array<f32>;\n\n\
             @compute @workgroup_size(64)\nfn try_programs(@builtin(global_invocation_id) id: vec3u) {\n    let g = given[id.x];\n";
    for (number, function) in programs.iter().enumerate() {
        let _ = writeln!(text, "    results[{number}u * {INPUTS}u + id.x] = {}(g[0], g[1], g[2]);", function.name);
    }
    text + "}\n"
}

#[test]
fn random_programs_stay_within_the_rounding_of_their_own_operations_on_the_device() {
    let programs: Vec<Function> = (0..PROGRAMS).map(random_program).collect();
    let mut draws = Stream::new("program inputs", 0);
    let mut inputs = vec![[0.0; 3]; INPUTS];
    inputs.iter_mut().flatten().for_each(|value| *value = f64::from((6.0 * draws.uniform() - 3.0) as f32));
    for gpu in adapters() {
        let buffers = [words(inputs.iter().flatten().copied()), vec![POISON; PROGRAMS * INPUTS]];
        let out =
            gpu.compute(&module(&programs), "try_programs", (INPUTS / WORKGROUP) as u32, &buffers).expect("it runs");
        let (mut sharp, mut compared) = (0, 0);
        for (function, results) in programs.iter().zip(out[1].chunks(INPUTS)) {
            for (input, word) in inputs.iter().zip(results) {
                let value = written(*word, || function.name.clone());
                let truth = evaluate(&function.graph, input)[0];
                if truth.value.abs() + truth.error() > LARGE {
                    continue;
                }
                let what = || format!("{value} for {truth:?} on {input:?}:\n{}", function.listing());
                assert!((value - truth.value).abs() <= truth.error(), "{}", what());
                compared += 1;
                sharp += usize::from(truth.error() <= LOOSE * truth.value.abs().max(1.0));
            }
        }
        let share = sharp as f64 / (PROGRAMS * INPUTS) as f64;
        println!("{compared} results compared, {share:.3} of all bounded to a thousandth");
        assert!(share > 0.8, "only {share} of the results are informative");
    }
}
