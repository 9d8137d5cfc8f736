//! Errors of recordings, diagnosis and identification.

use std::path::{Path, PathBuf};

/// Result with this crate's error.
pub(crate) type Result<T> = std::result::Result<T, DiagnosisError>;

/// Error of a recording, a diagnosis or an identification.
#[derive(Debug, thiserror::Error)]
pub enum DiagnosisError {
    /// A recording is damaged or does not fit the model file's `[log]`.
    #[error("{}{}: {what}", file.display(), line.map_or(String::new(), |line| format!(":{line}")))]
    Log {
        /// The recording.
        file: PathBuf,
        /// Line number, from 1, if known.
        line: Option<usize>,
        /// What is wrong.
        what: String,
        /// What to do.
        remedy: String,
    },
    /// The recordings are readable but insufficient for the task.
    #[error("{what}")]
    Unfit {
        /// What is wrong.
        what: String,
        /// What to do.
        remedy: String,
    },
    /// A file could not be written or read.
    #[error(transparent)]
    File(#[from] softdock_results::ResultsError),
    /// The page could not be drawn.
    #[error(transparent)]
    Page(#[from] softdock_analysis::AnalysisError),
}

impl DiagnosisError {
    /// Returns whether the error is a failure to write an output.
    pub fn is_write_failure(&self) -> bool {
        match self {
            Self::File(error) => error.is_write_failure(),
            Self::Page(error) => error.is_write_failure(),
            Self::Log { .. } | Self::Unfit { .. } => false,
        }
    }

    /// Returns the action that resolves the error.
    pub fn remedy(&self) -> &str {
        match self {
            Self::Log { remedy, .. } | Self::Unfit { remedy, .. } => remedy,
            Self::File(error) => error.remedy(),
            Self::Page(_) => "check the path and its permissions",
        }
    }

    /// Builds the error of a recording that cannot be read, for `map_err`.
    pub fn input(error: softdock_input::InputError) -> Self {
        Self::log(error.path(), error.line(), error.what(), error.remedy())
    }

    /// Builds the error of a damaged recording: file, line number from 1 if known, what is wrong, what to do.
    pub fn log(file: &Path, line: Option<usize>, what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Log { file: file.to_owned(), line, what: what.into(), remedy: remedy.into() }
    }

    /// Builds the error of recordings that are insufficient: what is wrong, what to do.
    pub fn unfit(what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Unfit { what: what.into(), remedy: remedy.into() }
    }
}
