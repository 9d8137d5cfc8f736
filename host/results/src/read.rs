//! Parquet files to tables, batch by batch, so that memory stays flat in the number of rows.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use arrow_array::{RecordBatch, RecordBatchReader};
use arrow_schema::SchemaRef;
use bytes::Bytes;
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::{ParquetRecordBatchReader, ParquetRecordBatchReaderBuilder};

use crate::foreign::guarded;
use crate::seal::{FILE_HASH, read_sealed};
use crate::table::Table;
use crate::{Result, ResultsError};

/// Rows decoded at a time.
const BATCH_ROWS: usize = 8_192;

/// An open file whose bytes are as its writer left them; its rows are not decoded yet.
pub struct TableReader {
    path: PathBuf,
    builder: ParquetRecordBatchReaderBuilder<Bytes>,
    selected: Option<Vec<String>>,
}

impl TableReader {
    /// Opens a file: reads it whole, compares its bytes with the hash that it states, and decodes its footer.
    ///
    /// # Errors
    /// If the file cannot be read, has another hash or none, or is not a Parquet file.
    pub fn open(path: &Path) -> Result<Self> {
        let bytes = read_sealed(path)?;
        let builder =
            guarded(path, || ParquetRecordBatchReaderBuilder::try_new(bytes).map_err(ResultsError::parquet(path)))?;
        Ok(Self { path: path.to_owned(), builder: builder.with_batch_size(BATCH_ROWS), selected: None })
    }

    /// The file metadata, without the embedded Arrow schema and the file's own hash.
    pub fn metadata(&self) -> BTreeMap<String, String> {
        let pairs = self.builder.metadata().file_metadata().key_value_metadata();
        let pairs = pairs.into_iter().flatten().filter(|pair| pair.key != "ARROW:schema" && pair.key != FILE_HASH);
        pairs.map(|pair| (pair.key.clone(), pair.value.clone().unwrap_or_default())).collect()
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Number of rows.
    pub fn rows(&self) -> u64 {
        self.builder.metadata().file_metadata().num_rows().max(0) as u64
    }

    /// Names of the columns, in file order.
    pub fn names(&self) -> Vec<String> {
        self.builder.schema().fields().iter().map(|field| field.name().clone()).collect()
    }

    /// The selected columns with units and meanings, without rows.
    pub fn columns(&self) -> Result<Table> {
        let empty = arrow_array::RecordBatch::new_empty(self.builder.schema().clone());
        let mut table = Table::from_batch(&empty).map_err(|name| unknown(&self.path, &name))?;
        if let Some(selected) = &self.selected {
            table.columns.retain(|column| selected.contains(&column.name));
        }
        Ok(table)
    }

    /// Only these columns will be read (in file order); a name that the file lacks is an error.
    pub fn select(mut self, names: &[impl AsRef<str>]) -> Result<Self> {
        let present = self.names();
        if let Some(missing) = names.iter().find(|name| !present.iter().any(|other| other == name.as_ref())) {
            return Err(ResultsError::contract(&self.path, format!("no column `{}`", missing.as_ref())));
        }
        let mask = ProjectionMask::columns(self.builder.parquet_schema(), names.iter().map(AsRef::as_ref));
        self.builder = self.builder.with_projection(mask);
        self.selected = Some(names.iter().map(|name| name.as_ref().to_owned()).collect());
        Ok(self)
    }

    /// The rows, as tables of a few thousand.
    pub fn batches(self) -> Result<Batches> {
        Ok(Batches(self.record_batches()?))
    }

    /// The rows as record batches of a few thousand.
    pub(crate) fn record_batches(self) -> Result<RecordBatches> {
        let (path, builder) = (&self.path, self.builder);
        let reader = guarded(path, || builder.build().map_err(ResultsError::parquet(path)))?;
        Ok(RecordBatches { path: self.path, reader, is_over: false })
    }

    /// All rows at once: for small tables.
    pub fn read(self) -> Result<Table> {
        let mut whole = self.columns()?;
        let path = self.path.clone();
        let values = self.rows().saturating_mul(whole.columns.len() as u64);
        if values > crate::foreign::MOST_VALUES {
            return Err(ResultsError::contract(&path, crate::foreign::too_many(self.rows(), whole.columns.len())));
        }
        for batch in self.batches()? {
            if !whole.append(batch?) {
                return Err(ResultsError::contract(&path, "a column changes its type"));
            }
        }
        Ok(whole)
    }
}

/// The rows of one file, as record batches.
pub(crate) struct RecordBatches {
    path: PathBuf,
    reader: ParquetRecordBatchReader,
    is_over: bool,
}

impl RecordBatches {
    /// The schema of the batches.
    pub(crate) fn schema(&self) -> SchemaRef {
        self.reader.schema()
    }
}

impl Iterator for RecordBatches {
    type Item = Result<RecordBatch>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.is_over {
            return None;
        }
        let (path, reader) = (&self.path, &mut self.reader);
        let batch = guarded(path, || reader.next().transpose().map_err(ResultsError::parquet(path)));
        // Behind an error the library's reader is in no known state.
        self.is_over = !matches!(batch, Ok(Some(_)));
        batch.transpose()
    }
}

/// The rows of one file, as tables of a few thousand.
pub struct Batches(RecordBatches);

impl Iterator for Batches {
    type Item = Result<Table>;

    fn next(&mut self) -> Option<Self::Item> {
        let batch = self.0.next()?;
        let path = &self.0.path;
        let table_of = |batch| guarded(path, || Table::from_batch(&batch).map_err(|name| unknown(path, &name)));
        let table = batch.and_then(table_of);
        self.0.is_over |= table.is_err();
        Some(table)
    }
}

fn unknown(path: &Path, name: &str) -> ResultsError {
    ResultsError::contract(path, format!("column `{name}` has a type or a kind that softdock does not write"))
}
