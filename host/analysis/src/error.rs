//! What can go wrong in the analysis of a results folder.

use std::path::PathBuf;

/// Result of this crate.
pub(crate) type Result<T> = std::result::Result<T, AnalysisError>;

/// A results folder that cannot be analysed.
#[derive(Debug, thiserror::Error)]
pub enum AnalysisError {
    /// A file could not be written, read or trusted.
    #[error(transparent)]
    File(#[from] softdock_results::ResultsError),
    /// The results are readable, but not those of the campaign.
    #[error("{}: {what}", path.display())]
    Results {
        /// File or folder.
        path: PathBuf,
        /// What is wrong with it.
        what: String,
    },
    /// A figure could not be drawn.
    #[error("figure `{figure}`: {what}")]
    Figure {
        /// Title of the figure.
        figure: String,
        /// The plotting library's answer.
        what: String,
    },
    /// The page could not be laid out.
    #[error("report page: {0}")]
    Page(#[from] minijinja::Error),
}

impl AnalysisError {
    /// Whether an output could not be written: a matter of the disk, not of the input.
    pub fn is_write_failure(&self) -> bool {
        matches!(self, Self::File(error) if error.is_write_failure())
    }
}
