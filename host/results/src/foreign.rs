//! Numeric columns of Parquet files that others have written.

use std::fs::File;
use std::path::Path;

use arrow_array::cast::AsArray;
use arrow_array::types::{Float32Type, Float64Type, Int32Type, Int64Type, UInt32Type, UInt64Type};
use arrow_array::{Array, ArrayRef};
use arrow_schema::DataType;
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;

use crate::{Error, Result};

/// Names of the columns of a Parquet file, in file order.
pub fn column_names(path: &Path) -> Result<Vec<String>> {
    Ok(open(path)?.schema().fields().iter().map(|field| field.name().clone()).collect())
}

/// The named columns as f64, row by row; missing values are NaN. A column that is no number is an error.
pub fn number_columns(path: &Path, names: &[&str]) -> Result<Vec<Vec<f64>>> {
    let builder = open(path)?;
    let mask = ProjectionMask::columns(builder.parquet_schema(), names.iter().copied());
    let mut columns = vec![Vec::new(); names.len()];
    for batch in builder.with_projection(mask).build().map_err(Error::parquet(path))? {
        let batch = batch.map_err(Error::parquet(path))?;
        for (name, column) in names.iter().zip(&mut columns) {
            let array = batch.column_by_name(name);
            let array = array.ok_or_else(|| Error::contract(path, format!("no column `{name}`")))?;
            if !append(array, column) {
                let what = format!("column `{name}` holds {}, not numbers", array.data_type());
                return Err(Error::contract(path, what));
            }
        }
    }
    Ok(columns)
}

fn open(path: &Path) -> Result<ParquetRecordBatchReaderBuilder<File>> {
    let file = File::open(path).map_err(Error::io(path))?;
    ParquetRecordBatchReaderBuilder::try_new(file).map_err(Error::parquet(path))
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
