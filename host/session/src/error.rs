//! Why a session, an emulated facility or a replay cannot begin or go on.

use softdock_campaign::Problems;
use softdock_realtime::drive::core::Unprepared;
use softdock_realtime::drive::replay::Unplayed;
use softdock_realtime::links::LinkError;
use softdock_realtime::log::mcap::LogError;
use std::fmt::Display;
use std::io;

/// Result of this crate.
pub(crate) type Result<T> = std::result::Result<T, SessionError>;

/// What can go wrong with a session.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// What was asked for cannot be done.
    #[error("{what}")]
    Refused {
        /// What is wrong.
        what: String,
        /// What to do.
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
    /// A file, a socket or a thread is refused by the operating system.
    #[error(transparent)]
    System(#[from] io::Error),
}

impl SessionError {
    /// What to do about it, where more than the message is known.
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
