//! Changes between two versions of a campaign's files, by file and key.

use crate::paths::NamedFile;
use serde_json::{Value, json};
use softdock_campaign::criteria::Criterion;
use softdock_campaign::difference::{KeyChange, TextChange, changed_keys};

/// Changes that a message lists.
const LISTED: usize = 30;

/// Change of a file with equal values.
const LAYOUT: &str = "only comments or layout differ";

/// How one file differs.
#[derive(Clone, Debug, PartialEq)]
pub enum FileChange {
    /// A key of a TOML file.
    Key(String, KeyChange),
    /// The file as a whole, and how.
    File(String, &'static str),
}

/// Names below `campaign/` of the two files that hold what runs are judged by.
#[derive(Clone, Copy, Debug)]
pub(crate) struct JudgedFiles<'a> {
    /// The campaign file.
    pub(crate) campaign: &'a str,
    /// The scenario file.
    pub(crate) scenario: &'a str,
}

/// Tables and keys of a campaign file by which runs are judged or reported; no run depends on them.
const JUDGED: [&str; 7] = ["title", "requirement", "metric", "compare", "outcome_map", "traces", "contact_events"];

impl FileChange {
    /// Returns whether the change affects only judgement and report, not the runs.
    pub(crate) fn leaves_runs(&self, files: JudgedFiles) -> bool {
        let (file, key) = match self {
            Self::File(_, how) => return *how == LAYOUT,
            Self::Key(file, change) => (file.as_str(), change.key.as_str()),
        };
        let table = key.split(['.', '[', ' ']).next().unwrap_or(key);
        let is_word = |ending: &str| key.ends_with(ending) && !key.contains(".set.");
        if file == files.campaign {
            return JUDGED.contains(&table)
                || key == "execution.invalid"
                || table == "variant" && is_word(".title")
                || table == "dispersion" && is_word(".source");
        }
        file == files.scenario
            && (key == "title" || key.strip_prefix("task.").is_some_and(|id| Criterion::of(id).is_some()))
    }

    /// As JSON: file, key, old and new value, or file and change.
    pub fn json(&self) -> Value {
        match self {
            Self::Key(file, change) => json!({ "file": file, "key": change.key, "old": change.old, "new": change.new }),
            Self::File(file, how) => json!({ "file": file, "change": how }),
        }
    }
}

impl std::fmt::Display for FileChange {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Key(file, change) => write!(f, "{file}: {change}"),
            Self::File(file, how) => write!(f, "{file}: {how}"),
        }
    }
}

/// The changes one a line; of many the first ones.
pub fn listed(changes: &[FileChange]) -> Vec<String> {
    let mut lines: Vec<String> = changes.iter().take(LISTED).map(ToString::to_string).collect();
    if changes.len() > LISTED {
        lines.push(format!("... and {} changes more", changes.len() - LISTED));
    }
    lines
}

/// Changes from the old to the new files; the names of the campaign files themselves may differ.
pub(crate) fn changed_files(old: (&str, &[NamedFile]), new: (&str, &[NamedFile])) -> Vec<FileChange> {
    let old_name = |name: &str| if name == new.0 { old.0.to_owned() } else { name.to_owned() };
    let mut changes = Vec::new();
    for file in new.1 {
        match old.1.iter().find(|other| other.name == old_name(&file.name)) {
            Some(before) => changed_file(before, file, &mut changes),
            None => changes.push(FileChange::File(file.name.clone(), "is not among the files of the results")),
        }
    }
    let is_gone = |file: &&NamedFile| !new.1.iter().any(|own| old_name(&own.name) == file.name);
    let gone = old.1.iter().filter(is_gone);
    changes.extend(gone.map(|file| FileChange::File(file.name.clone(), "is no longer a file of the campaign")));
    changes
}

/// Adds the changes from one state of a file to another.
fn changed_file(old: &NamedFile, new: &NamedFile, changes: &mut Vec<FileChange>) {
    let name = new.name.as_str();
    let whole = |how| FileChange::File(name.to_owned(), how);
    let (Ok(old), Ok(new)) = (old.bytes(), new.bytes()) else {
        return changes.push(whole("cannot be read"));
    };
    if old == new {
        return;
    }
    let change = match (std::str::from_utf8(&old), std::str::from_utf8(&new)) {
        (Ok(old), Ok(new)) if name.ends_with(".toml") => changed_keys(old, new),
        _ => TextChange::NotToml,
    };
    match change {
        TextChange::None => {}
        TextChange::LayoutOnly => changes.push(whole(LAYOUT)),
        TextChange::Keys(keys) => changes.extend(keys.into_iter().map(|key| FileChange::Key(name.to_owned(), key))),
        TextChange::NotToml => changes.push(whole("the file differs")),
    }
}
