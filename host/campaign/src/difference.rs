//! Which keys of a TOML file have changed, whatever its comments, its layout and the order of its keys.

use std::collections::BTreeSet;
use toml::{Table, Value};

/// Keys by which an entry of an array of tables is known, the first that it has.
const NAMES: [&str; 5] = ["id", "name", "target", "targets", "variable"];

/// Longest value that is repeated in full, in characters.
const LONGEST: usize = 80;

/// One key whose value differs between two states of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KeyChange {
    /// Dotted key; entries count from 1 and show their id or target (`requirement[2 SMOKE-020].at_most`).
    pub key: String,
    /// The value in the first state as TOML, shortened if long; none if the key is not there.
    pub old: Option<String>,
    /// The value in the second state, likewise.
    pub new: Option<String>,
}

impl std::fmt::Display for KeyChange {
    /// `runs: 64 -> 128`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let shown = |value: &Option<String>| value.clone().unwrap_or_else(|| "(not there)".to_owned());
        write!(f, "{}: {} -> {}", self.key, shown(&self.old), shown(&self.new))
    }
}

/// How two texts of one file differ.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum TextChange {
    /// They are the same.
    None,
    /// Both are TOML with the same values: only comments, layout or the order of keys differ.
    LayoutOnly,
    /// These keys differ.
    Keys(Vec<KeyChange>),
    /// They differ, and one of them is not TOML.
    NotToml,
}

/// Compares two states of a file by the keys of its TOML.
///
/// Entries of an array of tables are matched by their id, name, target or variable where each entry has one of its own,
/// else by their place. Numbers of equal value are equal, whether whole or not.
pub fn changed_keys(old: &str, new: &str) -> TextChange {
    if old == new {
        return TextChange::None;
    }
    let parse = |text: &str| softdock_input::toml_depth(text).ok().and_then(|_| text.parse::<Table>().ok());
    let (Some(old), Some(new)) = (parse(old), parse(new)) else { return TextChange::NotToml };
    let mut changes = Vec::new();
    tables("", &old, &new, &mut changes);
    if changes.is_empty() { TextChange::LayoutOnly } else { TextChange::Keys(changes) }
}

fn tables(prefix: &str, old: &Table, new: &Table, changes: &mut Vec<KeyChange>) {
    let added = new.keys().filter(|key| !old.contains_key(*key));
    for key in old.keys().chain(added) {
        let path = if prefix.is_empty() { key.clone() } else { format!("{prefix}.{key}") };
        values(path, old.get(key), new.get(key), changes);
    }
}

fn values(key: String, old: Option<&Value>, new: Option<&Value>, changes: &mut Vec<KeyChange>) {
    match (old, new) {
        (Some(Value::Table(old)), Some(Value::Table(new))) => tables(&key, old, new, changes),
        (Some(Value::Array(old)), Some(Value::Array(new))) if are_tables(old) && are_tables(new) => {
            entries(&key, old, new, changes);
        }
        // A whole array of tables that comes or goes is listed entry by entry.
        (Some(Value::Array(old)), None) if are_tables(old) => entries(&key, old, &[], changes),
        (None, Some(Value::Array(new))) if are_tables(new) => entries(&key, &[], new, changes),
        (Some(old), Some(new)) if equal(old, new) => {}
        (old, new) => changes.push(KeyChange { key, old: old.map(shown), new: new.map(shown) }),
    }
}

fn are_tables(array: &[Value]) -> bool {
    !array.is_empty() && array.iter().all(Value::is_table)
}

/// Entries of an array of tables.
fn entries(key: &str, old: &[Value], new: &[Value], changes: &mut Vec<KeyChange>) {
    let (own, other) = (names(old), names(new));
    let (Some(own), Some(other)) = (own, other) else {
        for index in 0..old.len().max(new.len()) {
            values(format!("{key}[{}]", index + 1), old.get(index), new.get(index), changes);
        }
        return;
    };
    for (index, name) in own.iter().enumerate() {
        let place = other.iter().position(|other| other == name);
        values(format!("{key}[{} {name}]", index + 1), Some(&old[index]), place.map(|place| &new[place]), changes);
    }
    for (index, name) in other.iter().enumerate().filter(|(_, name)| !own.contains(name)) {
        values(format!("{key}[{} {name}]", index + 1), None, Some(&new[index]), changes);
    }
    let shared = |names: &[String], others: &[String]| {
        names.iter().filter(|name| others.contains(name)).cloned().collect::<Vec<_>>()
    };
    let (before, after) = (shared(&own, &other), shared(&other, &own));
    if before != after {
        let (old, new) = (Some(before.join(", ")), Some(after.join(", ")));
        changes.push(KeyChange { key: format!("{key} (order of the entries)"), old, new });
    }
}

/// The name of each entry; `None` if one has no name, or two have the same.
fn names(array: &[Value]) -> Option<Vec<String>> {
    let name = |entry: &Value| {
        NAMES.iter().find_map(|key| match entry.get(key)? {
            Value::String(text) => Some(text.clone()),
            Value::Array(list) => {
                Some(list.iter().map(|item| item.as_str().unwrap_or("?")).collect::<Vec<_>>().join("+"))
            }
            _ => None,
        })
    };
    let names: Vec<String> = array.iter().map(name).collect::<Option<_>>()?;
    let different: BTreeSet<&String> = names.iter().collect();
    (different.len() == names.len()).then_some(names)
}

/// Equal values: a number is the same whether it is written as a whole number or not.
fn equal(old: &Value, new: &Value) -> bool {
    let number = |value: &Value| value.as_float().or(value.as_integer().map(|whole| whole as f64));
    match (old, new) {
        (Value::Array(old), Value::Array(new)) => {
            old.len() == new.len() && old.iter().zip(new).all(|(old, new)| equal(old, new))
        }
        (Value::Table(old), Value::Table(new)) => {
            old.len() == new.len() && old.iter().all(|(key, old)| new.get(key).is_some_and(|new| equal(old, new)))
        }
        (Value::Integer(old), Value::Integer(new)) => old == new,
        _ => match (number(old), number(new)) {
            (Some(old), Some(new)) => old == new || old.is_nan() && new.is_nan(),
            _ => old == new,
        },
    }
}

/// A value as one line of TOML.
fn shown(value: &Value) -> String {
    let text = value.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
    match text.char_indices().nth(LONGEST) {
        None => text,
        Some((end, _)) => format!("{}...", &text[..end]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(old: &str, new: &str) -> Vec<String> {
        match changed_keys(old, new) {
            TextChange::Keys(changes) => changes.iter().map(ToString::to_string).collect(),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn comments_layout_and_order_of_keys_are_no_change() {
        let (old, new) = ("a = 1\nb = { c = \"x\", d = 2.0 }\n", "# a comment\nb.d = 2\nb.c = 'x'\n\na   = 1\n");
        assert_eq!(changed_keys(old, new), TextChange::LayoutOnly);
        assert_eq!(changed_keys(old, old), TextChange::None);
        assert_eq!(changed_keys(old, "a = "), TextChange::NotToml);
    }

    #[test]
    fn a_changed_an_added_and_a_removed_key_are_named_with_both_values() {
        let (old, new) = ("runs = 64\n[e]\nparity = \"25 %\"\n", "runs = 128\n[e]\nshard_runs = 8\n");
        let expected = ["runs: 64 -> 128", "e.parity: \"25 %\" -> (not there)", "e.shard_runs: (not there) -> 8"];
        assert_eq!(lines(old, new), expected);
    }

    #[test]
    fn entries_are_matched_by_their_names_and_count_from_one() {
        let old = "[[r]]\nid = \"A\"\nlimit = \"1 N\"\n[[r]]\nid = \"B\"\nlimit = \"2 N\"\n";
        let new =
            "[[r]]\nid = \"C\"\nlimit = 3\n[[r]]\nid = \"A\"\nlimit = \"1 N\"\n[[r]]\nid = \"B\"\nlimit = \"4 N\"\n";
        assert_eq!(
            lines(old, new),
            ["r[2 B].limit: \"2 N\" -> \"4 N\"", "r[1 C]: (not there) -> { id = \"C\", limit = 3 }"]
        );
        let swapped = "[[r]]\nid = \"B\"\nlimit = \"2 N\"\n[[r]]\nid = \"A\"\nlimit = \"1 N\"\n";
        assert_eq!(lines(old, swapped), ["r (order of the entries): A, B -> B, A"]);
    }

    #[test]
    fn entries_without_names_of_their_own_are_matched_by_their_place() {
        let old = "[[d]]\ntarget = \"a\"\nv = 1\n[[d]]\ntarget = \"a\"\nv = 2\n";
        let new = "[[d]]\ntarget = \"a\"\nv = 1\n[[d]]\ntarget = \"a\"\nv = 3\n";
        assert_eq!(lines(old, new), ["d[2].v: 2 -> 3"]);
        let lists = ("m = [[1, 0], [0, 1]]", "m = [[1, 0.5], [0.5, 1]]");
        assert_eq!(lines(lists.0, lists.1), ["m: [[1, 0], [0, 1]] -> [[1, 0.5], [0.5, 1]]"]);
    }
}
