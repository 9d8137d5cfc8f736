//! The numbers that the operator's view shows, gathered from the cycles.

use crate::drive::checklist::{Check, Checklist};
use crate::drive::core::Core;
use crate::drive::guard::Alarm;
use crate::log::codes::{LimitKind, Phase, StopCause, cycle_flags};
use crate::log::record::{CycleRecord, LimitFlags, RobotRecord, TOOL};
use crate::signals::AXES;
use crate::time::Nanos;
use rtrb::Producer;
use softdock_kernels::vector::{Pose, Vec3};
use std::collections::VecDeque;

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
    pub(super) fn new(ring: Producer<Sample>, notices: Producer<Notice>) -> Self {
        Self { ring, notices }
    }

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

/// What may be used up before the drive stops; from the facility file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Budgets {
    /// Force \[N\].
    pub force_n: f64,
    /// Energy created by the contact \[J\].
    pub energy_j: f64,
}

/// Cycles whose times stand behind the percentiles: the last ten seconds at 1 kHz.
const WINDOW: usize = 10_000;
/// Time of one bar of the force's history; the bar is its largest force.
const BAR: Nanos = Nanos::from_millis(100);
/// Bars kept: as many as a wide terminal has columns.
const BARS: usize = 400;

/// Median, 99th percentile and maximum of a time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Percentiles {
    /// Median of the last ten seconds.
    pub p50: Nanos,
    /// 99th percentile of the last ten seconds.
    pub p99: Nanos,
    /// Largest since the start.
    pub max: Nanos,
}

/// The newest values of a time, and the largest of all.
#[derive(Clone, Debug, Default)]
struct Times {
    newest: VecDeque<i64>,
    max: i64,
}

impl Times {
    fn push(&mut self, time: Nanos) {
        if self.newest.len() == WINDOW {
            self.newest.pop_front();
        }
        self.newest.push_back(time.0);
        self.max = self.max.max(time.0);
    }

    fn percentiles(&self) -> Percentiles {
        let mut sorted: Vec<i64> = self.newest.iter().copied().collect();
        sorted.sort_unstable();
        // Nearest rank.
        let at = |share: f64| {
            let rank = (share * sorted.len() as f64).ceil() as usize;
            Nanos(sorted.get(rank.max(1) - 1).copied().unwrap_or(0))
        };
        Percentiles { p50: at(0.5), p99: at(0.99), max: Nanos(self.max) }
    }
}

/// All that is shown.
#[derive(Clone, Debug)]
pub struct View {
    /// What may be used up.
    pub budgets: Budgets,
    /// The newest cycle.
    pub newest: Sample,
    /// The newest notice.
    pub notice: Notice,
    /// Stops asked for so far.
    pub stops: u32,
    /// The drive is over.
    pub over: bool,
    /// Largest measured force since the start \[N\].
    pub peak_measured_force: f64,
    lateness: [Times; 2],
    round_trip: [Times; 2],
    bars: VecDeque<f64>,
    bar_began: Nanos,
    met: [LimitFlags; 2],
}

impl View {
    /// Before the first cycle.
    pub fn new(budgets: Budgets) -> Self {
        Self {
            budgets,
            newest: Sample::default(),
            notice: Notice::default(),
            stops: 0,
            over: false,
            peak_measured_force: 0.0,
            lateness: Default::default(),
            round_trip: Default::default(),
            bars: VecDeque::from([0.0]),
            bar_began: Nanos(0),
            met: Default::default(),
        }
    }

    /// Takes a cycle.
    pub fn take(&mut self, sample: &Sample) {
        self.newest = *sample;
        self.peak_measured_force = self.peak_measured_force.max(sample.force);
        if sample.time.0.saturating_sub(self.bar_began.0) >= BAR.0 {
            self.bar_began = sample.time;
            if self.bars.len() == BARS {
                self.bars.pop_front();
            }
            self.bars.push_back(0.0);
        }
        if let Some(bar) = self.bars.back_mut() {
            *bar = bar.max(sample.force);
        }
        for (place, robot) in sample.robots.iter().enumerate().filter(|(_, robot)| robot.present) {
            self.lateness[place].push(robot.lateness);
            self.round_trip[place].push(robot.round_trip);
            self.met[place].0 |= robot.limits.0;
        }
    }

    /// Takes what view and drive tell each other.
    pub(super) fn told(&mut self, stops: u32, over: bool) {
        self.stops = stops;
        self.over = over;
    }

    /// Lateness of our cycles for a robot (0 or 1).
    pub fn lateness(&self, robot: usize) -> Percentiles {
        self.lateness[robot].percentiles()
    }

    /// Times from a robot's report (0 or 1) to our answer.
    pub fn round_trip(&self, robot: usize) -> Percentiles {
        self.round_trip[robot].percentiles()
    }

    /// The largest forces \[N\] of the last times, the newest last, at most this many.
    pub fn force_history(&self, bars: usize) -> impl Iterator<Item = f64> {
        self.bars.iter().skip(self.bars.len().saturating_sub(bars)).copied()
    }

    /// Kinds of limits that a robot (0 or 1) has met on an axis (or the [`TOOL`]) since the start.
    pub fn met(&self, robot: usize, axis: usize) -> impl Iterator<Item = LimitKind> {
        let met = self.met[robot];
        LimitKind::ALL.iter().copied().filter(move |kind| met.has(*kind, axis.min(TOOL)))
    }
}
