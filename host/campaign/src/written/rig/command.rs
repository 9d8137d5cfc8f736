//! The model file of a command's way as written.

use crate::written::{At, Quantity};
use schemars::JsonSchema;
use serde::Deserialize;

/// Commands of one axis, sent at equal steps and echoed by the receiver at its own: a row is one tick of each clock. Or,
/// without an echo, a flag of the row in which a command was sent, and the motion then.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct CommandTable {
    /// "revolute" or "prismatic"; default revolute. A prismatic axis has m for rad.
    pub(crate) motion: Option<At<String>>,
    /// From one packet to the next.
    pub(crate) period: Quantity,
    /// Delay from sender to receiver; default none.
    pub(crate) transport_delay: Option<Quantity>,
    /// Step in which a command is written into a packet; default none.
    pub(crate) quantum: Option<Quantity>,
}
