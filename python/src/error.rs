//! Errors as Python sees them: message and remedy in one text.

use miette::Report;
use pyo3::create_exception;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;
use softdock_campaign::Problems;
use softdock_farm::FarmError;

create_exception!(
    softdock,
    SoftdockError,
    PyException,
    "Wrong input, or results that cannot be read or written: the message states file, line, key, value and remedy."
);

/// The exception of wrong files: every problem with its place.
fn of_problems(problems: Problems) -> PyErr {
    let reports: Vec<String> =
        problems.into_iter().map(|problem| softdock::report_text(&Report::new(problem))).collect();
    SoftdockError::new_err(reports.join("\n"))
}

/// The exception of a campaign function.
pub(crate) fn of_farm(error: FarmError) -> PyErr {
    if let FarmError::Campaign(problems) = error {
        return of_problems(problems);
    }
    let remedy = error.remedy().map(|remedy| format!("\n  help: {remedy}"));
    SoftdockError::new_err(format!("{error}{}", remedy.unwrap_or_default()))
}
