//! Errors of cases and their records.

use std::path::{Path, PathBuf};

/// Result with this crate's error.
pub(crate) type Result<T> = std::result::Result<T, GauntletError>;

/// Error of a case or of its records.
#[derive(Debug, thiserror::Error)]
pub enum GauntletError {
    /// The generator rejects a case of the plan.
    #[error(transparent)]
    Recordings(#[from] softdock_gauntlet::Error),
    /// A generated model file is not understood.
    #[error("the model file of a generated rig: {0}")]
    Model(String),
    /// The oracle's recordings cannot be used.
    #[error(transparent)]
    Diagnosis(#[from] softdock_diagnosis::DiagnosisError),
    /// A figure of the page cannot be drawn.
    #[error(transparent)]
    Page(#[from] softdock_analysis::AnalysisError),
    /// A file cannot be written.
    #[error(transparent)]
    Results(#[from] softdock_results::ResultsError),
    /// A file is not a valid input: not a regular file, too large, or not text.
    #[error(transparent)]
    Input(#[from] softdock_input::InputError),
    /// A file cannot be read or written.
    #[error("{}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Error of the file system.
        source: std::io::Error,
    },
    /// A line of the records is damaged, or a truth does not match its seal.
    #[error("{}: {what}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        what: String,
    },
    /// A name is not in the plan.
    #[error("{what}")]
    Unknown {
        /// What is wrong, with the valid names.
        what: String,
    },
}

impl GauntletError {
    /// Returns the action that resolves the error.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::Recordings(_) | Self::Model(_) | Self::Diagnosis(_) => {
                "this is a defect of the plan; please report it"
            }
            Self::Input(error) => error.remedy(),
            Self::Page(_) | Self::Results(_) | Self::File { .. } => "check the path and its permissions",
            Self::Damaged { .. } => "remove the folder and run the cases again",
            Self::Unknown { .. } => "use one of the listed names",
        }
    }

    pub(crate) fn file(path: &Path) -> impl FnOnce(std::io::Error) -> Self + use<'_> {
        move |source| Self::File { path: path.to_owned(), source }
    }

    pub(crate) fn damaged(path: &Path, what: impl ToString) -> Self {
        Self::Damaged { path: path.to_owned(), what: what.to_string() }
    }
}
