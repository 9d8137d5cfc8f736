//! Table of a measured recording: columns by name, changed and written again.

use crate::{GauntletError, Result};
use softdock_campaign::columns::RecordedColumn;
use std::collections::BTreeSet;
use std::path::Path;

/// Recording as a table; an empty cell is not a number.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct MeasuredTable {
    /// Names of the columns.
    pub(crate) header: Vec<String>,
    /// Rows.
    pub(crate) rows: Vec<Vec<f64>>,
}

impl MeasuredTable {
    /// Reads a file of numbers separated by commas, with names in its first line.
    pub(crate) fn read(path: &Path) -> Result<Self> {
        let text = softdock_input::read_text(path, softdock_input::MAX_TABLE)?;
        let mut lines = text.lines();
        let header: Vec<String> = lines.next().unwrap_or("").split(',').map(|name| name.trim().to_owned()).collect();
        let mut rows = Vec::new();
        for (number, line) in lines.enumerate().filter(|(_, line)| !line.trim().is_empty()) {
            let cell = |cell: &str| if cell.trim().is_empty() { Ok(f64::NAN) } else { cell.trim().parse::<f64>() };
            let row: Vec<f64> = line
                .split(',')
                .map(cell)
                .collect::<std::result::Result<_, _>>()
                .map_err(|error| GauntletError::damaged(path, format!("line {}: {error}", number + 2)))?;
            if row.len() != header.len() {
                let what = format!("line {}: {} cells, {} names", number + 2, row.len(), header.len());
                return Err(GauntletError::damaged(path, what));
            }
            rows.push(row);
        }
        Ok(Self { header, rows })
    }

    /// Drops the columns that a rig does not read.
    pub(crate) fn keep(&mut self, names: &BTreeSet<&str>) {
        let kept: Vec<usize> = (0..self.header.len()).filter(|c| names.contains(self.header[*c].as_str())).collect();
        self.header = kept.iter().map(|c| self.header[*c].clone()).collect();
        self.rows.iter_mut().for_each(|row| *row = kept.iter().map(|c| row[*c]).collect());
    }

    /// Text with a separator, in the order of the columns.
    pub(crate) fn text(&self, separator: char) -> String {
        let separator = separator.to_string();
        let cell = |value: &f64| if value.is_finite() { value.to_string() } else { String::new() };
        let row = |row: &Vec<f64>| row.iter().map(cell).collect::<Vec<_>>().join(&separator) + "\n";
        std::iter::once(self.header.join(&separator) + "\n").chain(self.rows.iter().map(row)).collect()
    }

    /// Place of a column.
    ///
    /// # Errors
    /// A column that is missing.
    pub(crate) fn place(&self, name: &str) -> Result<usize> {
        let what =
            || GauntletError::Unknown { what: format!("no column `{name}`; there are {}", self.header.join(", ")) };
        self.header.iter().position(|own| own == name).ok_or_else(what)
    }

    /// Values of a signal in SI units.
    pub(crate) fn signal(&self, column: &RecordedColumn) -> Result<Vec<f64>> {
        let place = self.place(&column.name)?;
        Ok(self.rows.iter().map(|row| row[place] * column.factor + column.offset).collect())
    }

    /// Replaces the values of a signal, in SI units.
    pub(crate) fn set(&mut self, column: &RecordedColumn, values: &[f64]) -> Result<()> {
        let place = self.place(&column.name)?;
        for (row, value) in self.rows.iter_mut().zip(values) {
            row[place] = (value - column.offset) / column.factor;
        }
        Ok(())
    }
}
