//! Data from the cycle to the operator's view over lock-free rings: a sample each cycle, and occasional notices.

use super::checklist::{Check, Checklist};
use super::core::Core;
use super::guard::Alarm;
use crate::log::codes::{Phase, StopCause, cycle_flags};
use crate::log::record::{CycleRecord, LimitFlags, RobotRecord};
use crate::signals::AXES;
use crate::time::Nanos;
use rtrb::{Consumer, Producer, RingBuffer};
use softdock_kernels::vector::{Pose, Vec3};

/// Capacity of the sample ring: four seconds at 1 kHz.
pub(crate) const RING_SAMPLES: usize = 4096;
/// Capacity of the notice ring.
const RING_NOTICES: usize = 64;

/// Sample of a cycle for the view.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// Cycle since the start of the drive.
    pub cycle: u64,
    /// Time since the start of the drive.
    pub time: Nanos,
    /// Phase.
    pub phase: Phase,
    /// Cause of the stop.
    pub cause: StopCause,
    /// The real robots get the commands.
    pub armed: bool,
    /// Magnitude of the compensated force \[N\].
    pub force: f64,
    /// Magnitude of the compensated moment \[N m\].
    pub moment: f64,
    /// Distance of part A, part B from their simulated positions \[m\].
    pub tracking: [f64; 2],
    /// Energy injected by the facility \[J\].
    pub energy: f64,
    /// Age of the sensor's sample.
    pub sensor_age: Nanos,
    /// Overruns so far.
    pub overruns: u64,
    /// Records lost by the log.
    pub log_dropped: u64,
    /// Robots 1 and 2.
    pub robots: [RobotSample; 2],
}

/// Sample of a robot for the view.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RobotSample {
    /// Whether the robot exists; the emulated one where no real one is driven.
    pub present: bool,
    /// Delay of the cycle's start after its due time.
    pub lateness: Nanos,
    /// Time from its report to our answer.
    pub round_trip: Nanos,
    /// Lost packets.
    pub lost: u64,
    /// Packets that arrived too late to be used.
    pub stale: u64,
    /// Answers that were late at the robot, or not sent because they would have been.
    pub late: u64,
    /// Share of each axis' nearest limit in use, 1 at the limit.
    pub limit_used: [f64; AXES],
    /// Limits that clamped the command.
    pub limits: LimitFlags,
}

impl Sample {
    /// Returns the sample of a record.
    pub fn of(record: &CycleRecord) -> Self {
        let force = &record.ft.compensated;
        let apart = |held: &Pose<f64>, simulated: Vec3<f64>| length(held.position.zip(simulated, |a, b| a - b));
        Self {
            cycle: record.cycle,
            time: record.time,
            phase: record.phase,
            cause: record.cause,
            armed: record.flags & cycle_flags::ARMED != 0,
            force: length(force.force),
            moment: length(force.moment),
            tracking: [
                apart(&record.part_a, record.simulated_part_a.position),
                apart(&record.part_b, record.simulated_part_b.position),
            ],
            energy: record.contact_energy,
            sensor_age: record.ft.age,
            overruns: record.overruns,
            log_dropped: record.log_dropped,
            robots: [
                RobotSample::of(&record.robot_1, &record.emulated_1),
                RobotSample::of(&record.robot_2, &record.emulated_2),
            ],
        }
    }
}

fn length(vector: Vec3<f64>) -> f64 {
    vector.dot(vector).sqrt()
}

impl RobotSample {
    fn of(real: &RobotRecord, emulated: &RobotRecord) -> Self {
        let robot = if real.present() { real } else { emulated };
        Self {
            present: robot.present(),
            lateness: robot.lateness,
            round_trip: robot.round_trip,
            lost: robot.link.lost,
            stale: robot.link.stale,
            late: robot.link.unsent.saturating_add(u64::from(robot.late_answers)),
            limit_used: robot.limit_used,
            limits: robot.limits,
        }
    }
}

/// Occasional data for the view.
#[derive(Clone, Copy, Debug, Default)]
pub struct Notice {
    /// The start-up checks.
    pub checklist: Checklist,
    /// The check that refused the session.
    pub refusal: Option<Check>,
    /// Time since the start and cause of the stop.
    pub stopped: Option<(Nanos, Alarm)>,
    /// Distance by which robot 1 has retracted its part after the stop \[m\].
    pub retracted: Option<f64>,
}

/// Cycles between two notices; one more is sent at the end.
const NOTICE_EVERY: u64 = 25;

/// The cycle's end of the rings.
pub struct Feed {
    ring: Producer<Sample>,
    notices: Producer<Notice>,
}

impl Feed {
    /// Sends a notice, every 25th cycle and at the end; neither waits nor allocates.
    pub fn notice(&mut self, core: &Core) {
        let record = core.record();
        if record.cycle.is_multiple_of(NOTICE_EVERY) || record.phase == Phase::Stopped {
            let (refusal, stopped) = (core.refusal(), core.stopped());
            let retracted = core.retracted();
            let _ = self.notices.push(Notice { checklist: *core.checklist(), refusal, stopped, retracted });
        }
    }

    /// Sends a sample, unless the ring is full; neither waits nor allocates.
    pub fn push(&mut self, record: &CycleRecord) {
        // The log has every sample that the view misses.
        let _ = self.ring.push(Sample::of(record));
    }
}

/// The view's end of the rings.
pub struct Samples {
    ring: Consumer<Sample>,
    notices: Consumer<Notice>,
}

impl Samples {
    /// Returns the next unread sample; `None` if all are read.
    pub fn next_sample(&mut self) -> Option<Sample> {
        self.ring.pop().ok()
    }

    /// Returns the next unread notice.
    pub fn next_notice(&mut self) -> Option<Notice> {
        self.notices.pop().ok()
    }

    /// Whether the cycle has closed its end: no more samples follow.
    pub fn is_abandoned(&self) -> bool {
        self.ring.is_abandoned()
    }
}

/// Creates both ends of the rings, with their memory touched.
pub fn feed() -> (Feed, Samples) {
    let (ring, samples) = touched(RING_SAMPLES, Sample::default());
    let (notices, noticed) = touched(RING_NOTICES, Notice::default());
    (Feed { ring, notices }, Samples { ring: samples, notices: noticed })
}

fn touched<T: Copy>(rooms: usize, value: T) -> (Producer<T>, Consumer<T>) {
    let (mut one, mut other) = RingBuffer::new(rooms);
    while one.push(value).is_ok() {}
    while other.pop().is_ok() {}
    (one, other)
}
