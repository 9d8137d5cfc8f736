//! What can go wrong with a case or with its records.

use std::path::{Path, PathBuf};

/// Result of this crate.
pub(crate) type Result<T> = std::result::Result<T, GauntletError>;

/// Why a case could not be run or scored.
#[derive(Debug, thiserror::Error)]
pub enum GauntletError {
    /// The generator refuses a case of the plan.
    #[error(transparent)]
    Recordings(#[from] softdock_gauntlet::Error),
    /// A generated model file is not understood.
    #[error("the model of a generated bench: {0}")]
    Model(String),
    /// The oracle's recordings cannot be used.
    #[error(transparent)]
    Diagnosis(#[from] softdock_diagnosis::DiagnosisError),
    /// A figure of the page cannot be drawn.
    #[error(transparent)]
    Page(#[from] softdock_analysis::Error),
    /// A file cannot be written.
    #[error(transparent)]
    Results(#[from] softdock_results::Error),
    /// A file is no input: no regular file, too large, no text.
    #[error(transparent)]
    Input(#[from] softdock_input::InputError),
    /// A file cannot be read or written.
    #[error("{}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What the file system says.
        source: std::io::Error,
    },
    /// A line of the records is damaged, or a sealed answer is not the one that was sealed.
    #[error("{}: {what}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        what: String,
    },
    /// A name that the plan does not know.
    #[error("{what}")]
    Unknown {
        /// What is wrong, with what could be written.
        what: String,
    },
}

impl GauntletError {
    /// What to do about it.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::Recordings(_) | Self::Model(_) | Self::Diagnosis(_) => {
                "this is a fault of the plan: please report it"
            }
            Self::Input(error) => error.remedy(),
            Self::Page(_) | Self::Results(_) | Self::File { .. } => "check the path and its permissions",
            Self::Damaged { .. } => "remove the folder and run the cases again",
            Self::Unknown { .. } => "write one of those",
        }
    }

    pub(crate) fn file(path: &Path) -> impl FnOnce(std::io::Error) -> Self + use<'_> {
        move |source| Self::File { path: path.to_owned(), source }
    }

    pub(crate) fn damaged(path: &Path, what: impl ToString) -> Self {
        Self::Damaged { path: path.to_owned(), what: what.to_string() }
    }
}
