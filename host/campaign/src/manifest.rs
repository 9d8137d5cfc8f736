//! `campaign.json` of a results folder: read within bounds and checked before a value of it is used.

use crate::problem::{Problem, Problems};
use crate::ranges::MOST_RUNS;
use crate::source::Source;
use serde_json::Value;
use softdock_input::{InputError, check_regular, read_text};
use std::ops::Range;
use std::path::{Component, Path, PathBuf};

/// Name of the file below a results folder.
pub const FILE: &str = "campaign.json";

/// Largest file: it records every extension and judgement of the campaign.
const LARGEST: u64 = 16 << 20;

/// Longest text of a value that must be short, in bytes.
const LONGEST: usize = 1_000;

/// What to do about a manifest that was changed by hand.
const RESTORE: &str = "restore the file from a backup, or run the campaign into a folder of its own with --out DIR";

/// Reads the manifest of a results folder; `None` if the folder has none.
///
/// `format` is the version that this program reads: the values of another version are not checked, only the JSON is.
///
/// # Errors
/// If the file is a pipe, device, socket or directory, is too large, is no UTF-8 or no JSON object, or if a value is out
/// of its range: a number of runs beyond the limit, a path that leads out of the folder.
pub fn read(folder: &Path, format: &str) -> Result<Option<Value>, Problems> {
    let path = folder.join(FILE);
    let refuse = |error: &InputError| {
        let mut problem = Problem::with_file(path.clone(), error.what()).remedy(error.remedy());
        problem.line = error.line().unwrap_or(1);
        Problems::from(problem)
    };
    if !check_regular(&path).map_err(|error| refuse(&error))? {
        return Ok(None);
    }
    let text = read_text(&path, LARGEST).map_err(|error| refuse(&error))?;
    let source = Source::new(path, text);
    check(&source, format).map(Some)
}

/// Checks the text of a manifest; problems name `path`.
///
/// # Errors
/// As [`read`].
pub fn check_text(path: &Path, text: &str, format: &str) -> Result<Value, Problems> {
    check(&Source::new(path.to_owned(), text.to_owned()), format)
}

fn check(source: &Source, format: &str) -> Result<Value, Problems> {
    let parsed: Value = serde_json::from_str(source.text()).map_err(|error| {
        let start = line_start(source.text(), error.line());
        let message = format!("this is not JSON: {error}");
        Problem::at(source, start..start, message).value("").remedy("move the damaged folder away, or restore the file")
    })?;
    if !parsed.is_object() {
        return Err(Problem::at(source, 0..0, "this is not a JSON object").value("").remedy(RESTORE).into());
    }
    if parsed["schema"] != format {
        return Ok(parsed);
    }
    let mut problems = Vec::new();
    let mut refuse = |key: &str, message: String, expected: String| {
        let problem = Problem::at(source, place(source.text(), key), message).key(key).value(excerpt(&parsed[key]));
        problems.push(problem.expected(expected).remedy(RESTORE));
    };
    for key in ["id", "hash"] {
        if parsed[key].as_str().is_none_or(|text| text.is_empty() || text.len() > LONGEST) {
            refuse(key, "this is not a name".to_owned(), format!("a text of 1 to {LONGEST} bytes"));
        }
    }
    if parsed["seed"].as_u64().is_none() {
        refuse("seed", "this is not a seed".to_owned(), format!("a whole number from 0 to {}", u64::MAX));
    }
    if parsed["runs"].as_u64().is_none_or(|runs| !(1..=MOST_RUNS).contains(&runs)) {
        let expected = format!("a whole number from 1 to {MOST_RUNS}");
        refuse("runs", "this is not a number of runs".to_owned(), expected);
    }
    for (key, is_optional) in [("campaign", false), ("model", true)] {
        let is_absent = is_optional && parsed[key].is_null();
        if !is_absent && !parsed[key].as_str().is_some_and(is_inside) {
            let message = "this path leads out of the folder `campaign`".to_owned();
            refuse(key, message, "a relative path below `campaign`, without `..`".to_owned());
        }
    }
    let cases = &parsed["cases"];
    if !cases.is_null() && cases != "cases.csv" && cases != "cases.parquet" {
        refuse(
            "cases",
            "this is not a table of cases of the folder".to_owned(),
            "`cases.csv` or `cases.parquet`".to_owned(),
        );
    }
    Problems::check(problems)?;
    Ok(parsed)
}

/// Whether a path, as a manifest states it, stays below the folder that it is seen from.
pub fn is_inside(path: &str) -> bool {
    let is_plain = !path.is_empty() && path.len() <= LONGEST && !path.contains(['\\', '\0', ':']);
    is_plain && PathBuf::from(path).components().all(|part| matches!(part, Component::Normal(_)))
}

/// First byte of a line, which counts from 1.
fn line_start(text: &str, line: usize) -> usize {
    let ends = text.match_indices('\n').map(|(at, _)| at + 1);
    std::iter::once(0).chain(ends).nth(line.saturating_sub(1)).unwrap_or(text.len())
}

/// Where a key of the outermost object is written; the start of the text if it is not.
fn place(text: &str, key: &str) -> Range<usize> {
    let name = format!("\"{key}\"");
    let written = text.match_indices(&name).find(|(at, name)| text[at + name.len()..].trim_start().starts_with(':'));
    written.map_or(0..0, |(at, name)| at..at + name.len())
}

/// A value as a message shows it.
fn excerpt(value: &Value) -> String {
    let text = if value.is_null() { "(none)".to_owned() } else { value.to_string() };
    if text.chars().count() <= 60 { text } else { text.chars().take(60).chain("...".chars()).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHOLE: &str = r#"{
  "campaign": "smoke.toml",
  "cases": "cases.csv",
  "hash": "ab",
  "id": "smoke/v",
  "model": "scenarios/found.toml",
  "runs": 64,
  "schema": "results/4",
  "seed": 1
}"#;

    fn check(text: &str) -> Result<Value, Problems> {
        check_text(Path::new("campaign.json"), text, "results/4")
    }

    #[test]
    fn a_manifest_states_runs_and_paths_within_their_ranges() {
        assert_eq!(check(WHOLE).expect("valid")["runs"], 64);
        let cases = [
            ("64", "1000000000000000000", 7, "runs", "from 1 to 1000000000"),
            ("64", "0", 7, "runs", "from 1 to 1000000000"),
            ("64", "1e300", 7, "runs", "from 1 to 1000000000"),
            ("64", "\"64\"", 7, "runs", "from 1 to 1000000000"),
            ("\"smoke.toml\"", "\"../../etc/passwd\"", 2, "campaign", "without `..`"),
            ("\"smoke.toml\"", "\"/etc/passwd\"", 2, "campaign", "relative path"),
            ("\"smoke.toml\"", "7", 2, "campaign", "relative path"),
            ("\"scenarios/found.toml\"", "\"scenarios/../../x\"", 6, "model", "without `..`"),
            ("\"cases.csv\"", "\"../cases.csv\"", 3, "cases", "`cases.parquet`"),
            ("1\n}", "-1\n}", 9, "seed", "from 0 to"),
            ("\"smoke/v\"", "\"\"", 5, "id", "1 to 1000 bytes"),
        ];
        for (old, new, line, key, expected) in cases {
            let problems = check(&WHOLE.replacen(old, new, 1)).expect_err(new);
            let problem = problems.iter().next().expect("never empty");
            assert_eq!((problem.line, problem.key.as_str()), (line, key), "{problems}");
            assert!(problem.expected.contains(expected) && !problem.remedy.is_empty(), "{problems}");
        }
    }

    #[test]
    fn what_is_no_object_of_this_version_is_refused_or_given_back() {
        assert_eq!(check("{\"schema\": \"results/1\", \"runs\": -1}").expect("another version")["runs"], -1);
        for text in ["", "[]", "7", "{\"a\": 1", &"[".repeat(100_000), &"{\"a\":".repeat(100_000)] {
            check(text).expect_err("no object");
        }
        let folder = tempfile::tempdir().expect("a folder");
        assert!(read(folder.path(), "results/4").expect("no manifest").is_none());
        std::fs::create_dir(folder.path().join(FILE)).expect("a directory");
        let problems = read(folder.path(), "results/4").expect_err("a directory");
        assert!(problems.to_string().contains("is no regular file but a directory"), "{problems}");
    }
}
