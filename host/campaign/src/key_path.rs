//! Paths of keys in a file: `contact.pair[2].stiffness`, `part_b.solid[bumper].position.y`.

/// What a target that is a key of the scenario begins with.
pub(crate) const PREFIX: &str = "scenario.";

/// A step from a value of the file to one inside it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Step {
    /// A key of a table.
    Key(String),
    /// An item of a list, counted from 0.
    Item(usize),
    /// All items of a list with this `name`.
    Named(String),
}

/// What is wrong with a path, and what to do about it.
pub(crate) type Fault = (String, String);

/// A path as steps: `scenario.contact.pair[2].stiffness`, `scenario.part_b.solid[bumper].position.y`.
pub(crate) fn steps(path: &str) -> Result<Vec<Step>, Fault> {
    let malformed = || {
        let remedy = "write keys with points between them, items of lists by number or name: \
                      scenario.contact.pair[1].stiffness, scenario.part_b.solid[bumper].radius";
        (format!("`{path}` is no path of a key"), remedy.to_owned())
    };
    let mut steps = Vec::new();
    for part in path.strip_prefix(PREFIX).unwrap_or(path).split('.') {
        let (key, items) = part.split_at(part.find('[').unwrap_or(part.len()));
        if key.is_empty() {
            return Err(malformed());
        }
        steps.push(Step::Key(key.to_owned()));
        for item in items.split_inclusive(']') {
            let inner = item.strip_prefix('[').and_then(|item| item.strip_suffix(']')).ok_or_else(malformed)?;
            steps.push(match inner.parse::<usize>() {
                Ok(0) => return Err((format!("`{path}` has an item 0"), "count the items of a list from 1".into())),
                Ok(number) => Step::Item(number - 1),
                Err(_) if inner.is_empty() => return Err(malformed()),
                Err(_) => Step::Named(inner.to_owned()),
            });
        }
    }
    Ok(steps)
}
