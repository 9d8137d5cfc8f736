//! Runs repeated in f64: `parity.parquet`, the two rows of each run side by side.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::read::TableReader;
use crate::runs::{RunRow, RunsSchema};
use crate::shards::Provenance;
use crate::table::{Column, Kind, Table, Values};
use crate::write::write_table;
use crate::{Error, Result};

/// Version of the parity table.
pub const PARITY_SCHEMA: &str = "parity/1";

/// Name of the file below a results folder.
pub const PARITY_FILE: &str = "parity.parquet";

/// Prefix of the columns that hold the f64 value.
pub const TRUTH_PREFIX: &str = "truth_";

/// One run as the campaign's backend computed it and as f64 has it.
#[derive(Clone, Debug, PartialEq)]
pub struct ParityRow {
    /// The campaign's row.
    pub backend: RunRow,
    /// The same run in f64.
    pub truth: RunRow,
}

/// The table: per run every status, metric, margin and verdict, and beside it the f64 value with prefix `truth_`.
pub fn parity_table(schema: &RunsSchema, rows: &[ParityRow]) -> Table {
    let side = |pick: fn(&ParityRow) -> &RunRow| {
        schema.table(&rows.iter().map(|row| pick(row).clone()).collect::<Vec<_>>()).columns
    };
    let kept = |column: &Column| !matches!(column.kind, Kind::Input | Kind::Key);
    let backend = side(|row| &row.backend);
    let truth = side(|row| &row.truth);
    let mut columns: Vec<Column> = backend.iter().take(1).cloned().collect();
    for (one, mut two) in backend.into_iter().zip(truth).filter(|(column, _)| kept(column)) {
        two.name = format!("{TRUTH_PREFIX}{}", two.name);
        two.description = format!("{}, in f64", two.description);
        columns.extend([one, two]);
    }
    Table { columns }
}

/// Writes the parity table of a results folder, sorted by run.
pub fn write_parity(
    results: &Path,
    schema: &RunsSchema,
    mut rows: Vec<ParityRow>,
    provenance: &Provenance,
) -> Result<()> {
    rows.sort_by_key(|row| row.backend.run);
    let path = results.join(PARITY_FILE);
    write_table(&path, &parity_table(schema, &rows), &provenance.metadata(PARITY_SCHEMA))
}

/// The parity table of a results folder, if it has one.
pub fn read_parity(results: &Path) -> Result<Option<Table>> {
    let path = results.join(PARITY_FILE);
    path.is_file().then(|| TableReader::open(&path)?.read()).transpose()
}

/// Joins the folders' parity tables into one, each run once, sorted; without any table nothing is written.
pub(crate) fn join_parity(folders: &[PathBuf], out: &Path) -> Result<()> {
    let mut whole: Option<(Table, Vec<(String, String)>)> = None;
    for folder in folders {
        let Some(table) = read_parity(folder)? else { continue };
        match &mut whole {
            Some((joined, _)) => {
                if !joined.append(table) {
                    return Err(Error::contract(&folder.join(PARITY_FILE), "other columns than its sisters"));
                }
            }
            None => {
                let metadata = TableReader::open(&folder.join(PARITY_FILE))?.metadata();
                whole = Some((table, metadata.into_iter().collect()));
            }
        }
    }
    let Some((table, metadata)) = whole else { return Ok(()) };
    let first_of: BTreeMap<u64, usize> =
        table.u64s("run").unwrap_or_default().iter().enumerate().rev().map(|(row, run)| (*run, row)).collect();
    let order: Vec<usize> = first_of.into_values().collect();
    write_table(out, &take(table, &order), &metadata)
}

/// The rows of a table in a new order.
fn take(table: Table, order: &[usize]) -> Table {
    let columns = table.columns.into_iter().map(|mut column| {
        column.values = match column.values {
            Values::U64(values) => Values::U64(order.iter().map(|row| values[*row]).collect()),
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
