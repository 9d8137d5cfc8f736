//! Errors of the campaign functions: message and remedy.

use softdock_campaign::Problems;
use softdock_engine::EngineError;
use std::fmt::Display;

/// Result with this crate's error.
pub(crate) type Result<T> = std::result::Result<T, FarmError>;

/// Why a campaign function did not complete.
#[derive(Debug, thiserror::Error)]
pub enum FarmError {
    /// The request cannot be met with this input.
    #[error("{message}")]
    Refused {
        /// What is wrong, with file, key, value and range.
        message: String,
        /// What to do.
        remedy: String,
    },
    /// The files of a campaign are wrong.
    #[error("{0}")]
    Campaign(Problems),
    /// A file of the user cannot be read.
    #[error(transparent)]
    Input(#[from] softdock_input::InputError),
    /// A results file cannot be read or written.
    #[error(transparent)]
    Results(#[from] softdock_results::ResultsError),
    /// A results folder cannot be analysed.
    #[error(transparent)]
    Analysis(#[from] softdock_analysis::AnalysisError),
    /// No engine can make the runs.
    #[error("{0}")]
    Engine(EngineError),
    /// The caller has cancelled the work; every finished run is on disk.
    #[error("cancelled; every finished run is on disk")]
    Cancelled,
}

impl FarmError {
    /// A refusal with its remedy.
    pub(crate) fn refused(message: impl Display, remedy: impl Display) -> Self {
        Self::Refused { message: message.to_string(), remedy: remedy.to_string() }
    }

    /// Returns whether the error is a failure to write a file.
    pub fn is_write_failure(&self) -> bool {
        match self {
            Self::Results(error) | Self::Analysis(softdock_analysis::AnalysisError::File(error)) => {
                error.is_write_failure()
            }
            _ => false,
        }
    }

    /// Returns the action that resolves the error, if the message does not state it.
    pub fn remedy(&self) -> Option<String> {
        match self {
            Self::Refused { remedy, .. } => Some(remedy.clone()),
            Self::Engine(_) => Some("`softdock devices` lists what runs can be made on".to_owned()),
            Self::Cancelled => Some("the same call resumes".to_owned()),
            Self::Input(error) => Some(error.remedy().to_owned()),
            Self::Results(error) | Self::Analysis(softdock_analysis::AnalysisError::File(error)) => {
                Some(error.remedy().to_owned())
            }
            Self::Campaign(_) | Self::Analysis(_) => None,
        }
    }
}

impl From<Problems> for FarmError {
    fn from(problems: Problems) -> Self {
        Self::Campaign(problems)
    }
}

impl From<EngineError> for FarmError {
    fn from(error: EngineError) -> Self {
        match error {
            EngineError::Stopped { .. } => Self::Cancelled,
            error => Self::Engine(error),
        }
    }
}

/// Converts an I/O error of writing, removing or locking a file, for `map_err`.
pub(crate) fn writing(path: &std::path::Path) -> impl FnOnce(std::io::Error) -> FarmError + '_ {
    |source| softdock_results::ResultsError::Write { path: path.to_owned(), source }.into()
}
