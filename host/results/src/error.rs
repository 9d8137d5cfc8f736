//! What can go wrong with a results file, in words that name the file.

use std::path::{Path, PathBuf};

/// Result of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// A results file that could not be written, read or trusted.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The operating system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's answer.
        source: std::io::Error,
    },
    /// The Parquet file is damaged, or not a Parquet file.
    #[error("{}: not a readable Parquet file: {source}", path.display())]
    Parquet {
        /// The file.
        path: PathBuf,
        /// The library's answer.
        source: parquet::errors::ParquetError,
    },
    /// The file is readable, but not what the contract says.
    #[error("{}: {what}", path.display())]
    Contract {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        what: String,
    },
}

impl Error {
    /// For `map_err` on file operations.
    pub(crate) fn io(path: &Path) -> impl FnOnce(std::io::Error) -> Self + '_ {
        |source| Self::Io { path: path.to_owned(), source }
    }

    /// For `map_err` on Parquet operations.
    pub(crate) fn parquet<E: Into<parquet::errors::ParquetError>>(path: &Path) -> impl FnOnce(E) -> Self + '_ {
        |source| Self::Parquet { path: path.to_owned(), source: source.into() }
    }

    /// A breach of the contract.
    pub(crate) fn contract(path: &Path, what: impl Into<String>) -> Self {
        Self::Contract { path: path.to_owned(), what: what.into() }
    }
}
