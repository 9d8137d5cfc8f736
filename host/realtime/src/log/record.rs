//! One cycle of the loop as the log keeps it: every signal, its unit and its meaning, declared here once.
//!
//! A [`CycleRecord`] is plain memory, so that the cycle can fill and hand it on without a heap. Start from
//! [`CycleRecord::BLANK`](Logged::BLANK), set what is known; what stays blank is null in Parquet and left out of the
//! standard topics. Times are since the start of the drive, on our clock, but for a robot's own stamp.

use super::codes::{LimitKind, OrderKind, Phase, StopCause, force_flags, robot_flags};
use super::table::{LogColumn, LogValue, Logged, Type, scalar};
use crate::signals::WireState;
use crate::signals::{AXES, ForceSample, LinkCounters, Order, RobotState};
use crate::time::Nanos;
use softdock_kernels::space::{Motion, Wrench};
use softdock_kernels::vector::Pose;

/// Which limits a command has met: one bit per axis and kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LimitFlags(
    /// Bit `8 * kind + axis`; axis 7 is the tool.
    pub u64,
);

/// The tool among the axes of [`LimitFlags`].
pub const TOOL: usize = AXES;

impl LimitFlags {
    /// Notes that a command has met a limit of an axis (or of the [`TOOL`]).
    pub fn set(&mut self, kind: LimitKind, axis: usize) {
        self.0 |= Self::bit(kind, axis);
    }

    /// Whether a command has met this limit.
    pub fn has(self, kind: LimitKind, axis: usize) -> bool {
        self.0 & Self::bit(kind, axis) != 0
    }

    /// Whether a command has met any limit.
    pub fn any(self) -> bool {
        self.0 != 0
    }

    const fn bit(kind: LimitKind, axis: usize) -> u64 {
        1 << (8 * kind.code() as usize + axis)
    }
}

impl Logged for LimitFlags {
    const BLANK: Self = Self(0);
    fn describe(name: &str, unit: &'static str, meaning: &str, out: &mut Vec<LogColumn>) {
        let kinds = LimitKind::WORDS.iter().enumerate().map(|(kind, word)| format!("{kind} {word}"));
        let kinds = kinds.collect::<Vec<_>>().join(", ");
        let meaning = format!("{meaning}: bit 8 kind + axis (0 to 5 joints, 6 rail, 7 tool), kinds {kinds}");
        out.push(scalar(name, unit, &meaning, Type::Whole));
    }
    fn write(&self, sink: &mut impl FnMut(LogValue)) {
        sink(LogValue::Whole(self.0));
    }
    fn read(source: &mut impl FnMut() -> LogValue) -> Self {
        Self(u64::read(source))
    }
}

record! {
    /// A robot in one cycle: what it told, what it was told, and what would have been sent if it were not.
    RobotRecord {
        flags: u32, "bits", "bits: 1 present, 2 a report came in this cycle, 4 ready, 8 tells its set-points, 16 tells torques, 32 tells the tool's pose";
        order: OrderKind, "1", "what was sent";
        stamp: Nanos, "ns", "the robot's own time of its last report";
        received: Nanos, "ns", "arrival of its last report since the start";
        position: [f64; AXES], "rad", "measured axis";
        asked: [f64; AXES], "rad", "set-point that the robot follows";
        torque: [f64; AXES], "N m", "torque or force of the axis";
        tool: Pose<f64>, "1", "pose of the tool in the robot's base, as it reports it";
        command: [f64; AXES], "rad", "command as sent; null where a hold was sent";
        computed: [f64; AXES], "rad", "command that the loop computed, behind the limits; sent if armed";
        lateness: Nanos, "ns", "start of our cycle after its due instant";
        round_trip: Nanos, "ns", "from the arrival of its report until our answer was sent";
        late_answers: u32, "1", "answers of ours that the robot counts as late or missing";
        link: LinkCounters, "1", "link";
        wire: WireState, "1", "wire";
        limits: LimitFlags, "bits", "limits that the command has met";
        limit_used: [f64; AXES], "1", "share of the axis' nearest limit in use, 1 at the limit";
    }
}

record! {
    /// A force/torque sensor in one cycle.
    ForceRecord {
        flags: u32, "bits", "bits: 1 present, 2 a sample came since the last cycle, 4 saturated, 8 invalid";
        sequence: u32, "1", "the sensor's own count of samples";
        received: Nanos, "ns", "arrival of the newest sample since the start";
        age: Nanos, "ns", "age of the sample when the loop used it";
        raw: Wrench<f64>, "1", "as measured, the sensor's axes and origin";
        peak: Wrench<f64>, "1", "of all samples of the cycle, the one farthest from those of the last cycle, as measured";
        compensated: Wrench<f64>, "1", "bias, weight and inertia of the tool taken off, part A's axes and origin";
        link: LinkCounters, "1", "link";
    }
}

record! {
    /// Every signal of one cycle.
    CycleRecord {
        cycle: u64, "1", "cycle of the master since the start of the drive";
        tick: u64, "1", "tick of the simulation since the start of the run";
        time: Nanos, "ns", "start of the cycle since the start of the drive, our monotonic clock";
        wall_offset: Nanos, "ns", "start of the drive since the Unix epoch: time + wall_offset is a wall-clock time";
        phase: Phase, "1", "phase";
        cause: StopCause, "1", "cause of the stop";
        flags: u32, "bits", "bits: 1 armed, 2 overrun, 4 latch closed, 8 records of the log were lost before this one";
        busy: Nanos, "ns", "duration of the cycle's work";
        overruns: u64, "1", "cycles so far whose work took too long";
        log_dropped: u64, "1", "records that the log has lost so far";
        robot_1: RobotRecord, "1", "robot 1";
        robot_2: RobotRecord, "1", "robot 2";
        emulated_1: RobotRecord, "1", "emulated robot 1";
        emulated_2: RobotRecord, "1", "emulated robot 2";
        ft: ForceRecord, "1", "sensor";
        emulated_ft: ForceRecord, "1", "emulated sensor";
        part_a: Pose<f64>, "1", "part A where the robots hold it, contact frame";
        part_b: Pose<f64>, "1", "part B where the robots hold it, contact frame";
        simulated_part_a: Motion<f64>, "1", "simulated part A, contact frame";
        simulated_part_b: Motion<f64>, "1", "simulated part B, contact frame";
        fed_back: Wrench<f64>, "1", "wrench on part A that the simulation took, part A's axes and origin";
        contact_energy: f64, "J", "energy that the contact has created so far, as observed at the port";
        broken: u32, "bits", "bits: links of those who take the commands that cannot go on: 1 robot 1, 2 robot 2, 4 sensor";
        request: StopCause, "1", "what somebody wanted the run stopped for";
        go: u32, "1", "1 once the operator has let the robots move";
    }
}

impl RobotRecord {
    /// Takes over a report of this cycle, or notes that none came and the last one stands.
    ///
    /// `start` is the start of the drive on the clock of [`RobotState::received`].
    pub fn take(&mut self, report: Option<&RobotState>, start: Nanos) {
        let Some(report) = report else {
            self.flags &= !robot_flags::FRESH;
            return;
        };
        let bit = |set: bool, bit: u32| if set { bit } else { 0 };
        self.flags = robot_flags::PRESENT
            | robot_flags::FRESH
            | bit(report.ready, robot_flags::READY)
            | bit(report.asked.is_some(), robot_flags::ASKED)
            | bit(report.torque.is_some(), robot_flags::TORQUE)
            | bit(report.pose.is_some(), robot_flags::POSE);
        self.stamp = report.stamp;
        self.received = report.received - start;
        self.position = report.position;
        self.asked = report.asked.unwrap_or(Logged::BLANK);
        self.torque = report.torque.unwrap_or(Logged::BLANK);
        self.tool = report.pose.unwrap_or(Logged::BLANK);
        self.late_answers = report.late_answers;
    }

    /// Notes what was sent.
    pub fn tell(&mut self, order: Option<&Order>) {
        (self.order, self.command) = match order {
            None => (OrderKind::None, Logged::BLANK),
            Some(Order::Hold) => (OrderKind::Hold, Logged::BLANK),
            Some(Order::Move(axes)) => (OrderKind::Move, *axes),
            Some(Order::End(axes)) => (OrderKind::End, *axes),
        };
    }

    /// The report that came in this cycle, as it was; for a replay.
    pub fn report(&self, start: Nanos) -> Option<RobotState> {
        let told = |bit: u32| self.flags & bit != 0;
        told(robot_flags::FRESH).then(|| RobotState {
            stamp: self.stamp,
            received: self.received + start,
            position: self.position,
            asked: told(robot_flags::ASKED).then_some(self.asked),
            torque: told(robot_flags::TORQUE).then_some(self.torque),
            pose: told(robot_flags::POSE).then_some(self.tool),
            late_answers: self.late_answers,
            ready: told(robot_flags::READY),
        })
    }

    /// Where its controller holds it, or where it stands if it does not tell that; see [`RobotState::set_point`].
    pub fn set_point(&self) -> [f64; AXES] {
        if self.flags & robot_flags::ASKED != 0 { self.asked } else { self.position }
    }

    /// Whether there is such a robot in the drive.
    pub fn present(&self) -> bool {
        self.flags & robot_flags::PRESENT != 0
    }
}

impl ForceRecord {
    /// Takes over the newest sample, or notes that none came and the last one stands.
    ///
    /// `start` is the start of the drive on the clock of [`ForceSample::received`].
    pub fn take(&mut self, sample: Option<&ForceSample>, start: Nanos) {
        let Some(sample) = sample else {
            self.flags &= !force_flags::FRESH;
            return;
        };
        let bit = |set: bool, bit: u32| if set { bit } else { 0 };
        self.flags = force_flags::PRESENT
            | force_flags::FRESH
            | bit(sample.saturated, force_flags::SATURATED)
            | bit(sample.invalid, force_flags::INVALID);
        self.sequence = sample.sequence;
        self.received = sample.received - start;
        (self.raw, self.peak) = (sample.wrench, sample.peak);
    }

    /// The sample that came in this cycle, as it was; for a replay.
    pub fn sample(&self, start: Nanos) -> Option<ForceSample> {
        let told = |bit: u32| self.flags & bit != 0;
        told(force_flags::FRESH).then(|| ForceSample {
            received: self.received + start,
            sequence: self.sequence,
            wrench: self.raw,
            peak: self.peak,
            saturated: told(force_flags::SATURATED),
            invalid: told(force_flags::INVALID),
        })
    }
}

#[cfg(test)]
mod tests;
