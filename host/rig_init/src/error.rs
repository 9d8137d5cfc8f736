//! Errors of `rig init`.

use softdock_campaign::Problems;
use softdock_diagnosis::DiagnosisError;

/// Error of a proposal.
#[derive(Debug, thiserror::Error)]
pub enum RigInitError {
    /// A log that cannot be read, or that fits no rig.
    #[error(transparent)]
    Recording(#[from] DiagnosisError),
    /// A URDF that cannot be used.
    #[error("the URDF cannot be used")]
    Urdf(Problems),
}

impl From<Problems> for RigInitError {
    fn from(problems: Problems) -> Self {
        Self::Urdf(problems)
    }
}
