//! What can go wrong with a recording or its identification.

use std::path::{Path, PathBuf};

/// Result of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// A recording that cannot be used, or a robot that cannot be identified from it.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A recording is damaged or does not fit the model file's `[log]`.
    #[error("{}{}: {what}", file.display(), line.map_or(String::new(), |line| format!(":{line}")))]
    Log {
        /// The recording.
        file: PathBuf,
        /// Line, from 1, if one can be told.
        line: Option<usize>,
        /// What is wrong.
        what: String,
        /// What to do.
        remedy: String,
    },
    /// The recordings are readable but do not determine what is asked.
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

impl Error {
    /// Whether an output could not be written: a matter of the disk, not of the input.
    pub fn is_write_failure(&self) -> bool {
        match self {
            Self::File(error) => error.is_write_failure(),
            Self::Page(error) => error.is_write_failure(),
            Self::Log { .. } | Self::Unfit { .. } => false,
        }
    }

    /// What to do about it.
    pub fn remedy(&self) -> &str {
        match self {
            Self::Log { remedy, .. } | Self::Unfit { remedy, .. } => remedy,
            Self::File(error) => error.remedy(),
            Self::Page(_) => "check the path and its permissions",
        }
    }

    /// For `map_err` on the input of a recording.
    pub(crate) fn input(error: softdock_input::InputError) -> Self {
        Self::log(error.path(), error.line(), error.what(), error.remedy())
    }

    pub(crate) fn log(file: &Path, line: Option<usize>, what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Log { file: file.to_owned(), line, what: what.into(), remedy: remedy.into() }
    }

    pub(crate) fn unfit(what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Unfit { what: what.into(), remedy: remedy.into() }
    }
}
