//! A column of a recording as a model file's `[log]` names it: its unit, and what turns it into SI.

use crate::check::{Checker, FILL_IN};
use crate::units::{UnitError, noun, quantity, suggestions};
use crate::written::At;
use crate::written::robot::LogTable;
use softdock_kernels::range::Range;

/// A column and what turns it into SI: `factor * column + offset`.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedColumn {
    /// Name of the column.
    pub name: String,
    /// SI per unit of the column.
    pub factor: f64,
    /// Added in SI.
    pub offset: f64,
    /// SI unit of the signal.
    pub unit: &'static str,
}

impl RecordedColumn {
    /// The column of a signal with a given SI unit.
    pub(crate) fn read(c: &mut Checker, written: &At<LogTable>, si: &'static str) -> Option<Self> {
        let t = &written.value;
        if t.column.value == FILL_IN {
            c.refuse_open(
                &t.column.span,
                "a column of the recordings",
                "write the name of the column, or remove the line",
            );
            return None;
        }
        if t.unit.value == FILL_IN {
            let units = suggestions(si);
            c.refuse_open(&t.unit.span, units, format!("write one of: {units}"));
            return None;
        }
        let factor = match quantity(&format!("1 {}", t.unit.value), si) {
            Ok(factor) => factor,
            Err(error) => {
                let message = match error {
                    UnitError::Mismatch { found } => format!("the unit of {found}, not of {}", noun(si)),
                    _ => format!("`{}` is no unit that is read", t.unit.value),
                };
                c.refuse(&t.unit.span, message, format!("write one of: {}", suggestions(si)));
                return None;
            }
        };
        let scale = c.number_or(&t.scale, 1.0, "1", Range::size(1e9));
        let offset = c.number_or(&t.offset, 0.0, si, Range::size(1e9));
        Some(Self { name: t.column.value.clone(), factor: factor * scale, offset, unit: si })
    }
}
