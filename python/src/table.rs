//! A table of results for Python: an Arrow stream without copies, and columns as lists.

use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::{PyCapsule, PyList};
use softdock_results::Values;
use softdock_results::arrow_table::ArrowTable;

/// Native part of `softdock.Table`.
#[pyclass(frozen, module = "softdock")]
pub(crate) struct Table(pub(crate) ArrowTable);

#[pymethods]
impl Table {
    /// The table as an Arrow C stream.
    #[pyo3(signature = (requested_schema = None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        // The consumer casts, as the interface permits.
        let _ = requested_schema;
        PyCapsule::new_with_value(py, self.0.stream(), c"arrow_array_stream")
    }

    fn __len__(&self) -> usize {
        self.0.rows()
    }

    fn __getitem__<'py>(&self, py: Python<'py>, column: &str) -> PyResult<Bound<'py, PyList>> {
        match self.0.values(column).ok_or_else(|| PyKeyError::new_err(column.to_owned()))? {
            Values::U64(values) => PyList::new(py, values),
            Values::I64(values) => PyList::new(py, values),
            Values::U32(values) => PyList::new(py, values),
            Values::F64(values) => PyList::new(py, values),
            Values::Bool(values) => PyList::new(py, values),
            Values::Words { vocabulary, codes } => {
                PyList::new(py, codes.into_iter().map(|code| vocabulary[code as usize].as_str()))
            }
        }
    }

    /// Name, unit and meaning of every column.
    #[getter]
    fn columns(&self) -> Vec<(String, String, String)> {
        let owned = |(name, unit, meaning): (&str, &str, &str)| (name.to_owned(), unit.to_owned(), meaning.to_owned());
        self.0.columns().map(owned).collect()
    }
}
