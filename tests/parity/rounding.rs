//! Carries out a trace in f64 and, beside each value, bounds what rounding to f32 may make of it.
//!
//! The bound is a running error analysis (Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., 3.3): every
//! operation passes its operands' errors on and adds its own rounding. Where a comparison or a floor is too close to
//! call, both outcomes are joined: the bound then holds their difference, so that no sample must be left out.

use softdock_kernels::real::Real;
use softdock_kernels::trace::{Graph, Op};

/// Rounding of one f32 operation, relative.
pub(crate) const F32: f64 = 1.0 / 16_777_216.0;
/// Below this an f32 may be flushed to zero.
const TINY: f64 = f32::MIN_POSITIVE as f64;
/// WGSL allows 2.5 ulp for a division and leaves a square root to be made of 1 / inverseSqrt(x): 2 + 2.5 ulp.
/// An ulp is up to two roundings.
const DIVISION: f64 = 5.0;
const SQUARE_ROOT: f64 = 9.0;

/// A value and how far an f32 evaluation may be from it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Value {
    pub(crate) value: f64,
    pub(crate) error: f64,
}

/// A value, or a mask with whether it is certain; masks are 0 or 1, uncertain ones with an error of 1.
fn mask(value: bool, certain: bool) -> Value {
    Value { value: f64::from(u8::from(value)), error: if certain { 0.0 } else { 1.0 } }
}

/// Rounds a result: its operands' part of the error, and so many roundings of its own.
fn rounded(value: f64, passed_on: f64, roundings: f64) -> Value {
    Value { value, error: passed_on + roundings * F32 * (value.abs() + passed_on) + TINY }
}

/// Either of two outcomes; the value is the first.
fn either(taken: Value, other: Value) -> Value {
    Value { value: taken.value, error: taken.error.max((other.value - taken.value).abs() + other.error) }
}

/// The results of a trace on exact inputs, with their bounds.
pub(crate) fn evaluate(graph: &Graph, inputs: &[f64]) -> Vec<Value> {
    let mut values: Vec<Value> = Vec::with_capacity(graph.ops.len());
    for op in &graph.ops {
        let v = |node: u32| values[node as usize];
        let result = match *op {
            Op::Input(i) => Value { value: inputs[i as usize], error: 0.0 },
            Op::Const(bits) => constant(f64::from_bits(bits)),
            Op::Known(value) => mask(value, true),
            Op::Less(a, b) => compare(v(a), v(b), v(a).value < v(b).value),
            Op::LessEqual(a, b) => compare(v(a), v(b), v(a).value <= v(b).value),
            Op::And(a, b) => logic(v(a), v(b), 0.0),
            Op::Or(a, b) => logic(v(a), v(b), 1.0),
            Op::Not(a) => Value { value: 1.0 - v(a).value, ..v(a) },
            Op::Select(mask, then, other) => {
                let (taken, left) = if v(mask).value > 0.5 { (v(then), v(other)) } else { (v(other), v(then)) };
                if v(mask).error > 0.0 { either(taken, left) } else { taken }
            }
            op => arithmetic(op, v),
        };
        values.push(result);
    }
    graph.results.iter().map(|node| values[*node as usize]).collect()
}

fn constant(value: f64) -> Value {
    let printed = f64::from(value.clamp(-f64::from(f32::MAX), f64::from(f32::MAX)) as f32);
    Value { value, error: (printed - value).abs() }
}

fn compare(a: Value, b: Value, outcome: bool) -> Value {
    mask(outcome, (a.value - b.value).abs() > a.error + b.error || (a.error == 0.0 && b.error == 0.0))
}

/// And or or; `decisive` is the operand value that settles it whatever the other is.
fn logic(a: Value, b: Value, decisive: f64) -> Value {
    let settles = |x: Value| x.value == decisive && x.error == 0.0;
    let value = if decisive == 0.0 { a.value * b.value } else { a.value.max(b.value) };
    let error = if settles(a) || settles(b) { 0.0 } else { a.error.max(b.error) };
    Value { value, error }
}

fn arithmetic(op: Op, v: impl Fn(u32) -> Value) -> Value {
    let product = |a: Value, b: Value| a.value.abs() * b.error + b.value.abs() * a.error + a.error * b.error;
    match op {
        Op::Add(a, b) => rounded(v(a).value + v(b).value, v(a).error + v(b).error, 1.0),
        Op::Sub(a, b) => rounded(v(a).value - v(b).value, v(a).error + v(b).error, 1.0),
        Op::Mul(a, b) => rounded(v(a).value * v(b).value, product(v(a), v(b)), 1.0),
        Op::Div(a, b) => divide(v(a), v(b)),
        Op::Neg(a) => Value { value: -v(a).value, ..v(a) },
        Op::Fma(a, b, c) => {
            // A driver may round the product as well.
            let unfused = F32 * (v(a).value * v(b).value).abs() + TINY;
            let passed_on = product(v(a), v(b)) + v(c).error + unfused;
            rounded(v(a).value.mul_add(v(b).value, v(c).value), passed_on, 1.0)
        }
        Op::Sqrt(a) => {
            let (root, error) = (v(a).value.sqrt(), v(a).error);
            let passed_on = (root - (v(a).value - error).max(0.0).sqrt()).max((v(a).value + error).sqrt() - root);
            rounded(root, passed_on, SQUARE_ROOT)
        }
        Op::Abs(a) => Value { value: v(a).value.abs(), ..v(a) },
        Op::Floor(a) => step(v(a), f64::floor),
        Op::Min(a, b) => extreme(v(a), v(b), v(a).value < v(b).value),
        Op::Max(a, b) => extreme(v(a), v(b), v(b).value < v(a).value),
        Op::Exponent(a) => step(v(a), |x| x.frexp().1),
        Op::Mantissa(a) => {
            let (mantissa, exponent) = v(a).value.frexp();
            let scaled = v(a).error / 2.0_f64.powf(exponent);
            let certain = step(v(a), |x| x.frexp().1).error == 0.0;
            Value { value: mantissa, error: if certain { scaled } else { 0.5 + scaled } }
        }
        Op::Exp2(a) => {
            let value = v(a).value.exp2_whole();
            Value { value, error: if v(a).error == 0.0 { 0.0 } else { value * (v(a).error.exp2() - 1.0) } }
        }
        other => unreachable!("{other:?} is no arithmetic"),
    }
}

fn divide(a: Value, b: Value) -> Value {
    let quotient = a.value / b.value;
    // A divisor that may be zero bounds nothing.
    let least = (b.value.abs() - b.error).max(0.0);
    let passed_on = (a.error + quotient.abs() * b.error) / least;
    let passed_on = if passed_on.is_nan() { 0.0 } else { passed_on };
    rounded(quotient, passed_on, DIVISION)
}

/// A function that is constant but for steps upwards.
fn step(x: Value, function: impl Fn(f64) -> f64) -> Value {
    let value = function(x.value);
    let (low, high) = (function(x.value - x.error), function(x.value + x.error));
    Value { value, error: (value - low).max(high - value) }
}

/// A minimum or maximum: what is the farther from being chosen adds to the bound only as far as it may be chosen.
fn extreme(a: Value, b: Value, first: bool) -> Value {
    let (taken, other) = if first { (a, b) } else { (b, a) };
    let overlap = (taken.error + other.error - (taken.value - other.value).abs()).max(0.0);
    let error = if overlap > 0.0 { taken.error.max(other.error) } else { taken.error };
    Value { value: taken.value, error }
}
