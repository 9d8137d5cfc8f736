//! Transmission of a command from sender to receiver.

pub mod block;
pub mod hypotheses;
pub(crate) mod packets;
pub(crate) mod timing;
