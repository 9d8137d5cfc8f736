//! The emulated facility on sockets: one thread, three ports, one physics clock, paced by absolute times.

use super::facility::EmulatedFacility;
use crate::clock::{Clock, Monotonic};
use crate::histogram::Histogram;
use crate::protocol::link::AT_ONCE;
use crate::time::Nanos;
use crate::wire::relay::Endpoint;
use crate::wire::udp::{UdpPort, wait_for_any};
use crate::wire::{MAX_DATAGRAM, Port};
use std::io;
use std::net::SocketAddr;
use std::sync::atomic::{AtomicBool, Ordering};

/// Greatest interval between two checks of the stop flag.
const LOOK: Nanos = Nanos::from_millis(20);
/// Greatest number of datagrams taken from a socket in a row: a flood must not delay the physics.
const MOST_QUEUED: usize = 64;

const ENDPOINTS: [Endpoint; 3] = [Endpoint::Robot1, Endpoint::Robot2, Endpoint::Sensor];

/// The facility's ports.
pub struct Sockets {
    /// Robot 1, robot 2, sensor.
    pub ports: [UdpPort; 3],
}

impl Sockets {
    fn send(&mut self, endpoint: Endpoint, to: SocketAddr, datagram: &[u8]) {
        // A missing receiver is no error: the controller sends again in its next cycle.
        let _ = self.ports[endpoint as usize].send(datagram, to);
    }
}

/// Serves the facility until `stop` holds or until a time; records its lateness at each event.
///
/// Allocates only between two sessions. Datagrams are taken as they arrive; those that have arrived by an event of the
/// facility are processed before that event.
///
/// # Errors
/// If a socket fails.
pub fn serve(
    facility: &mut EmulatedFacility,
    sockets: &mut Sockets,
    stop: &AtomicBool,
    until: Nanos,
    lateness: &mut Histogram,
) -> io::Result<()> {
    facility.begin(Monotonic.now());
    while !stop.load(Ordering::Relaxed) && Monotonic.now() < until {
        let due = facility.next();
        wait_for_any(&sockets.ports, due.min(Monotonic.now() + LOOK))?;
        take(facility, sockets)?;
        let now = Monotonic.now();
        if due <= now {
            lateness.add(now - due);
            facility.run_until(now, &mut |endpoint, to, datagram| sockets.send(endpoint, to, datagram));
        }
    }
    Ok(())
}

/// Takes the waiting datagrams.
fn take(facility: &mut EmulatedFacility, sockets: &mut Sockets) -> io::Result<()> {
    let mut buffer = [0; MAX_DATAGRAM];
    for (index, endpoint) in ENDPOINTS.into_iter().enumerate() {
        for _ in 0..MOST_QUEUED {
            let Some((length, from)) = sockets.ports[index].receive(&mut buffer, AT_ONCE)? else {
                break;
            };
            let arrived = sockets.ports[index].arrived();
            facility.take(endpoint, arrived, from, &buffer[..length], &mut |endpoint, to, datagram| {
                sockets.send(endpoint, to, datagram);
            });
        }
    }
    Ok(())
}
