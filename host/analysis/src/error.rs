//! Errors of the analysis of a results folder.

use softdock_results::columns::ColumnError;
use std::path::{Path, PathBuf};

/// Result with this crate's error.
pub(crate) type Result<T> = std::result::Result<T, AnalysisError>;

/// Error of the analysis of a results folder.
#[derive(Debug, thiserror::Error)]
pub enum AnalysisError {
    /// A file could not be written, read or verified.
    #[error(transparent)]
    File(#[from] softdock_results::ResultsError),
    /// The results do not belong to the campaign.
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
        /// Message of the plotting library.
        what: String,
    },
    /// The page could not be rendered.
    #[error("report page: {0}")]
    Page(#[from] minijinja::Error),
}

impl AnalysisError {
    /// Creates the error of a results folder whose runs lack a column.
    pub fn of_column(results: &Path, error: &ColumnError) -> Self {
        Self::Results { path: results.to_owned(), what: error.to_string() }
    }

    /// Returns whether the error is a failure to write an output.
    pub fn is_write_failure(&self) -> bool {
        matches!(self, Self::File(error) if error.is_write_failure())
    }
}
