//! A file's text with its path and the dotted key of every place in it.

use miette::NamedSource;
use overlay::Overlay;
use settings::{SetFile, Settings};
use softdock_input::toml_depth;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

pub(crate) mod overlay;
pub(crate) mod settings;

/// What messages name in the place of a file for a value of the command line.
const SETTING: &str = "--set";

/// Longest value that a message repeats in full.
const EXCERPT: usize = 60;

/// A text file; cheap to clone.
#[derive(Clone, Debug)]
pub(crate) struct Source(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    path: PathBuf,
    named: NamedSource<String>,
    places: Vec<Place>,
    /// Bytes at which lines begin, ascending.
    line_starts: Vec<usize>,
    overlay: Option<Overlay>,
    /// What the command line has set in this file.
    set: Vec<(Range<usize>, SetPlace)>,
    /// What the command line sets in this file and in those that it names.
    settings: Settings,
    /// The text is the caller's: no file has it.
    is_given: bool,
}

/// Where a value that the command line has set stands there.
#[derive(Clone, Debug)]
pub(crate) struct SetPlace {
    /// The setting: `KEY=VALUE`.
    pub(crate) source: Source,
    /// Whether the value is meant, not the key.
    pub(crate) is_value: bool,
    /// First byte of the value in the setting.
    pub(crate) value_at: usize,
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
    /// A source from a text; keys are found if it is TOML.
    pub(crate) fn new(path: PathBuf, text: String) -> Self {
        let mut places = Vec::new();
        if path.extension().is_some_and(|e| e == "toml")
            && toml_depth(&text).is_ok()
            && let Ok(table) = DeTable::parse(&text)
        {
            collect_table("", table.get_ref(), &mut places);
        }
        let line_starts = std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect();
        let named = NamedSource::new(path.display().to_string(), text);
        let (set, settings) = Default::default();
        Self(Arc::new(Inner { path, named, places, line_starts, overlay: None, set, settings, is_given: false }))
    }

    /// A text of the caller in the place of a file.
    pub(crate) fn given(path: PathBuf, text: String) -> Self {
        let inner = Arc::into_inner(Self::new(path, text).0).expect("nobody else has it yet");
        Self(Arc::new(Inner { is_given: true, ..inner }))
    }

    /// A setting of the command line, with the key that it sets.
    pub(crate) fn of_setting(text: &str, key: &str) -> Self {
        let (path, places) =
            (PathBuf::from(SETTING), vec![Place { span: 0..text.len(), key: key.to_owned(), is_table: false }]);
        let named = NamedSource::new(SETTING, text.to_owned());
        let (set, settings) = Default::default();
        Self(Arc::new(Inner {
            path,
            named,
            places,
            line_starts: vec![0],
            overlay: None,
            set,
            settings,
            is_given: false,
        }))
    }

    /// Whether this is a setting of the command line for the campaign file itself.
    pub(crate) fn is_setting_of_campaign(&self) -> bool {
        self.path() == Path::new(SETTING) && SetFile::of(self.text()).0 == SetFile::Campaign
    }

    /// The file with the places of the values that the command line has set in it.
    pub(crate) fn with_settings(self, set: Vec<(Range<usize>, SetPlace)>, settings: &Settings) -> Self {
        let inner = Arc::into_inner(self.0).expect("nobody else has it yet");
        Self(Arc::new(Inner { set, settings: settings.clone(), ..inner }))
    }

    /// The unchanged file with the settings of those that it names.
    pub(crate) fn keep_settings(self, settings: &Settings) -> Self {
        if self.0.settings.is_empty() && settings.is_empty() { self } else { self.with_settings(Vec::new(), settings) }
    }

    /// What the command line sets in this file and in those that it names.
    pub(crate) fn settings(&self) -> &Settings {
        &self.0.settings
    }

    /// Whether the text is not that of the file.
    pub(crate) fn is_edited(&self) -> bool {
        self.0.is_given || self.is_set()
    }

    /// Whether the command line has set a value in this file.
    pub(crate) fn is_set(&self) -> bool {
        !self.0.set.is_empty()
    }

    /// Returns the file with the keys of an overlay replaced.
    pub(crate) fn with(&self, overlay: Overlay) -> Self {
        let plain = Self::new(self.path().to_owned(), self.text().to_owned());
        let inner = Arc::into_inner(plain.0).expect("nobody else has it yet");
        let (set, settings) = (self.0.set.clone(), self.0.settings.clone());
        Self(Arc::new(Inner { overlay: Some(overlay), set, settings, ..inner }))
    }

    /// What replaces keys of this file.
    pub(crate) fn overlay(&self) -> Option<&Overlay> {
        self.0.overlay.as_ref()
    }

    /// The file in which a span really stands, and where.
    pub(crate) fn resolve(&self, span: Range<usize>) -> (Self, Range<usize>) {
        let foreign = self.overlay().and_then(|overlay| overlay.resolve(&span, self.text().len()));
        let (source, span) = foreign.unwrap_or_else(|| (self.clone(), span));
        source.set_at(&span).unwrap_or((source, span))
    }

    /// The place on the command line of a span inside a value that was set there.
    fn set_at(&self, span: &Range<usize>) -> Option<(Self, Range<usize>)> {
        let around = |(own, _): &&(Range<usize>, SetPlace)| own.start <= span.start && span.end <= own.end;
        let (_, place) = self.0.set.iter().filter(around).min_by_key(|(own, _)| own.len())?;
        let start = if place.is_value { place.value_at } else { 0 };
        Some((place.source.clone(), start..place.source.text().trim_end().len()))
    }

    /// The spans at which a dotted key is written, without its value.
    pub(crate) fn key_spans(&self, key: &str) -> impl Iterator<Item = Range<usize>> {
        let value = self.span_of(key);
        let written = self.0.places.iter().filter(move |place| place.key == key && place.span != value);
        written.map(|place| place.span.clone())
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
        let line = self.0.line_starts.partition_point(|start| *start <= offset);
        (line, 1 + self.text()[self.0.line_starts[line - 1]..offset].chars().count())
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
