//! Evaluates a trace in f64 with an enclosure of the f32 rounding of each value.
//!
//! The enclosure is interval arithmetic in which every operation adds its own rounding (Higham, Accuracy and Stability
//! of Numerical Algorithms, 2nd ed., 3.3, gives the running error analysis that it follows). Where a comparison or a
//! floor is too close to call, both outcomes are joined, so that no sample has to be left out.

use softdock_kernels::lookup::LookupTable;
use softdock_kernels::real::Real;
use softdock_tracer::trace::{Graph, Op};

/// Rounding of one f32 operation, relative.
pub(crate) const F32: f64 = 1.0 / 16_777_216.0;
/// Below this an f32 may be flushed to zero.
const TINY: f64 = f32::MIN_POSITIVE as f64;
/// WGSL allows 2.5 ulp for a division and a square root made of 1 / inverseSqrt(x), 2 + 2.5 ulp; an ulp is up to two
/// roundings.
const DIVISION: f64 = 5.0;
const SQUARE_ROOT: f64 = 9.0;

/// A value and the interval in which an f32 evaluation lies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Value {
    /// What f64 gives; 0 or 1 for a mask.
    pub(crate) value: f64,
    low: f64,
    high: f64,
}

impl Value {
    fn exact(value: f64) -> Self {
        Self { value, low: value, high: value }
    }

    fn mask(value: bool, certain: bool) -> Self {
        let value = f64::from(u8::from(value));
        if certain { Self::exact(value) } else { Self { value, low: 0.0, high: 1.0 } }
    }

    /// The smallest interval around a value and corners, with so many roundings.
    fn around(value: f64, corners: &[f64], roundings: f64) -> Self {
        // 0 * inf and inf / inf come of operands without bounds: so is the result.
        let lost = corners.iter().any(|corner| corner.is_nan());
        let low = if lost { f64::NEG_INFINITY } else { corners.iter().copied().fold(value, f64::min) };
        let high = if lost { f64::INFINITY } else { corners.iter().copied().fold(value, f64::max) };
        let widened = |end: f64| roundings * F32 * end.abs() + TINY;
        Self { value, low: low - widened(low), high: high + widened(high) }
    }

    /// A non-decreasing function of one operand.
    fn map(self, function: impl Fn(f64) -> f64) -> Self {
        Self { value: function(self.value), low: function(self.low), high: function(self.high) }
    }

    /// The distance to the farther end.
    pub(crate) fn error(&self) -> f64 {
        (self.value - self.low).max(self.high - self.value)
    }

    fn certain(&self) -> bool {
        self.low == self.high
    }
}

/// The results of a trace on exact inputs, enclosed.
pub(crate) fn evaluate(graph: &Graph, inputs: &[f64]) -> Vec<Value> {
    let mut values: Vec<Value> = Vec::with_capacity(graph.ops.len());
    for op in &graph.ops {
        let v = |node: u32| values[node as usize];
        let result = match *op {
            Op::Input(i) => Value::exact(inputs[i as usize]),
            Op::Const(bits) => constant(f64::from_bits(bits)),
            Op::Known(value) => Value::mask(value, true),
            Op::Less(a, b) => compare(v(a), v(b), v(a).value < v(b).value),
            Op::LessEqual(a, b) => compare(v(a), v(b), v(a).value <= v(b).value),
            Op::And(a, b) | Op::Min(a, b) => both(v(a), v(b), Real::min),
            Op::Or(a, b) | Op::Max(a, b) => both(v(a), v(b), Real::max),
            Op::Not(a) => Value { value: 1.0 - v(a).value, low: 1.0 - v(a).high, high: 1.0 - v(a).low },
            Op::Select(mask, then, other) => {
                let (taken, left) = if v(mask).value > 0.5 { (v(then), v(other)) } else { (v(other), v(then)) };
                if v(mask).certain() { taken } else { either(taken, left) }
            }
            Op::LookUp { table, index, step } => looked_up(&graph.tables[table as usize], v(index), step as usize),
            op => arithmetic(op, v),
        };
        values.push(result);
    }
    graph.results.iter().map(|node| values[*node as usize]).collect()
}

/// A number of a table; where the index is too close to call, any that it may reach.
fn looked_up(table: &LookupTable, index: Value, step: usize) -> Value {
    let value = table.at(index.value, step);
    // An index is a whole number, whatever the enclosure of its sum.
    let [low, high] = [index.low, index.high].map(|end| end.max(0.0).round() as usize);
    let reached = (low..=high.min(table.values.len())).map(|index| table.at(index as f64, step));
    reached.fold(Value::exact(value), |all, one| Value { low: all.low.min(one), high: all.high.max(one), ..all })
}

/// A literal, as it is printed.
fn constant(value: f64) -> Value {
    let printed = f64::from(value.clamp(-f64::from(f32::MAX), f64::from(f32::MAX)) as f32);
    Value { value, low: printed.min(value), high: printed.max(value) }
}

fn compare(a: Value, b: Value, outcome: bool) -> Value {
    let apart = a.high < b.low || b.high < a.low;
    Value::mask(outcome, apart || (a.certain() && b.certain()))
}

/// Minimum or maximum, of numbers or masks.
fn both(a: Value, b: Value, choose: fn(f64, f64) -> f64) -> Value {
    Value { value: choose(a.value, b.value), low: choose(a.low, b.low), high: choose(a.high, b.high) }
}

/// One of two outcomes; f64 takes the first.
fn either(taken: Value, other: Value) -> Value {
    Value { value: taken.value, low: taken.low.min(other.low), high: taken.high.max(other.high) }
}

fn arithmetic(op: Op, v: impl Fn(u32) -> Value) -> Value {
    match op {
        Op::Add(a, b) => sum(v(a), v(b), v(a).value + v(b).value),
        Op::Sub(a, b) => sum(v(a), negated(v(b)), v(a).value - v(b).value),
        Op::Mul(a, b) => Value::around(v(a).value * v(b).value, &products(v(a), v(b)), 1.0),
        Op::Div(a, b) => divide(v(a), v(b)),
        Op::Neg(a) => negated(v(a)),
        // A driver may round the product as well.
        Op::Fma(a, b, c) => {
            let product = Value::around(v(a).value * v(b).value, &products(v(a), v(b)), 1.0);
            sum(product, v(c), v(a).value.mul_add(v(b).value, v(c).value))
        }
        Op::Sqrt(a) => {
            let root = v(a).map(|x| x.max(0.0).sqrt());
            Value::around(v(a).value.sqrt(), &[root.low, root.high], SQUARE_ROOT)
        }
        Op::Abs(a) if v(a).low >= 0.0 => v(a),
        Op::Abs(a) if v(a).high <= 0.0 => negated(v(a)),
        Op::Abs(a) => Value { value: v(a).value.abs(), low: 0.0, high: v(a).high.max(-v(a).low) },
        Op::Floor(a) => v(a).map(f64::floor),
        Op::Exponent(a) => v(a).map(|x| x.frexp().1),
        Op::Mantissa(a) => {
            let same = v(a).map(|x| x.frexp().1).certain();
            let whole = Value { value: v(a).value.frexp().0, low: 0.5, high: 1.0 };
            if same { v(a).map(|x| x.frexp().0) } else { whole }
        }
        Op::Exp2(a) => v(a).map(Real::exp2_whole),
        other => unreachable!("{other:?} is no arithmetic"),
    }
}

fn negated(a: Value) -> Value {
    Value { value: -a.value, low: -a.high, high: -a.low }
}

fn sum(a: Value, b: Value, value: f64) -> Value {
    Value::around(value, &[a.low + b.low, a.high + b.high], 1.0)
}

fn products(a: Value, b: Value) -> [f64; 4] {
    [a.low * b.low, a.low * b.high, a.high * b.low, a.high * b.high]
}

fn divide(a: Value, b: Value) -> Value {
    let corners = [a.low / b.low, a.low / b.high, a.high / b.low, a.high / b.high];
    // A divisor that may be zero bounds nothing.
    let crosses = b.low <= 0.0 && b.high >= 0.0;
    Value::around(a.value / b.value, if crosses { &[f64::NAN] } else { &corners }, DIVISION)
}
