//! What crosses a facility's links, whatever the protocol: joint positions, torques and wrenches in SI units.
//!
//! Everything here is `Copy`: the cycle allocates nothing.

use crate::time::Nanos;
use softdock_kernels::space::Wrench;
use softdock_kernels::vector::Pose;

/// Axes of a robot: six joints and, last, the rail under it (0 where there is none).
pub const AXES: usize = 7;
/// The rail among the axes; metres and newtons there.
pub const RAIL: usize = 6;

/// Largest joint angle that is believed or sent \[rad\]: four turns, more than any industrial robot's endless axis shows.
pub const MAX_JOINT: f64 = 8.0 * std::f64::consts::PI;
/// Largest rail position that is believed or sent \[m\].
pub const MAX_RAIL: f64 = 100.0;
/// Largest torque \[N m\] or force \[N\] that is believed.
pub const MAX_EFFORT: f64 = 1e6;

/// Whether axes are finite and no further than any robot's: a guard against garbage, far outside the limits of a cell.
pub fn plausible(position: &[f64; AXES]) -> bool {
    // Written so that NaN is refused.
    position[..RAIL].iter().all(|joint| joint.abs() <= MAX_JOINT) && position[RAIL].abs() <= MAX_RAIL
}

/// What a robot can be asked for and tells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capabilities {
    /// Period of its commands.
    pub cycle: Nanos,
    /// It gives the beat: each of its packets wants one answer within its cycle.
    pub master: bool,
    /// It has a rail.
    pub rail: bool,
    /// It reports torques (or motor currents scaled to torques).
    pub torque: bool,
    /// It reports the pose of its tool.
    pub pose: bool,
}

/// A robot's report of one cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RobotState {
    /// Its own time: IPOC of RSI, the time stamp of FANUC and EGM, the distributed clock of EtherCAT.
    pub stamp: Nanos,
    /// When it arrived, on our clock.
    pub received: Nanos,
    /// Measured axes: joints \[rad\], rail \[m\].
    pub position: [f64; AXES],
    /// The set-points that it follows, if it tells them: joints \[rad\], rail \[m\].
    pub asked: Option<[f64; AXES]>,
    /// Torques of the joints \[N m\] and force of the rail \[N\], if it tells them.
    pub torque: Option<[f64; AXES]>,
    /// Pose of its tool in its base, if it tells it \[m\].
    pub pose: Option<Pose<f64>>,
    /// Answers of ours that it counts as late or missing.
    pub late_answers: u32,
    /// It follows commands: drives on, no fault, no stop.
    pub ready: bool,
}

/// What a robot is told for a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Order {
    /// Ask for no motion: corrections of zero, targets where the axes are, drives not enabled. What a dry run sends.
    Hold,
    /// Be there at the end of the cycle: joints \[rad\], rail \[m\].
    Move([f64; AXES]),
    /// Stay there and end the session by the protocol's own controlled end.
    End([f64; AXES]),
}

impl RobotState {
    /// Where its controller holds it, or where it stands if it does not tell that: joints \[rad\], rail \[m\].
    pub fn set_point(&self) -> [f64; AXES] {
        self.asked.unwrap_or(self.position)
    }
}

/// The tolerance of an axis: a joint's \[rad\] or the rail's \[m\].
pub(crate) fn of_axis([joint, rail]: [f64; 2], axis: usize) -> f64 {
    if axis == RAIL { rail } else { joint }
}

/// An axis as users call it.
pub fn axis_name(axis: usize) -> String {
    if axis == RAIL { "rail".to_owned() } else { format!("axis {}", axis + 1) }
}

/// A sample of the force/torque sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceSample {
    /// When it arrived, on our clock.
    pub received: Nanos,
    /// The sensor's own count of samples.
    pub sequence: u32,
    /// Force \[N\] and moment \[N m\] in the sensor's axes, about its origin, as measured.
    pub wrench: Wrench<f64>,
    /// Of all samples since the last look, the one whose force is farthest from the one before them.
    pub peak: Wrench<f64>,
    /// The sensor says that this is beyond its range.
    pub saturated: bool,
    /// The sensor says that this may not be used (any other error).
    pub invalid: bool,
}

impl ForceSample {
    /// A good sample that stands for itself alone.
    pub fn new(received: Nanos, sequence: u32, wrench: Wrench<f64>) -> Self {
        Self { received, sequence, wrench, peak: wrench, saturated: false, invalid: false }
    }
}

/// The sample since the last look whose force is farthest from what that look saw.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Peak {
    looked: Option<Wrench<f64>>,
    farthest: Option<Wrench<f64>>,
}

impl Peak {
    /// One more sample.
    pub(crate) fn see(&mut self, sample: Wrench<f64>) {
        let away = |from: Wrench<f64>, wrench: Wrench<f64>| (wrench.force - from.force).norm();
        let nearer = |from, farthest| away(from, sample) < away(from, farthest);
        if !self.looked.zip(self.farthest).is_some_and(|(from, farthest)| nearer(from, farthest)) {
            self.farthest = Some(sample);
        }
    }

    /// A look, whose newest sample this is; gives the farthest one.
    pub(crate) fn look(&mut self, newest: Wrench<f64>) -> Wrench<f64> {
        self.looked = Some(newest);
        self.farthest.take().unwrap_or(newest)
    }
}

/// What a link has seen since it was opened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LinkCounters {
    /// Datagrams taken.
    pub received: u64,
    /// Datagrams that never came, by the sender's own count.
    pub lost: u64,
    /// Datagrams that came after a newer one, or twice: not used.
    pub stale: u64,
    /// Datagrams that could not be read.
    pub malformed: u64,
    /// Datagrams of somebody else.
    pub foreign: u64,
    /// Reports that a newer one had overtaken before anybody looked at them: not answered.
    pub overtaken: u64,
    /// Answers not sent, because their cycle was over.
    pub unsent: u64,
}

/// Why a link cannot go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LinkFault {
    /// The operating system refuses.
    #[error("the network interface failed: {0:?}")]
    Io(std::io::ErrorKind),
    /// The other side has ended the session or reports a fault.
    #[error("the other side has stopped: {0}")]
    Stopped(&'static str),
    /// The other side is not what was configured.
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

/// A robot, whatever its protocol; also an emulated one.
pub trait RobotLink {
    /// What it can do.
    fn capabilities(&self) -> Capabilities;

    /// Its newest report, waiting for one until `deadline` on the clock of its port; `None` if none came.
    ///
    /// # Errors
    /// If the link cannot go on. A lost, late, foreign or malformed datagram is no error, but counted.
    fn receive(&mut self, deadline: Nanos) -> Result<Option<RobotState>, LinkFault>;

    /// Answers the last report; nothing is sent when that report's cycle is over, but counted.
    ///
    /// # Errors
    /// If the link cannot go on.
    fn send(&mut self, order: &Order) -> Result<(), LinkFault>;

    /// What the link has seen.
    fn counters(&self) -> LinkCounters;
}

/// A force/torque sensor, whatever its protocol; also an emulated one.
pub trait ForceSensor {
    /// Period of its samples.
    fn period(&self) -> Nanos;

    /// The newest sample that has arrived since the last call; `None` if none has.
    ///
    /// # Errors
    /// If the link cannot go on.
    fn latest(&mut self) -> Result<Option<ForceSample>, LinkFault>;

    /// What the link has seen.
    fn counters(&self) -> LinkCounters;
}

/// Both robots and the sensor.
pub struct Links {
    /// Robots 1 and 2.
    pub robots: [Box<dyn RobotLink>; 2],
    /// The sensor.
    pub sensor: Box<dyn ForceSensor>,
}

/// How a robot stands to what it has been sent; all of it counts from its first answer with a motion.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WireState {
    /// Answers that the robot has not taken.
    pub untaken: u64,
    /// The same in a row.
    pub untaken_in_row: u32,
    /// Cycles in a row in which the robot has reported a set-point that nobody here has sent.
    pub off_course: u32,
    /// Reports that came too early: the robot's cycle has become shorter than it was.
    pub early: u32,
    /// Cycles in a row in which it is away from its commands and led back within its limits.
    pub led_back: u32,
    /// 1 while what it is sent moves.
    pub moving: u32,
}
