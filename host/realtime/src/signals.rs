//! Signals on a facility's links, independent of the protocol: joint positions, torques and wrenches in SI units.
//!
//! All types are `Copy`: the cycle allocates nothing.

use crate::time::Nanos;
use softdock_kernels::space::Wrench;
use softdock_kernels::vector::Pose;

/// Axes of a robot: six joints and, last, its rail (0 without one).
pub const AXES: usize = 7;
/// Index of the rail among the axes; its units are metres and newtons.
pub const RAIL: usize = 6;

/// Greatest joint angle that is accepted or sent \[rad\]: four turns, more than any industrial robot's endless axis.
pub const MAX_JOINT: f64 = 8.0 * std::f64::consts::PI;
/// Greatest rail position that is accepted or sent \[m\].
pub const MAX_RAIL: f64 = 100.0;
/// Greatest torque \[N m\] or force \[N\] that is accepted.
pub const MAX_EFFORT: f64 = 1e6;

/// Whether axes are finite and within these bounds: rejects corrupt data, far outside the limits of a cell.
pub fn plausible(position: &[f64; AXES]) -> bool {
    // This form refuses NaN.
    position[..RAIL].iter().all(|joint| joint.abs() <= MAX_JOINT) && position[RAIL].abs() <= MAX_RAIL
}

/// Capabilities of a robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capabilities {
    /// Period of its commands.
    pub cycle: Nanos,
    /// Whether it is the clock master: each of its packets needs one answer within its cycle.
    pub master: bool,
    /// Whether it has a rail.
    pub rail: bool,
    /// Whether it reports torques (or motor currents scaled to torques).
    pub torque: bool,
    /// Whether it reports the pose of its tool.
    pub pose: bool,
}

/// A robot's report of one cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RobotState {
    /// Robot time: IPOC of RSI, the time stamp of FANUC and EGM, the distributed clock of EtherCAT.
    pub stamp: Nanos,
    /// Arrival on our clock.
    pub received: Nanos,
    /// Measured axes: joints \[rad\], rail \[m\].
    pub position: [f64; AXES],
    /// Set-points, if reported: joints \[rad\], rail \[m\].
    pub reported_set_point: Option<[f64; AXES]>,
    /// Torques of the joints \[N m\] and force of the rail \[N\], if reported.
    pub torque: Option<[f64; AXES]>,
    /// Pose of its tool in its base, if reported \[m\].
    pub pose: Option<Pose<f64>>,
    /// Answers of ours that it reports as late or missing.
    pub late_answers: u32,
    /// Whether it follows commands: drives on, no fault, no stop.
    pub ready: bool,
}

/// Command of a robot for a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Order {
    /// No motion: corrections of zero, targets at the present axes, drives not enabled. Dry runs send this.
    Hold,
    /// Position at the end of the cycle: joints \[rad\], rail \[m\].
    Move([f64; AXES]),
    /// Hold and end the session by the protocol's own controlled end.
    End([f64; AXES]),
}

impl RobotState {
    /// Returns the set-point, or the measured axes if none is reported: joints \[rad\], rail \[m\].
    pub fn set_point(&self) -> [f64; AXES] {
        self.reported_set_point.unwrap_or(self.position)
    }
}

/// Returns the tolerance of an axis: a joint's \[rad\] or the rail's \[m\].
pub(crate) fn of_axis([joint, rail]: [f64; 2], axis: usize) -> f64 {
    if axis == RAIL { rail } else { joint }
}

/// Returns the name of an axis for users.
pub fn axis_name(axis: usize) -> String {
    if axis == RAIL { "rail".to_owned() } else { format!("axis {}", axis + 1) }
}

/// A sample of the force/torque sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceSample {
    /// Arrival on our clock.
    pub received: Nanos,
    /// The sensor's sample counter.
    pub sequence: u32,
    /// Force \[N\] and moment \[N m\] in the sensor's axes, about its origin, as measured.
    pub wrench: Wrench<f64>,
    /// The sample since the last read whose force changed most from its predecessor.
    pub peak: Wrench<f64>,
    /// The sensor reports saturation.
    pub saturated: bool,
    /// The sensor reports that this sample is not usable (any other error).
    pub invalid: bool,
}

impl ForceSample {
    /// Creates a valid single sample.
    pub fn new(received: Nanos, sequence: u32, wrench: Wrench<f64>) -> Self {
        Self { received, sequence, wrench, peak: wrench, saturated: false, invalid: false }
    }
}

/// Keeps the sample since the last read whose force is farthest from that of the last read.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Peak {
    looked: Option<Wrench<f64>>,
    farthest: Option<Wrench<f64>>,
}

impl Peak {
    /// Takes one more sample.
    pub(crate) fn see(&mut self, sample: Wrench<f64>) {
        let away = |from: Wrench<f64>, wrench: Wrench<f64>| (wrench.force - from.force).norm();
        let nearer = |from, farthest| away(from, sample) < away(from, farthest);
        if !self.looked.zip(self.farthest).is_some_and(|(from, farthest)| nearer(from, farthest)) {
            self.farthest = Some(sample);
        }
    }

    /// Reads with this newest sample; returns the farthest one.
    pub(crate) fn read(&mut self, newest: Wrench<f64>) -> Wrench<f64> {
        self.looked = Some(newest);
        self.farthest.take().unwrap_or(newest)
    }
}

/// Counters of a link since it was opened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LinkCounters {
    /// Datagrams taken.
    pub received: u64,
    /// Lost datagrams, by the sender's own count.
    pub lost: u64,
    /// Datagrams after a newer one, or repeated: not used.
    pub stale: u64,
    /// Malformed datagrams.
    pub malformed: u64,
    /// Datagrams from other hosts.
    pub foreign: u64,
    /// Reports replaced by a newer one before they were read: not answered.
    pub overtaken: u64,
    /// Answers not sent, because their cycle was over.
    pub unsent: u64,
}

/// Fault that ends a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LinkFault {
    /// The operating system reports an error.
    #[error("the network interface failed: {0:?}")]
    Io(std::io::ErrorKind),
    /// The other side has ended the session or reports a fault.
    #[error("the other side has stopped: {0}")]
    Stopped(&'static str),
    /// The other side does not match the configuration.
    #[error("the other side does not match its configuration: {0}")]
    Mismatch(&'static str),
    /// The protocol cannot express the command.
    #[error("the command cannot be sent: {0}")]
    Unsendable(&'static str),
}

impl From<std::io::Error> for LinkFault {
    fn from(error: std::io::Error) -> Self {
        Self::Io(error.kind())
    }
}

/// A link to a robot, real or emulated, of any protocol.
pub trait RobotLink {
    /// Returns the capabilities.
    fn capabilities(&self) -> Capabilities;

    /// Returns the newest report, waiting for one until `deadline` on the clock of its port; `None` if none arrived.
    ///
    /// # Errors
    /// If the link has failed. A lost, late, foreign or malformed datagram is counted and is no error.
    fn receive(&mut self, deadline: Nanos) -> Result<Option<RobotState>, LinkFault>;

    /// Answers the last report. An answer after the end of that report's cycle is counted and not sent.
    ///
    /// # Errors
    /// If the link has failed.
    fn send(&mut self, order: &Order) -> Result<(), LinkFault>;

    /// Returns the counters of the link.
    fn counters(&self) -> LinkCounters;
}

/// A link to a force/torque sensor, real or emulated, of any protocol.
pub trait ForceSensor {
    /// Period of its samples.
    fn period(&self) -> Nanos;

    /// Returns the newest sample since the last call; `None` if none has arrived.
    ///
    /// # Errors
    /// If the link has failed.
    fn latest(&mut self) -> Result<Option<ForceSample>, LinkFault>;

    /// Returns the counters of the link.
    fn counters(&self) -> LinkCounters;
}

/// Both robots and the sensor.
pub struct Links {
    /// Robots 1 and 2.
    pub robots: [Box<dyn RobotLink>; 2],
    /// The sensor.
    pub sensor: Box<dyn ForceSensor>,
}

/// State of a robot relative to its commands; counts from the first answer with a motion.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WireState {
    /// Answers that the robot has not taken.
    pub untaken: u64,
    /// Successive answers that the robot has not taken.
    pub untaken_in_row: u32,
    /// Successive cycles with a reported set-point that this machine has not sent.
    pub off_course: u32,
    /// Early reports: the robot's cycle has become shorter.
    pub early: u32,
    /// Successive cycles in which the robot is away from its commands and led back within its limits.
    pub led_back: u32,
    /// 1 while its commands move.
    pub moving: u32,
}
