//! Given cases: the inputs of runs as a table, in the place of a campaign's draws.
//!
//! A column is a parameter in SI, named as in the runs table (`in_loop_delay_s`, `loop_delay_s`) or by its field
//! (`loop_delay`). A column `run` gives the run numbers, on which the noise depends; without it rows count from 0. In a
//! table with `in_` columns, the other columns of the runs table (`space_...`, `status`, ...) are left aside.
//!
//! A parameter without a column keeps the campaign's nominal value. A derived value of the campaign is applied only
//! where the table has no column for it.

use crate::problem::{Problem, Problems};
use crate::ranges::{MOST_RUNS, in_words, legal};
use crate::source::Source;
use crate::suggest::suggestion;
use crate::units::show;
use softdock_kernels::fields::{Field, fields};
use softdock_kernels::params::Params;
use softdock_kernels::range::Range;
use std::ops::Range as Span;
use std::path::Path;
use std::sync::Arc;

/// Problems of one table that are listed.
pub(crate) const LISTED: usize = 20;

/// Most columns of a table.
const MOST_COLUMNS: usize = 10_000;

/// Longest name of a column, in bytes.
const LONGEST_NAME: usize = 200;

/// Column of the run numbers.
const RUN: &str = "run";

/// Columns of the runs table that are no inputs, besides those that begin with `space_` or `hil_`.
const RESULTS: [&str; 5] = ["outer", "status", "agreement", "flags", "effective_mass_kg"];

/// A checked table of cases; cheap to clone.
#[derive(Clone, Debug)]
pub struct Cases(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    source: Source,
    bytes: Vec<u8>,
    /// Run numbers, ascending.
    runs: Vec<u64>,
    /// Whether the table gives them.
    numbered: bool,
    /// Per column: field of `Params`, and place of its header in the file.
    columns: Vec<(usize, Span<usize>)>,
    /// Per column: its values in SI.
    values: Vec<Vec<f64>>,
    left_aside: usize,
}

/// What a column is.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Meaning {
    Run,
    Input(usize),
    LeftAside,
}

/// A table as it was read, before its values are checked.
struct Raw {
    source: Source,
    /// Whether rows are lines of a text.
    is_text: bool,
    headers: Vec<String>,
    /// Places of the headers.
    spans: Vec<Span<usize>>,
}

impl Cases {
    /// Reads a CSV file: a header, then one case a line.
    ///
    /// # Errors
    /// Unknown and double columns, cells that are not finite or out of the parameter's legal range, run numbers
    /// that do not ascend, and a table without rows: each with its line, column, value, range and remedy.
    pub fn of_csv(path: &Path) -> Result<Self, Problems> {
        let source = Source::read(path, None)?;
        let text = source.text();
        let start_of = |part: &str| part.as_ptr() as usize - text.as_ptr() as usize;
        let span_of = |part: &str| start_of(part)..start_of(part) + part.len();
        let mut lines = text.trim_start_matches('\u{feff}').lines().filter(|line| !line.trim().is_empty());
        let Some(header) = lines.next() else {
            let remedy = "write a header with names of parameters, then one case a line";
            return Err(Problem::at(&source, 0..0, "the table is empty").remedy(remedy).into());
        };
        let cells: Vec<&str> = header.split(',').map(cell).collect();
        let raw = Raw {
            headers: cells.iter().map(|name| (*name).to_owned()).collect(),
            spans: cells.iter().map(|name| span_of(name)).collect(),
            is_text: true,
            source: source.clone(),
        };
        let meanings = raw.meanings()?;
        let mut values = vec![Vec::new(); cells.len()];
        let mut places = Vec::new();
        let mut problems = Vec::new();
        for line in lines {
            let row: Vec<&str> = line.split(',').map(cell).collect();
            if row.len() != cells.len() {
                let message = format!("{} cells in this row, {} in the header", row.len(), cells.len());
                let remedy = "write one number for each column, separated by commas";
                problems.push(Problem::at(&source, span_of(line), message).key("").value("").remedy(remedy));
                continue;
            }
            for (at, text) in row.iter().enumerate().filter(|(at, _)| meanings[*at] != Meaning::LeftAside) {
                match text.parse::<f64>().ok().filter(|number| number.is_finite()) {
                    Some(number) => values[at].push(number),
                    None => {
                        let problem = Problem::at(&source, span_of(text), "not a finite number");
                        problems.push(problem.key(cells[at]).value(*text).remedy(raw.number_remedy(at, meanings[at])));
                        values[at].push(f64::NAN);
                    }
                }
            }
            problems.truncate(2 * LISTED);
            places.push(row.iter().map(|cell| span_of(cell)).collect::<Vec<_>>());
        }
        let bytes = text.as_bytes().to_vec();
        raw.check(bytes, &meanings, values, |row, column| places[row][column].clone(), problems)
    }

    /// Takes the columns of a Parquet file; `read` gives the named ones as numbers, NaN where there is none.
    ///
    /// # Errors
    /// As [`of_csv`](Self::of_csv), with rows that count from 1; and what `read` answers.
    pub fn of_columns(
        path: &Path,
        bytes: Vec<u8>,
        names: &[String],
        read: impl FnOnce(&[&str]) -> Result<Vec<Vec<f64>>, String>,
    ) -> Result<Self, Problems> {
        let source = Source::new(path.to_owned(), String::new());
        let raw = Raw { headers: names.to_vec(), spans: vec![0..0; names.len()], is_text: false, source };
        let meanings = raw.meanings()?;
        let used: Vec<usize> = (0..names.len()).filter(|at| meanings[*at] != Meaning::LeftAside).collect();
        let named: Vec<&str> = used.iter().map(|at| names[*at].as_str()).collect();
        let columns = read(&named).map_err(|message| {
            Problem::with_file(path.to_owned(), message).remedy("write the parameters as columns of numbers")
        })?;
        let mut values = vec![Vec::new(); names.len()];
        for (at, column) in used.into_iter().zip(columns) {
            values[at] = column;
        }
        raw.check(bytes, &meanings, values, |_, _| 0..0, Vec::new())
    }

    /// Number of cases.
    pub fn len(&self) -> u64 {
        self.0.runs.len() as u64
    }

    /// Never: a table without rows is refused.
    pub fn is_empty(&self) -> bool {
        self.0.runs.is_empty()
    }

    /// The file that was read.
    pub fn path(&self) -> &Path {
        self.0.source.path()
    }

    /// Run numbers, ascending.
    pub(crate) fn runs(&self) -> &[u64] {
        &self.0.runs
    }

    /// Field of `Params`, place of the header and values in SI of every column.
    pub(crate) fn columns(&self) -> impl Iterator<Item = (usize, &Span<usize>, &[f64])> {
        let columns = self.0.columns.iter().zip(&self.0.values);
        columns.map(|((field, header), values)| (*field, header, values.as_slice()))
    }

    /// The file.
    pub(crate) fn source(&self) -> &Source {
        &self.0.source
    }

    /// Its bytes.
    pub fn bytes(&self) -> &[u8] {
        &self.0.bytes
    }

    /// Name under which a results folder keeps it: `cases.csv` or `cases.parquet`.
    pub fn file_name(&self) -> &'static str {
        let is_parquet = self.path().extension().is_some_and(|extension| extension.eq_ignore_ascii_case("parquet"));
        if is_parquet { "cases.parquet" } else { "cases.csv" }
    }

    /// blake3 of the file, in hexadecimal.
    pub fn hash(&self) -> String {
        blake3::hash(self.bytes()).to_hex().to_string()
    }

    /// Names of the parameters that have a column.
    pub fn parameters(&self) -> Vec<String> {
        let table = fields::<f64, Params<f64>>();
        self.0.columns.iter().map(|(field, _)| table[*field].name.clone()).collect()
    }

    /// Number of columns that are no inputs.
    pub fn left_aside(&self) -> usize {
        self.0.left_aside
    }

    /// Whether the run numbers are those of the table.
    pub fn is_numbered(&self) -> bool {
        self.0.numbered
    }

    pub(crate) fn has(&self, field: usize) -> bool {
        self.0.columns.iter().any(|(own, _)| *own == field)
    }
}

impl Raw {
    /// What each column is; every wrong name at once.
    fn meanings(&self) -> Result<Vec<Meaning>, Problems> {
        self.check_headers()?;
        let table = fields::<f64, Params<f64>>();
        let of_runs = self.headers.iter().any(|name| name.starts_with("in_"));
        let mut problems = Vec::new();
        let mut meanings = Vec::new();
        for (at, name) in self.headers.iter().enumerate() {
            let meaning = meaning(name, &table, of_runs);
            let double = meaning.is_some_and(|own| own != Meaning::LeftAside && meanings.contains(&own));
            match meaning {
                None => {
                    let near: Vec<&str> = table.iter().map(|field| field.name.as_str()).collect();
                    let remedy = format!(
                        "{}; values are in SI: a column with a unit is called as in the runs table, \
                                          in_loop_delay_s",
                        suggestion(name, &near)
                    );
                    problems.push(self.problem(at, None, "no parameter has this name").value("").remedy(remedy));
                }
                Some(_) if double => {
                    problems
                        .push(self.problem(at, None, "a second column of this parameter").value("").remedy("keep one"));
                }
                Some(_) => {}
            }
            meanings.push(meaning.unwrap_or(Meaning::LeftAside));
        }
        problems.truncate(LISTED);
        Problems::check(problems)?;
        if !meanings.iter().any(|meaning| matches!(meaning, Meaning::Input(_))) {
            let remedy = "add a column with the name of a parameter: loop_delay";
            return Err(self.problem(0, None, "no column is a parameter").key("").value("").remedy(remedy).into());
        }
        Ok(meanings)
    }

    /// Refuses headers that no table of cases has, before they are compared with the names of parameters.
    fn check_headers(&self) -> Result<(), Problems> {
        let long = self.headers.iter().position(|name| name.len() > LONGEST_NAME);
        if self.headers.len() <= MOST_COLUMNS && long.is_none() {
            return Ok(());
        }
        let span = long.and_then(|at| self.spans.get(at)).map_or(0..0, |span| span.start..span.start);
        let message = match long {
            Some(at) => format!("the name of column {} has {} bytes", at + 1, self.headers[at].len()),
            None => format!("the header names {} columns", self.headers.len()),
        };
        let expected = format!("at most {MOST_COLUMNS} columns with names of at most {LONGEST_NAME} bytes");
        let remedy = "write a header with names of parameters, separated by commas, then one case a line";
        Err(Problem::at(&self.source, span, message).key("").value("").expected(expected).remedy(remedy).into())
    }

    /// A problem with a column, or with its cell in a row.
    fn problem(&self, column: usize, cell: Option<(usize, Span<usize>)>, message: &str) -> Problem {
        let name = self.headers.get(column).map_or("", String::as_str);
        if self.is_text {
            let span = cell.map_or_else(|| self.spans.get(column).cloned().unwrap_or(0..0), |(_, span)| span);
            return Problem::at(&self.source, span, message).key(name);
        }
        let (row, shown) = match cell {
            Some((row, _)) => (row + 1, format!("row {}: ", row + 1)),
            None => (1, String::new()),
        };
        let message = format!("{}: {shown}{message}", self.source.path().display());
        let mut problem = Problem::with_file(self.source.path().to_owned(), message).key(name);
        problem.line = row;
        problem
    }

    fn number_remedy(&self, column: usize, meaning: Meaning) -> String {
        match meaning {
            Meaning::Input(field) => {
                let field = &fields::<f64, Params<f64>>()[field];
                format!("write a number {}, or remove the row", in_words(legal(&field.name), field.unit))
            }
            _ => format!("write a whole number in column `{}`, or remove the row", self.headers[column]),
        }
    }

    /// The table if every value is legal and there are no `problems` yet; a cell of a text that is NaN is among these.
    fn check(
        self,
        bytes: Vec<u8>,
        meanings: &[Meaning],
        values: Vec<Vec<f64>>,
        place: impl Fn(usize, usize) -> Span<usize>,
        mut problems: Vec<Problem>,
    ) -> Result<Cases, Problems> {
        let table = fields::<f64, Params<f64>>();
        let rows = meanings.iter().zip(&values).find(|(meaning, _)| **meaning != Meaning::LeftAside);
        let rows = rows.map_or(0, |(_, values)| values.len());
        if rows == 0 && problems.is_empty() {
            let remedy = "add at least one row below the header";
            return Err(self.problem(0, None, "the table has no rows").key("").value("").remedy(remedy).into());
        }
        if rows as u64 > MOST_RUNS {
            let message = format!("{rows} rows, more than {MOST_RUNS}");
            return Err(self.problem(0, None, &message).key("").value("").remedy("cut the table into parts").into());
        }
        let mut runs: Vec<u64> = (0..rows as u64).collect();
        for (column, meaning) in meanings.iter().enumerate() {
            for (row, value) in values[column].iter().enumerate() {
                let wrong = match meaning {
                    Meaning::LeftAside => None,
                    Meaning::Run => {
                        let least = row.checked_sub(1).map_or(0, |before| runs[before] + 1);
                        let whole = value.fract() == 0.0 && *value >= least as f64 && *value < MOST_RUNS as f64;
                        runs[row] = if whole { *value as u64 } else { least };
                        let range = format!("a whole number from {least} to {}: run numbers ascend", MOST_RUNS - 1);
                        (!whole).then_some(("is no run number here", range))
                    }
                    Meaning::Input(field) => {
                        let (field, range) = (&table[*field], legal(&table[*field].name));
                        let words = in_words(range, field.unit);
                        let message = if value.is_finite() { "is out of range" } else { "is not a finite number" };
                        (!holds(&range, *value)).then_some((message, words))
                    }
                };
                let is_known = self.is_text && value.is_nan();
                if let Some((message, range)) = wrong.filter(|_| !is_known && problems.len() < 2 * LISTED) {
                    let unit = if let Meaning::Input(field) = meaning { table[*field].unit } else { "1" };
                    let message = format!("{} {message}", show(*value, unit));
                    let problem = self.problem(column, Some((row, place(row, column))), &message);
                    let remedy = format!(
                        "write {}{range}",
                        if unit == "1" && *meaning == Meaning::Run { "" } else { "a value " }
                    );
                    problems.push(problem.value(value.to_string()).expected(range).remedy(remedy));
                }
            }
        }
        problems.sort_by_key(|problem| (problem.line, problem.column));
        problems.truncate(LISTED);
        Problems::check(problems)?;
        let (mut columns, mut kept) = (Vec::new(), Vec::new());
        for (column, values) in values.into_iter().enumerate() {
            if let Meaning::Input(field) = meanings[column] {
                columns.push((field, self.spans[column].clone()));
                kept.push(values);
            }
        }
        Ok(Cases(Arc::new(Inner {
            bytes,
            runs,
            numbered: meanings.contains(&Meaning::Run),
            columns,
            values: kept,
            left_aside: meanings.iter().filter(|meaning| **meaning == Meaning::LeftAside).count(),
            source: self.source,
        })))
    }
}

/// Whether a value is legal; an end of the range may be rounded to single precision, as a GPU applies it.
pub(crate) fn holds(range: &Range, value: f64) -> bool {
    let rounded = |end: f64| range.contains(end) && value as f32 == end as f32;
    value.is_finite() && (range.contains(value) || rounded(range.max) || rounded(range.min))
}

fn meaning(name: &str, table: &[Field], of_runs: bool) -> Option<Meaning> {
    let bare = name.strip_prefix("in_").unwrap_or(name);
    let field = table.iter().position(|field| field.name == bare || field.column() == bare);
    let is_result = RESULTS.contains(&name) || name.starts_with("space_") || name.starts_with("hil_");
    match field {
        _ if name == RUN => Some(Meaning::Run),
        Some(field) => Some(Meaning::Input(field)),
        None => (of_runs && is_result).then_some(Meaning::LeftAside),
    }
}

/// A cell without spaces and quotes.
fn cell(text: &str) -> &str {
    text.trim().trim_matches('"').trim()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn campaign() -> crate::Campaign {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../campaigns/smoke.toml");
        crate::load(&path).expect("it loads")
    }

    fn of(text: &str) -> Result<Cases, Problems> {
        let folder = tempfile::tempdir().expect("room");
        let path = folder.path().join("cases.csv");
        std::fs::write(&path, text).expect("room");
        Cases::of_csv(&path)
    }

    #[test]
    fn a_column_replaces_the_draw_and_everything_else_is_nominal() {
        let nominal = campaign().nominal();
        let cases = of("loop_delay, in_contact_stiffness_n_per_m\n0.004, 1e5\n0.02,2e5\n").expect("legal");
        let campaign = campaign().with_cases(cases).expect("legal");
        assert_eq!((campaign.runs, campaign.outer_draws), (2, None));
        let params = campaign.draw(1).expect("a draw").params;
        assert_eq!((params.loop_delay, params.contact_stiffness), (0.02, 2e5));
        assert_eq!(params.contact_friction, nominal.contact_friction, "dispersed in the campaign, nominal here");
        let derived = 2.0 / 3.0 * 2e5 * 0.05;
        assert!((params.bristle_stiffness - derived).abs() < 1e-9 * derived, "derived from the case");
    }

    #[test]
    fn a_column_of_a_derived_value_takes_its_place() {
        let cases = of("contact_stiffness,bristle_stiffness\n1e5,777\n").expect("legal");
        assert_eq!(
            campaign().with_cases(cases).expect("legal").draw(0).expect("a draw").params.bristle_stiffness,
            777.0
        );
    }

    #[test]
    fn an_effect_that_only_a_case_has_is_computed() {
        let with = |value: f64| {
            let cases = of(&format!("contact_adhesion\n{value}\n")).expect("legal");
            campaign().with_cases(cases).expect("legal").effects()
        };
        assert!(with(5.0) != campaign().effects(), "the campaign has no adhesion");
        assert!(with(0.0) != with(5.0) && with(0.0) == with(-0.0), "a column of the null value switches nothing on");
    }

    #[test]
    fn run_numbers_are_those_of_the_table() {
        let campaign = campaign().with_cases(of("run,loop_delay\n3,0.004\n17,0.02\n").expect("legal")).expect("legal");
        assert_eq!([0, 1].map(|place| campaign.run_at(place)), [3, 17]);
        assert_eq!((campaign.place_of(17), campaign.place_of(4)), (Some(1), None));
        assert_eq!(campaign.draw(17).expect("a draw").params.loop_delay, 0.02);
    }

    #[test]
    fn other_bytes_are_another_campaign() {
        let hash = |text: &str| campaign().with_cases(of(text).expect("legal")).expect("legal").hash;
        let (one, two) = (hash("loop_delay\n0.004\n"), hash("loop_delay\n0.005\n"));
        assert!(one != two && one != campaign().hash);
    }

    #[test]
    fn bad_cells_are_pointed_at() {
        let cases = [
            ("", 1, "", "empty"),
            ("loop_delay\n", 1, "", "no rows"),
            ("loop_dely\n0.004\n", 1, "loop_dely", "no parameter has this name"),
            ("loop_delay_ms\n4\n", 1, "loop_delay_ms", "no parameter has this name"),
            ("loop_delay,in_loop_delay_s\n1,1\n", 1, "in_loop_delay_s", "a second column"),
            ("loop_delay\n0.004\nnan\n", 3, "loop_delay", "not a finite number"),
            ("loop_delay\n0.004\n4\n", 3, "loop_delay", "4 s is out of range"),
            ("loop_delay,tilt_x\n0.004\n", 2, "", "1 cells in this row, 2 in the header"),
            ("run,loop_delay\n3,0.004\n3,0.004\n", 3, "run", "is no run number here"),
            ("run\n3\n", 1, "", "no column is a parameter"),
        ];
        for (text, line, key, message) in cases {
            let problems = of(text).expect_err(text);
            let first = problems.iter().next().expect("never empty");
            assert_eq!((first.line, first.key.as_str()), (line, key), "{text}: {first}");
            assert!(first.message.contains(message), "{text}: {first}");
            assert!(!first.remedy.is_empty(), "{text}: {first}");
        }
        let problems = of("loop_delay,tilt_x\n4,0\n0.004,x\n1,2,3\n0.004,9\n").expect_err("four mistakes");
        assert_eq!(problems.iter().map(|problem| problem.line).collect::<Vec<_>>(), [2, 3, 4, 5]);
        let problems = of("loop_delay\n4\n").expect_err("out of range");
        let first = problems.iter().next().expect("never empty");
        assert_eq!((first.value.as_str(), first.expected.as_str()), ("4", "at least 0 s, at most 0.128 s"));
    }

    #[test]
    fn a_case_that_the_substep_cannot_follow_is_refused() {
        let cases = of("contact_stiffness\n1e11\n").expect("legal");
        let problems = campaign().with_cases(cases).expect_err("too stiff");
        let first = problems.iter().next().expect("never empty");
        assert!(first.file.ends_with("cases.csv") && first.remedy.contains("substep"), "{first}: {}", first.remedy);
    }
}
