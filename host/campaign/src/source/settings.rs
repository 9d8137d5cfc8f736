//! Values of the command line for keys of a campaign's files.

use crate::key_path::{PREFIX, Step, steps};
use std::str::FromStr;
use toml_edit::Value;

/// What a key of the facility file begins with.
const STATION: &str = "station.";

/// A file of a campaign in which keys can be set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SetFile {
    Campaign,
    Scenario,
    Station,
}

impl SetFile {
    /// The file of a key, and its path there.
    pub(crate) fn of(key: &str) -> (Self, &str) {
        match (key.strip_prefix(PREFIX), key.strip_prefix(STATION)) {
            (Some(path), _) => (Self::Scenario, path),
            (_, Some(path)) => (Self::Station, path),
            _ => (Self::Campaign, key),
        }
    }
}

/// A key of a campaign's files with a value in place of the written one: `runs=200`, `scenario.contact.friction=0.3`.
#[derive(Clone, Debug)]
pub struct Setting {
    /// As given: key, `=`, value.
    pub(crate) text: String,
    /// Key, with the prefix of its file.
    pub(crate) key: String,
    pub(crate) file: SetFile,
    pub(crate) steps: Vec<Step>,
    pub(crate) value: Value,
}

impl FromStr for Setting {
    type Err = String;

    /// Reads `KEY=VALUE`; a value that is no TOML is a text, so that `8 ms` and `cpu` need no quotes of their own.
    fn from_str(text: &str) -> Result<Self, String> {
        let malformed = || "write KEY=VALUE, such as runs=200 or scenario.contact.friction=0.3".to_owned();
        let (key, value) = text.split_once('=').ok_or_else(malformed)?;
        let (key, value) = (key.trim(), value.trim());
        if key.is_empty() || value.is_empty() {
            return Err(malformed());
        }
        let (file, path) = SetFile::of(key);
        let steps = steps(path).map_err(|(message, remedy)| format!("{message}: {remedy}"))?;
        let value = value.parse::<Value>().unwrap_or_else(|_| Value::from(value));
        Ok(Self { text: text.to_owned(), key: key.to_owned(), file, steps, value })
    }
}

/// All values that are set.
#[derive(Clone, Debug, Default)]
pub struct Settings(pub(crate) Vec<Setting>);

impl Settings {
    /// Whether nothing is set.
    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}
