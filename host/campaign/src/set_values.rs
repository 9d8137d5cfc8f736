//! Puts values of the command line into a campaign's files: they count as written there.

use crate::key_path::{Fault, Step};
use crate::problem::{Problem, Problems};
use crate::source::settings::{SetFile, Setting, Settings};
use crate::source::{SetPlace, Source};
use crate::suggest::suggestion;
use toml_edit::{Array, DocumentMut, InlineTable, Item, Table, TableLike, Value};

/// Keys by which an item of a list is named in brackets.
const NAMES: [&str; 3] = ["name", "id", "target"];

impl Setting {
    /// The setting as a source of its own, to which messages refer.
    fn source(&self) -> Source {
        Source::of_setting(&self.text, &self.key)
    }

    fn refuse(&self, (message, remedy): Fault) -> Problem {
        Problem::at(&self.source(), 0..self.text.len(), message).value("").remedy(remedy)
    }
}

impl Settings {
    /// Puts settings together.
    ///
    /// # Errors
    /// If two of them set one key.
    pub fn new(settings: Vec<Setting>) -> Result<Self, Problems> {
        for (at, setting) in settings.iter().enumerate() {
            if settings[..at].iter().any(|other| other.key == setting.key) {
                let fault = (format!("`{}` is set twice", setting.key), "write one value for it".to_owned());
                return Err(setting.refuse(fault).into());
            }
        }
        Ok(Self(settings))
    }

    /// The file with the values that are set in it, and a comment at its end that lists them.
    pub(crate) fn apply(&self, file: SetFile, source: Source) -> Result<Source, Problems> {
        let own: Vec<&Setting> = self.0.iter().filter(|setting| setting.file == file).collect();
        // Text that is no TOML is refused by its reader, with its place.
        let is_shallow = softdock_input::toml_depth(source.text()).is_ok();
        let document = is_shallow.then(|| source.text().parse::<DocumentMut>().ok()).flatten();
        let (false, Some(mut document)) = (own.is_empty(), document) else { return Ok(source.keep_settings(self)) };
        let mut places = Vec::new();
        let mut problems = Vec::new();
        for setting in &own {
            let mut walk = Walk { setting, path: String::new(), created: Vec::new() };
            match walk.put(Spot::Table(document.as_table_mut()), &setting.steps) {
                Ok(()) => places.push((walk.path, walk.created, setting.source())),
                Err(fault) => problems.push(setting.refuse(fault)),
            }
        }
        Problems::check(problems)?;
        let mut text = document.to_string();
        if !text.ends_with('\n') {
            text.push('\n');
        }
        text.push_str("\n# Set on the command line:\n");
        own.iter().for_each(|setting| text += &format!("# --set {:?}\n", setting.text));
        let edited = Source::given(source.path().to_owned(), text);
        let places = places.into_iter().flat_map(|(path, created, setting)| {
            let value_at = setting.text().find('=').map_or(0, |at| at + 1);
            let value_at = value_at + setting.text()[value_at..].len() - setting.text()[value_at..].trim_start().len();
            let whole = SetPlace { source: setting.clone(), is_value: false, value_at };
            let mut spans: Vec<_> = edited.key_spans(&path).map(|span| (span, whole.clone())).collect();
            created.iter().for_each(|path| spans.extend(edited.key_spans(path).map(|span| (span, whole.clone()))));
            spans.push((edited.span_of(&path), SetPlace { is_value: true, ..whole }));
            spans
        });
        let places = places.collect();
        Ok(edited.with_settings(places, self))
    }
}

/// A way through a file to the place of a setting.
struct Walk<'a> {
    setting: &'a Setting,
    /// Path so far, with the numbers of items.
    path: String,
    /// Paths of the tables that the file did not have.
    created: Vec<String>,
}

/// A value inside a document.
enum Spot<'a> {
    Item(&'a mut Item),
    Value(&'a mut Value),
    Table(&'a mut Table),
}

impl<'a> Spot<'a> {
    fn table(self) -> Option<&'a mut dyn TableLike> {
        match self {
            Self::Item(item) => item.as_table_like_mut(),
            Self::Value(value) => value.as_inline_table_mut().map(|table| table as &mut dyn TableLike),
            Self::Table(table) => Some(table),
        }
    }

    /// Whether a table in it must stand in braces.
    fn is_inline(&self) -> bool {
        match self {
            Self::Item(item) => item.is_value(),
            Self::Value(_) => true,
            Self::Table(_) => false,
        }
    }
}

/// Puts a value in the place of another, with the comments and spaces around it.
fn replace(old: &mut Value, mut new: Value) {
    *new.decor_mut() = old.decor().clone();
    *old = new;
}

impl Walk<'_> {
    fn put(&mut self, spot: Spot<'_>, steps: &[Step]) -> Result<(), Fault> {
        let Some((step, rest)) = steps.split_first() else {
            let new = self.setting.value.clone();
            match spot {
                Spot::Item(Item::Value(old)) | Spot::Value(old) => replace(old, new),
                Spot::Item(item) => *item = Item::Value(new),
                Spot::Table(_) => return Err(self.fault("an item of a list has keys", "name a key of it")),
            }
            return Ok(());
        };
        match spot {
            Spot::Item(Item::ArrayOfTables(tables)) => {
                let named = |name: &str| tables.iter().position(|table| is_named(table, name));
                let known: Vec<String> = tables.iter().filter_map(|table| name_of(table)).collect();
                let at = self.item(step, tables.len(), named, &known)?;
                self.put(Spot::Table(tables.get_mut(at).expect("an item of the list")), rest)
            }
            Spot::Item(Item::Value(Value::Array(list))) | Spot::Value(Value::Array(list)) => {
                self.put_in_list(list, step, rest)
            }
            spot => self.put_in_table(spot, step, rest),
        }
    }

    fn put_in_list(&mut self, list: &mut Array, step: &Step, rest: &[Step]) -> Result<(), Fault> {
        const AXES: [&str; 3] = ["x", "y", "z"];
        let axis = match step {
            Step::Key(key) if list.len() == 3 => AXES.iter().position(|axis| axis == key).map(Step::Item),
            _ => None,
        };
        let tables = || list.iter().filter_map(Value::as_inline_table);
        let named =
            |name: &str| list.iter().position(|item| item.as_inline_table().is_some_and(|table| is_named(table, name)));
        let known: Vec<String> = tables().filter_map(|table| name_of(table)).collect();
        let at = self.item(axis.as_ref().unwrap_or(step), list.len(), named, &known)?;
        self.put(Spot::Value(list.get_mut(at).expect("an item of the list")), rest)
    }

    /// The number of an item, from 0.
    fn item(
        &mut self,
        step: &Step,
        count: usize,
        named: impl Fn(&str) -> Option<usize>,
        known: &[String],
    ) -> Result<usize, Fault> {
        let at = match step {
            Step::Item(at) if *at < count => *at,
            Step::Item(at) => {
                let what = format!("there is no item {}, the list has {count}", at + 1);
                return Err(self.fault(&what, &format!("write a number from 1 to {count}")));
            }
            Step::Named(name) => named(name).ok_or_else(|| {
                let known: Vec<&str> = known.iter().map(String::as_str).collect();
                let remedy = match known.as_slice() {
                    [] => "the items have no names: write a number from 1".to_owned(),
                    known => suggestion(name, known),
                };
                self.fault(&format!("no item has the name `{name}`"), &remedy)
            })?,
            Step::Key(key) => {
                let remedy =
                    "write the number or the name of an item in brackets, as requirement[1] or dispersion[loop_delay]";
                return Err(self.fault(&format!("`{key}` is asked of a list"), remedy));
            }
        };
        self.path += &format!("[{}]", at + 1);
        Ok(at)
    }

    fn put_in_table(&mut self, spot: Spot<'_>, step: &Step, rest: &[Step]) -> Result<(), Fault> {
        let Step::Key(key) = step else {
            return Err(self.fault("there is no list before the brackets", "remove the brackets"));
        };
        let is_inline = spot.is_inline();
        let Some(table) = spot.table() else {
            return Err(self.fault(&format!("the value before `{key}` has no keys"), "end the path there"));
        };
        if !self.path.is_empty() {
            self.path.push('.');
        }
        self.path += key;
        if table.get(key).is_none_or(Item::is_none) {
            let new = match rest.first() {
                None => Item::Value(self.setting.value.clone()),
                Some(Step::Key(_)) if is_inline => Item::Value(Value::InlineTable(InlineTable::new())),
                Some(Step::Key(_)) => Item::Table(Table::new()),
                Some(_) => return Err(self.fault("the file does not write this list", "write it in the file")),
            };
            table.insert(key, new);
            if rest.is_empty() {
                return Ok(());
            }
            self.created.push(self.path.clone());
        }
        let inside = table.get_mut(key).expect("a key of the table");
        self.put(Spot::Item(inside), rest)
    }

    fn fault(&self, what: &str, remedy: &str) -> Fault {
        (format!("`{}`: {what}", self.setting.key), remedy.to_owned())
    }
}

/// Whether an item of a list has a name.
fn is_named(table: &dyn TableLike, name: &str) -> bool {
    NAMES.iter().any(|key| table.get(key).and_then(Item::as_str) == Some(name))
}

/// The name of an item of a list.
fn name_of(table: &dyn TableLike) -> Option<String> {
    NAMES.iter().find_map(|key| table.get(key)?.as_str()).map(str::to_owned)
}

#[cfg(test)]
mod tests;
