//! ABB Externally Guided Motion: the robot sends its state as protobuf over UDP, by default each 4 ms, and wants joint
//! targets back.
//!
//! [`messages`] is the codec on top of [`wire_format`], [`driver`] our side, [`controller`] the emulated robot.

pub mod controller;
pub mod driver;
pub mod messages;
#[cfg(test)]
mod tests;
pub mod wire_format;

use crate::time::Nanos;

/// Port to which a robot sends unless its `UdpUc` device says otherwise.
pub const EGM_PORT: u16 = 6510;
/// Cycle of a robot unless its motion asks for another.
pub const CYCLE: Nanos = Nanos::from_millis(4);
