//! What a cycle hands to the operator: a small sample each cycle and a notice now and then, over rings that never wait.

use super::checklist::{Check, Checklist};
use super::core::Core;
use super::guard::Alarm;
use crate::log::codes::{Phase, StopCause, cycle_flags};
use crate::log::record::{CycleRecord, LimitFlags, RobotRecord};
use crate::signals::AXES;
use crate::time::Nanos;
use rtrb::{Consumer, Producer, RingBuffer};
use softdock_kernels::vector::{Pose, Vec3};

/// Samples that wait for the view: four seconds at 1 kHz.
pub(crate) const RING_SAMPLES: usize = 4096;
/// Notices that wait for the view.
const RING_NOTICES: usize = 64;

/// What the view needs of one cycle.
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
    /// Distance of part A, part B from where the simulation has them \[m\].
    pub tracking: [f64; 2],
    /// Energy that the contact has created \[J\].
    pub energy: f64,
    /// Age of the sensor's sample.
    pub sensor_age: Nanos,
    /// Cycles so far whose work took too long.
    pub overruns: u64,
    /// Records that the log has lost.
    pub log_dropped: u64,
    /// Robots 1 and 2.
    pub robots: [RobotSample; 2],
}

/// What the view needs of a robot in one cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RobotSample {
    /// There is one; the emulated one where no real one is driven.
    pub present: bool,
    /// Start of the cycle after its due instant.
    pub lateness: Nanos,
    /// From its report to our answer.
    pub round_trip: Nanos,
    /// Packets that never came.
    pub lost: u64,
    /// Packets that came too late to be used.
    pub stale: u64,
    /// Answers that came too late for the robot, or were not sent because they would have.
    pub late: u64,
    /// Share of each axis' nearest limit in use, 1 at the limit.
    pub limit_used: [f64; AXES],
    /// Limits that the command has met.
    pub limits: LimitFlags,
}

impl Sample {
    /// What the view needs of a record.
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

/// What the view needs besides, now and then.
#[derive(Clone, Copy, Debug, Default)]
pub struct Notice {
    /// The checks of the start-up.
    pub checklist: Checklist,
    /// The check that has refused the session.
    pub refusal: Option<Check>,
    /// When the session was stopped, since its start, and why.
    pub stopped: Option<(Nanos, Alarm)>,
    /// How far robot 1 has moved its part back after the stop \[m\].
    pub retracted: Option<f64>,
}

/// A notice every so many cycles, and one at the end.
const NOTICE_EVERY: u64 = 25;

/// The cycle's end of the view.
pub struct Feed {
    ring: Producer<Sample>,
    notices: Producer<Notice>,
}

impl Feed {
    /// Shows what the decisions have found, every 25th cycle and at the end; neither waits nor allocates.
    pub fn notice(&mut self, core: &Core) {
        let record = core.record();
        if record.cycle.is_multiple_of(NOTICE_EVERY) || record.phase == Phase::Stopped {
            let (refusal, stopped) = (core.refusal(), core.stopped());
            let retracted = core.retracted();
            let _ = self.notices.push(Notice { checklist: *core.checklist(), refusal, stopped, retracted });
        }
    }

    /// Shows a cycle, unless the view is behind; neither waits nor allocates.
    pub fn push(&mut self, record: &CycleRecord) {
        // A cycle that the view misses is in the log.
        let _ = self.ring.push(Sample::of(record));
    }
}

/// The view's end of what a cycle hands over.
pub struct Samples {
    ring: Consumer<Sample>,
    notices: Consumer<Notice>,
}

impl Samples {
    /// The next cycle that the view has not seen; none if it has seen all.
    pub fn next_sample(&mut self) -> Option<Sample> {
        self.ring.pop().ok()
    }

    /// The next notice that the view has not seen.
    pub fn next_notice(&mut self) -> Option<Notice> {
        self.notices.pop().ok()
    }

    /// Whether the cycle has dropped its end: no more samples come.
    pub fn is_abandoned(&self) -> bool {
        self.ring.is_abandoned()
    }
}

/// The cycle's end and the view's end of the rings between them, their memory touched.
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
