//! The protocols of robots and sensors: each with its codec, our driver, and the other side for the emulated facility.

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

/// Where an emulated endpoint puts the datagrams that it sends.
pub type Outbox<'a> = &'a mut dyn FnMut(SocketAddr, &[u8]);

/// The controller of an emulated robot: no socket, no clock of its own, so that it also runs in virtual time.
pub trait EmulatedController: Send {
    /// Period of its cycle.
    fn cycle(&self) -> Nanos;

    /// Goes on with another cycle, for tests of what notices that; a controller without a cycle of its own ignores it.
    fn change_cycle(&mut self, _cycle: Nanos) {}

    /// Takes a datagram.
    fn take(&mut self, now: Nanos, from: SocketAddr, datagram: &[u8], out: Outbox);

    /// Where its interpolator asks the axes to be now: joints \[rad\], rail \[m\].
    fn target(&mut self, now: Nanos) -> [f64; AXES];

    /// Begins its next cycle: reports the measured state, and counts an answer that has not come.
    fn report(&mut self, now: Nanos, state: &RobotState, out: Outbox);

    /// Answers that were late or missing, if it counts them.
    fn late_answers(&self) -> u32 {
        0
    }

    /// Why it has stopped following, if it has.
    fn fault(&self) -> Option<&'static str>;

    /// A client commands it, or did so until a moment ago.
    fn has_client(&self) -> bool;

    /// Offers a new session after one that has ended, with its robot held at these axes: joints \[rad\], rail \[m\].
    fn renew(&mut self, at: [f64; AXES]);
}

/// The electronics of an emulated sensor: no socket, no clock of its own.
pub trait SensorBox: Send {
    /// Period of its samples.
    fn period(&self) -> Nanos;

    /// Takes a datagram.
    fn take(&mut self, now: Nanos, from: SocketAddr, datagram: &[u8], out: Outbox);

    /// Sends a sample, if anybody has asked for them.
    fn report(&mut self, now: Nanos, sample: &ForceSample, out: Outbox);
}

/// What an interpolator does within a cycle: it moves on a line from where it was to where it is asked to be.
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
