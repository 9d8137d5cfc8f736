//! Errors of the library crates as the command reports them, and the files that it lists.

use crate::words::{explain, refuse};
use miette::{IntoDiagnostic, Report};
use softdock_results::{ResultFile, write_files};
use softdock_session::SessionError;
use std::path::{Path, PathBuf};

/// An error of a session with its remedy; of input files, all problems with their places.
pub(crate) fn session_failed(error: SessionError) -> Report {
    let remedy = error.remedy().map(str::to_owned);
    match (error, remedy) {
        (SessionError::Files(problems), _) => explain(problems),
        (error, Some(remedy)) => refuse(error, remedy),
        (error, None) => Err::<(), _>(error).into_diagnostic().expect_err("an error"),
    }
}

/// An error of a diagnosis or an identification with its remedy.
pub(crate) fn diagnosis_failed(error: softdock_diagnosis::DiagnosisError) -> Report {
    refuse(&error, error.remedy())
}

/// An error of the gauntlet with its remedy.
pub(crate) fn gauntlet_failed(error: softdock_bench::GauntletError) -> Report {
    refuse(&error, error.remedy())
}

/// Writes files into a folder, which is made if needed; gives their paths.
pub(crate) fn write(folder: &Path, files: &[ResultFile]) -> miette::Result<Vec<PathBuf>> {
    write_files(folder, files).map_err(|error| refuse(error, "name a folder that can be written"))
}

/// Paths, one a line.
pub(crate) fn listed(paths: &[PathBuf]) -> String {
    paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join("\n")
}

pub(crate) fn paths(paths: &[PathBuf]) -> Vec<&Path> {
    paths.iter().map(PathBuf::as_path).collect()
}
