//! Identifies the dead time between a robot's commands and its motion from the records of a session.
//!
//! Commands define a position for every instant: interpolators move linearly between them. This trajectory is filtered
//! by the robot's lag, if it has one, shifted by the dead time, and fitted to the measured axes by least squares.

mod fit;
mod response;

pub use response::Lag;

use super::start::moved;
use crate::log::codes::{OrderKind, robot_flags};
use crate::log::record::{CycleRecord, RobotRecord};
use crate::signals::AXES;
use crate::time::Nanos;
use response::Course;

/// Least range of an axis' commands that counts as motion \[rad\], \[m\].
const MOVING: f64 = 1e-3;

/// Clock of the time stamps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DelayClock {
    /// The robot's own stamps (IPOC of RSI), without network jitter.
    Robot,
    /// Arrival times of the reports on our clock.
    Ours,
}

/// Command timing that a protocol states.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProtocolTiming {
    /// Period of its commands.
    pub cycle: Nanos,
    /// Time from a report to the instant for which the command that answers it is meant.
    pub ahead: Nanos,
}

impl ProtocolTiming {
    /// Creates the timing of robots emulated in process, and of drives in CSP: a command is for the end of its cycle.
    pub fn one_cycle(cycle: Nanos) -> Self {
        Self { cycle, ahead: cycle }
    }

    /// Creates the timing of RSI: an answer is taken at the end of its cycle, and reached at the end of the next one.
    pub fn two_cycles(cycle: Nanos) -> Self {
        Self { cycle, ahead: cycle * 2 }
    }
}

/// Prior knowledge of a robot's lag.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ServoResponse {
    /// No lag: dead time only.
    None,
    /// Known lag.
    Known(Lag),
    /// First order; fitted.
    First,
    /// Second order with a zero; fitted.
    Second,
}

/// The identified dead time of a robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeadTime {
    /// Dead time in addition to the protocol's stated timing \[s\].
    pub dead_time: f64,
    /// Standard error \[s\]; accounts for the correlation of successive residuals.
    pub error: f64,
    /// The lag fitted together with the dead time.
    pub lag: Option<Lag>,
    /// Root mean square of the residuals \[rad\], \[m\].
    pub residual: f64,
    /// Samples of moving axes.
    pub samples: usize,
}

impl DeadTime {
    /// Returns the delay of slow motion: dead time plus the lag's delay at low frequency \[s\].
    pub fn of_slow_motion(&self) -> f64 {
        self.dead_time + self.lag.map_or(0.0, Lag::delay)
    }
}

/// Identifies the dead times of robots 1 and 2 (of the emulated ones, if both kinds exist) from a session's records in
/// order; `None` for a robot that has not moved.
///
/// The dead time counts from the instant for which a command was meant (the report that it answered plus
/// [`ProtocolTiming::ahead`]) to the report that shows the axes there. With [`ProtocolTiming::one_cycle`] a command
/// sent at t and reached at t + cycle has a dead time of 0; over RSI, one reached two cycles after the report that it
/// answered. With [`DelayClock::Robot`] both instants are the robot's own stamps. With [`DelayClock::Ours`] both are
/// arrivals on our clock: a constant transport time of the reports cancels and their jitter is noise.
///
/// Lost records and packets are held over, as the robots do. Only fast changes of speed make lag and dead time
/// separately identifiable: see [`DeadTime::error`].
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
    /// Commanded positions.
    course: Course,
    /// Times \[s\] and positions of the measurements.
    measured: Vec<(f64, f64)>,
}

/// Collects the moving axes of a robot.
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
            // A time near zero has all digits as a floating-point number.
            let time = (instant - *begin.get_or_insert(instant)).seconds();
            let Some(command) = commanded_axes(record).or_else(|| commands.last().map(|(_, last)| *last)) else {
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

/// Returns the command of a robot in a cycle; `None` if it was to hold or nothing was sent.
fn commanded_axes(record: &RobotRecord) -> Option<[f64; AXES]> {
    matches!(record.order, OrderKind::Move | OrderKind::End).then_some(record.command)
}

/// Adds a command; after a gap the trajectory stays constant until the command's own cycle.
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
