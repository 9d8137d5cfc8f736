//! ABB Externally Guided Motion: the robot sends its state as protobuf over UDP, by default each 4 ms, and takes joint
//! targets as answers.
//!
//! [`messages`] is the codec on top of [`wire_format`], [`driver`] our side, [`controller`] the emulated robot.

pub mod controller;
pub mod driver;
pub mod messages;
#[cfg(test)]
mod tests;
pub mod wire_format;

use crate::time::Nanos;

/// Default port of a robot's `UdpUc` device.
pub const EGM_PORT: u16 = 6510;
/// Default cycle of a robot's motion.
pub const CYCLE: Nanos = Nanos::from_millis(4);
