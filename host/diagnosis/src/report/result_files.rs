//! Figures and files of a results folder.

use serde_json::Value;
use softdock_results::ResultFile;
use std::path::Path;

/// Figures and files of a result.
#[derive(Clone, Debug)]
pub struct FiguresAndFiles {
    /// Figures as JSON.
    pub figures: Value,
    /// Files of the results folder, including the figures.
    pub files: Vec<ResultFile>,
}

/// Returns figures as readable JSON.
pub fn readable(figures: &Value) -> String {
    serde_json::to_string_pretty(figures).expect("a value has string keys") + "\n"
}

/// Returns a file's name without its folder, so that results contain no path of the machine.
pub fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
}

/// Returns the names of files, each preceded by a blank, for a command line.
pub fn file_names<P: AsRef<Path>>(paths: &[P]) -> String {
    paths.iter().map(|path| format!(" {}", file_name(path.as_ref()))).collect()
}
