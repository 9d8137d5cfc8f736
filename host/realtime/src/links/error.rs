//! Why a link cannot be opened.

use crate::protocol::ethercat::OpenError;
use crate::protocol::netft::calibration::CalibrationError;
use crate::signals::LinkFault;

/// A link that cannot be opened, or an address that no link can be opened at.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    /// The address cannot be used as it is written.
    #[error("{what}")]
    Address {
        /// What is wrong.
        what: String,
        /// What to write.
        remedy: String,
    },
    /// This machine, the controller or the sensor refuses.
    #[error("{what}")]
    Refused {
        /// What is wrong.
        what: String,
        /// What to do.
        remedy: String,
    },
    /// The link fails at its opening.
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
    /// What to do about it, where more than the message is known.
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
