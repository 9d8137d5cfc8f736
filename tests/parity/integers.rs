//! Random integers and bit tricks: the same bits on the device as in Rust.

use super::table::Row;
use super::{POISON, WORKGROUP, adapters, written};
use softdock_kernels::frame::Batch;
use softdock_kernels::noise::uniforms;
use softdock_kernels::philox::philox4x32;
use softdock_kernels::real::Real;
use softdock_tracer::kernel::kernel;
use std::fmt::Write;

/// A function of whole words: its call on the words `w`, and its twin.
pub(crate) struct Words {
    call: &'static str,
    outputs: usize,
    twin: fn(&[u32; 6]) -> Vec<u32>,
}

const fn row(name: &'static str, call: &'static str, outputs: usize, twin: fn(&[u32; 6]) -> Vec<u32>) -> Row<Words> {
    Row { name, allowed: 0.0, reason: "integers and bits: equal", twin: Words { call, outputs, twin } }
}

/// The batch's key while these run.
const KEY: [u32; 2] = [0xDEAD_BEEF, 0x0BAD_CAFE];

/// Every function of `wgsl/philox.wgsl` and `wgsl/math.wgsl`.
pub(crate) const INTEGER_ROWS: [Row<Words>; 6] = [
    row("high_product", "vec4u(high_product(w[0], w[1]))", 1, |w| {
        vec![((u64::from(w[0]) * u64::from(w[1])) >> 32) as u32]
    }),
    row("philox4x32", "philox4x32(vec4u(w[0], w[1], w[2], w[3]), vec2u(w[4], w[5]))", 4, |w| {
        philox4x32([w[0], w[1], w[2], w[3]], [w[4], w[5]]).to_vec()
    }),
    row("uniforms", "bitcast<vec4u>(uniforms(vec2u(w[0], w[1]), w[2], w[3]))", 4, |w| {
        let run = u64::from(w[0]) | u64::from(w[1]) << 32;
        uniforms(KEY, run, w[2], w[3]).map(|u| (u as f32).to_bits()).to_vec()
    }),
    row("mantissa", "vec4u(bitcast<u32>(mantissa(bitcast<f32>(w[0] % 0x7f000000u + 0x00800000u))))", 1, |w| {
        vec![(positive(w[0]).frexp().0 as f32).to_bits()]
    }),
    row("exponent", "vec4u(bitcast<u32>(exponent(bitcast<f32>(w[0] % 0x7f000000u + 0x00800000u))))", 1, |w| {
        vec![(positive(w[0]).frexp().1 as f32).to_bits()]
    }),
    row("exp2_whole", "vec4u(bitcast<u32>(exp2_whole(f32(i32(w[0] % 253u) - 126))))", 1, |w| {
        vec![((f64::from(w[0] % 253) - 126.0).exp2_whole() as f32).to_bits()]
    }),
];

/// A positive normal f32 made of a word.
fn positive(word: u32) -> f64 {
    f64::from(f32::from_bits(word % 0x7f00_0000 + 0x0080_0000))
}

/// Known answers of the Random123 distribution (kat_vectors, philox4x32 10): counter, key, answer.
const KNOWN: [([u32; 6], [u32; 4]); 3] = [
    ([0; 6], [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8]),
    ([!0; 6], [0x408f_276d, 0x41c8_3b0e, 0xa20b_c7c6, 0x6d54_51fd]),
    (
        [0x243f_6a88, 0x85a3_08d3, 0x1319_8a2e, 0x0370_7344, 0xa409_3822, 0x299f_31d0],
        [0xd16c_fe09, 0x94fd_cceb, 0x5001_e420, 0x2412_6ea1],
    ),
];

/// 10,000 random counters and keys behind the known ones, in whole workgroups.
const COUNT: usize = 10_048;

fn inputs() -> Vec<[u32; 6]> {
    let random = (KNOWN.len() as u32..COUNT as u32).map(|i| {
        let (a, b) = (philox4x32([i, 1, 2, 3], [4, 5]), philox4x32([i, 6, 7, 8], [9, 10]));
        [a[0], a[1], a[2], a[3], b[0], b[1]]
    });
    KNOWN.iter().map(|(words, _)| *words).chain(random).collect()
}

/// An entry point that calls every row on six words.
fn module() -> String {
    let mut text = kernel(&super::samples::CASES[0].plant, Batch::whole())
        .text
        .replace("batch.key", &format!("vec2u({:#x}u, {:#x}u)", KEY[0], KEY[1]));
    text += "\n@group(0) @binding(0) var<storage, read_write> given: array<array<u32, 6>>;\n\
             @group(0) @binding(1) var<storage, read_write> answers: array<u32>;\n\n\
             @compute @workgroup_size(64)\nfn try_words(@builtin(global_invocation_id) id: vec3u) {\n    let w = given[id.x];\n";
    let width: usize = INTEGER_ROWS.iter().map(|row| row.twin.outputs).sum();
    let mut output = 0;
    for row in &INTEGER_ROWS {
        let _ = writeln!(text, "    let {}_of = {};", row.name, row.twin.call);
        for component in 0..row.twin.outputs {
            let _ = writeln!(text, "    answers[id.x * {width}u + {output}u] = {}_of[{component}];", row.name);
            output += 1;
        }
    }
    text + "}\n"
}

#[test]
fn random_numbers_and_bit_tricks_are_the_same_bits_on_the_device() {
    let inputs = inputs();
    let expected: Vec<Vec<u32>> =
        inputs.iter().map(|w| INTEGER_ROWS.iter().flat_map(|row| (row.twin.twin)(w)).collect()).collect();
    let width = expected[0].len();
    for gpu in adapters() {
        let buffers = [inputs.concat(), vec![POISON; COUNT * width]];
        let out = gpu.compute(&module(), "try_words", (COUNT / WORKGROUP) as u32, &buffers).expect("it runs");
        for ((answer, expected), input) in out[1].chunks(width).zip(&expected).zip(&inputs) {
            assert_eq!(answer, expected, "{input:x?}");
        }
        for ((_, known), answer) in KNOWN.iter().zip(out[1].chunks(width)) {
            assert_eq!(answer[1..5], known[..], "Random123's known answers");
        }
        assert!(out[1].chunks(width).all(|row| row[5..9].iter().all(|u| written(*u, String::new) > 0.0)));
    }
}
