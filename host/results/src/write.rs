//! Tables to Parquet files, with equal bytes for equal content.

use std::borrow::Cow;
use std::path::Path;
use std::sync::Arc;

use parquet::arrow::ArrowWriter;
use parquet::basic::{Compression, ZstdLevel};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::schema::types::ColumnPath;

use crate::atomic::atomically;
use crate::seal::{FILE_HASH, blank, seal};
use crate::table::{Table, Values};
use crate::{Result, ResultsError};

/// File metadata: keys and values in the order in which they are written.
pub type Metadata = Vec<(String, String)>;

/// Rows of a row group: large enough to compress, small enough to stream.
const ROW_GROUP_ROWS: usize = 100_000;

/// Writes a table: zstd, units and meanings as field metadata, whole or not at all.
///
/// NaN becomes null. The same table and metadata give the same bytes, also on another machine.
pub fn write_table(path: &Path, table: &Table, metadata: &[(String, String)]) -> Result<()> {
    write_batches(path, std::iter::once(Ok(Cow::Borrowed(table))), metadata)
}

/// As [`write_table`], for tables with the same columns that come one after another, so that memory stays flat.
///
/// Without any table there are no columns: that is an error, and so is an error in place of a table.
pub(crate) fn write_batches<'a>(
    path: &Path,
    mut tables: impl Iterator<Item = Result<Cow<'a, Table>>>,
    metadata: &[(String, String)],
) -> Result<()> {
    let first = tables.next().ok_or_else(|| ResultsError::contract(path, "no columns to write"))??;
    // A table that was read and is written again has the hash of the file that it came from.
    let metadata: Metadata = metadata.iter().filter(|(key, _)| key != FILE_HASH).cloned().collect();
    atomically(path, |file| {
        // Arrow readers look for file metadata in the embedded schema, others in the footer: it stands in both.
        let schema = first.schema().with_metadata(metadata.iter().cloned().collect::<arrow_schema::Metadata>());
        let mut writer = ArrowWriter::try_new(&mut *file, Arc::new(schema), Some(properties(&first, &metadata)))
            .map_err(unwritten(path))?;
        for table in std::iter::once(Ok(first)).chain(tables) {
            let table = table?;
            check_rows(path, &table)?;
            let batch = table.batch().map_err(ResultsError::parquet(path))?;
            writer.write(&batch).map_err(unwritten(path))?;
        }
        writer.close().map_err(unwritten(path))?;
        seal(path, file)
    })
}

/// The system's answer behind an error of the Parquet writer.
fn unwritten(path: &Path) -> impl FnOnce(ParquetError) -> ResultsError + '_ {
    |error| {
        let source = match error {
            ParquetError::External(source) => match source.downcast::<std::io::Error>() {
                Ok(source) => *source,
                Err(source) => std::io::Error::other(source),
            },
            error => std::io::Error::other(error),
        };
        ResultsError::Write { path: path.to_owned(), source }
    }
}

fn check_rows(path: &Path, table: &Table) -> Result<()> {
    let rows = table.rows();
    match table.columns.iter().find(|column| column.values.len() != rows) {
        None => Ok(()),
        Some(column) => {
            let what = format!("column `{}` has {} rows of {rows}", column.name, column.values.len());
            Err(ResultsError::contract(path, what))
        }
    }
}

/// Real numbers hardly repeat: a dictionary of them costs more time than all the rest of writing.
fn properties(table: &Table, metadata: &[(String, String)]) -> WriterProperties {
    let numbers = table.columns.iter().filter(|column| matches!(column.values, Values::F64(_)));
    let own = KeyValue::new(FILE_HASH.to_owned(), blank());
    let metadata = metadata.iter().map(|(key, value)| KeyValue::new(key.clone(), value.clone())).chain([own]).collect();
    let all = WriterProperties::builder()
        .set_compression(Compression::ZSTD(ZstdLevel::default()))
        .set_max_row_group_row_count(Some(ROW_GROUP_ROWS))
        .set_created_by("softdock".to_owned())
        .set_key_value_metadata(Some(metadata));
    numbers
        .fold(all, |all, column| all.set_column_dictionary_enabled(ColumnPath::from(column.name.as_str()), false))
        .build()
}

/// Hash of a table's rows: names and values bit by bit, file metadata left out.
///
/// Two shards that hold the same rows have the same hash, whoever computed them.
pub fn content_hash(table: &Table) -> String {
    let mut hasher = blake3::Hasher::new();
    for column in &table.columns {
        hasher.update(column.name.as_bytes());
        hasher.update(&[0]);
        hasher.update(&(column.values.len() as u64).to_le_bytes());
        hash_values(&mut hasher, &column.values);
    }
    hasher.finalize().to_hex().to_string()
}

fn hash_values(hasher: &mut blake3::Hasher, values: &Values) {
    let mut put = |bytes: &[u8]| {
        hasher.update(bytes);
    };
    match values {
        Values::U64(values) => values.iter().for_each(|value| put(&value.to_le_bytes())),
        Values::I64(values) => values.iter().for_each(|value| put(&value.to_le_bytes())),
        Values::U32(values) => values.iter().for_each(|value| put(&value.to_le_bytes())),
        // The null's bit pattern is a NaN that no other value can have: NaN is null.
        Values::F64(values) => values.iter().for_each(|value| {
            let bits = value.filter(|number| !number.is_nan()).map_or(u64::MAX, f64::to_bits);
            put(&bits.to_le_bytes());
        }),
        Values::Bool(values) => values.iter().for_each(|value| put(&[value.map_or(2, u8::from)])),
        Values::Words { .. } => {
            for row in 0..values.len() {
                put(values.word(row).unwrap_or_default().as_bytes());
                put(&[0]);
            }
        }
    }
}
