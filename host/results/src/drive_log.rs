//! The log of a drive as a table: one row per cycle, one column per signal, for those who read Parquet.
//!
//! The columns come from whoever drives: names with unit suffixes, units, meanings and values. The whole log, with
//! every bit of a number that is not one, is the MCAP file beside it; here NaN is null, as in every table.

use std::borrow::Cow;
use std::path::Path;

use crate::read::TableReader;
use crate::table::{Column, ColumnKind, Table, Values};
use crate::write::{Metadata, write_batches};
use crate::{Result, ResultsError};

/// Version of the table.
pub const DRIVE_SCHEMA: &str = "drive/1";

/// Key of the table's version in the file metadata.
const SCHEMA_KEY: &str = "softdock.schema";

/// A signal of the cycle; `description` states the frame. Those named `cycle`, `tick` and `time_ns` name the row.
pub fn signal(name: &str, unit: &str, description: &str, values: Values) -> Column {
    let names_row = matches!(name, "cycle" | "tick" | "time_ns");
    Column {
        name: name.to_owned(),
        unit: unit.to_owned(),
        description: description.to_owned(),
        source: "drive".to_owned(),
        kind: if names_row { ColumnKind::Key } else { ColumnKind::Signal },
        values,
    }
}

/// Writes a log, part after part: tables with the same columns, some thousand rows each. Returns the rows.
///
/// The file appears whole or not at all; `metadata` is kept in the file, with the table's version before it.
///
/// # Errors
/// If there is no part, if two have different columns, or if the file cannot be written; an error instead of a part
/// is passed on.
pub fn write_drive_log(
    path: &Path,
    parts: impl IntoIterator<Item = Result<Table>>,
    metadata: &[(String, String)],
) -> Result<u64> {
    let mut all = vec![(SCHEMA_KEY.to_owned(), DRIVE_SCHEMA.to_owned())];
    all.extend_from_slice(metadata);
    let mut rows = 0;
    let mut shape: Option<Vec<(String, String)>> = None;
    let checked = parts.into_iter().map(|part| {
        let part = part?;
        let columns: Vec<_> = part.columns.iter().map(|column| (column.name.clone(), column.unit.clone())).collect();
        if *shape.get_or_insert_with(|| columns.clone()) != columns {
            return Err(ResultsError::contract(path, "the parts of a log have different columns"));
        }
        rows += part.rows() as u64;
        Ok(Cow::Owned(part))
    });
    write_batches(path, checked, &all)?;
    Ok(rows)
}

/// Opens a log for reading, part by part or whole, and returns its metadata.
///
/// # Errors
/// If the file cannot be read or is no log of a drive.
pub fn open_drive_log(path: &Path) -> Result<(TableReader, Metadata)> {
    let reader = TableReader::open(path)?;
    let mut metadata = reader.metadata();
    match metadata.remove(SCHEMA_KEY) {
        Some(schema) if schema == DRIVE_SCHEMA => Ok((reader, metadata.into_iter().collect())),
        Some(schema) => Err(ResultsError::contract(path, format!("holds `{schema}`, not the log of a drive"))),
        None => Err(ResultsError::contract(path, "has no `softdock.schema`: not written by softdock")),
    }
}
