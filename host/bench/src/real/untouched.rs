//! Changes of recordings that change nothing: rows, names, clocks, units, rate, layout.

use crate::real::sets::MeasuredSet;
use crate::real::table::MeasuredTable;
use crate::{GauntletError, Result};
use toml::{Table, Value};

/// Number of gaps, and rows in each.
const GAPS: usize = 10;
const GAP_ROWS: usize = 3;
/// Shift of the clock \[s\].
const SHIFT: f64 = 1000.0;
/// Samples after interpolation for one before.
const FINER: f64 = 1.25;

/// Units of the recordings with another of the same quantity, and its number for one of the first.
const UNITS: &[(&str, &str, f64)] = &[
    ("rad", "deg", 180.0 / std::f64::consts::PI),
    ("deg", "rad", std::f64::consts::PI / 180.0),
    ("rad/s", "deg/s", 180.0 / std::f64::consts::PI),
    ("m", "mm", 1e3),
    ("N m", "mN m", 1e3),
    ("N", "mN", 1e3),
    ("s", "ms", 1e3),
    ("us", "ms", 1e-3),
];

/// Change of the form of data alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UntouchedChange {
    /// Rows are missing.
    RowsDropped,
    /// Files have other names.
    FilesRenamed,
    /// Columns in reverse order, separated by semicolons.
    ColumnsReversed,
    /// The clock starts later.
    ClockShifted,
    /// Other units, stated in the model file.
    UnitsChanged,
    /// Interpolated to shorter steps.
    Resampled,
}

impl UntouchedChange {
    /// The changes that a set allows.
    pub(crate) fn of(set: &MeasuredSet) -> Vec<Self> {
        let mut all = vec![Self::FilesRenamed, Self::ColumnsReversed, Self::ClockShifted];
        if set.beside.is_empty() {
            all.push(Self::UnitsChanged);
        }
        if set.droppable {
            all.push(Self::RowsDropped);
        }
        if set.continuous {
            all.push(Self::Resampled);
        }
        all
    }

    /// Returns the word in case ids.
    pub fn word(self) -> &'static str {
        match self {
            Self::RowsDropped => "rows_dropped",
            Self::FilesRenamed => "files_renamed",
            Self::ColumnsReversed => "columns_reversed",
            Self::ClockShifted => "clock_shifted",
            Self::UnitsChanged => "units_changed",
            Self::Resampled => "resampled",
        }
    }

    /// Changes the model file.
    ///
    /// # Errors
    /// A model file that is no TOML.
    pub(crate) fn rig(self, rig: &str) -> Result<String> {
        if self != Self::UnitsChanged {
            return Ok(rig.to_owned());
        }
        let mut parsed = parsed(rig)?;
        for column in columns(&mut parsed) {
            if let Some((_, other, factor)) = changed(column) {
                column.insert("unit".to_owned(), Value::String(other.to_owned()));
                // A scale is a value in the declared unit for one of the column.
                let scale = column.get("scale").and_then(Value::as_float);
                if let Some(scale) = scale {
                    column.insert("scale".to_owned(), Value::Float(scale * factor));
                }
            }
        }
        Ok(parsed.to_string())
    }

    /// Changes the numbers of a recording, whose rig file is `rig`.
    ///
    /// # Errors
    /// A column that is missing.
    pub(crate) fn table(self, table: &mut MeasuredTable, rig: &str, clock: &str) -> Result<()> {
        match self {
            Self::FilesRenamed => {}
            Self::ColumnsReversed => {
                table.header.reverse();
                table.rows.iter_mut().for_each(|row| row.reverse());
            }
            Self::RowsDropped => {
                let every = table.rows.len() / (GAPS + 1);
                // Gaps at uneven distances.
                let is_gap =
                    |i: usize| (1..=GAPS).any(|gap| (0..GAP_ROWS).any(|k| i == gap * every + 7 * gap * gap + k));
                let mut row = 0;
                table.rows.retain(|_| {
                    row += 1;
                    !is_gap(row - 1)
                });
            }
            Self::ClockShifted => {
                let place = table.place(clock)?;
                let unit = if clock.ends_with("_us") { 1e6 } else { 1.0 };
                table.rows.iter_mut().for_each(|row| row[place] += SHIFT * unit);
            }
            Self::UnitsChanged => {
                let mut parsed = parsed(rig)?;
                for column in columns(&mut parsed) {
                    // With a scale the numbers stay: it states what they count.
                    let name = column.get("column").and_then(Value::as_str).unwrap_or("").to_owned();
                    if let Some((_, _, factor)) = changed(column).filter(|_| !column.contains_key("scale")) {
                        let place = table.place(&name)?;
                        table.rows.iter_mut().for_each(|row| row[place] *= factor);
                    }
                }
            }
            Self::Resampled => {
                let count = ((table.rows.len() - 1) as f64 * FINER) as usize;
                table.rows = (0..count).map(|i| interpolated(&table.rows, i as f64 / FINER)).collect();
            }
        }
        Ok(())
    }

    /// Returns a time on the changed clock.
    pub(crate) fn shifted(self, time: f64) -> f64 {
        if self == Self::ClockShifted { time + SHIFT } else { time }
    }

    /// Returns the separator of the columns.
    pub(crate) fn separator(self) -> char {
        if self == Self::ColumnsReversed { ';' } else { ',' }
    }
}

/// A rig file as a table.
fn parsed(rig: &str) -> Result<Table> {
    rig.parse().map_err(|error: toml::de::Error| GauntletError::Model(error.to_string()))
}

/// The columns of a rig file.
fn columns(rig: &mut Table) -> impl Iterator<Item = &mut Table> {
    let log = rig.get_mut("log").and_then(Value::as_table_mut);
    log.into_iter().flat_map(|log| log.iter_mut()).filter_map(|(_, column)| column.as_table_mut())
}

/// The other unit of a column.
fn changed(column: &Table) -> Option<(&'static str, &'static str, f64)> {
    let unit = column.get("unit").and_then(Value::as_str)?;
    UNITS.iter().find(|(own, ..)| *own == unit).copied()
}

/// A row between two others, by cubics through four.
fn interpolated(rows: &[Vec<f64>], place: f64) -> Vec<f64> {
    let before = place.floor() as usize;
    let s = place - before as f64;
    let row = |shift: i64| &rows[(before as i64 + shift).clamp(0, rows.len() as i64 - 1) as usize];
    let [a, b, c, d] = [row(-1), row(0), row(1), row(2)];
    let weights = [
        -s * (s - 1.0) * (s - 2.0) / 6.0,
        (s + 1.0) * (s - 1.0) * (s - 2.0) / 2.0,
        -(s + 1.0) * s * (s - 2.0) / 2.0,
        (s + 1.0) * s * (s - 1.0) / 6.0,
    ];
    if before == 0 || before + 2 >= rows.len() {
        return (0..b.len()).map(|k| b[k] + s * (c[k] - b[k])).collect();
    }
    (0..b.len()).map(|k| weights[0] * a[k] + weights[1] * b[k] + weights[2] * c[k] + weights[3] * d[k]).collect()
}
