//! The dead time between a robot's commands and its motion, measured from the records of a drive.
//!
//! What a command asks of an axis is known for every instant: interpolators move on lines between commands. That
//! course, seen through the robot's own lag if it has one and shifted by the dead time, is fitted to the measured axes
//! by least squares.

mod fit;
mod response;

pub use response::Lag;

use super::start::moved;
use crate::log::codes::{OrderKind, robot_flags};
use crate::log::record::{CycleRecord, RobotRecord};
use crate::signals::AXES;
use crate::time::Nanos;
use response::Course;

/// An axis moves if its commands span this much \[rad\], \[m\].
const MOVING: f64 = 1e-3;

/// Which clock counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DelayClock {
    /// The robot's own stamps (IPOC of RSI): what the network does to datagrams does not count.
    Robot,
    /// Arrivals of its reports on our clock.
    Ours,
}

/// What a protocol states of a robot's commands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProtocolTiming {
    /// Period of its commands.
    pub cycle: Nanos,
    /// From the instant of a report to the one for which the command that answers it is meant.
    pub ahead: Nanos,
}

impl ProtocolTiming {
    /// Emulated in process, and drives in CSP: a command is for the end of the cycle that begins with it.
    pub fn one_cycle(cycle: Nanos) -> Self {
        Self { cycle, ahead: cycle }
    }

    /// RSI: an answer is taken at the end of its cycle, and reached at the end of the next one.
    pub fn two_cycles(cycle: Nanos) -> Self {
        Self { cycle, ahead: cycle * 2 }
    }
}

/// What is known of a robot's own lag.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ServoResponse {
    /// It has none: all that delays it is dead time.
    None,
    /// This one.
    Known(Lag),
    /// Of first order; to be fitted.
    First,
    /// Of second order with a zero; to be fitted.
    Second,
}

/// The measured dead time of a robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeadTime {
    /// Dead time beyond what the protocol states \[s\].
    pub dead_time: f64,
    /// Its standard error \[s\], with the correlation of successive residuals in the count of samples.
    pub error: f64,
    /// The lag with which the dead time goes.
    pub lag: Option<Lag>,
    /// Root mean square of what stays unexplained \[rad\], \[m\].
    pub residual: f64,
    /// Samples of moving axes.
    pub samples: usize,
}

impl DeadTime {
    /// How much later slow motion comes: the dead time and the lag's own delay at low frequency \[s\].
    pub fn of_slow_motion(&self) -> f64 {
        self.dead_time + self.lag.map_or(0.0, Lag::delay)
    }
}

/// Dead times of robots 1 and 2 (of the emulated ones, where both kinds are there), from a drive's records in order;
/// `None` for a robot that has not moved.
///
/// It counts from the instant for which a command was meant, which is the instant of the report that it answered and
/// [`ProtocolTiming::ahead`], to the instant of the report that shows the axes there. So with [`ProtocolTiming::one_cycle`] a command
/// sent at t and reached at t + cycle has a dead time of 0, and over RSI one that is reached two cycles after the
/// report that it answered. With [`DelayClock::RobotLink`] both instants are the robot's own stamps; with [`DelayClock::Ours`] both are
/// arrivals on our clock, so that a constant transport of the reports cancels and their jitter is noise.
///
/// Records that the log has lost, and lost packets, are held over as the robots do. A fitted lag and the dead time are
/// told apart by quick changes of speed alone: see [`DeadTime::error`].
pub fn delays(
    records: &[CycleRecord],
    stated: [ProtocolTiming; 2],
    timing: DelayClock,
    response: [ServoResponse; 2],
) -> [Option<DeadTime>; 2] {
    std::array::from_fn(|robot| {
        let history = History::of(records, robot, stated[robot], timing);
        fit::fit(&history.axes, response[robot])
    })
}

/// Commands and measurements of one axis.
struct Axis {
    /// Where it was asked to be.
    course: Course,
    /// When it was measured \[s\], and where.
    measured: Vec<(f64, f64)>,
}

/// The moving axes of a robot.
struct History {
    axes: Vec<Axis>,
}

impl History {
    fn of(records: &[CycleRecord], robot: usize, stated: ProtocolTiming, timing: DelayClock) -> Self {
        let mut commands: Vec<(f64, [f64; AXES])> = Vec::new();
        let mut measured: Vec<(f64, [f64; AXES])> = Vec::new();
        let mut begin = None;
        for record in records.iter().map(|record| moved(record)[robot]) {
            if record.flags & robot_flags::FRESH == 0 {
                continue;
            }
            let instant = if timing == DelayClock::Robot { record.stamp } else { record.received };
            // Near zero a number of seconds has all its digits.
            let time = (instant - *begin.get_or_insert(instant)).seconds();
            let Some(command) = told(record).or_else(|| commands.last().map(|(_, last)| *last)) else {
                continue;
            };
            measured.push((time, record.position));
            hold_over(&mut commands, time + stated.ahead.seconds(), stated.cycle.seconds(), command);
        }
        let axes = (0..AXES).map(|axis| Axis {
            course: Course::new(commands.iter().map(|(time, axes)| (*time, axes[axis]))),
            measured: measured.iter().map(|(time, axes)| (*time, axes[axis])).collect(),
        });
        Self { axes: axes.filter(|axis| axis.course.span() > MOVING).collect() }
    }
}

/// What a robot was told in a cycle; nothing if it was asked to stay or nothing was sent.
fn told(record: &RobotRecord) -> Option<[f64; AXES]> {
    matches!(record.order, OrderKind::Move | OrderKind::End).then_some(record.command)
}

/// Adds a command; one after a gap is not approached before its own cycle.
fn hold_over(commands: &mut Vec<(f64, [f64; AXES])>, time: f64, cycle: f64, command: [f64; AXES]) {
    if let Some((last, held)) = commands.last().copied() {
        if time <= last {
            return;
        }
        if time - last > 1.5 * cycle {
            commands.push((time - cycle, held));
        }
    }
    commands.push((time, command));
}
