//! Rates of the loop, and the dead times that follow from them.

use crate::real::Real;

/// Rates of the loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timing {
    /// Integration step \[s\].
    pub substep: f64,
    /// Substeps in a tick (one command period).
    pub substeps: u32,
    /// A run ends after this many ticks.
    pub max_ticks: u32,
}

impl Timing {
    /// The command period \[s\].
    pub fn tick(&self) -> f64 {
        self.substep * f64::from(self.substeps)
    }

    /// The dead time that the frame itself causes \[s\]: a wrench held over a tick, `(T - dt) / 2`.
    ///
    /// Half the hold is `T / 2`; semi-implicit Euler moves with the velocity of the step's end, which
    /// gives half a substep back (checked by the half-tick oracle).
    pub fn own_delay(&self) -> f64 {
        0.5 * (self.tick() - self.substep)
    }

    /// Dead time of the loop \[s\]: the frame's own, the sensor's and the transport of commands.
    pub fn loop_delay(&self, sensor: f64, transport: f64) -> f64 {
        self.own_delay() + sensor + transport
    }

    /// Transport delay of commands \[s\] in a loop with this dead time and sensor delay; inverse of
    /// [`loop_delay`](Self::loop_delay).
    #[inline(always)]
    pub fn transport_delay<R: Real>(&self, loop_delay: R, sensor: R) -> R {
        let own = R::lit(self.own_delay());
        loop_delay - sensor - own
    }
}
