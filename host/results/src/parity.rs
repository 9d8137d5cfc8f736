//! Runs made a second time, in f64 or at half the substep: one table each, the two rows of each run side by side.

use std::path::Path;

use crate::Result;
use crate::read::TableReader;
use crate::runs::columns::ColumnHandle;
use crate::runs::{RunRow, RunsSchema};
use crate::shards::{Provenance, ShardIndex};
use crate::table::{Column, ColumnKind, Table};
use crate::write::write_table;

/// How some runs are made a second time, and where both rows stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Repetition {
    /// Name of the file below a results folder.
    pub file: &'static str,
    /// Version of the table.
    pub schema: &'static str,
    /// Prefix of the columns that hold the second value.
    pub prefix: &'static str,
    /// How the second value was made, in words.
    pub words: &'static str,
}

/// The GPU's runs in f64.
pub const PARITY: Repetition =
    Repetition { file: "parity.parquet", schema: "parity/1", prefix: "truth_", words: "in f64" };

/// Runs in f64 at half the substep; the command period stays.
pub const HALF_STEP: Repetition =
    Repetition { file: "half_step.parquet", schema: "half_step/1", prefix: "half_step_", words: "at half the substep" };

impl Repetition {
    /// The column with the second value.
    pub fn second<T>(&self, first: &ColumnHandle<T>) -> ColumnHandle<T> {
        ColumnHandle::named(format!("{}{}", self.prefix, first.name()))
    }
}

/// One run, made twice.
#[derive(Clone, Debug, PartialEq)]
pub struct RepeatedRow {
    /// The row that is put to the test.
    pub first: RunRow,
    /// The same run, made again.
    pub second: RunRow,
}

/// The table: per run every status, metric, margin and verdict, and beside it the second value with its prefix.
fn repetition_table(kind: &Repetition, schema: &RunsSchema, rows: &[RepeatedRow]) -> Table {
    let side = |pick: fn(&RepeatedRow) -> &RunRow| {
        schema.table(&rows.iter().map(|row| pick(row).clone()).collect::<Vec<_>>()).columns
    };
    let kept = |column: &Column| !matches!(column.kind, ColumnKind::Input | ColumnKind::Key);
    let first = side(|row| &row.first);
    let second = side(|row| &row.second);
    let mut columns: Vec<Column> = first.iter().take(1).cloned().collect();
    for (one, mut two) in first.into_iter().zip(second).filter(|(column, _)| kept(column)) {
        two.name = format!("{}{}", kind.prefix, two.name);
        two.description = format!("{}, {}", two.description, kind.words);
        columns.extend([one, two]);
    }
    Table { columns }
}

/// Writes the repeated runs of the shards of a results folder, sorted by run.
///
/// # Errors
/// If the file cannot be written.
pub fn write_repetition(
    kind: &Repetition,
    results: &Path,
    schema: &RunsSchema,
    mut rows: Vec<RepeatedRow>,
    provenance: &Provenance,
    index: &ShardIndex,
) -> Result<()> {
    rows.sort_by_key(|row| row.first.run);
    let mut metadata = provenance.metadata(kind.schema);
    metadata.extend(index.stated_rows());
    write_table(&results.join(kind.file), &repetition_table(kind, schema, &rows), &metadata)
}

/// The repeated runs of a results folder, if it has any.
///
/// # Errors
/// If the file is damaged, or was made from other runs than those of the index.
pub fn read_repetition(kind: &Repetition, results: &Path, index: &ShardIndex) -> Result<Option<Table>> {
    let path = results.join(kind.file);
    if !path.exists() {
        return Ok(None);
    }
    let reader = TableReader::open(&path)?;
    index.check_origin(&path, &reader.metadata(), kind.schema)?;
    reader.read().map(Some)
}
