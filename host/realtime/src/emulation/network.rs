//! The emulated facility and its network in virtual time: the time advances when a caller waits for a datagram.

use super::facility::EmulatedFacility;
use crate::clock::{Clock, Virtual};
use crate::time::Nanos;
use crate::wire::Port;
use crate::wire::relay::{Direction, Endpoint, Relay};
use std::cell::RefCell;
use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};
use std::io;
use std::net::{Ipv4Addr, SocketAddr};
use std::rc::Rc;

/// Address of an endpoint of the facility.
pub fn address_of(endpoint: Endpoint) -> SocketAddr {
    SocketAddr::from((Ipv4Addr::new(10, 0, 0, 10 + endpoint as u8), 49_152))
}

/// Our address for an endpoint.
pub fn our_address(endpoint: Endpoint) -> SocketAddr {
    SocketAddr::from((Ipv4Addr::new(10, 0, 0, 1), 59_152 + endpoint as u16))
}

/// The address of a foreign host.
fn stranger() -> SocketAddr {
    SocketAddr::from((Ipv4Addr::new(10, 0, 0, 99), 49_152))
}

/// A datagram in transit: arrival time, sequence number, receiver.
type Flight = Reverse<(Nanos, u64, u8, bool, bool, Vec<u8>)>;

/// The facility, the network, and its faults.
pub struct Network {
    clock: Virtual,
    facility: EmulatedFacility,
    /// The faults.
    pub relay: Relay,
    flights: BinaryHeap<Flight>,
    sent: u64,
    /// Our answers that reached the relay, in order.
    pub answers: Vec<(Nanos, Endpoint, Vec<u8>)>,
    /// Datagrams that have arrived for us: endpoint, sender, time.
    inbox: [VecDeque<(SocketAddr, Nanos, Vec<u8>)>; 3],
}

const ENDPOINTS: [Endpoint; 3] = [Endpoint::Robot1, Endpoint::Robot2, Endpoint::Sensor];

impl Network {
    /// Creates a network on a clock.
    pub fn new(clock: Virtual, facility: EmulatedFacility, relay: Relay) -> Rc<RefCell<Self>> {
        let inbox = Default::default();
        Rc::new(RefCell::new(Self {
            clock,
            facility,
            relay,
            flights: BinaryHeap::new(),
            sent: 0,
            answers: Vec::new(),
            inbox,
        }))
    }

    /// Returns the facility.
    pub fn facility(&mut self) -> &mut EmulatedFacility {
        &mut self.facility
    }

    /// Sends a datagram through the relay.
    fn launch(&mut self, endpoint: Endpoint, direction: Direction, datagram: &[u8]) {
        let now = self.clock.now();
        for passing in self.relay.pass(now, endpoint, direction, datagram) {
            self.sent += 1;
            let arrival = now + passing.delay;
            let flight =
                (arrival, self.sent, endpoint as u8, direction == Direction::Report, passing.impostor, passing.bytes);
            self.flights.push(Reverse(flight));
        }
    }

    /// Advances the time to the next event, at most to a deadline; returns whether there was one.
    fn advance(&mut self, deadline: Nanos) -> bool {
        let flight = self.flights.peek().map_or(Nanos(i64::MAX), |flight| flight.0.0);
        let next = flight.min(self.facility.next());
        if next > deadline {
            return false;
        }
        self.clock.sleep_until(next);
        if next == flight {
            self.land();
            return true;
        }
        let mut out: Vec<(Endpoint, Vec<u8>)> = Vec::new();
        self.facility.run_until(next, &mut |endpoint, _, datagram| out.push((endpoint, datagram.to_vec())));
        out.iter().for_each(|(endpoint, datagram)| self.launch(*endpoint, Direction::Report, datagram));
        true
    }

    /// Delivers the next datagram.
    fn land(&mut self) {
        let Some(Reverse((at, _, endpoint, report, impostor, bytes))) = self.flights.pop() else {
            return;
        };
        let endpoint = ENDPOINTS[usize::from(endpoint)];
        if report {
            let from = if impostor { stranger() } else { address_of(endpoint) };
            self.inbox[endpoint as usize].push_back((from, at, bytes));
            return;
        }
        let from = if impostor { stranger() } else { our_address(endpoint) };
        let mut out: Vec<Vec<u8>> = Vec::new();
        self.facility.take(endpoint, at, from, &bytes, &mut |_, _, datagram| out.push(datagram.to_vec()));
        out.iter().for_each(|datagram| self.launch(endpoint, Direction::Report, datagram));
    }
}

/// Our port of a link.
pub struct NetworkPort {
    network: Rc<RefCell<Network>>,
    endpoint: Endpoint,
    arrived: Nanos,
}

impl NetworkPort {
    /// Creates the port of an endpoint.
    pub fn new(network: &Rc<RefCell<Network>>, endpoint: Endpoint) -> Self {
        Self { network: Rc::clone(network), endpoint, arrived: Nanos(0) }
    }
}

impl Port for NetworkPort {
    fn now(&self) -> Nanos {
        self.network.borrow().clock.now()
    }

    fn receive(&mut self, buffer: &mut [u8], deadline: Nanos) -> io::Result<Option<(usize, SocketAddr)>> {
        let mut network = self.network.borrow_mut();
        // All events that are due by now are processed before the port is read.
        let now = network.clock.now();
        while network.advance(now) {}
        loop {
            if let Some((from, at, bytes)) = network.inbox[self.endpoint as usize].pop_front() {
                let length = bytes.len().min(buffer.len());
                buffer[..length].copy_from_slice(&bytes[..length]);
                self.arrived = at;
                return Ok(Some((length, from)));
            }
            if !network.advance(deadline) {
                network.clock.sleep_until(deadline);
                return Ok(None);
            }
        }
    }

    fn arrived(&self) -> Nanos {
        self.arrived
    }

    fn send(&mut self, datagram: &[u8], _to: SocketAddr) -> io::Result<()> {
        let mut network = self.network.borrow_mut();
        let now = network.clock.now();
        network.answers.push((now, self.endpoint, datagram.to_vec()));
        network.launch(self.endpoint, Direction::Answer, datagram);
        Ok(())
    }
}
