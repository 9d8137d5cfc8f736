//! Tables of measured values: one named column of a CSV file.

use crate::problem::{Problem, Problems};
use crate::ranges::in_words;
use crate::source::Source;
use crate::suggest::suggestion;
use crate::units::{quantity, show};
use softdock_kernels::range::Range;

/// The column's values in SI, ascending; `unit` is the column's unit as written, `si` that of the parameter.
pub(crate) fn column(source: &Source, name: &str, unit: &str, si: &str, range: Range) -> Result<Vec<f64>, Problems> {
    let refuse = |line: &str, value: &str, message: String, remedy: String| -> Problems {
        let start = line.as_ptr() as usize - source.text().as_ptr() as usize;
        Problem::at(source, start..start + line.len(), message).key(name).value(value).remedy(remedy).into()
    };
    let mut lines = source.text().lines().filter(|line| !line.trim().is_empty());
    let header = lines.next().unwrap_or(source.text());
    let names: Vec<&str> = header.split(',').map(cell).collect();
    let index = names.iter().position(|column| *column == name);
    let Some(index) = index else {
        return Err(refuse(header, header, format!("there is no column `{name}`"), suggestion(name, &names)));
    };
    let mut values = Vec::new();
    for line in lines {
        let text = line.split(',').nth(index).map_or("", cell);
        let number: Option<f64> = text.parse().ok().filter(|number: &f64| number.is_finite());
        let Some(number) = number else {
            let remedy = "write a finite number in every row, or remove the row".to_owned();
            return Err(refuse(line, text, format!("`{text}` is not a finite number"), remedy));
        };
        // The unit was checked by the caller, so that it can only be the number that fails here.
        let value = quantity(&format!("{number:e} {unit}"), si).unwrap_or(f64::NAN);
        if !range.contains(value) {
            let remedy = format!("write values {}", in_words(range, si));
            return Err(refuse(line, text, format!("{} is out of range", show(value, si)), remedy));
        }
        values.push(value);
    }
    if values.is_empty() {
        let remedy = "add at least one row below the header".to_owned();
        return Err(refuse(header, "", "the table has no rows".to_owned(), remedy));
    }
    values.sort_by(f64::total_cmp);
    Ok(values)
}

/// A cell without spaces and quotes.
fn cell(text: &str) -> &str {
    text.trim().trim_matches('"').trim()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<f64>, Problems> {
        let source = Source::new("delays.csv".into(), text.to_owned());
        column(&source, "delay", "ms", "s", Range::within(0.0, 0.1))
    }

    #[test]
    fn values_are_sorted_and_in_si() {
        assert_eq!(read("run, \"delay\"\n1, 12\n2,4\n\n3,8.5\n").expect("valid"), vec![0.004, 0.0085, 0.012]);
    }

    #[test]
    fn bad_rows_are_pointed_at() {
        let cases = [
            ("run,dely\n1,2\n", 1),
            ("run,delay\n1,2\n2,\n", 3),
            ("run,delay\n1,nan\n", 2),
            ("run,delay\n1,200\n", 2),
            ("run,delay\n", 1),
            ("", 1),
        ];
        for (text, line) in cases {
            let problems = read(text).expect_err(text);
            let problem = problems.iter().next().expect("never empty");
            assert_eq!((problem.line, problem.key.as_str()), (line, "delay"), "{text}: {problem}");
            assert!(!problem.remedy.is_empty());
        }
    }
}
