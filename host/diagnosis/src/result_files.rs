//! Figures and files that a piece of work leaves in its results folder.

use serde_json::Value;
use softdock_results::ResultFile;
use std::path::Path;

/// Figures and files of a piece of work.
#[derive(Clone, Debug)]
pub struct FiguresAndFiles {
    /// The figures, for programs.
    pub figures: Value,
    /// The files of the results folder, the figures among them.
    pub files: Vec<ResultFile>,
}

/// Figures as readable JSON.
pub(crate) fn readable(figures: &Value) -> String {
    serde_json::to_string_pretty(figures).expect("a value has string keys") + "\n"
}

/// A file's name without its folder: no path of the machine stands in a result.
pub fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
}

/// The names of files, each behind a blank, as a command line continues with them.
pub fn file_names<P: AsRef<Path>>(paths: &[P]) -> String {
    paths.iter().map(|path| format!(" {}", file_name(path.as_ref()))).collect()
}
