//! Command lines that repeat a piece of work; results state them.

use crate::report::result_files::{file_name, file_names};
use std::fmt::Display;
use std::path::Path;

/// A command line under construction. Paths are reduced to file names: no path of the machine stands in a result.
#[derive(Clone, Debug)]
pub struct CommandLine(String);

impl CommandLine {
    /// Starts with the command and its arguments without options.
    pub fn new<P: AsRef<Path>>(command: &str, files: &[P]) -> Self {
        Self(format!("softdock {command}{}", file_names(files)))
    }

    /// Adds files without an option.
    #[must_use]
    pub fn more<P: AsRef<Path>>(self, files: &[P]) -> Self {
        Self(self.0 + &file_names(files))
    }

    /// Adds an option with its value, if there is one.
    #[must_use]
    pub fn option(self, name: &str, value: Option<impl Display>) -> Self {
        Self(value.map_or(self.0.clone(), |value| format!("{} --{name} {value}", self.0)))
    }

    /// Adds an option with a file, if there is one.
    #[must_use]
    pub fn file(self, name: &str, path: Option<&Path>) -> Self {
        self.option(name, path.map(file_name))
    }

    /// Adds an option with several files, if there are any.
    #[must_use]
    pub fn files<P: AsRef<Path>>(self, name: &str, paths: &[P]) -> Self {
        if paths.is_empty() { self } else { Self(format!("{} --{name}{}", self.0, file_names(paths))) }
    }

    /// Adds an option without a value, if it is set.
    #[must_use]
    pub fn flag(self, name: &str, is_set: bool) -> Self {
        if is_set { Self(format!("{} --{name}", self.0)) } else { self }
    }

    /// Returns the whole line.
    pub fn text(self) -> String {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn command_line_states_file_names_and_set_options_only() {
        let line = CommandLine::new("diagnose", &["/a/model.toml", "b/log_1.csv"])
            .files("holdout", &[] as &[&str])
            .file("marks", Some(Path::new("/c/marks.csv")))
            .option("weight", None::<f64>)
            .option("cutoff", Some(10.0))
            .flag("half-step", true)
            .flag("design", false);
        assert_eq!(line.text(), "softdock diagnose model.toml log_1.csv --marks marks.csv --cutoff 10 --half-step");
    }
}
