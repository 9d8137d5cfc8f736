//! Converts records to columns: the values of many cycles, signal by signal.

use super::record::CycleRecord;
use super::table::{LogColumn, LogValue, Type, columns, store};

/// The values of one column, one per cycle.
#[derive(Clone, Debug, PartialEq)]
pub enum Cells {
    /// Real numbers; NaN where missing.
    Real(Vec<f64>),
    /// Signed integers.
    Signed(Vec<i64>),
    /// Unsigned integers.
    Whole(Vec<u64>),
    /// Short unsigned integers.
    Word(Vec<u32>),
    /// Indices into an enumeration.
    Code(&'static [&'static str], Vec<u32>),
}

impl Cells {
    fn with_capacity(kind: Type, rows: usize) -> Self {
        match kind {
            Type::Real => Self::Real(Vec::with_capacity(rows)),
            Type::Signed => Self::Signed(Vec::with_capacity(rows)),
            Type::Whole => Self::Whole(Vec::with_capacity(rows)),
            Type::Word => Self::Word(Vec::with_capacity(rows)),
            Type::Code(words) => Self::Code(words, Vec::with_capacity(rows)),
        }
    }

    fn push(&mut self, value: LogValue) {
        match (self, value) {
            (Self::Real(cells), value) => cells.push(value.real()),
            (Self::Signed(cells), value) => cells.push(value.signed()),
            (Self::Whole(cells), value) => cells.push(value.bits()),
            (Self::Word(cells) | Self::Code(_, cells), value) => cells.push(value.bits() as u32),
        }
    }
}

/// Returns every column with the records' values, in the order of the table.
pub fn cells(records: &[CycleRecord]) -> Vec<(LogColumn, Cells)> {
    let columns = columns::<CycleRecord>();
    let mut cells: Vec<Cells> = columns.iter().map(|column| Cells::with_capacity(column.kind, records.len())).collect();
    let mut values: Vec<LogValue> = columns.iter().map(|column| LogValue::blank(column.kind)).collect();
    for record in records {
        store(record, &mut values);
        cells.iter_mut().zip(&values).for_each(|(cells, value)| cells.push(*value));
    }
    columns.into_iter().zip(cells).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::codes::Phase;
    use crate::log::sample;

    #[test]
    fn rows_become_columns() {
        let records: Vec<CycleRecord> = (0..700).map(sample::cycle).collect();
        let columns = cells(&records);
        let of = |name: &str| &columns.iter().find(|(column, _)| column.name == name).expect("a column").1;
        assert_eq!(of("cycle"), &Cells::Whole((0..700).collect()));
        assert_eq!(of("time_ns"), &Cells::Signed((0..700).map(|n| n * 1_000_000).collect()));
        let Cells::Code(words, phases) = of("phase") else { panic!("no words") };
        assert_eq!((words[phases[0] as usize], words[phases[600] as usize]), ("approach", "contact"));
        assert_eq!(phases[0], Phase::Approach.code());
        let Cells::Real(force) = of("ft_compensated_force_x_n") else { panic!("no reals") };
        assert_eq!(force[650].to_bits(), records[650].ft.compensated.force.x.to_bits());
        assert!(columns.iter().all(|(_, cells)| match cells {
            Cells::Real(cells) => cells.len() == 700,
            Cells::Signed(cells) => cells.len() == 700,
            Cells::Whole(cells) => cells.len() == 700,
            Cells::Word(cells) | Cells::Code(_, cells) => cells.len() == 700,
        }));
    }
}
