//! Tables of given cases: inputs of the user in the place of draws.

use crate::error::{FarmError, Result};
use crate::observer::Note;
use softdock_campaign::Cases;
use softdock_results::foreign::{column_names, number_columns};
use std::path::Path;

/// Reads a table of given cases, a column per parameter in SI units: Parquet by its extension, else CSV.
///
/// # Errors
/// If the file is not such a table.
pub fn read_cases(path: &Path) -> Result<Cases> {
    if !path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("parquet")) {
        return Ok(Cases::of_csv(path)?);
    }
    let unreadable = |error: &dyn std::fmt::Display| {
        FarmError::refused(error, "name a CSV or Parquet file with a column per parameter")
    };
    let bytes = softdock_input::read(path, softdock_input::MAX_BINARY)?;
    let names = column_names(path).map_err(|error| unreadable(&error))?;
    let columns = |names: &[&str]| number_columns(path, names).map_err(|error| error.to_string());
    Ok(Cases::of_columns(path, bytes, &names, columns)?)
}

/// What a table gives, as a note.
pub(crate) fn note(cases: &Cases) -> Note {
    Note::GivenCases {
        runs: cases.len(),
        parameters: cases.parameters().len(),
        is_numbered: cases.is_numbered(),
        ignored_columns: cases.left_aside(),
    }
}
