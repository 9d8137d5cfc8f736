//! Errors of reading user files, with path and remedy.

use std::path::{Path, PathBuf};

/// Result of this crate.
pub(crate) type Result<T> = std::result::Result<T, InputError>;

/// A user file that cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum InputError {
    /// The file does not exist.
    #[error("{}: there is no such file", path.display())]
    Absent {
        /// The file.
        path: PathBuf,
    },
    /// A directory, pipe, socket or device.
    #[error("{}: is no regular file but a {kind}", path.display())]
    NotRegular {
        /// The file.
        path: PathBuf,
        /// Kind of the file.
        kind: &'static str,
    },
    /// More bytes than this kind of file may have.
    #[error("{}: has {}, the limit is {}", path.display(), size(*bytes), size(*limit))]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Its size; while it grows, a lower bound.
        bytes: u64,
        /// The greatest accepted size.
        limit: u64,
    },
    /// A byte that is not UTF-8.
    #[error("{}:{line}:{column}: byte 0x{byte:02X} is not UTF-8 text", path.display())]
    NotText {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Column in characters, from 1.
        column: usize,
        /// The byte.
        byte: u8,
    },
    /// The operating system reports an error.
    #[error("{}: cannot be read: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
}

impl InputError {
    /// Returns the path of the file.
    pub fn path(&self) -> &Path {
        match self {
            Self::Absent { path }
            | Self::NotRegular { path, .. }
            | Self::TooLarge { path, .. }
            | Self::NotText { path, .. }
            | Self::Io { path, .. } => path,
        }
    }

    /// Returns the problem, without the path.
    pub fn what(&self) -> String {
        match self {
            Self::Absent { .. } => "there is no such file".to_owned(),
            Self::NotRegular { kind, .. } => format!("is no regular file but a {kind}"),
            Self::TooLarge { bytes, limit, .. } => format!("has {}, the limit is {}", size(*bytes), size(*limit)),
            Self::NotText { byte, .. } => format!("byte 0x{byte:02X} is not UTF-8 text"),
            Self::Io { source, .. } => format!("cannot be read: {source}"),
        }
    }

    /// Returns the line of the fault, if it has one.
    pub fn line(&self) -> Option<usize> {
        match self {
            Self::NotText { line, .. } => Some(*line),
            _ => None,
        }
    }

    /// Returns the remedy.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::Absent { .. } => "check the path",
            Self::NotRegular { .. } => "name a regular file; write the output of a program to a file first",
            Self::TooLarge { .. } => "name a smaller file, or split it",
            Self::NotText { .. } => "save the file with the encoding UTF-8 (UTF-16 and Latin-1 are not read)",
            Self::Io { .. } => "check the path and its permissions",
        }
    }
}

/// Formats a number of bytes for users.
fn size(bytes: u64) -> String {
    match bytes {
        0..1024 => format!("{bytes} bytes"),
        1024..1_048_576 => format!("{:.1} KiB", bytes as f64 / 1024.0),
        1_048_576..1_073_741_824 => format!("{:.1} MiB", bytes as f64 / 1_048_576.0),
        _ => format!("{:.1} GiB", bytes as f64 / 1_073_741_824.0),
    }
}
