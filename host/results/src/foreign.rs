//! Numeric columns of Parquet files that others have written.

use std::fs::File;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use arrow_array::cast::AsArray;
use arrow_array::types::{Float32Type, Float64Type, Int32Type, Int64Type, UInt32Type, UInt64Type};
use arrow_array::{Array, ArrayRef};
use arrow_schema::DataType;
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;

use crate::{Result, ResultsError};

/// Most values that a table may hold in memory: 1 GiB as f64. A small file can state and hold far more.
pub const MOST_VALUES: u64 = 1 << 27;

/// Largest selected column of a row group, decompressed \[bytes\].
const LARGEST_CHUNK: i64 = 2 << 30;

/// Rows decoded at a time.
const BATCH_ROWS: usize = 8_192;

/// What is wrong with a table that does not fit into memory.
pub(crate) fn too_many(rows: u64, columns: usize) -> String {
    format!("{rows} rows of {columns} columns: more than {MOST_VALUES} values; cut the table")
}

/// Names of the columns of a Parquet file, in file order.
pub fn column_names(path: &Path) -> Result<Vec<String>> {
    guarded(path, || Ok(open(path)?.schema().fields().iter().map(|field| field.name().clone()).collect()))
}

/// The named columns as f64, row by row; missing values are NaN. A column that is no number is an error.
///
/// # Errors
/// If the file cannot be read, lacks a column, or states or holds more than [`MOST_VALUES`] values.
pub fn number_columns(path: &Path, names: &[&str]) -> Result<Vec<Vec<f64>>> {
    guarded(path, || read_numbers(path, names, MOST_VALUES))
}

fn read_numbers(path: &Path, names: &[&str], most_values: u64) -> Result<Vec<Vec<f64>>> {
    let builder = open(path)?;
    for name in names {
        let field = builder.schema().fields().iter().find(|field| field.name() == name);
        let field = field.ok_or_else(|| ResultsError::contract(path, format!("no column `{name}`")))?;
        if !is_number(field.data_type()) {
            let what = format!("column `{name}` holds {}, not numbers", field.data_type());
            return Err(ResultsError::contract(path, what));
        }
    }
    let most = most_values / names.len().max(1) as u64;
    let groups = builder.metadata().row_groups().iter().map(|group| group.num_rows().max(0) as u64);
    let stated = groups.fold(0, u64::saturating_add).max(builder.metadata().file_metadata().num_rows().max(0) as u64);
    if stated > most {
        return Err(ResultsError::contract(path, too_many(stated, names.len())));
    }
    let mask = ProjectionMask::columns(builder.parquet_schema(), names.iter().copied());
    let chunks = builder.metadata().row_groups().iter().flat_map(|group| group.columns().iter().enumerate());
    let mut selected = chunks.filter(|(leaf, _)| mask.leaf_included(*leaf)).map(|(_, chunk)| chunk);
    if let Some(chunk) = selected.find(|chunk| !(0..=LARGEST_CHUNK).contains(&chunk.uncompressed_size())) {
        let (name, bytes) = (chunk.column_path().string(), chunk.uncompressed_size());
        let what = format!("column `{name}` states {bytes} bytes in a row group, the limit is {LARGEST_CHUNK}");
        return Err(ResultsError::contract(path, what));
    }
    let mut columns = vec![Vec::new(); names.len()];
    let reader =
        builder.with_projection(mask).with_batch_size(BATCH_ROWS).build().map_err(ResultsError::parquet(path))?;
    let mut rows = 0;
    for batch in reader {
        let batch = batch.map_err(ResultsError::parquet(path))?;
        rows += batch.num_rows() as u64;
        // The stated number of rows may be wrong.
        if rows > most {
            return Err(ResultsError::contract(path, too_many(rows, names.len())));
        }
        for (name, column) in names.iter().zip(&mut columns) {
            let array = batch.column_by_name(name);
            let array = array.ok_or_else(|| ResultsError::contract(path, format!("no column `{name}`")))?;
            if !append(array, column) {
                let what = format!("column `{name}` holds {}, not numbers", array.data_type());
                return Err(ResultsError::contract(path, what));
            }
        }
    }
    Ok(columns)
}

fn open(path: &Path) -> Result<ParquetRecordBatchReaderBuilder<File>> {
    let file = softdock_input::open(path, softdock_input::MAX_BINARY)?;
    ParquetRecordBatchReaderBuilder::try_new(file).map_err(ResultsError::parquet(path))
}

/// Takes a panic of the Parquet library for a damaged file: it asserts what a damaged footer states.
pub(crate) fn guarded<T>(path: &Path, read: impl FnOnce() -> Result<T>) -> Result<T> {
    catch_unwind(AssertUnwindSafe(read)).unwrap_or_else(|_| {
        Err(ResultsError::contract(path, "not a readable Parquet file: its footer or pages are damaged"))
    })
}

fn is_number(kind: &DataType) -> bool {
    use DataType::{Float32, Float64, Int32, Int64, UInt32, UInt64};
    matches!(kind, Float64 | Float32 | Int64 | Int32 | UInt64 | UInt32)
}

/// `false` if the array holds no numbers.
fn append(array: &ArrayRef, out: &mut Vec<f64>) -> bool {
    macro_rules! numbers {
        ($kind:ty) => {
            out.extend(array.as_primitive::<$kind>().iter().map(|value| value.map_or(f64::NAN, |value| value as f64)))
        };
    }
    match array.data_type() {
        DataType::Float64 => numbers!(Float64Type),
        DataType::Float32 => numbers!(Float32Type),
        DataType::Int64 => numbers!(Int64Type),
        DataType::Int32 => numbers!(Int32Type),
        DataType::UInt64 => numbers!(UInt64Type),
        DataType::UInt32 => numbers!(UInt32Type),
        _ => return false,
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Column, ColumnKind, Table, Values, write_table};

    fn written(path: &Path, rows: usize) {
        let column = Column {
            name: "force".to_owned(),
            unit: "N".to_owned(),
            description: "a force".to_owned(),
            source: "test".to_owned(),
            kind: ColumnKind::Signal,
            values: Values::F64(vec![Some(1.5); rows]),
        };
        let word = Column { name: "word".to_owned(), values: Values::Bool(vec![Some(true); rows]), ..column.clone() };
        write_table(path, &Table { columns: vec![column, word] }, &[]).expect("written");
    }

    #[test]
    fn a_small_file_with_too_many_rows_is_refused_whatever_its_footer_states() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("large.parquet");
        written(&path, 5_000);
        let read = |most| read_numbers(&path, &["force"], most);
        assert_eq!(read(5_000).expect("at the limit")[0].len(), 5_000);
        assert!(read(4_999).expect_err("beyond").to_string().contains("5000 rows of 1 columns"));
        // The footer states 10 rows in the place of 5000; the row group is as it was.
        let mut bytes = std::fs::read(&path).expect("read");
        let [stated, wrong] = [[0x90, 0x4e], [0x94, 0x00]];
        let at = bytes.windows(2).rposition(|two| two == stated).expect("rows of the group");
        let first = bytes[..at].windows(2).rposition(|two| two == stated).expect("another place");
        for place in [at, first] {
            let mut changed = bytes.clone();
            changed[place..place + 2].copy_from_slice(&wrong);
            std::fs::write(&path, changed).expect("written");
            let refused = guarded(&path, || read(4_999));
            assert!(refused.is_err() || refused.is_ok_and(|columns| columns[0].len() <= 10));
        }
        bytes.truncate(bytes.len() / 2);
        std::fs::write(&path, bytes).expect("written");
        assert!(column_names(&path).is_err());
    }

    #[test]
    fn columns_without_numbers_are_refused_before_they_are_read() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("words.parquet");
        written(&path, 3);
        let error = number_columns(&path, &["force", "word"]).expect_err("no numbers");
        assert!(error.to_string().contains("column `word` holds Boolean, not numbers"), "{error}");
        assert!(number_columns(&path, &["forze"]).expect_err("none").to_string().contains("no column `forze`"));
    }
}
