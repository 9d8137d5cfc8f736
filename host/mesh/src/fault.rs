//! What is wrong with a mesh, and what to do about it.

/// Why a mesh cannot be a contact part.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MeshFault {
    /// What is wrong, where, with the value.
    pub message: String,
    /// What to do.
    pub remedy: String,
}

impl MeshFault {
    pub(crate) fn new(message: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { message: message.into(), remedy: remedy.into() }
    }
}
