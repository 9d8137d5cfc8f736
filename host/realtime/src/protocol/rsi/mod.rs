//! KUKA Robot Sensor Interface: the controller sends its state as XML over UDP every 4 or 12 ms and takes a correction
//! as answer within the cycle.
//!
//! [`tags`] maps signals to elements, [`codec`] parses and writes the messages, [`driver`] is our side, [`controller`]
//! the emulated KRC, [`context`] writes the controller's own configuration from the same tag map, and [`ethernet_file`]
//! reads the tag map of such a configuration.

pub mod codec;
pub mod context;
pub mod controller;
pub mod driver;
pub mod ethernet_file;
mod scan;
pub mod tags;
#[cfg(test)]
mod tests;

use crate::time::Nanos;

/// Default port of a controller's messages (49152 is Net F/T's).
pub const RSI_PORT: u16 = 59152;
/// Cycle of the RSI mode `IPO_FAST`.
pub const CYCLE: Nanos = Nanos::from_millis(4);
