//! A port in memory with a settable clock: tests connect driver and emulated device without a network.

use crate::protocol::{EmulatedController, SensorBox};
use crate::signals::{AXES, RobotState};
use crate::time::Nanos;
use crate::wire::Port;
use std::collections::VecDeque;
use std::io;
use std::net::SocketAddr;
use std::sync::{Arc, Mutex};

#[derive(Default)]
struct Shared {
    now: Nanos,
    incoming: VecDeque<(SocketAddr, Vec<u8>)>,
    sent: Vec<(SocketAddr, Vec<u8>)>,
}

/// The driver's end; the test holds the other.
#[derive(Clone, Default)]
pub(crate) struct MemoryPort(Arc<Mutex<Shared>>);

/// Address of the tests' device.
pub(crate) fn peer() -> SocketAddr {
    SocketAddr::from(([192, 168, 1, 2], 49152))
}

/// Address of the driver.
pub(crate) fn local() -> SocketAddr {
    SocketAddr::from(([192, 168, 1, 1], 59152))
}

impl MemoryPort {
    pub(crate) fn set_now(&self, now: Nanos) {
        self.0.lock().unwrap().now = now;
    }

    /// Advances the time; returns it.
    pub(crate) fn now_after(&self, time: Nanos) -> Nanos {
        let mut shared = self.0.lock().unwrap();
        shared.now += time;
        shared.now
    }

    pub(crate) fn deliver(&self, from: SocketAddr, datagram: &[u8]) {
        self.0.lock().unwrap().incoming.push_back((from, datagram.to_vec()));
    }

    /// Returns the datagrams sent since the last call.
    pub(crate) fn sent(&self) -> Vec<(SocketAddr, Vec<u8>)> {
        std::mem::take(&mut self.0.lock().unwrap().sent)
    }

    /// Runs a controller's next cycle and delivers its datagrams.
    pub(crate) fn report(&self, controller: &mut dyn EmulatedController, state: &RobotState) {
        let now = self.now();
        controller.report(now, state, &mut |_, datagram| self.deliver(peer(), datagram));
    }

    /// Delivers the driver's datagrams to a controller.
    pub(crate) fn answer(&self, controller: &mut dyn EmulatedController) {
        let now = self.now();
        for (_, datagram) in self.sent() {
            controller.take(now, local(), &datagram, &mut |_, reply| self.deliver(peer(), reply));
        }
    }

    /// Delivers the driver's datagrams to a sensor.
    pub(crate) fn answer_sensor(&self, sensor: &mut dyn SensorBox) {
        let now = self.now();
        for (_, datagram) in self.sent() {
            sensor.take(now, local(), &datagram, &mut |_, reply| self.deliver(peer(), reply));
        }
    }
}

impl Port for MemoryPort {
    fn now(&self) -> Nanos {
        self.0.lock().unwrap().now
    }

    fn receive(&mut self, buffer: &mut [u8], _deadline: Nanos) -> io::Result<Option<(usize, SocketAddr)>> {
        Ok(self.0.lock().unwrap().incoming.pop_front().map(|(from, datagram)| {
            let length = datagram.len().min(buffer.len());
            buffer[..length].copy_from_slice(&datagram[..length]);
            (length, from)
        }))
    }

    fn send(&mut self, datagram: &[u8], to: SocketAddr) -> io::Result<()> {
        self.0.lock().unwrap().sent.push((to, datagram.to_vec()));
        Ok(())
    }
}

/// Creates a measured state at these axes.
pub(crate) fn state_at(position: [f64; AXES], now: Nanos) -> RobotState {
    RobotState {
        stamp: now,
        received: now,
        position,
        reported_set_point: Some(position),
        torque: Some([0.0; AXES]),
        pose: None,
        late_answers: 0,
        ready: true,
    }
}
