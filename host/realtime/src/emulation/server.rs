//! The emulated facility on real sockets: one thread, three ports, one physics clock, paced by absolute times.

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

/// A look at the stop flag at least this often.
const LOOK: Nanos = Nanos::from_millis(20);
/// Most datagrams taken from a socket in a row: a flood must not hold up the physics.
const MOST_QUEUED: usize = 64;

const ENDPOINTS: [Endpoint; 3] = [Endpoint::Robot1, Endpoint::Robot2, Endpoint::Sensor];

/// The facility's ends of its three links.
pub struct Sockets {
    /// Robot 1, robot 2, sensor.
    pub ports: [UdpPort; 3],
}

impl Sockets {
    fn send(&mut self, endpoint: Endpoint, to: SocketAddr, datagram: &[u8]) {
        // Nobody there yet is no error of a controller's: it sends again in its next cycle.
        let _ = self.ports[endpoint as usize].send(datagram, to);
    }
}

/// Serves the facility from now on, until told to stop or until a time; notes how late it was at its own instants.
///
/// It takes nothing from the heap but between two sessions. Datagrams are taken as they come, and those that are there at an instant of the
/// facility have come before it.
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

/// Takes the datagrams that wait.
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
