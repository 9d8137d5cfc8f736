//! Errors of opening a link.

use crate::protocol::ethercat::OpenError;
use crate::protocol::netft::calibration::CalibrationError;
use crate::signals::LinkFault;

/// A link that cannot be opened, or an unusable address.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    /// An unusable address.
    #[error("{what}")]
    Address {
        /// Problem.
        what: String,
        /// Remedy.
        remedy: String,
    },
    /// This machine, the controller or the sensor refuses the link.
    #[error("{what}")]
    Refused {
        /// Problem.
        what: String,
        /// Remedy.
        remedy: String,
    },
    /// A link fault at the opening.
    #[error(transparent)]
    Fault(#[from] LinkFault),
    /// The drives of an EtherCAT segment cannot be opened.
    #[error(transparent)]
    EtherCat(#[from] OpenError),
    /// A calibration of the emulated sensor cannot be used.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
}

impl LinkError {
    /// Returns the remedy, where more is known than the message.
    pub fn remedy(&self) -> Option<&str> {
        match self {
            Self::Address { remedy, .. } | Self::Refused { remedy, .. } => Some(remedy),
            Self::Fault(_) | Self::EtherCat(_) | Self::Calibration(_) => None,
        }
    }

    pub(crate) fn address(what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Address { what: what.into(), remedy: remedy.into() }
    }

    pub(crate) fn refused(what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Refused { what: what.into(), remedy: remedy.into() }
    }
}
