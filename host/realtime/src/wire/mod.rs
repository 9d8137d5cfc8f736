//! Datagram ports: a UDP socket, or an address in a network of virtual time that may lose datagrams.

pub mod relay;
pub mod udp;

use crate::time::Nanos;
use std::io;
use std::net::SocketAddr;

/// Largest datagram that any of the protocols sends.
pub const MAX_DATAGRAM: usize = 1500;

/// A port that sends and receives datagrams, with its clock.
pub trait Port {
    /// Returns the present time.
    fn now(&self) -> Nanos;

    /// Returns the next datagram and its sender, waiting until `deadline`; a past deadline does not wait.
    ///
    /// # Errors
    /// If the network interface fails.
    fn receive(&mut self, buffer: &mut [u8], deadline: Nanos) -> io::Result<Option<(usize, SocketAddr)>>;

    /// Returns the arrival of the last received datagram: before now, if it has waited. A port without stamps returns
    /// now.
    fn arrived(&self) -> Nanos {
        self.now()
    }

    /// Sends a datagram.
    ///
    /// # Errors
    /// If the network interface fails.
    fn send(&mut self, datagram: &[u8], to: SocketAddr) -> io::Result<()>;
}
