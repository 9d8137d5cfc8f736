//! Configuration of an EtherCAT robot, and errors of its opening.

use super::CYCLE;
use super::mapping::Unusable;
use super::scale::AxisScale;
use super::watchdog::WATCHDOG;
use crate::signals::{AXES, RAIL};
use crate::time::Nanos;

/// One axis and the device that drives it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisConfig {
    /// Position of the device in the segment, from 0.
    pub station: usize,
    /// Its counts and the axis' SI units.
    pub scale: AxisScale,
}

/// An EtherCAT robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EtherCatConfig {
    /// The axes in use: joints 1 to 6, then the rail. `None`: the axis does not exist; it reads 0 and takes no targets.
    pub axes: [Option<AxisConfig>; AXES],
    /// Period of the cycle, of the drives' interpolation and of SYNC0; 1 ms by default.
    pub cycle: Nanos,
    /// Time in the cycle after which a frame counts as lost; half a cycle by default.
    pub answer: Nanos,
    /// Time without a frame after which drives switch off; set at the opening, [`WATCHDOG`] by default.
    pub watchdog: Nanos,
    /// Whether the drives latch their targets by SYNC0 of the distributed clocks, if all of them have these.
    pub clocks: bool,
    /// Whether faults that the drives have at the start are acknowledged, once. Later faults are never acknowledged: an
    /// operator checks the robot and opens it anew.
    pub reset_faults: bool,
}

impl EtherCatConfig {
    /// Creates axes on devices 0, 1, 2 .. of the segment, at 1 kHz; joints first, a seventh is the rail.
    pub fn new(scales: &[AxisScale]) -> Self {
        let axes = std::array::from_fn(|i| scales.get(i).map(|scale| AxisConfig { station: i, scale: *scale }));
        let cycle = CYCLE;
        Self { axes, cycle, answer: Nanos(cycle.0 / 2), watchdog: WATCHDOG, clocks: true, reset_faults: false }
    }

    /// Whether the robot has a rail.
    pub fn rail(&self) -> bool {
        self.axes[RAIL].is_some()
    }

    /// Checks the configuration.
    ///
    /// # Errors
    /// [`OpenError::Config`] with the axis and the reason.
    pub fn check(&self) -> Result<(), OpenError> {
        let flawed = |text: String| Err(OpenError::Config(text));
        if self.cycle.0 < 100_000 || self.cycle.0 > 100_000_000 {
            return flawed(format!("a cycle of {} ms is not between 0.1 and 100 ms", self.cycle.0 as f64 * 1e-6));
        }
        if self.answer.0 <= 0 || self.answer.0 > self.cycle.0 {
            return flawed("the frame time-out must be within the cycle".to_owned());
        }
        if self.watchdog.0 < 4 * self.cycle.0 || self.watchdog.0 > 1_000_000_000 {
            let ms = self.watchdog.0 as f64 * 1e-6;
            return flawed(format!("a watchdog of {ms} ms is not between 4 cycles and 1 s"));
        }
        let axes: Vec<_> = self.axes.iter().enumerate().filter_map(|(i, axis)| axis.map(|axis| (i, axis))).collect();
        if axes.is_empty() {
            return flawed("no axis has a drive".to_owned());
        }
        for (n, (i, axis)) in axes.iter().enumerate() {
            if let Some(flaw) = axis.scale.flaw() {
                return flawed(format!("axis {}: {flaw}", i + 1));
            }
            if let Some((other, _)) = axes[..n].iter().find(|(_, other)| other.station == axis.station) {
                return flawed(format!("axes {} and {} have the same drive {}", other + 1, i + 1, axis.station));
            }
        }
        Ok(())
    }
}

/// Error of opening an EtherCAT robot.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// The configuration is invalid.
    #[error("the configuration of the EtherCAT robot cannot be used: {0}")]
    Config(String),
    /// The interface cannot be opened.
    #[error(
        "interface {0} cannot be opened ({1}): check its name, that it is up, and that this process may open raw sockets (CAP_NET_RAW)"
    )]
    Interface(String, std::io::Error),
    /// The interface has failed later.
    #[error("the interface failed: {0}")]
    Io(#[from] std::io::Error),
    /// No device answers.
    #[error("no EtherCAT device answers on {0}: check cable and power, and that the link is up")]
    Silent(String),
    /// A step of the start-up failed.
    #[error("{0} failed: {1}")]
    Bus(&'static str, String),
    /// A step of the start-up timed out.
    #[error("{0} did not end within {1} s")]
    Late(&'static str, i64),
    /// The segment has no device at the position of an axis.
    #[error("axis {0} is configured for device {1} of the segment, which has only {2} devices")]
    NoDevice(usize, usize, usize),
    /// A drive has an unusable mapping of its process data.
    #[error("drive {0} ({1}): {2}")]
    Mapping(usize, String, Unusable),
    /// A drive lacks a capability, or its process data differ from its mapping.
    #[error("drive {0} ({1}): {2}")]
    Drive(usize, String, String),
}
