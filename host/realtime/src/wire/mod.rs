//! Datagrams: a port is a UDP socket or a place in a network of virtual time; what stands between may lose them.

mod arrival;
pub mod relay;
pub mod udp;

use crate::time::Nanos;
use std::io;
use std::net::SocketAddr;

/// Largest datagram that any of the protocols sends.
pub const MAX_DATAGRAM: usize = 1500;

/// Where datagrams come and go, with the clock that times them.
pub trait Port {
    /// The time now.
    fn now(&self) -> Nanos;

    /// The next datagram and its sender, waiting for one until `deadline` (a time gone by: no waiting).
    ///
    /// # Errors
    /// If the network interface fails.
    fn receive(&mut self, buffer: &mut [u8], deadline: Nanos) -> io::Result<Option<(usize, SocketAddr)>>;

    /// When the datagram taken last had arrived: before now, if it has waited for us. A port that cannot tell says now.
    fn arrived(&self) -> Nanos {
        self.now()
    }

    /// Sends a datagram.
    ///
    /// # Errors
    /// If the network interface fails.
    fn send(&mut self, datagram: &[u8], to: SocketAddr) -> io::Result<()>;
}
