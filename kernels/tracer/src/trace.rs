//! The symbolic scalar: running a stage with it records the stage as straight-line code.
//!
//! A [`Graph`] holds each distinct operation once (common subexpressions share a node), with constants folded and
//! neutral operations dropped as it is built. What no result needs is never printed (see [`crate::wgsl`]).

use softdock_kernels::lookup::LookupTable;
use softdock_kernels::real::Real;
use std::cell::RefCell;
use std::collections::HashMap;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// A number whose value is not known yet: a node of the graph under construction on this thread.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Sym(pub(crate) u32);

/// A comparison whose outcome is not known yet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SymMask(pub(crate) u32);

/// One operation; operands are earlier nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[expect(missing_docs, reason = "the operations of `Real`, one for one")]
pub enum Op {
    /// Input number `n` of the traced function.
    Input(u32),
    /// A constant, by its bits.
    Const(u64),
    Add(u32, u32),
    Sub(u32, u32),
    Mul(u32, u32),
    Div(u32, u32),
    Neg(u32),
    /// a * b + c.
    Fma(u32, u32, u32),
    Sqrt(u32),
    Abs(u32),
    Floor(u32),
    Min(u32, u32),
    Max(u32, u32),
    Mantissa(u32),
    Exponent(u32),
    Exp2(u32),
    /// Number `index + step` of table `table` of [`Graph::tables`].
    LookUp {
        table: u32,
        index: u32,
        step: u32,
    },
    /// A constant outcome.
    Known(bool),
    Less(u32, u32),
    LessEqual(u32, u32),
    And(u32, u32),
    Or(u32, u32),
    Not(u32),
    /// mask, then, other.
    Select(u32, u32, u32),
}

impl Op {
    /// The nodes that this operation reads.
    pub fn operands(&self) -> impl Iterator<Item = u32> {
        let list = match *self {
            Op::Input(_) | Op::Const(_) | Op::Known(_) => [None; 3],
            Op::Neg(a) | Op::Sqrt(a) | Op::Abs(a) | Op::Floor(a) | Op::Not(a) => [Some(a), None, None],
            Op::Mantissa(a) | Op::Exponent(a) | Op::Exp2(a) => [Some(a), None, None],
            Op::LookUp { index, .. } => [Some(index), None, None],
            Op::Fma(a, b, c) | Op::Select(a, b, c) => [Some(a), Some(b), Some(c)],
            Op::Add(a, b) | Op::Sub(a, b) | Op::Mul(a, b) | Op::Div(a, b) | Op::Min(a, b) | Op::Max(a, b) => {
                [Some(a), Some(b), None]
            }
            Op::Less(a, b) | Op::LessEqual(a, b) | Op::And(a, b) | Op::Or(a, b) => [Some(a), Some(b), None],
        };
        list.into_iter().flatten()
    }
}

/// A traced function: operations in order of execution, and its results.
#[derive(Clone, Debug, Default)]
pub struct Graph {
    /// Every operation, operands first.
    pub ops: Vec<Op>,
    /// The nodes that are the function's results.
    pub results: Vec<u32>,
    /// The tables that it reads.
    pub tables: Vec<LookupTable>,
    known: HashMap<Op, u32>,
}

thread_local! {
    static GRAPH: RefCell<Graph> = RefCell::default();
}

/// Runs `function` on `inputs` symbols and records what it does.
pub fn trace(inputs: usize, function: impl FnOnce(&[Sym]) -> Vec<Sym>) -> Graph {
    GRAPH.with_borrow_mut(|graph| *graph = Graph::default());
    let arguments: Vec<Sym> = (0..inputs as u32).map(|i| Sym(push(Op::Input(i)))).collect();
    let results = function(&arguments);
    GRAPH.with_borrow_mut(|graph| {
        let mut graph = std::mem::take(graph);
        graph.results = results.into_iter().map(|r| r.0).collect();
        graph
    })
}

impl Graph {
    /// Which nodes a result depends on.
    pub fn live(&self) -> Vec<bool> {
        let mut live = vec![false; self.ops.len()];
        for &result in &self.results {
            live[result as usize] = true;
        }
        for index in (0..self.ops.len()).rev() {
            if live[index] {
                self.ops[index].operands().for_each(|o| live[o as usize] = true);
            }
        }
        live
    }

    fn constant(&self, node: u32) -> Option<f64> {
        match self.ops[node as usize] {
            Op::Const(bits) => Some(f64::from_bits(bits)),
            _ => None,
        }
    }

    fn outcome(&self, node: u32) -> Option<bool> {
        match self.ops[node as usize] {
            Op::Known(value) => Some(value),
            _ => None,
        }
    }

    fn negated(&self, node: u32) -> Option<u32> {
        match self.ops[node as usize] {
            Op::Neg(inner) => Some(inner),
            _ => None,
        }
    }

    /// The constant and the other factor of a product with a constant.
    fn scaled(&self, node: u32) -> Option<(f64, u32)> {
        match self.ops[node as usize] {
            Op::Mul(a, b) => match (self.constant(a), self.constant(b)) {
                (Some(factor), _) => Some((factor, b)),
                (_, Some(factor)) => Some((factor, a)),
                _ => None,
            },
            _ => None,
        }
    }

    fn intern(&mut self, op: Op) -> u32 {
        let next = self.ops.len() as u32;
        *self.known.entry(op).or_insert_with(|| {
            self.ops.push(op);
            next
        })
    }

    /// Adds an operation unless it folds into what is there.
    fn push(&mut self, op: Op) -> u32 {
        match self.fold(op) {
            Ok(node) => node,
            Err(op) => self.intern(op),
        }
    }

    /// Place of a table among those that the function reads.
    fn table(&mut self, table: &LookupTable) -> u32 {
        let known = self.tables.iter().position(|own| own.offset == table.offset);
        known.unwrap_or_else(|| {
            self.tables.push(table.clone());
            self.tables.len() - 1
        }) as u32
    }

    fn lit(&mut self, value: f64) -> u32 {
        self.intern(Op::Const(value.to_bits()))
    }

    /// The node that an operation is equal to, or its normal form.
    ///
    /// Folding trusts that numbers are finite (0 * x = 0): the monitor ends a loop at its first NaN.
    fn fold(&mut self, op: Op) -> Result<u32, Op> {
        let c = |node| self.constant(node);
        match op {
            Op::Add(a, b) => match (c(a), c(b)) {
                (Some(x), Some(y)) => Ok(self.lit(x + y)),
                (Some(0.0), _) => Ok(b),
                (_, Some(0.0)) => Ok(a),
                _ => match (self.negated(a), self.negated(b)) {
                    (_, Some(inner)) => Ok(self.push(Op::Sub(a, inner))),
                    (Some(inner), _) => Ok(self.push(Op::Sub(b, inner))),
                    _ => Err(Op::Add(a.min(b), a.max(b))),
                },
            },
            Op::Sub(a, b) => match (c(a), c(b)) {
                (Some(x), Some(y)) => Ok(self.lit(x - y)),
                (Some(0.0), _) => Ok(self.push(Op::Neg(b))),
                (_, Some(0.0)) => Ok(a),
                _ if a == b => Ok(self.lit(0.0)),
                _ => match self.negated(b) {
                    Some(inner) => Ok(self.push(Op::Add(a, inner))),
                    None => Err(op),
                },
            },
            Op::Mul(a, b) => match (c(a), c(b)) {
                (Some(x), Some(y)) => Ok(self.lit(x * y)),
                (Some(0.0), _) | (_, Some(0.0)) => Ok(self.lit(0.0)),
                (Some(1.0), _) => Ok(b),
                (_, Some(1.0)) => Ok(a),
                (Some(-1.0), _) => Ok(self.push(Op::Neg(b))),
                (_, Some(-1.0)) => Ok(self.push(Op::Neg(a))),
                _ => Err(Op::Mul(a.min(b), a.max(b))),
            },
            Op::Div(a, b) => match (c(a), c(b)) {
                (Some(x), Some(y)) => Ok(self.lit(x / y)),
                (Some(0.0), _) => Ok(self.lit(0.0)),
                (_, Some(1.0)) => Ok(a),
                _ => Err(op),
            },
            Op::Fma(a, b, addend) => self.fold_fma(a, b, addend),
            _ => self.fold_unary_and_logic(op),
        }
    }

    fn fold_fma(&mut self, a: u32, b: u32, addend: u32) -> Result<u32, Op> {
        let (x, y) = (self.constant(a), self.constant(b));
        match (x, y, self.constant(addend)) {
            (Some(x), Some(y), Some(z)) => Ok(self.lit(x.mul_add(y, z))),
            // A product that is rounded would not be the fused one.
            (Some(x), Some(y), None) if x.mul_add(y, -(x * y)) == 0.0 => {
                let product = self.lit(x * y);
                Ok(self.push(Op::Add(product, addend)))
            }
            (_, _, Some(0.0)) => Ok(self.push(Op::Mul(a, b))),
            (Some(v), _, _) if v == 0.0 || v.abs() == 1.0 => Ok(self.scaled_sum(v, b, addend)),
            (_, Some(v), _) if v == 0.0 || v.abs() == 1.0 => Ok(self.scaled_sum(v, a, addend)),
            _ => Err(Op::Fma(a.min(b), a.max(b), addend)),
        }
    }

    /// `factor * node + addend` for a factor of -1, 0 or 1.
    fn scaled_sum(&mut self, factor: f64, node: u32, addend: u32) -> u32 {
        if factor == 0.0 {
            addend
        } else if factor > 0.0 {
            self.push(Op::Add(node, addend))
        } else {
            self.push(Op::Sub(addend, node))
        }
    }

    fn fold_negation(&mut self, node: u32) -> Result<u32, Op> {
        if let Some(value) = self.constant(node) {
            return Ok(self.lit(-value));
        }
        if let Some(inner) = self.negated(node) {
            return Ok(inner);
        }
        // The sign of a product goes to its constant.
        match self.scaled(node) {
            Some((factor, other)) => {
                let factor = self.lit(-factor);
                Ok(self.push(Op::Mul(factor, other)))
            }
            None => Err(Op::Neg(node)),
        }
    }

    fn fold_unary_and_logic(&mut self, op: Op) -> Result<u32, Op> {
        let c = |node| self.constant(node);
        let known = match op {
            Op::Neg(a) => return self.fold_negation(a),
            Op::Sqrt(a) => c(a).map(f64::sqrt),
            Op::Abs(a) => c(a).map(f64::abs),
            Op::Floor(a) => c(a).map(f64::floor),
            Op::Mantissa(a) => c(a).map(|x| Real::frexp(x).0),
            Op::Exponent(a) => c(a).map(|x| Real::frexp(x).1),
            Op::Exp2(a) => c(a).map(Real::exp2_whole),
            Op::Min(a, b) => c(a).zip(c(b)).map(|(x, y)| Real::min(x, y)),
            Op::Max(a, b) => c(a).zip(c(b)).map(|(x, y)| Real::max(x, y)),
            _ => None,
        };
        match known {
            Some(value) => Ok(self.lit(value)),
            None => self.fold_logic(op),
        }
    }

    fn fold_logic(&mut self, op: Op) -> Result<u32, Op> {
        let (c, o) = (|node| self.constant(node), |node| self.outcome(node));
        let known = match op {
            Op::Min(a, b) | Op::Max(a, b) if a == b => return Ok(a),
            Op::Less(a, b) => c(a).zip(c(b)).map(|(x, y)| x < y),
            Op::LessEqual(a, b) => c(a).zip(c(b)).map(|(x, y)| x <= y),
            Op::Not(a) => o(a).map(|v| !v),
            Op::And(a, b) => match (o(a), o(b)) {
                (Some(true), _) => return Ok(b),
                (_, Some(true)) => return Ok(a),
                (Some(false), _) | (_, Some(false)) => Some(false),
                _ => None,
            },
            Op::Or(a, b) => match (o(a), o(b)) {
                (Some(false), _) => return Ok(b),
                (_, Some(false)) => return Ok(a),
                (Some(true), _) | (_, Some(true)) => Some(true),
                _ => None,
            },
            Op::Select(mask, then, other) => match o(mask) {
                Some(true) => return Ok(then),
                Some(false) => return Ok(other),
                None if then == other => return Ok(then),
                None => None,
            },
            _ => None,
        };
        known.map(|value| self.intern(Op::Known(value))).ok_or(op)
    }
}

// Not inlined: inside the always-inlined stages a copy per operation takes the compiler minutes.
#[inline(never)]
fn push(op: Op) -> u32 {
    GRAPH.with_borrow_mut(|graph| graph.push(op))
}

macro_rules! symbolic {
    ($ty:ident, $($trait:ident $function:ident => $op:ident),*) => {
        $(impl $trait for $ty {
            type Output = Self;
            fn $function(self, o: Self) -> Self {
                Self(push(Op::$op(self.0, o.0)))
            }
        })*
    };
}

symbolic!(Sym, Add add => Add, Sub sub => Sub, Mul mul => Mul, Div div => Div);
symbolic!(SymMask, BitAnd bitand => And, BitOr bitor => Or);

impl Neg for Sym {
    type Output = Self;
    fn neg(self) -> Self {
        Self(push(Op::Neg(self.0)))
    }
}

impl Not for SymMask {
    type Output = Self;
    fn not(self) -> Self {
        Self(push(Op::Not(self.0)))
    }
}

impl Real for Sym {
    type Mask = SymMask;

    fn lit(value: f64) -> Self {
        Self(push(Op::Const(value.to_bits())))
    }
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        Self(push(Op::Fma(self.0, factor.0, addend.0)))
    }
    fn sqrt(self) -> Self {
        Self(push(Op::Sqrt(self.0)))
    }
    fn abs(self) -> Self {
        Self(push(Op::Abs(self.0)))
    }
    fn floor(self) -> Self {
        Self(push(Op::Floor(self.0)))
    }
    fn lt(self, other: Self) -> SymMask {
        SymMask(push(Op::Less(self.0, other.0)))
    }
    fn le(self, other: Self) -> SymMask {
        SymMask(push(Op::LessEqual(self.0, other.0)))
    }
    fn select(mask: SymMask, then: Self, other: Self) -> Self {
        Self(push(Op::Select(mask.0, then.0, other.0)))
    }
    fn any(_mask: SymMask) -> bool {
        true
    }
    fn frexp(self) -> (Self, Self) {
        (Self(push(Op::Mantissa(self.0))), Self(push(Op::Exponent(self.0))))
    }
    fn exp2_whole(self) -> Self {
        Self(push(Op::Exp2(self.0)))
    }
    fn look_up(table: &LookupTable, index: Self, step: usize) -> Self {
        let table = GRAPH.with_borrow_mut(|graph| graph.table(table));
        Self(push(Op::LookUp { table, index: index.0, step: step as u32 }))
    }
    fn min(self, other: Self) -> Self {
        Self(push(Op::Min(self.0, other.0)))
    }
    fn max(self, other: Self) -> Self {
        Self(push(Op::Max(self.0, other.0)))
    }
}
