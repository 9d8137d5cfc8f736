//! The emulated facility on real sockets: one thread, three ports, the machine's clock.

use super::facility::Facility;
use crate::clock::{Clock, Monotonic};
use crate::time::Nanos;
use crate::wire::relay::Endpoint;
use crate::wire::udp::UdpPort;
use crate::wire::{MAX_DATAGRAM, Port};
use std::io;
use std::net::SocketAddr;
use std::sync::atomic::{AtomicBool, Ordering};

/// A wait for the next event looks at the sockets this often.
const SLICE: Nanos = Nanos::from_micros(200);

/// The facility's ends of its three links.
pub struct Sockets {
    /// Robot 1, robot 2, sensor.
    pub ports: [UdpPort; 3],
}

const ENDPOINTS: [Endpoint; 3] = [Endpoint::Robot1, Endpoint::Robot2, Endpoint::Sensor];

impl Sockets {
    fn send(&mut self, endpoint: Endpoint, to: SocketAddr, datagram: &[u8]) {
        // Nobody there yet is no error of a controller's: it sends again in its next cycle.
        let _ = self.ports[endpoint as usize].send(datagram, to);
    }
}

/// Serves the facility until told to stop, or until a time.
///
/// # Errors
/// If a socket fails.
pub fn serve(facility: &mut Facility, sockets: &mut Sockets, stop: &AtomicBool, until: Nanos) -> io::Result<()> {
    let mut buffer = [0; MAX_DATAGRAM];
    while !stop.load(Ordering::Relaxed) && Monotonic.now() < until {
        let next = facility.next().min(Monotonic.now() + SLICE);
        Monotonic.sleep_until(next);
        for (index, endpoint) in ENDPOINTS.into_iter().enumerate() {
            while let Some((length, from)) = sockets.ports[index].receive(&mut buffer, Nanos(0))? {
                let now = sockets.ports[index].arrived();
                facility.take(endpoint, now, from, &buffer[..length], &mut |e, to, bytes| sockets.send(e, to, bytes));
            }
        }
        let now = Monotonic.now();
        facility.run_until(now, &mut |endpoint, to, bytes| sockets.send(endpoint, to, bytes));
    }
    Ok(())
}
