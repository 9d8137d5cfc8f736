//! What can go wrong with a results file, in words that name the file.

use std::path::{Path, PathBuf};

/// Result of this crate.
pub(crate) type Result<T> = std::result::Result<T, ResultsError>;

/// A results file that could not be written, read or trusted.
#[derive(Debug, thiserror::Error)]
pub enum ResultsError {
    /// A file could not be written: a matter of the disk, not of the input.
    #[error("{}: cannot be written: {source}", path.display())]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// The system's answer.
        source: std::io::Error,
    },
    /// The file is no input: absent, no regular file, or too large.
    #[error(transparent)]
    Input(#[from] softdock_input::InputError),
    /// A folder or file could not be read.
    #[error("{}: cannot be read: {source}", path.display())]
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
    /// The file is readable, but violates the contract.
    #[error("{}: {what}", path.display())]
    Contract {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        what: String,
    },
}

impl ResultsError {
    /// Whether a file could not be written: a matter of the disk, not of the input.
    pub fn is_write_failure(&self) -> bool {
        matches!(self, Self::Write { .. })
    }

    /// What to do about it.
    pub fn remedy(&self) -> &'static str {
        use std::io::ErrorKind as ColumnKind;
        match self {
            Self::Write { source, .. } => match source.kind() {
                ColumnKind::StorageFull
                | ColumnKind::QuotaExceeded
                | ColumnKind::FileTooLarge
                | ColumnKind::WriteZero => {
                    "free space on the file system, or name a folder on another one; the same command resumes"
                }
                ColumnKind::PermissionDenied | ColumnKind::ReadOnlyFilesystem => {
                    "name a folder that this user may write in, or change its permissions; the same command resumes"
                }
                _ => "check the folder and its file system; the same command resumes",
            },
            Self::Input(error) => error.remedy(),
            Self::Io { .. } => "check the path and its permissions",
            Self::Parquet { .. } => "name a Parquet file, or restore the file from a backup",
            Self::Contract { .. } => "remove or restore the file; `softdock run` makes a missing shard again",
        }
    }

    /// For `map_err` on what writes.
    pub(crate) fn write(path: &Path) -> impl FnOnce(std::io::Error) -> Self + '_ {
        |source| Self::Write { path: path.to_owned(), source }
    }

    /// For `map_err` on what reads.
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
