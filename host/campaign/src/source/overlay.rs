//! A scenario in which a campaign's variant replaces keys: both texts are read as one, every place keeps its file.
//!
//! The campaign's places follow those of the scenario: its text is parsed behind as many line breaks as the scenario has
//! bytes, so that the spans of both lie on one axis and the scenario's own reader checks either.

use super::Source;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Replaced keys of a scenario, and the file with their values.
#[derive(Clone, Debug)]
pub(crate) struct Overlay {
    /// The campaign file.
    source: Source,
    /// Which variant of it, from 0; none of an effects file, which is one itself.
    variant: Option<usize>,
    /// The dotted keys, of the scenario.
    keys: Vec<String>,
}

impl Overlay {
    pub(crate) fn new(source: &Source, variant: usize, keys: Vec<String>) -> Self {
        Self { source: source.clone(), variant: Some(variant), keys }
    }

    /// The table `[set]` of an effects file.
    pub(crate) fn of_effects(source: &Source, keys: Vec<String>) -> Self {
        Self { source: source.clone(), variant: None, keys }
    }

    /// The campaign's text, to be parsed: behind a scenario of so many bytes.
    pub(crate) fn text_behind(&self, length: usize) -> String {
        "\n".repeat(length + 1) + self.source.text()
    }

    /// Where a span on the common axis stands in the campaign file, if it does.
    pub(crate) fn resolve(&self, span: &Range<usize>, length: usize) -> Option<(Source, Range<usize>)> {
        let first = length + 1;
        (span.start >= first).then(|| (self.source.clone(), span.start - first..span.end.max(first) - first))
    }

    /// The span, on the common axis, of a scenario's key that is replaced here.
    pub(crate) fn span_of(&self, key: &str, length: usize) -> Option<Range<usize>> {
        let replaced =
            |own: &&String| key.strip_prefix(own.as_str()).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'));
        self.keys.iter().find(replaced)?;
        let table = self.variant.map_or_else(String::new, |variant| format!("variant[{}].", variant + 1));
        let span = self.source.span_of(&format!("{table}set.{key}"));
        Some(span.start + length + 1..span.end + length + 1)
    }

    /// Puts the variant's values, found in the parsed `campaign`, in their places in the parsed `scenario`.
    ///
    /// A key whose table is missing gets one; a key inside something that is no table replaces it, for the reader to
    /// refuse.
    pub(crate) fn lay_over<'a>(&self, scenario: &mut DeTable<'a>, mut campaign: DeTable<'a>) {
        let Some(DeValue::Table(set)) = self.table(&mut campaign) else { return };
        for (key, value) in std::mem::take(set) {
            let span = key.span();
            let path: Vec<String> = key.get_ref().split('.').map(str::to_owned).collect();
            place(scenario, &path, span, value);
        }
    }
}

impl Overlay {
    /// The table with the replacements.
    fn table<'a, 'b>(&self, file: &'b mut DeTable<'a>) -> Option<&'b mut DeValue<'a>> {
        let Some(variant) = self.variant else {
            return file.get_mut("set").map(Spanned::get_mut);
        };
        let Some(DeValue::Array(variants)) = file.get_mut("variant").map(Spanned::get_mut) else { return None };
        let Some(DeValue::Table(variant)) = variants.get_mut(variant).map(Spanned::get_mut) else { return None };
        variant.get_mut("set").map(Spanned::get_mut)
    }
}

/// Puts a value at a path, whose keys were written at `span`.
fn place<'a>(table: &mut DeTable<'a>, path: &[String], span: Range<usize>, value: Spanned<DeValue<'a>>) {
    let name = || Spanned::new(span.clone(), path[0].clone().into());
    if let [last] = path {
        table.remove(last.as_str());
        table.insert(name(), value);
        return;
    }
    let holds_table = table.get(path[0].as_str()).is_some_and(|held| held.get_ref().is_table());
    if !holds_table {
        table.remove(path[0].as_str());
        table.insert(name(), Spanned::new(span.clone(), DeValue::Table(DeTable::new())));
    }
    if let Some(DeValue::Table(inner)) = table.get_mut(path[0].as_str()).map(Spanned::get_mut) {
        place(inner, &path[1..], span, value);
    }
}
