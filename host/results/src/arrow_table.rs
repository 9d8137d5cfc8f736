//! Tables for other programs, as Arrow: the C data interface passes their buffers on without a copy.

use std::path::Path;
use std::sync::Arc;

use arrow_array::cast::AsArray;
use arrow_array::types::Float64Type;
use arrow_array::{ArrayRef, Float64Array, RecordBatch, RecordBatchIterator, new_empty_array};
use arrow_schema::{ArrowError, DataType, Field, Schema, SchemaRef};

pub use arrow_array::ffi_stream::FFI_ArrowArrayStream;

use crate::read::TableReader;
use crate::shards::ShardIndex;
use crate::table::{Table, Values};
use crate::{Result, ResultsError};

/// Record batches of one schema. A field's metadata state `unit`, `description`, `source` and `kind`.
#[derive(Clone, Debug)]
pub struct ArrowTable {
    schema: SchemaRef,
    batches: Vec<RecordBatch>,
}

/// A column in another unit than SI.
#[derive(Clone, Debug, PartialEq)]
pub struct OtherUnit {
    /// Name of the column in SI.
    pub column: String,
    /// Its name in the other unit.
    pub name: String,
    /// The other unit.
    pub unit: String,
    /// SI value of one such unit.
    pub in_si: f64,
}

impl ArrowTable {
    /// Selected columns of all runs, in the order of the shards; every file's bytes are verified.
    ///
    /// # Errors
    /// If there is no shard, or a shard cannot be read any more or lacks a column.
    pub fn of_runs(index: &ShardIndex, names: &[String]) -> Result<Self> {
        let mut table: Option<Self> = None;
        for path in index.paths() {
            let batches = TableReader::open(&path)?.select(names)?.record_batches()?;
            let schema = table.as_ref().map_or_else(|| batches.schema(), |table| table.schema.clone());
            let whole = table.get_or_insert(Self { schema: schema.clone(), batches: Vec::new() });
            for batch in batches {
                // Files state their own metadata; fields and types are those of the first.
                let batch = batch?.with_schema(schema.clone()).map_err(|error| mismatch(&path, &error))?;
                whole.batches.push(batch);
            }
        }
        table.ok_or_else(|| ResultsError::contract(Path::new("runs"), "no shard"))
    }

    /// A file of results.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn of_file(path: &Path) -> Result<Self> {
        let batches = TableReader::open(path)?.record_batches()?;
        Ok(Self { schema: batches.schema(), batches: batches.collect::<Result<_>>()? })
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.batches.iter().map(RecordBatch::num_rows).sum()
    }

    /// Name, SI unit or other unit, and meaning of every column.
    pub fn columns(&self) -> impl Iterator<Item = (&str, &str, &str)> {
        self.schema.fields().iter().map(|field| {
            let text = |key: &str| field.metadata().get(key).map_or("", String::as_str);
            (field.name().as_str(), text("unit"), text("description"))
        })
    }

    /// The values of a column; `None` if the table has no such column.
    pub fn values(&self, name: &str) -> Option<Values> {
        let place = self.schema.index_of(name).ok()?;
        let mut parts = self.batches.iter().map(|batch| Values::from_array(batch.column(place)));
        let first = match parts.next() {
            Some(part) => part?,
            None => Values::from_array(&new_empty_array(self.schema.field(place).data_type()))?,
        };
        parts.try_fold(first, |mut whole, part| whole.append(part?).then_some(whole))
    }

    /// The same table with columns in other units; columns that it lacks are ignored.
    #[must_use]
    pub fn in_units(self, units: &[OtherUnit]) -> Self {
        let places: Vec<Option<&OtherUnit>> = self
            .schema
            .fields()
            .iter()
            .map(|field| units.iter().find(|unit| unit.column == *field.name()))
            .map(|unit| unit.filter(|unit| unit.in_si.is_finite() && unit.in_si > 0.0))
            .collect();
        let fields = self.schema.fields().iter().zip(&places).map(|(field, unit)| match unit {
            Some(unit) if *field.data_type() == DataType::Float64 => {
                let mut metadata = field.metadata().clone();
                metadata.insert("unit".to_owned(), unit.unit.clone());
                Arc::new(Field::new(&unit.name, DataType::Float64, field.is_nullable()).with_metadata(metadata))
            }
            _ => field.clone(),
        });
        let schema = Arc::new(Schema::new(fields.collect::<Vec<_>>()).with_metadata(self.schema.metadata().clone()));
        let converted = |batch: &RecordBatch| {
            let columns = batch.columns().iter().zip(&places);
            let columns = columns.map(|(column, unit)| match (unit, column.as_primitive_opt::<Float64Type>()) {
                (Some(unit), Some(values)) => scaled(values, unit.in_si),
                _ => column.clone(),
            });
            RecordBatch::try_new(schema.clone(), columns.collect()).expect("names and units alone have changed")
        };
        Self { batches: self.batches.iter().map(converted).collect(), schema }
    }

    /// A stream of the Arrow C data interface, which shares the buffers of this table.
    pub fn stream(&self) -> FFI_ArrowArrayStream {
        let batches = self.batches.clone().into_iter().map(Ok);
        FFI_ArrowArrayStream::new(Box::new(RecordBatchIterator::new(batches, self.schema.clone())))
    }
}

impl From<&Table> for ArrowTable {
    fn from(table: &Table) -> Self {
        let batch = table.batch().expect("the columns of a table are equally long");
        Self { schema: batch.schema(), batches: vec![batch] }
    }
}

/// Values divided by the SI value of one unit.
fn scaled(values: &Float64Array, in_si: f64) -> ArrayRef {
    Arc::new(values.unary::<_, Float64Type>(|value| value / in_si))
}

fn mismatch(path: &Path, error: &ArrowError) -> ResultsError {
    ResultsError::contract(path, format!("its columns are not those of the other shards: {error}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::{Column, ColumnKind};
    use arrow_array::Array;
    use arrow_array::ffi_stream::RecordBatchStreamReader;

    fn column(name: &str, unit: &str, values: Values) -> Column {
        let text = |word: &str| word.to_owned();
        let (description, source) = (text("a column"), text("test"));
        Column { name: text(name), unit: text(unit), description, source, kind: ColumnKind::Metric, values }
    }

    #[test]
    fn stream_passes_values_units_and_nulls_on() {
        let delays = Values::F64(vec![Some(0.004), None, Some(0.08)]);
        let table =
            Table { columns: vec![column("in_delay_s", "s", delays), column("run", "1", Values::U64(vec![0, 1, 2]))] };
        let unit = OtherUnit {
            column: "in_delay_s".to_owned(),
            name: "in_delay_ms".to_owned(),
            unit: "ms".to_owned(),
            in_si: 1e-3,
        };
        let arrow = ArrowTable::from(&table).in_units(&[unit]);
        assert_eq!(arrow.columns().next(), Some(("in_delay_ms", "ms", "a column")));

        let read: Vec<RecordBatch> =
            RecordBatchStreamReader::try_new(arrow.stream()).unwrap().collect::<std::result::Result<_, _>>().unwrap();
        let values = read[0].column(0).as_primitive::<Float64Type>();
        assert_eq!((values.value(0), values.is_null(1), values.value(2)), (4.0, true, 80.0));
        assert_eq!(read[0].schema().field(0).metadata()["unit"], "ms");
        // Without a copy: the reader sees the writer's own buffer.
        let own = arrow.batches[0].column(1).to_data().buffers()[0].as_ptr();
        assert_eq!(read[0].column(1).to_data().buffers()[0].as_ptr(), own);
    }
}
