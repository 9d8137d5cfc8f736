//! Derived values: parameters that follow from others, in an order in which each finds what it needs.

use crate::check::Checker;
use crate::dispersion::{Dispersion, find};
use crate::expression::{self, Bounds, Expression};
use crate::ranges::{in_words, legal};
use crate::units::show;
use crate::written::campaign::DerivedTable;
use softdock_kernels::fields::{Field, from_slice};
use softdock_kernels::params::Params;
use std::ops::Range as Span;

/// A derived parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Derived {
    /// Index into the field table of `Params`.
    pub field: usize,
    /// Name of the parameter.
    pub name: String,
    /// SI unit.
    pub unit: &'static str,
    /// The expression as written.
    pub text: String,
    pub(crate) expression: Expression,
    /// Place of the expression in the campaign file.
    pub(crate) place: Span<usize>,
}

/// Reads and orders the derived values; `fields` are the parameters and, behind them, the campaign's variables.
pub(crate) fn read(
    c: &mut Checker,
    fields: &[Field],
    tables: &[&DerivedTable],
    dispersed: &[Dispersion],
) -> Vec<Derived> {
    let names: Vec<&str> = fields.iter().map(|field| field.name.as_str()).collect();
    let mut derived: Vec<Derived> = Vec::new();
    for table in tables {
        let Some(field) = find(c, fields, &table.target) else { continue };
        let name = &fields[field].name;
        if dispersed.iter().any(|d| d.field == field) || derived.iter().any(|d| d.field == field) {
            let message = format!("`{name}` is set twice");
            c.refuse(&table.target.span, message, "keep one of its [[dispersion]] and [[derived]] entries");
            continue;
        }
        match expression::parse(&table.expr.value, &names) {
            Ok(expression) => derived.push(Derived {
                field,
                name: name.clone(),
                unit: fields[field].unit,
                text: table.expr.value.clone(),
                expression,
                place: table.expr.span.clone(),
            }),
            Err(fault) => {
                // The text begins behind its quote.
                let start = table.expr.span.start + 1;
                c.refuse(&(start + fault.place.start..start + fault.place.end), fault.message, fault.remedy);
            }
        }
    }
    in_order(c, derived)
}

/// Each derived value behind those that it uses; a cycle is named.
fn in_order(c: &mut Checker, mut waiting: Vec<Derived>) -> Vec<Derived> {
    let mut ordered: Vec<Derived> = Vec::new();
    while !waiting.is_empty() {
        let is_waiting = |field: &usize| waiting.iter().any(|other| other.field == *field);
        match waiting.iter().position(|derived| !derived.expression.names().iter().any(is_waiting)) {
            Some(ready) => ordered.push(waiting.remove(ready)),
            None => {
                let cycle = cycle(&waiting);
                let message = format!("derived values in a circle: {}", cycle.join(" -> "));
                c.refuse(
                    &waiting[0].place,
                    message,
                    "compute one of them from parameters that are not derived from it",
                );
                return ordered;
            }
        }
    }
    ordered
}

/// The names around a circle, the first one also at the end.
fn cycle(waiting: &[Derived]) -> Vec<&str> {
    let mut path: Vec<usize> = vec![0];
    loop {
        let used = waiting[path[path.len() - 1]].expression.names();
        // Every waiting value uses another waiting one, so that the walk never ends without a circle.
        let next = waiting.iter().position(|other| used.contains(&other.field)).unwrap_or(0);
        if let Some(start) = path.iter().position(|seen| *seen == next) {
            return path[start..].iter().chain([&next]).map(|index| waiting[*index].name.as_str()).collect();
        }
        path.push(next);
    }
}

/// Evaluates the derived values in their order.
pub(crate) fn with_derived(mut values: Vec<f64>, derived: &[Derived]) -> Params<f64> {
    for derived in derived {
        values[derived.field] = derived.expression.value(&values);
    }
    from_slice(&values)
}

/// Adds the bounds of the derived values; bounds beyond the legal range are refused.
pub(crate) fn bounds(c: &mut Checker, derived: &[Derived], bounds: &mut [Bounds]) {
    for derived in derived {
        let of = derived.expression.value(bounds);
        let range = legal(&derived.name);
        if range.contains(of.least) && range.contains(of.greatest) {
            bounds[derived.field] = of;
        } else {
            let unit = derived.unit;
            let message = format!(
                "`{}` may lie anywhere from {} to {}, beyond its legal range",
                derived.name,
                show(of.least, unit),
                show(of.greatest, unit)
            );
            let words = in_words(range, unit);
            c.refuse(&derived.place, message, format!("bound it with max(..., ...) and min(..., ...): {words}"));
        }
    }
}
