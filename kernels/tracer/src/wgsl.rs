//! Prints traced stages and declared bundles as WGSL that a person can read.

use crate::trace::{Graph, Op};
use softdock_kernels::fields::Field;
use std::fmt::Write;

/// A WGSL struct made from a field table.
#[derive(Clone, Debug)]
pub struct Struct {
    /// Its name.
    pub name: String,
    /// Its members, all f32.
    pub fields: Vec<Field>,
}

/// A traced stage function with the structs that it takes and gives.
#[derive(Clone, Debug)]
pub struct Function {
    /// Its name.
    pub name: String,
    /// Argument names and structs.
    pub arguments: Vec<(String, Struct)>,
    /// What it returns.
    pub result: Struct,
    /// What it does.
    pub graph: Graph,
}

impl Struct {
    /// The declaration, one member a line with unit and meaning.
    ///
    /// A bare scalar needs none: it is an `f32`.
    pub fn declaration(&self) -> String {
        if self.is_scalar() {
            return String::new();
        }
        let mut out = format!("struct {} {{\n", self.name);
        for field in &self.fields {
            let _ = writeln!(out, "    {}: f32, // [{}] {}", self.member(field), field.unit, field.meaning);
        }
        out + "}\n"
    }

    /// A member's WGSL name.
    pub fn member<'a>(&self, field: &'a Field) -> &'a str {
        &field.name
    }

    /// Whether the bundle is a bare scalar.
    pub fn is_scalar(&self) -> bool {
        self.name == "f32"
    }

    /// Member `field` of the variable `owner`.
    pub fn access(&self, owner: &str, field: &Field) -> String {
        if self.is_scalar() { owner.to_owned() } else { format!("{owner}.{}", field.name) }
    }
}

impl Function {
    /// Number of operations that are printed.
    pub fn operations(&self) -> usize {
        let live = self.graph.live();
        let counted = |op: &Op| !matches!(op, Op::Input(_) | Op::Const(_) | Op::Known(_));
        self.graph.ops.iter().zip(live).filter(|(op, live)| *live && counted(op)).count()
    }

    /// Floating-point operations: two for a fused multiply-add, one for every other that is printed.
    pub fn flops(&self) -> usize {
        let live = self.graph.live();
        let fused = |op: &Op| matches!(op, Op::Fma(..));
        self.operations() + self.graph.ops.iter().zip(live).filter(|(op, live)| *live && fused(op)).count()
    }

    /// The function as straight-line WGSL.
    pub fn listing(&self) -> String {
        let printer = Printer::new(self);
        let arguments: Vec<_> = self.arguments.iter().map(|(name, s)| format!("{name}: {}", s.name)).collect();
        let mut out = format!(
            "// {} operations\nfn {}({}) -> {} {{\n",
            self.operations(),
            self.name,
            arguments.join(", "),
            self.result.name
        );
        printer.body(&mut out);
        out + "}\n"
    }
}

/// Names and fusions of one function's nodes.
struct Printer<'a> {
    function: &'a Function,
    inputs: Vec<String>,
    uses: Vec<u32>,
    live: Vec<bool>,
    /// Products that vanish into the one sum that uses them.
    fused: Vec<bool>,
}

impl<'a> Printer<'a> {
    fn new(function: &'a Function) -> Self {
        let graph = &function.graph;
        let inputs =
            function.arguments.iter().flat_map(|(name, s)| s.fields.iter().map(move |f| s.access(name, f))).collect();
        let live = graph.live();
        let mut uses = vec![0; graph.ops.len()];
        for (op, _) in graph.ops.iter().zip(&live).filter(|(_, live)| **live) {
            op.operands().for_each(|o| uses[o as usize] += 1);
        }
        graph.results.iter().for_each(|r| uses[*r as usize] += 1);
        let mut printer = Self { function, inputs, uses, live, fused: vec![false; graph.ops.len()] };
        printer.fuse();
        printer
    }

    /// A product used once, by a sum or difference, becomes that sum's fma.
    fn fuse(&mut self) {
        for index in 0..self.function.graph.ops.len() {
            if !self.live[index] {
                continue;
            }
            if let Op::Add(a, b) | Op::Sub(a, b) = self.function.graph.ops[index] {
                let product = [b, a].into_iter().find(|n| self.is_lone_product(*n));
                if let Some(product) = product {
                    self.fused[product as usize] = true;
                }
            }
        }
    }

    fn is_lone_product(&self, node: u32) -> bool {
        matches!(self.function.graph.ops[node as usize], Op::Mul(..)) && self.uses[node as usize] == 1
    }

    fn body(&self, out: &mut String) {
        let graph = &self.function.graph;
        for (index, op) in graph.ops.iter().enumerate() {
            let silent = matches!(op, Op::Input(_) | Op::Const(_) | Op::Known(_));
            if self.live[index] && !silent && !self.fused[index] {
                let _ = writeln!(out, "    let t{index} = {};", self.expression(*op));
            }
        }
        if self.function.result.is_scalar() {
            let _ = writeln!(out, "    return {};", self.name(graph.results[0]));
            return;
        }
        let _ = writeln!(out, "    return {}(", self.function.result.name);
        for (node, field) in graph.results.iter().zip(&self.function.result.fields) {
            let _ = writeln!(out, "        {}, // {}", self.name(*node), self.function.result.member(field));
        }
        out.push_str("    );\n");
    }

    fn name(&self, node: u32) -> String {
        match self.function.graph.ops[node as usize] {
            Op::Input(input) => self.inputs[input as usize].clone(),
            Op::Const(bits) => literal(f64::from_bits(bits)),
            Op::Known(value) => value.to_string(),
            _ => format!("t{node}"),
        }
    }

    fn expression(&self, op: Op) -> String {
        let n = |node| self.name(node);
        match op {
            Op::Add(a, b) => self.sum(a, b, false),
            Op::Sub(a, b) => self.sum(a, b, true),
            Op::Mul(a, b) => format!("{} * {}", n(a), n(b)),
            Op::Div(a, b) => format!("{} / {}", n(a), n(b)),
            Op::Neg(a) => format!("-{}", n(a)),
            Op::Fma(a, b, c) => format!("fma({}, {}, {})", n(a), n(b), n(c)),
            Op::Sqrt(a) => format!("sqrt({})", n(a)),
            Op::Abs(a) => format!("abs({})", n(a)),
            Op::Floor(a) => format!("floor({})", n(a)),
            Op::Min(a, b) => format!("min({}, {})", n(a), n(b)),
            Op::Max(a, b) => format!("max({}, {})", n(a), n(b)),
            Op::Mantissa(a) => format!("mantissa({})", n(a)),
            Op::Exponent(a) => format!("exponent({})", n(a)),
            Op::Exp2(a) => format!("exp2_whole({})", n(a)),
            Op::LookUp { table, index, step } => {
                // Bounded, so that no index reads another table.
                let table = &self.function.graph.tables[table as usize];
                let last = table.values.len() - 1;
                format!("tables[{}u + min(u32({}) + {step}u, {last}u)]", table.offset, n(index))
            }
            Op::Less(a, b) => format!("{} < {}", n(a), n(b)),
            Op::LessEqual(a, b) => format!("{} <= {}", n(a), n(b)),
            Op::And(a, b) => format!("{} && {}", n(a), n(b)),
            Op::Or(a, b) => format!("{} || {}", n(a), n(b)),
            Op::Not(a) => format!("!{}", n(a)),
            Op::Select(mask, then, other) => format!("select({}, {}, {})", n(other), n(then), n(mask)),
            Op::Input(_) | Op::Const(_) | Op::Known(_) => unreachable!("printed where it is used"),
        }
    }

    /// A sum or difference, fused with a lone product where there is one.
    fn sum(&self, a: u32, b: u32, minus: bool) -> String {
        let product = |node: u32| match self.function.graph.ops[node as usize] {
            Op::Mul(x, y) if self.fused[node as usize] => Some((self.name(x), self.name(y))),
            _ => None,
        };
        match (product(a), product(b), minus) {
            (_, Some((x, y)), false) => format!("fma({x}, {y}, {})", self.operand(a)),
            (_, Some((x, y)), true) => format!("fma(-({x}), {y}, {})", self.operand(a)),
            (Some((x, y)), None, false) => format!("fma({x}, {y}, {})", self.operand(b)),
            (Some((x, y)), None, true) => format!("fma({x}, {y}, -({}))", self.operand(b)),
            (None, None, false) => format!("{} + {}", self.name(a), self.name(b)),
            (None, None, true) => format!("{} - {}", self.name(a), self.name(b)),
        }
    }

    /// An operand that may itself be a vanished product.
    fn operand(&self, node: u32) -> String {
        match self.function.graph.ops[node as usize] {
            Op::Mul(x, y) if self.fused[node as usize] => format!("{} * {}", self.name(x), self.name(y)),
            _ => self.name(node),
        }
    }
}

/// A number as an f32 literal; beyond the range of f32 it is cut there.
pub(crate) fn literal(value: f64) -> String {
    let value = (value.clamp(-f64::from(f32::MAX), f64::from(f32::MAX))) as f32;
    // Denormals may be flushed: write them as the zero that they would become.
    let value = if value.is_subnormal() { 0.0 } else { value };
    if value < 0.0 { format!("({value:?}f)") } else { format!("{value:?}f") }
}
