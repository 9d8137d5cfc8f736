//! Transmission of the commands: laboratory poses once a millisecond, a transport delay, linear interpolation.

use super::bodies::Part;
use super::nominal::SHARE;
use crate::space::{Quaternion, Vector, difference, scaled, sum, turn_between, turned};

/// Commanded pose and twist of a robot at an instant.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct CommandedPose {
    /// Laboratory \[m\], \[m/s\].
    pub(crate) position: Vector,
    pub(crate) velocity: Vector,
    pub(crate) attitude: Quaternion,
    /// World axes \[rad/s\].
    pub(crate) omega: Vector,
}

impl CommandedPose {
    /// A little later \[s\].
    pub(crate) fn after(&self, time: f64) -> Self {
        let position = sum(self.position, scaled(time, self.velocity));
        Self { position, attitude: turned(self.attitude, scaled(time, self.omega)), ..*self }
    }
}

/// Where the robots hold simulated parts: each makes its share of the relative translation, and turns its own part.
pub(crate) fn shared([a, b]: &[Part; 2]) -> [(Vector, Quaternion); 2] {
    let gap = difference(a.position, b.position);
    [(scaled(SHARE, gap), a.attitude), (scaled(SHARE - 1.0, gap), b.attitude)]
}

/// Commands as they were sent, one every period from some time before the start on.
pub(crate) struct Path {
    /// \[s\]
    period: f64,
    delay: f64,
    /// When the first one is to be reached \[s\].
    begin: f64,
    poses: Vec<[(Vector, Quaternion); 2]>,
}

impl Path {
    pub(crate) fn new(period: f64, delay: f64, begin: f64) -> Self {
        Self { period, delay, begin, poses: Vec::new() }
    }

    /// Sends the next command, to be reached a period after the last one.
    pub(crate) fn send(&mut self, parts: &[Part; 2]) {
        self.poses.push(shared(parts));
    }

    /// What arrives at a time \[s\]; before the first two commands it is on the line through them.
    pub(crate) fn at(&self, time: f64) -> [CommandedPose; 2] {
        let place = (time - self.delay - self.begin) / self.period;
        let last = (place.floor().max(0.0) as usize).min(self.poses.len() - 2);
        let since = (place - last as f64) * self.period;
        std::array::from_fn(|robot| {
            let [(from, level), (to, end)] = [self.poses[last][robot], self.poses[last + 1][robot]];
            let velocity = scaled(1.0 / self.period, difference(to, from));
            let omega = scaled(1.0 / self.period, turn_between(level, end));
            CommandedPose { position: from, velocity, attitude: level, omega }.after(since)
        })
    }
}
