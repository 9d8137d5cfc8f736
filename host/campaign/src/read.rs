//! From TOML text to the types as written; what the parser complains about becomes a [`Problem`].

use crate::problem::{Problem, Problems};
use crate::source::Source;
use crate::suggest::suggestion;
use serde::de::DeserializeOwned;
use softdock_input::{InputError, MAX_TABLE, MAX_TEXT};
use std::ops::Range;
use std::path::Path;
use toml::Spanned;
use toml::de::{DeTable, DeValue, Deserializer, Error};

impl Source {
    /// Reads a text file; `referred` makes the problem point to the key that names the file.
    pub(crate) fn read(path: &Path, referred: Option<(&Source, Range<usize>)>) -> Result<Self, Problems> {
        let refuse = |message: String, remedy: &str| -> Problems {
            match &referred {
                Some((source, span)) => Problem::at(source, span.clone(), message),
                None => Problem::with_file(path.to_owned(), message),
            }
            .remedy(remedy)
            .into()
        };
        let shown = path.display();
        let is_table = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("csv"));
        let limit = if is_table { MAX_TABLE } else { MAX_TEXT };
        let text = softdock_input::read_text(path, limit).map_err(|error| match &error {
            InputError::Absent { .. } => refuse(
                format!("there is no file `{shown}`"),
                "check the path; it is relative to the file that names it",
            ),
            InputError::NotRegular { kind: "directory", .. } => {
                refuse(format!("`{shown}` is a directory"), "name a file in it")
            }
            InputError::NotText { line, column, .. } => {
                let mut problem = Problem::with_file(path.to_owned(), error.what()).expected("UTF-8");
                (problem.line, problem.column) = (*line, *column);
                problem.remedy(error.remedy()).into()
            }
            _ => refuse(format!("`{shown}` {}", error.what()), error.remedy()),
        })?;
        Ok(Self::new(path.to_owned(), text))
    }
}

/// What to write for a key that must be there.
const EXAMPLES: &[(&str, &str)] = &[
    ("schema", "schema = \"campaign/2\" (or \"scenario/2\", \"facility/2\", \"robot/1\")"),
    (
        "facility",
        "a table [facility] with file = \"../facilities/reference.toml\" or session_rules = \"none\", and unstable_speed = \"2 m/s\"",
    ),
    ("capture", "capture = true (success needs a closed latch) or false"),
    ("touch", "touch = true (success needs a touch) or false"),
    ("id", "id = \"a-name\""),
    ("title", "title = \"one line for people\""),
    ("seed", "seed = 20261121 (any whole number; the same seed gives the same runs)"),
    ("runs", "runs = 1000"),
    ("scenario", "scenario = \"scenarios/plate_impact.toml\""),
    ("dist", "dist = { kind = \"uniform\", min = \"...\", max = \"...\" }"),
    ("kind", "kind = \"uniform\""),
    ("timing", "a table [timing] with time_limit = \"15 s\""),
    ("time_limit", "time_limit = \"15 s\""),
    ("mass", "mass = \"400 kg\""),
    ("inertia", "inertia = { ixx = \"60 kg m^2\", iyy = \"60 kg m^2\", izz = \"60 kg m^2\" }"),
    ("closing_speed", "closing_speed = \"0.05 m/s\""),
    ("stiffness", "stiffness = \"1e5 N/m\""),
    ("law", "law = \"linear\""),
    ("max_depth", "max_depth = \"20 mm\""),
    ("source", "source = \"where the values come from\""),
    ("subject", "subject = \"space\" (or \"facility\", \"agreement\")"),
    ("probability", "probability = \"99 %\""),
    ("confidence", "confidence = \"90 %\""),
    ("keep", "keep = [\"worst:5\", \"random:20\"]"),
];

/// Added to a message about an unknown key of the campaign on the command line.
const OTHER_FILES: &str = " (keys of the scenario begin with `scenario.`, those of the facility file with `station.`)";

/// What has changed since an older version of a format.
const CHANGES: &[(&str, &str)] = &[
    (
        "campaign/1",
        "write schema = \"campaign/2\"; each [[requirement]] has its subject: \"space\" (as before), \"facility\" or \
         \"agreement\"",
    ),
    (
        "scenario/1",
        "write schema = \"scenario/2\"; [facility] names the facility file whose rules stop a session (file = \"...\") or says \
         session_rules = \"none\", and has unstable_speed (was \"2 m/s\"); [task] has capture (was false) and touch (was \
         true); max_force is max_contact_force",
    ),
    (
        "facility/1",
        "write schema = \"facility/2\"; [safety] has every rule: contact_energy is injected_energy, following_error is \
         a distance at the tool, and following_rotation, tool_reach, tool_rotation, \
         sensor_saturation are new",
    ),
];

/// Refuses an older version of a format before its keys are looked at.
fn check_age(source: &Source, table: &DeTable<'_>, format: &str) -> Option<Problem> {
    let written = table.get("schema")?;
    let found = written.get_ref().as_str()?;
    let is_older = |(older, _): &&(&str, &str)| *older == found && older.split('/').next() == format.split('/').next();
    let (_, remedy) = CHANGES.iter().find(is_older)?;
    let message = "this version of softdock does not read this format";
    Some(Problem::at(source, written.span(), message).expected(format!("\"{format}\"")).remedy(*remedy))
}

/// Reads a file of the given format ("campaign/2").
pub(crate) fn parse<T: DeserializeOwned>(source: &Source, format: &str) -> Result<T, Problems> {
    let behind = overlay_text(source);
    structured(source, overlaid_table(source, format, &behind)?)
}

/// The text of a file's overlay, if there is one, for [`overlaid_table`].
pub(crate) fn overlay_text(source: &Source) -> Option<String> {
    source.overlay().map(|overlay| overlay.text_behind(source.text().len()))
}

/// The text of a file of the given format as a table, with what its overlay replaces.
pub(crate) fn overlaid_table<'s>(
    source: &'s Source,
    format: &str,
    overlay_text: &'s Option<String>,
) -> Result<Spanned<DeTable<'s>>, Problems> {
    let mut table = table(source, format)?;
    if let (Some(overlay), Some(text)) = (source.overlay(), overlay_text) {
        let campaign = DeTable::parse(text).map_err(|error| syntax(source, &error))?;
        overlay.lay_over(table.get_mut(), campaign.into_inner());
    }
    Ok(table)
}

/// The values of a table in the places that a type has for them.
pub(crate) fn structured<T: DeserializeOwned>(source: &Source, table: Spanned<DeTable<'_>>) -> Result<T, Problems> {
    from_table(table).map_err(|error| structure(source, &error).into())
}

/// The text of a file of the given format as a table.
fn table<'s>(source: &'s Source, format: &str) -> Result<Spanned<DeTable<'s>>, Problems> {
    if source.text().trim().is_empty() {
        return Err(Problem::at(source, 0..0, "the file is empty")
            .remedy(format!("start it with schema = \"{format}\"; the shipped files show every key"))
            .into());
    }
    check_depth(source)?;
    // Syntax first: the parser's own words; this distinguishes an incomplete table from a wrong key.
    let table = DeTable::parse(source.text()).map_err(|error| syntax(source, &error))?;
    Problems::check(check_lengths(source, table.get_ref()))?;
    match check_age(source, table.get_ref(), format) {
        Some(problem) => Err(problem.into()),
        None => Ok(table),
    }
}

/// Longest text of a file, in characters.
pub(crate) const LONGEST_TEXT: usize = 10_000;

/// Longest key, in characters.
const LONGEST_KEY: usize = 200;

/// Refuses nesting that the parsers, which recurse, cannot take.
fn check_depth(source: &Source) -> Result<(), Problems> {
    softdock_input::toml_depth(source.text()).map(drop).map_err(|deep| {
        Problem::at(source, deep.offset..deep.offset + 1, deep.to_string())
            .expected(format!("at most {} levels", softdock_input::MAX_DEPTH))
            .remedy("no key takes such a value: remove brackets, braces or parts of the dotted key here")
            .into()
    })
}

/// Refuses keys and texts that are too long for tables, pages and file names.
fn check_lengths(source: &Source, table: &DeTable<'_>) -> Vec<Problem> {
    let mut problems = Vec::new();
    check_keys(source, table, &mut problems);
    problems
}

fn check_keys(source: &Source, table: &DeTable<'_>, problems: &mut Vec<Problem>) {
    for (key, value) in table {
        if let Some(problem) = too_long(source, "key", key.get_ref(), key.span(), LONGEST_KEY) {
            // The dotted path of the key is as long as the key.
            problems.push(problem.key("").value(source.excerpt(&key.span())));
            continue;
        }
        check_value(source, value, problems);
    }
}

fn check_value(source: &Source, value: &Spanned<DeValue<'_>>, problems: &mut Vec<Problem>) {
    match value.get_ref() {
        DeValue::String(text) => problems.extend(too_long(source, "text", text, value.span(), LONGEST_TEXT)),
        DeValue::Table(table) => check_keys(source, table, problems),
        DeValue::Array(array) => array.iter().for_each(|item| check_value(source, item, problems)),
        _ => {}
    }
}

fn too_long(source: &Source, kind: &str, text: &str, span: Range<usize>, limit: usize) -> Option<Problem> {
    // Most are short in bytes already.
    let length = if text.len() > limit { text.chars().count() } else { 0 };
    (length > limit).then(|| {
        Problem::at(source, span.start..span.start + 1, format!("the {kind} has {length} characters"))
            .value(source.excerpt(&span))
            .expected(format!("at most {limit} characters"))
            .remedy(format!("shorten it to {limit} characters; longer explanations belong in a document"))
    })
}

fn from_table<T: DeserializeOwned>(table: Spanned<DeTable<'_>>) -> Result<T, Error> {
    T::deserialize(Deserializer::from(table))
}

fn syntax(source: &Source, error: &Error) -> Problem {
    let span = error.span().unwrap_or(0..0);
    let at_end = source.text()[span.start.min(source.text().len())..].trim().is_empty();
    let remedy = if at_end {
        "the file ends too early: close the quote or bracket that is open here"
    } else {
        "check quotes, brackets and `=` here: a text needs quotes, a key occurs once in its table"
    };
    let key = key_before(source.text(), span.start);
    Problem::at(source, span, format!("this is not TOML: {}", one_line(error.message()))).key(key).remedy(remedy)
}

/// The key at or before a place in a text that cannot be parsed, by its looks.
fn key_before(text: &str, offset: usize) -> String {
    let line_end = text.get(offset..).and_then(|rest| rest.find('\n')).map_or(text.len(), |at| offset + at);
    let lines: Vec<&str> = text.get(..line_end).unwrap_or("").lines().map(str::trim).collect();
    let header = lines.iter().rev().find_map(|line| line.strip_prefix('[')?.split(']').next());
    let header = header.map_or("", |name| name.trim_start_matches('['));
    let last = lines.iter().rev().find(|line| line.starts_with('[') || line.contains('='));
    let key = last.and_then(|line| line.split_once('=')).map_or("", |(key, _)| key.trim());
    [header, key].into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(".")
}

/// A text without line breaks.
fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The words in backticks of a message.
fn quoted(message: &str) -> Vec<&str> {
    message.split('`').skip(1).step_by(2).collect()
}

fn structure(source: &Source, error: &Error) -> Problem {
    let span = error.span().unwrap_or(0..0);
    let message = error.message();
    let names = quoted(message);
    if message.starts_with("unknown field") {
        let known = if names.len() > 1 { suggestion(names[0], &names[1..]) } else { "remove it".to_owned() };
        let (written, _) = source.resolve(span.clone());
        let known = if written.is_setting_of_campaign() { known + OTHER_FILES } else { known };
        return Problem::at(source, span, format!("there is no key `{}` here", names[0])).value("").remedy(known);
    }
    if message.starts_with("missing field") {
        let (written, at) = source.resolve(span.clone());
        let parent = written.table_at(&at);
        let key = if parent.is_empty() { names[0].to_owned() } else { format!("{parent}.{}", names[0]) };
        let example = EXAMPLES.iter().find(|row| row.0 == names[0]);
        let remedy = example.map_or_else(|| format!("add {} = ...", names[0]), |row| format!("add {}", row.1));
        return Problem::at(source, span, "this key must be there").key(key).value("").remedy(remedy);
    }
    let (found, expected) = message.split_once(", expected ").unwrap_or((message, ""));
    let expected = match expected {
        "u64" | "u32" => "a whole number, not negative",
        "f64" => "a number",
        other => other,
    };
    let found = found.trim_start_matches("invalid type: ").trim_start_matches("invalid value: ");
    Problem::at(source, span, format!("{} does not fit here", one_line(found)))
        .expected(one_line(expected))
        .remedy(format!("write {}", one_line(expected)))
}

/// Refuses another format version.
pub(crate) fn check_format(source: &Source, written: &crate::written::At<String>, format: &str) -> Option<Problem> {
    (written.value != format).then(|| {
        Problem::at(source, written.span.clone(), "this version of softdock does not read this format")
            .expected(format!("\"{format}\""))
            .remedy(format!("write schema = \"{format}\""))
    })
}
