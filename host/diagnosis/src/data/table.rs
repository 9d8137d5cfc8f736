//! Columns of numbers from a CSV or Parquet file, named by a model file or by convention.

use crate::data::dialect::{Dialect, is_date};
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
    /// Names of the columns of a file without a header; empty if such a file is refused.
    pub order: &'a [String],
}

/// Columns that were read, with what was assumed of the file.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadTable {
    /// The columns in the order in which they are wanted, row by row.
    pub columns: Vec<Vec<f64>>,
    /// Statements about the separator, the decimal mark, the header and the like, where they are not the usual ones.
    pub assumed: Vec<String>,
    /// Whether the time was dates, which are in seconds since 1970.
    pub has_dates: bool,
    /// Line of each row in a CSV file; empty for Parquet.
    lines: Vec<usize>,
}

impl ReadTable {
    /// Returns the place of a row in its file, such as `line 3` or, in Parquet, `row 2`.
    pub fn place(&self, row: usize) -> String {
        self.lines.get(row).map_or_else(|| format!("row {}", row + 1), |line| format!("line {line}"))
    }
}

impl Wanted<'_> {
    /// Reads the columns in their order: Parquet if the file name ends in `.parquet`, otherwise CSV.
    ///
    /// # Errors
    /// A file that cannot be read, a column that is missing, a row or a cell that has no numbers.
    pub fn read(&self, path: &Path) -> Result<ReadTable> {
        if !is_parquet(path) {
            return self.csv(path);
        }
        Ok(ReadTable { columns: self.parquet(path)?, assumed: Vec::new(), has_dates: false, lines: Vec::new() })
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

    fn csv(&self, path: &Path) -> Result<ReadTable> {
        let text = text_of(path)?;
        let Some(mut dialect) = Dialect::of(&text) else {
            return Err(DiagnosisError::log(
                path,
                None,
                "the file is empty",
                "name a CSV file with a header, or a Parquet file",
            ));
        };
        let known = match dialect.header.clone() {
            Some((_, names)) => names,
            None => self.without_header(path, &mut dialect)?,
        };
        let line = dialect.header.as_ref().map(|(line, _)| *line);
        let place = |name: &str| {
            let place = known.iter().position(|column| column == name);
            place.ok_or_else(|| self.no_column(path, line, name, &known))
        };
        let places: Vec<usize> = self.columns.iter().map(|column| place(column.1)).collect::<Result<_>>()?;
        let mut columns = vec![Vec::new(); self.columns.len()];
        let (mut has_dates, mut lines) = (false, Vec::new());
        let mut rows = dialect.rows(&text).peekable();
        while let Some((number, line)) = rows.next() {
            let cells = dialect.cells(line);
            let is_last = rows.peek().is_none();
            let is_trailed = cells.len() == known.len() + 1 && cells[known.len()].is_empty();
            if is_last && cells.len() < known.len() {
                dialect.assumed.push(format!("line {number}, the last one, is incomplete and is ignored"));
                continue;
            }
            if cells.len() != known.len() && !(dialect.is_trailed && is_trailed) {
                let what = format!("{} values where the header names {} columns", cells.len(), known.len());
                return Err(DiagnosisError::log(path, Some(number), what, dialect.remedy_of_width()));
            }
            lines.push(number);
            for (((signal, name), place), column) in self.columns.iter().zip(&places).zip(&mut columns) {
                let cell = cells[*place];
                has_dates |= *signal == TIME && is_date(cell);
                column.push(self.number(&dialect, signal, cell).ok_or_else(|| {
                    let what = format!("`{cell}` in column `{name}` is not a finite number");
                    DiagnosisError::log(path, Some(number), what, COMPLETE)
                })?);
            }
        }
        if has_dates {
            dialect.assumed.push("the time is date and time by ISO 8601: it is converted to seconds".to_owned());
        }
        Ok(ReadTable { columns, assumed: dialect.assumed, has_dates, lines })
    }

    /// Names the columns of a file without a header in the order in which the model file lists them, if they are as
    /// many.
    fn without_header(&self, path: &Path, dialect: &mut Dialect) -> Result<Vec<String>> {
        if self.order.len() == dialect.columns {
            let names = self.order.join(", ");
            dialect.assumed.push(format!("the file has no header: its columns are taken for {names}, as in [log]"));
            return Ok(self.order.to_vec());
        }
        let (found, known) = (dialect.columns, self.order.len());
        let what = format!("the file has no header, and {found} columns where {known} names are known");
        Err(DiagnosisError::log(path, Some(1), what, "add a first line with the names of the columns"))
    }

    /// The number in a cell; without one NaN or nothing. Only a time may be a date.
    fn number(&self, dialect: &Dialect, signal: &str, cell: &str) -> Option<f64> {
        let number = if signal == TIME { dialect.number(cell) } else { dialect.number_or_missing(cell) }?;
        match number.is_finite() {
            true => Some(number),
            false => (self.gaps == Gaps::Kept).then_some(f64::NAN),
        }
    }
}

/// Signal of the clock.
const TIME: &str = "t";

/// Whether a file is Parquet by its ending; else it is CSV.
pub fn is_parquet(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("parquet"))
}

/// Names of a file's columns.
pub fn column_names(path: &Path) -> Result<Vec<String>> {
    if is_parquet(path) {
        return Ok(softdock_results::foreign::column_names(path)?);
    }
    let header = Dialect::of(&text_of(path)?).and_then(|dialect| dialect.header);
    Ok(header.map_or_else(Vec::new, |(_, names)| names))
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

/// Remedy for a row without a number.
const COMPLETE: &str = "cut the recording so that every row is complete";
