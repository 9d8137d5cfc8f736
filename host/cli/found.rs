//! What `identify` and `diagnose` share: the files that they leave, the command that repeats them, their errors.

use crate::words::refuse;
use miette::{IntoDiagnostic, Report};
use softdock_diagnosis::Error;
use softdock_results::write_file;
use std::path::{Path, PathBuf};

/// The files that were written, one a line.
pub(crate) fn listed(folder: &Path, files: &[(&str, String)]) -> String {
    files.iter().map(|(name, _)| folder.join(name).display().to_string()).collect::<Vec<_>>().join("\n")
}

/// Writes files into a folder, which is made if it is not there.
pub(crate) fn write(folder: &Path, files: &[(&str, String)]) -> miette::Result<()> {
    std::fs::create_dir_all(folder)
        .map_err(|error| refuse(format!("{}: {error}", folder.display()), "name a folder that can be written"))?;
    files.iter().try_for_each(|(name, text)| write_file(&folder.join(name), text.as_bytes())).into_diagnostic()
}

/// An error with its remedy.
pub(crate) fn told(error: Error) -> Report {
    refuse(&error, error.remedy())
}

pub(crate) fn paths(paths: &[PathBuf]) -> Vec<&Path> {
    paths.iter().map(PathBuf::as_path).collect()
}

/// A file's name without its folder: no path of the machine stands in a result.
pub(crate) fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
}

/// The names of files as a command line goes on with them.
pub(crate) fn file_names(paths: &[PathBuf]) -> String {
    paths.iter().map(|path| format!(" {}", file_name(path))).collect()
}
