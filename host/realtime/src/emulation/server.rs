//! The emulated facility on real sockets: one thread, one physics clock, paced by absolute times.

use super::facility::Facility;
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

/// A facility and the sockets of its controllers and of its sensor.
pub struct Server {
    facility: Facility,
    ports: [UdpPort; 3],
    lateness: Histogram,
}

impl Server {
    /// A facility behind the sockets of robots 1 and 2 and of the sensor.
    pub fn new(facility: Facility, ports: [UdpPort; 3]) -> Self {
        Self { facility, ports, lateness: Histogram::default() }
    }

    /// Runs the facility from now on, until `stop` is set; allocates nothing.
    ///
    /// # Errors
    /// If a network interface fails; a client that is not there is no failure.
    pub fn run(&mut self, stop: &AtomicBool) -> io::Result<()> {
        self.facility.begin(Monotonic.now());
        while !stop.load(Ordering::Relaxed) {
            self.turn()?;
        }
        Ok(())
    }

    /// Waits for what comes first, a datagram or the next instant of the facility, and does it.
    fn turn(&mut self) -> io::Result<()> {
        let due = self.facility.next();
        wait_for_any(&self.ports, due.min(Monotonic.now() + LOOK))?;
        // What has come was there before what is due now.
        self.take()?;
        let now = Monotonic.now();
        if due > now {
            return Ok(());
        }
        self.lateness.add(now - due);
        let (ports, mut sent) = (&mut self.ports, Ok(()));
        self.facility.run_until(now, &mut |endpoint, to, datagram| {
            send(&mut ports[endpoint as usize], to, datagram, &mut sent);
        });
        sent
    }

    /// Takes the datagrams that wait.
    fn take(&mut self) -> io::Result<()> {
        let mut buffer = [0; MAX_DATAGRAM];
        for (port, endpoint) in self.ports.iter_mut().zip(ENDPOINTS) {
            for _ in 0..MOST_QUEUED {
                let Some((length, from)) = port.receive(&mut buffer, AT_ONCE)? else {
                    break;
                };
                let mut sent = Ok(());
                self.facility.take(endpoint, Monotonic.now(), from, &buffer[..length], &mut |_, to, datagram| {
                    send(port, to, datagram, &mut sent);
                });
                sent?;
            }
        }
        Ok(())
    }

    /// The facility.
    pub fn facility(&mut self) -> &mut Facility {
        &mut self.facility
    }

    /// How late the facility itself was: start of its work after the due instant.
    pub fn lateness(&self) -> &Histogram {
        &self.lateness
    }
}

/// Sends, and keeps the first failure.
fn send(port: &mut UdpPort, to: SocketAddr, datagram: &[u8], sent: &mut io::Result<()>) {
    if let (Err(failure), true) = (port.send(datagram, to), sent.is_ok()) {
        *sent = Err(failure);
    }
}
