//! Text of a commented TOML file.

use softdock_campaign::FILL_IN;

/// Longest line of a comment.
const WIDTH: usize = 118;

/// A TOML file under construction.
#[derive(Clone, Debug, Default)]
pub(crate) struct TomlText {
    pub(crate) text: String,
}

impl TomlText {
    /// Adds a comment, wrapped.
    pub(crate) fn comment(&mut self, text: &str) {
        let mut line = String::from("#");
        for word in text.split_whitespace() {
            if line.len() + 1 + word.len() > WIDTH && line.len() > 1 {
                self.push(&line);
                line = "#".to_owned();
            }
            line = format!("{line} {word}");
        }
        self.push(&line);
    }

    /// Adds a comment on the lines that follow, not on the next key alone.
    pub(crate) fn remark(&mut self, text: &str) {
        self.comment(text);
        self.push("");
    }

    /// Adds a line as it is.
    pub(crate) fn push(&mut self, line: &str) {
        self.text += line;
        self.text.push('\n');
    }

    /// Starts a table.
    pub(crate) fn table(&mut self, name: &str) {
        self.push(&format!("\n[{name}]"));
    }

    /// Adds a key with the figure on which its value is based.
    pub(crate) fn key(&mut self, key: &str, value: &str, basis: &str) {
        if !basis.is_empty() {
            self.comment(basis);
        }
        self.push(&format!("{key} = {value}"));
    }

    /// Adds a key with a number and its unit.
    pub(crate) fn quantity(&mut self, key: &str, value: f64, unit: &str, basis: &str) {
        let number = crate::figures::short(value);
        let value = if unit.is_empty() { number } else { format!("\"{number} {unit}\"") };
        self.key(key, &value, basis);
    }

    /// Adds a key whose value the log does not show.
    pub(crate) fn open(&mut self, key: &str, unit: &str, meaning: &str) {
        let unit = if unit.is_empty() { "pure number".to_owned() } else { format!("in {unit}") };
        self.key(key, &quoted(FILL_IN), &format!("{meaning}; {unit}"));
    }

    /// Adds an optional key as a comment.
    pub(crate) fn optional(&mut self, key: &str, example: &str, meaning: &str) {
        self.push(&format!("# {key} = \"{example}\"   # {meaning}"));
    }

    /// Adds a line of `[log]`.
    pub(crate) fn column(&mut self, signal: &str, column: &str, unit: &str, more: &str, basis: &str) {
        if !basis.is_empty() {
            self.comment(basis);
        }
        let column = quoted(column);
        self.push(&format!("\"{signal}\" = {{ column = {column}, unit = \"{unit}\"{more} }}"));
    }

    /// Keys that are open, with line and meaning.
    pub(crate) fn open_keys(&self) -> Vec<(usize, String, String)> {
        let mut meaning = String::new();
        let mut found = Vec::new();
        for (number, line) in self.text.lines().enumerate() {
            if let Some(comment) = line.strip_prefix("# ") {
                meaning = if meaning.is_empty() { comment.to_owned() } else { format!("{meaning} {comment}") };
                continue;
            }
            if line.contains(&quoted(FILL_IN)) {
                let key = line.split('=').next().unwrap_or_default().trim().trim_matches('"').to_owned();
                found.push((number + 1, key, std::mem::take(&mut meaning)));
            }
            meaning.clear();
        }
        found
    }
}

/// A TOML string.
pub(crate) fn quoted(text: &str) -> String {
    let escaped: String = text
        .chars()
        .map(|c| match c {
            '"' => "\\\"".to_owned(),
            '\\' => "\\\\".to_owned(),
            c if c.is_control() => format!("\\u{:04X}", c as u32),
            c => c.to_string(),
        })
        .collect();
    format!("\"{escaped}\"")
}
