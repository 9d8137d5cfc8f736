//! FANUC Stream Motion (option J519): the controller sends its status at 125 Hz over UDP and takes joint targets as
//! answers; its Remote Motion Interface starts the program that follows them.
//!
//! [`packets`] is the codec, [`driver`] our side, [`rmi`] the sessions over TCP, [`armed`] a robot whose program was
//! started by such a session, [`controller`] and [`rmi_server`] the emulated controller.

pub mod armed;
pub mod controller;
pub mod driver;
pub mod packets;
pub mod rmi;
pub mod rmi_server;
#[cfg(test)]
mod tests;

use crate::time::Nanos;

/// Port on which a controller takes Stream Motion packets.
pub const STREAM_PORT: u16 = 60015;
/// Port on which a controller takes Remote Motion sessions.
pub const RMI_PORT: u16 = 16001;
/// Cycle of the stream.
pub const CYCLE: Nanos = Nanos::from_millis(8);
