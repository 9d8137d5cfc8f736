//! A record as columns of numbers, written as CSV.

use std::fmt::Write;

/// One column: its name with the unit as suffix, and the decimals that its instrument writes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Column {
    pub(crate) name: &'static str,
    pub(crate) decimals: usize,
}

pub(crate) const fn column(name: &'static str, decimals: usize) -> Column {
    Column { name, decimals }
}

/// Decimals of a record without instruments.
const EXACT: usize = 12;

/// Rows of numbers under named columns.
#[derive(Clone)]
pub(crate) struct Table {
    columns: Vec<Column>,
    values: Vec<f64>,
}

impl Table {
    pub(crate) fn new(columns: &[Column]) -> Self {
        Self { columns: columns.to_vec(), values: Vec::new() }
    }

    /// Returns the same columns with all digits, for the truth, which no instrument rounds.
    pub(crate) fn exact(mut self) -> Self {
        self.columns.iter_mut().for_each(|column| column.decimals = EXACT);
        self
    }

    /// The same rows so much later: a record's time is its first column.
    pub(crate) fn later(mut self, by: f64) -> Self {
        let width = self.columns.len();
        self.values.iter_mut().step_by(width).for_each(|time| *time += by);
        self
    }

    /// Adds a row of one value per column.
    pub(crate) fn push(&mut self, row: &[f64]) {
        debug_assert_eq!(row.len(), self.columns.len());
        self.values.extend_from_slice(row);
    }

    /// The largest difference of any value.
    #[cfg(test)]
    pub(crate) fn distance(&self, other: &Self) -> f64 {
        assert_eq!(self.values.len(), other.values.len());
        self.values.iter().zip(&other.values).map(|(one, other)| (one - other).abs()).fold(0.0, f64::max)
    }

    /// The text of the file.
    pub(crate) fn csv(&self) -> String {
        let mut text = self.columns.iter().map(|column| column.name).collect::<Vec<_>>().join(",");
        text.push('\n');
        for row in self.values.chunks(self.columns.len()) {
            for (i, (value, column)) in row.iter().zip(&self.columns).enumerate() {
                let comma = if i == 0 { "" } else { "," };
                // Writing to a String cannot fail.
                let _ = write!(text, "{comma}{value:.*}", column.decimals);
            }
            text.push('\n');
        }
        text
    }
}
