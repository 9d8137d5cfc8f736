//! Errors of sessions, emulated facilities and replays.

use softdock_campaign::Problems;
use softdock_realtime::drive::core::Unprepared;
use softdock_realtime::drive::replay::Unplayed;
use softdock_realtime::links::LinkError;
use softdock_realtime::log::mcap::LogError;
use std::fmt::Display;
use std::io;

/// Result of this crate.
pub(crate) type Result<T> = std::result::Result<T, SessionError>;

/// An error of a session.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// The request cannot be met.
    #[error("{what}")]
    Refused {
        /// Problem.
        what: String,
        /// Remedy.
        remedy: String,
    },
    /// A campaign, scenario, facility, experiment or effects file cannot be used.
    #[error(transparent)]
    Files(#[from] Problems),
    /// A link cannot be opened.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The run cannot be driven on these robots.
    #[error(transparent)]
    Unprepared(#[from] Unprepared),
    /// The log cannot be replayed.
    #[error(transparent)]
    Unplayed(#[from] Unplayed),
    /// The log cannot be written or read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// A results file cannot be written.
    #[error(transparent)]
    Results(#[from] softdock_results::ResultsError),
    /// The operating system refuses a file, a socket or a thread.
    #[error(transparent)]
    System(#[from] io::Error),
}

impl SessionError {
    /// Returns the remedy, where more is known than the message.
    pub fn remedy(&self) -> Option<&str> {
        match self {
            Self::Refused { remedy, .. } => Some(remedy),
            Self::Link(error) => error.remedy(),
            Self::Results(error) => Some(error.remedy()),
            Self::Files(_) | Self::Unprepared(_) | Self::Unplayed(_) | Self::Log(_) | Self::System(_) => None,
        }
    }

    pub(crate) fn refused(what: impl Display, remedy: impl Display) -> Self {
        Self::Refused { what: what.to_string(), remedy: remedy.to_string() }
    }
}
