//! Runs made a second time, in f64 or at half the substep: one table each, the two rows of each run side by side.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::read::TableReader;
use crate::runs::{RunRow, RunsSchema};
use crate::shards::Provenance;
use crate::table::{Column, Kind, Table, Values};
use crate::write::write_table;
use crate::{Error, Result};

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
    let kept = |column: &Column| !matches!(column.kind, Kind::Input | Kind::Key);
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

/// Writes the repeated runs of a results folder, sorted by run.
pub fn write_repetition(
    kind: &Repetition,
    results: &Path,
    schema: &RunsSchema,
    mut rows: Vec<RepeatedRow>,
    provenance: &Provenance,
) -> Result<()> {
    rows.sort_by_key(|row| row.first.run);
    let path = results.join(kind.file);
    write_table(&path, &repetition_table(kind, schema, &rows), &provenance.metadata(kind.schema))
}

/// The repeated runs of a results folder, if it has any.
pub fn read_repetition(kind: &Repetition, results: &Path) -> Result<Option<Table>> {
    let path = results.join(kind.file);
    path.is_file().then(|| TableReader::open(&path)?.read()).transpose()
}

/// Joins the folders' tables into one, each run once, sorted; without any table nothing is written.
pub(crate) fn join_repetitions(kind: &Repetition, folders: &[PathBuf], out: &Path) -> Result<()> {
    let mut whole: Option<(Table, Vec<(String, String)>)> = None;
    for folder in folders {
        let Some(table) = read_repetition(kind, folder)? else { continue };
        match &mut whole {
            Some((joined, _)) => {
                if !joined.append(table) {
                    return Err(Error::contract(&folder.join(kind.file), "other columns than its sisters"));
                }
            }
            None => {
                let metadata = TableReader::open(&folder.join(kind.file))?.metadata();
                whole = Some((table, metadata.into_iter().collect()));
            }
        }
    }
    let Some((table, metadata)) = whole else { return Ok(()) };
    let first_of: BTreeMap<u64, usize> =
        table.u64s("run").unwrap_or_default().iter().enumerate().rev().map(|(row, run)| (*run, row)).collect();
    let order: Vec<usize> = first_of.into_values().collect();
    write_table(&out.join(kind.file), &take(table, &order), &metadata)
}

/// The rows of a table in a new order.
fn take(table: Table, order: &[usize]) -> Table {
    let columns = table.columns.into_iter().map(|mut column| {
        column.values = match column.values {
            Values::U64(values) => Values::U64(order.iter().map(|row| values[*row]).collect()),
            Values::I64(values) => Values::I64(order.iter().map(|row| values[*row]).collect()),
            Values::U32(values) => Values::U32(order.iter().map(|row| values[*row]).collect()),
            Values::F64(values) => Values::F64(order.iter().map(|row| values[*row]).collect()),
            Values::Bool(values) => Values::Bool(order.iter().map(|row| values[*row]).collect()),
            Values::Words { vocabulary, codes } => {
                Values::Words { vocabulary, codes: order.iter().map(|row| codes[*row]).collect() }
            }
        };
        column
    });
    Table { columns: columns.collect() }
}
