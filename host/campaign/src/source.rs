//! A file's text with its path and the dotted key of every place in it.

use crate::overlay::Overlay;
use crate::problem::{Problem, Problems};
use miette::NamedSource;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Longest value that a message repeats in full.
const EXCERPT: usize = 60;

/// Larger files are refused: no campaign, model or table of measured values comes near.
const LARGEST_FILE: u64 = 64 << 20;

/// A text file; cheap to clone.
#[derive(Clone, Debug)]
pub(crate) struct Source(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    path: PathBuf,
    named: NamedSource<String>,
    places: Vec<Place>,
    overlay: Option<Overlay>,
}

/// A key or a value of a TOML file.
#[derive(Debug)]
struct Place {
    span: Range<usize>,
    key: String,
    /// The value is a table, in which keys may be missing.
    is_table: bool,
}

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
        let data = std::fs::metadata(path).map_err(|error| match error.kind() {
            std::io::ErrorKind::NotFound => refuse(
                format!("there is no file `{shown}`"),
                "check the path; it is relative to the file that names it",
            ),
            _ => refuse(format!("`{shown}` cannot be read: {error}"), "check the path and its permissions"),
        })?;
        if data.is_dir() {
            return Err(refuse(format!("`{shown}` is a directory"), "name a file in it"));
        }
        if !data.is_file() || data.len() > LARGEST_FILE {
            return Err(refuse(format!("`{shown}` is not a file of at most 64 MiB"), "name a regular, smaller file"));
        }
        let bytes = std::fs::read(path).map_err(|error| {
            refuse(format!("`{shown}` cannot be read: {error}"), "check the path and its permissions")
        })?;
        Self::decode(path, bytes)
    }

    fn decode(path: &Path, bytes: Vec<u8>) -> Result<Self, Problems> {
        let text = String::from_utf8(bytes).map_err(|error| {
            let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
            let byte = error.as_bytes()[valid.len()];
            let line_start = valid.iter().rposition(|b| *b == b'\n').map_or(0, |at| at + 1);
            let mut problem = Problem::with_file(path.to_owned(), format!("byte 0x{byte:02X} is not UTF-8 text"))
                .expected("UTF-8")
                .remedy("save the file with the encoding UTF-8 (UTF-16 and Latin-1 are not read)");
            problem.line = 1 + valid.iter().filter(|b| **b == b'\n').count();
            problem.column = 1 + String::from_utf8_lossy(&valid[line_start..]).chars().count();
            Problems::from(problem)
        })?;
        Ok(Self::new(path.to_owned(), text))
    }

    /// A source from a text; keys are found if it is TOML.
    pub(crate) fn new(path: PathBuf, text: String) -> Self {
        let mut places = Vec::new();
        if path.extension().is_some_and(|e| e == "toml")
            && let Ok(table) = DeTable::parse(&text)
        {
            collect_table("", table.get_ref(), &mut places);
        }
        let named = NamedSource::new(path.display().to_string(), text);
        Self(Arc::new(Inner { path, named, places, overlay: None }))
    }

    /// The same file with keys replaced by another.
    pub(crate) fn with(&self, overlay: Overlay) -> Self {
        let plain = Self::new(self.path().to_owned(), self.text().to_owned());
        let inner = Arc::into_inner(plain.0).expect("nobody else has it yet");
        Self(Arc::new(Inner { overlay: Some(overlay), ..inner }))
    }

    /// What replaces keys of this file.
    pub(crate) fn overlay(&self) -> Option<&Overlay> {
        self.0.overlay.as_ref()
    }

    /// The file in which a span really stands, and where.
    pub(crate) fn resolve(&self, span: Range<usize>) -> (Self, Range<usize>) {
        let foreign = self.overlay().and_then(|overlay| overlay.resolve(&span, self.text().len()));
        foreign.unwrap_or_else(|| (self.clone(), span))
    }

    pub(crate) fn path(&self) -> &Path {
        &self.0.path
    }

    pub(crate) fn text(&self) -> &str {
        self.0.named.inner()
    }

    pub(crate) fn named(&self) -> &NamedSource<String> {
        &self.0.named
    }

    /// A path written in this file, seen from this file's folder.
    pub(crate) fn sibling(&self, path: &str) -> PathBuf {
        self.path().parent().unwrap_or(Path::new("")).join(path)
    }

    /// Line and column (in characters) of a byte, both from 1.
    pub(crate) fn line_column(&self, offset: usize) -> (usize, usize) {
        let mut offset = offset.min(self.text().len());
        while !self.text().is_char_boundary(offset) {
            offset -= 1;
        }
        let before = &self.text()[..offset];
        let line_start = before.rfind('\n').map_or(0, |at| at + 1);
        (1 + before.matches('\n').count(), 1 + before[line_start..].chars().count())
    }

    /// The dotted key of the smallest key or value around a span; empty outside all.
    pub(crate) fn key_at(&self, span: &Range<usize>) -> String {
        self.smallest(span, |_| true)
    }

    /// The dotted key of the smallest table around a span; empty in the root table.
    pub(crate) fn table_at(&self, span: &Range<usize>) -> String {
        self.smallest(span, |place| place.is_table)
    }

    fn smallest(&self, span: &Range<usize>, wanted: impl Fn(&Place) -> bool) -> String {
        let around = |place: &&Place| place.span.start <= span.start && span.end <= place.span.end && wanted(place);
        let smallest = self.0.places.iter().filter(around).min_by_key(|place| place.span.len());
        smallest.map_or_else(String::new, |place| place.key.clone())
    }

    /// The span of a dotted key's value; if it is not written, of the table in which it would stand.
    pub(crate) fn span_of(&self, key: &str) -> Range<usize> {
        if let Some(span) = self.overlay().and_then(|overlay| overlay.span_of(key, self.text().len())) {
            return span;
        }
        let written = self.0.places.iter().rev().find(|place| place.key == key);
        match (written, key.rsplit_once('.')) {
            (Some(place), _) => place.span.clone(),
            (None, Some((table, _))) => self.span_of(table),
            (None, None) => 0..0,
        }
    }

    /// The text of a span if it is short and on one line.
    pub(crate) fn excerpt(&self, span: &Range<usize>) -> String {
        let text = self.text().get(span.clone()).unwrap_or("");
        match text.lines().next() {
            None => String::new(),
            Some(line) if line.chars().count() <= EXCERPT && line.len() == text.len() => line.to_owned(),
            Some(line) => line.chars().take(EXCERPT).chain("...".chars()).collect(),
        }
    }
}

fn collect_table(prefix: &str, table: &DeTable<'_>, places: &mut Vec<Place>) {
    for (key, value) in table {
        let name = if prefix.is_empty() { key.get_ref().to_string() } else { format!("{prefix}.{}", key.get_ref()) };
        places.push(Place { span: key.span(), key: name.clone(), is_table: false });
        collect_value(name, value, places);
    }
}

fn collect_value(name: String, value: &Spanned<DeValue<'_>>, places: &mut Vec<Place>) {
    let is_table = value.get_ref().is_table();
    places.push(Place { span: value.span(), key: name.clone(), is_table });
    match value.get_ref() {
        DeValue::Table(table) => collect_table(&name, table, places),
        DeValue::Array(array) => {
            for (index, item) in array.iter().enumerate() {
                collect_value(format!("{name}[{}]", index + 1), item, places);
            }
        }
        _ => {}
    }
}
