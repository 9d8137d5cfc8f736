//! Results folders: summary, runs, time histories, comparisons.

use crate::error::of_farm;
use crate::table::Table;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use softdock_farm::query::{Runs, Units, run_trace};
use softdock_farm::{FarmError, ResultsFolder, Shown};
use softdock_results::arrow_table::ArrowTable;
use softdock_results::columns::Loop;
use std::path::PathBuf;

/// An open results folder.
#[pyclass(frozen, module = "softdock._softdock")]
pub(crate) struct NativeResults(ResultsFolder);

fn units(author: bool) -> Units {
    if author { Units::Author } else { Units::Si }
}

impl NativeResults {
    /// Answers a question to the runs, without the interpreter's lock.
    fn ask<T: Send>(&self, py: Python<'_>, ask: impl FnOnce(&Runs) -> Result<T, FarmError> + Send) -> PyResult<T> {
        py.detach(|| Runs::of(&self.0).and_then(|runs| ask(&runs)).map_err(of_farm))
    }
}

#[pymethods]
impl NativeResults {
    #[new]
    fn new(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        py.detach(|| ResultsFolder::open(&path).map(Self).map_err(of_farm))
    }

    #[getter]
    fn path(&self) -> PathBuf {
        self.0.path.clone()
    }

    #[getter]
    fn id(&self) -> &str {
        &self.0.campaign.id
    }

    #[getter]
    fn title(&self) -> &str {
        &self.0.campaign.title
    }

    #[getter]
    fn variants(&self) -> Vec<String> {
        self.0.campaign.variants.iter().map(|variant| variant.name.clone()).collect()
    }

    /// `summary` or `compare`, the JSON of `summary.json` or `compare.json`, and the text of the terminal.
    fn summary(&self, py: Python<'_>) -> PyResult<(&'static str, String, String)> {
        py.detach(|| {
            let shown = softdock_farm::status(&self.0.path).map_err(of_farm)?.shown;
            let kind = if matches!(shown, Shown::Variants(_)) { "compare" } else { "summary" };
            Ok((kind, shown.json().to_string(), shown.text()))
        })
    }

    fn runs(&self, py: Python<'_>, columns: Option<Vec<String>>, varied: bool, author: bool) -> PyResult<Table> {
        self.ask(py, |runs| runs.table(columns.as_deref(), varied, units(author))).map(Table)
    }

    fn row(&self, py: Python<'_>, run: u64) -> PyResult<Table> {
        self.ask(py, |runs| runs.row(run)).map(|table| Table(ArrowTable::from(&table)))
    }

    fn causes(&self, py: Python<'_>, agreement: &str) -> PyResult<Table> {
        self.ask(py, |runs| runs.causes(agreement)).map(|table| Table(ArrowTable::from(&table)))
    }

    fn agreement(&self, py: Python<'_>, by: &str, bins: usize, author: bool) -> PyResult<Table> {
        let table = self.ask(py, |runs| runs.agreement_by(by, bins, units(author)))?;
        Ok(Table(ArrowTable::from(&table)))
    }

    fn worst(&self, py: Python<'_>, requirement: &str, place: &str, most: usize, author: bool) -> PyResult<Table> {
        let side = match place {
            "space" => Loop::Space,
            "facility" => Loop::Hil,
            other => return Err(PyValueError::new_err(format!("loop is {other:?}; write \"space\" or \"facility\""))),
        };
        let table = self.ask(py, |runs| runs.worst(requirement, side, most, units(author)))?;
        Ok(Table(ArrowTable::from(&table)))
    }

    /// Time history of a run, and its file: the kept one, or one that is made again in f64 below `replays/`.
    fn trace(&self, py: Python<'_>, run: u64) -> PyResult<(Table, PathBuf)> {
        py.detach(|| {
            let file = run_trace(&self.0, run).map_err(of_farm)?;
            let table = ArrowTable::of_file(&file).map_err(|error| of_farm(error.into()))?;
            Ok((Table(table), file))
        })
    }
}

/// JSON and text of `softdock compare`.
#[pyfunction]
pub(crate) fn compare_folders(py: Python<'_>, first: PathBuf, second: PathBuf) -> PyResult<(String, String)> {
    py.detach(|| {
        let compared = softdock_farm::compare_folders(&first, &second).map_err(of_farm)?;
        Ok((compared.json().to_string(), compared.text()))
    })
}
