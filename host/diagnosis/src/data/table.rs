//! Columns of numbers from a CSV or Parquet file, named by a model file or by convention.

use crate::{DiagnosisError, Result};
use std::path::Path;

/// Treatment of a cell without a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gaps {
    /// The file is refused.
    Refused,
    /// It is a gap in the recording: NaN.
    Kept,
}

/// Source of the column names.
#[derive(Clone, Copy, Debug)]
pub enum Named<'a> {
    /// The `[log]` of a model file.
    By(&'a str),
    /// Fixed names, with the remedy for a missing column.
    Agreed(&'a str),
}

/// The columns that are wanted of a file.
pub struct Wanted<'a> {
    /// Signal and column.
    pub columns: Vec<(&'a str, &'a str)>,
    /// Who names them.
    pub named: Named<'a>,
    /// What is made of cells without a number.
    pub gaps: Gaps,
}

impl Wanted<'_> {
    /// Reads the columns in their order: Parquet if the file name ends in `.parquet`, otherwise CSV.
    pub fn read(&self, path: &Path) -> Result<Vec<Vec<f64>>> {
        if is_parquet(path) { self.parquet(path) } else { self.csv(path) }
    }

    /// The error for a column that the file lacks.
    fn no_column(&self, path: &Path, line: Option<usize>, name: &str, known: &[String]) -> DiagnosisError {
        let model = match self.named {
            Named::By(model) => model,
            Named::Agreed(remedy) => {
                return DiagnosisError::log(path, line, format!("there is no column `{name}`"), remedy);
            }
        };
        let signal = self.columns.iter().find(|column| column.1 == name).map_or("", |column| column.0);
        let what = format!("there is no column `{name}`, which [log] of {model} names for `{signal}`");
        let shown: Vec<&str> = known.iter().take(12).map(String::as_str).collect();
        let more = if known.len() > shown.len() { ", ..." } else { "" };
        DiagnosisError::log(path, line, what, format!("name one of its columns there: {}{more}", shown.join(", ")))
    }

    fn parquet(&self, path: &Path) -> Result<Vec<Vec<f64>>> {
        let known = softdock_results::foreign::column_names(path)?;
        let names: Vec<&str> = self.columns.iter().map(|column| column.1).collect();
        if let Some(name) = names.iter().find(|name| !known.iter().any(|column| column == *name)) {
            return Err(self.no_column(path, None, name, &known));
        }
        let columns = softdock_results::foreign::number_columns(path, &names).map_err(|error| match error {
            softdock_results::ResultsError::Contract { what, .. } => {
                DiagnosisError::log(path, None, what, self.numbers())
            }
            other => other.into(),
        })?;
        for (name, values) in names.iter().zip(&columns) {
            let row = values.iter().position(|value| !value.is_finite());
            if let (Gaps::Refused, Some(row)) = (self.gaps, row) {
                let what = format!("row {} of column `{name}` is not a finite number", row + 1);
                return Err(DiagnosisError::log(path, None, what, COMPLETE));
            }
        }
        Ok(columns)
    }

    /// Returns the remedy for a column without numbers.
    fn numbers(&self) -> String {
        match self.named {
            Named::By(model) => format!("name columns of numbers in [log] of {model}"),
            Named::Agreed(remedy) => remedy.to_owned(),
        }
    }

    fn csv(&self, path: &Path) -> Result<Vec<Vec<f64>>> {
        let text = text_of(path)?;
        let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
        let Some((_, header)) = lines.next() else {
            return Err(DiagnosisError::log(
                path,
                None,
                "the file is empty",
                "name a CSV file with a header, or a Parquet file",
            ));
        };
        let known = cells(header);
        let place = |name: &str| {
            let place = known.iter().position(|column| column == name);
            place.ok_or_else(|| self.no_column(path, Some(1), name, &known))
        };
        let places: Vec<usize> = self.columns.iter().map(|column| place(column.1)).collect::<Result<_>>()?;
        let mut columns = vec![Vec::new(); self.columns.len()];
        for (number, line) in lines {
            let cells: Vec<&str> = line.split(',').collect();
            if cells.len() != known.len() {
                let what = format!("{} values where the header names {} columns", cells.len(), known.len());
                return Err(DiagnosisError::log(path, Some(number + 1), what, "complete or remove the row"));
            }
            for (((_, name), place), column) in self.columns.iter().zip(&places).zip(&mut columns) {
                column.push(self.number(clean(cells[*place])).ok_or_else(|| {
                    let what = format!("`{}` in column `{name}` is not a finite number", clean(cells[*place]));
                    DiagnosisError::log(path, Some(number + 1), what, COMPLETE)
                })?);
            }
        }
        Ok(columns)
    }

    /// The number in a cell; without one NaN or nothing.
    fn number(&self, cell: &str) -> Option<f64> {
        let gap = |cell: &str| cell.is_empty() || ["nan", "null", "na"].contains(&cell.to_ascii_lowercase().as_str());
        match cell.parse::<f64>() {
            Ok(value) if value.is_finite() => Some(value),
            _ if self.gaps == Gaps::Kept && (gap(cell) || cell.parse::<f64>().is_ok()) => Some(f64::NAN),
            _ => None,
        }
    }
}

/// Whether a file is Parquet by its ending; else it is CSV.
pub fn is_parquet(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("parquet"))
}

/// Names of a file's columns.
pub fn column_names(path: &Path) -> Result<Vec<String>> {
    if is_parquet(path) {
        return Ok(softdock_results::foreign::column_names(path)?);
    }
    let text = text_of(path)?;
    Ok(text.lines().find(|line| !line.trim().is_empty()).map_or_else(Vec::new, cells))
}

/// The text of a CSV file.
fn text_of(path: &Path) -> Result<String> {
    softdock_input::read_text(path, softdock_input::MAX_TABLE).map_err(|error| match error {
        softdock_input::InputError::NotText { line, .. } => {
            let remedy = "save it as UTF-8, or as Parquet with the ending .parquet";
            DiagnosisError::log(path, Some(line), error.what(), remedy)
        }
        error => DiagnosisError::input(error),
    })
}

/// The names in a header.
fn cells(header: &str) -> Vec<String> {
    header.split(',').map(|cell| clean(cell).to_owned()).collect()
}

/// Remedy for a row without a number.
const COMPLETE: &str = "cut the recording so that every row is complete";

/// A cell without spaces and quotes.
fn clean(cell: &str) -> &str {
    cell.trim().trim_start_matches('\u{feff}').trim_matches('"').trim()
}
