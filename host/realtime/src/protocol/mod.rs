//! Protocols of robots and sensors: each with codec, driver, and emulated device.

mod attitude;
pub mod egm;
pub mod ethercat;
pub mod fanuc;
pub(crate) mod link;
pub mod netft;
pub mod rsi;
mod text;

#[cfg(test)]
mod fuzz;
#[cfg(test)]
pub(crate) mod memory;

use crate::signals::{AXES, ForceSample, RobotState};
use crate::time::Nanos;
use std::net::SocketAddr;

/// Takes the datagrams that an emulated device sends.
pub type Outbox<'a> = &'a mut dyn FnMut(SocketAddr, &[u8]);

/// The controller of an emulated robot: without socket and clock, so that it also runs in virtual time.
pub trait EmulatedController: Send {
    /// Period of its cycle.
    fn cycle(&self) -> Nanos;

    /// Changes the cycle, for tests of its supervision; a controller without a cycle of its own ignores it.
    fn change_cycle(&mut self, _cycle: Nanos) {}

    /// Takes a datagram.
    fn take(&mut self, now: Nanos, from: SocketAddr, datagram: &[u8], out: Outbox);

    /// Returns the interpolator's present target of the axes: joints \[rad\], rail \[m\].
    fn target(&mut self, now: Nanos) -> [f64; AXES];

    /// Begins the next cycle: reports the measured state, and counts a missing answer.
    fn report(&mut self, now: Nanos, state: &RobotState, out: Outbox);

    /// Returns the count of late or missing answers, if the controller has one.
    fn late_answers(&self) -> u32 {
        0
    }

    /// Returns the reason why it has stopped following, if it has.
    fn fault(&self) -> Option<&'static str>;

    /// Whether a client commands it, or did so a moment ago.
    fn has_client(&self) -> bool;

    /// Offers a new session after one has ended, with the robot held at these axes: joints \[rad\], rail \[m\].
    fn renew(&mut self, at: [f64; AXES]);
}

/// The electronics of an emulated sensor: without socket and clock.
pub trait SensorBox: Send {
    /// Period of its samples.
    fn period(&self) -> Nanos;

    /// Takes a datagram.
    fn take(&mut self, now: Nanos, from: SocketAddr, datagram: &[u8], out: Outbox);

    /// Sends a sample, if a client has requested them.
    fn report(&mut self, now: Nanos, sample: &ForceSample, out: Outbox);
}

/// Interpolates linearly within a cycle from the previous to the present target.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Line {
    pub(crate) from: [f64; AXES],
    pub(crate) to: [f64; AXES],
    pub(crate) since: Nanos,
}

impl Line {
    pub(crate) fn at(&self, now: Nanos, cycle: Nanos) -> [f64; AXES] {
        let part = ((now - self.since).0 as f64 / cycle.0 as f64).clamp(0.0, 1.0);
        std::array::from_fn(|axis| self.from[axis] + part * (self.to[axis] - self.from[axis]))
    }
}
