//! A cycle of the loop in the log: every signal with its unit and its meaning, declared once.
//!
//! A [`CycleRecord`] is plain memory, so that the cycle fills and copies it without allocation. Start from
//! [`CycleRecord::BLANK`](Logged::BLANK) and set the known values; blank ones are null in Parquet and omitted from the
//! standard topics. Times count from the start of the session, on our clock, except a robot's own stamp.

use super::codes::{LimitKind, OrderKind, Phase, StopCause, force_flags, robot_flags};
use super::table::{LogColumn, LogValue, Logged, Type, scalar};
use crate::signals::WireState;
use crate::signals::{AXES, ForceSample, LinkCounters, Order, RobotState};
use crate::time::Nanos;
use softdock_kernels::space::{Motion, Wrench};
use softdock_kernels::vector::Pose;

/// Limits that clamped a command: one bit per axis and kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LimitFlags(
    /// Bit `8 * kind + axis`; axis 7 is the tool.
    pub u64,
);

/// Index of the tool among the axes of [`LimitFlags`].
pub const TOOL: usize = AXES;

impl LimitFlags {
    /// Sets the bit of a limit of an axis (or of the [`TOOL`]).
    pub fn set(&mut self, kind: LimitKind, axis: usize) {
        self.0 |= Self::bit(kind, axis);
    }

    /// Whether this limit clamped the command.
    pub fn has(self, kind: LimitKind, axis: usize) -> bool {
        self.0 & Self::bit(kind, axis) != 0
    }

    /// Whether any limit clamped the command.
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
    /// A robot in one cycle: its report, the command sent, and the command computed.
    RobotRecord {
        flags: u32, "bits", "bits: 1 present, 2 a report arrived in this cycle, 4 ready, 8 reports set-points, 16 reports torques, 32 reports the tool's pose";
        order: OrderKind, "1", "kind of the command sent";
        stamp: Nanos, "ns", "the robot's own time of its last report";
        received: Nanos, "ns", "arrival of its last report since the start";
        position: [f64; AXES], "rad", "measured axis";
        asked: [f64; AXES], "rad", "set-point that the robot follows";
        torque: [f64; AXES], "N m", "torque or force of the axis";
        tool: Pose<f64>, "1", "pose of the tool in the robot's base, as it reports it";
        command: [f64; AXES], "rad", "command as sent; null where a hold was sent";
        computed: [f64; AXES], "rad", "command computed by the loop, limited; sent if armed";
        lateness: Nanos, "ns", "delay of our cycle's start after its due time";
        round_trip: Nanos, "ns", "from the arrival of its report until our answer was sent";
        late_answers: u32, "1", "answers of ours that the robot reports as late or missing";
        link: LinkCounters, "1", "link";
        wire: WireState, "1", "wire";
        limits: LimitFlags, "bits", "limits that clamped the command";
        limit_used: [f64; AXES], "1", "share of the axis' nearest limit in use, 1 at the limit";
    }
}

record! {
    /// A force/torque sensor in one cycle.
    ForceRecord {
        flags: u32, "bits", "bits: 1 present, 2 a sample arrived since the last cycle, 4 saturated, 8 invalid";
        sequence: u32, "1", "the sensor's own count of samples";
        received: Nanos, "ns", "arrival of the newest sample since the start";
        age: Nanos, "ns", "age of the sample at its use in the loop";
        raw: Wrench<f64>, "1", "measured wrench, sensor axes and origin";
        peak: Wrench<f64>, "1", "measured sample of the cycle with the largest change from the last cycle";
        compensated: Wrench<f64>, "1", "without bias, tool weight and tool inertia, part A's axes and origin";
        link: LinkCounters, "1", "link";
    }
}

record! {
    /// Every signal of one cycle.
    CycleRecord {
        cycle: u64, "1", "cycle of the master since the start of the session";
        tick: u64, "1", "tick of the simulation since the start of the run";
        time: Nanos, "ns", "start of the cycle since the start of the session, our monotonic clock";
        wall_offset: Nanos, "ns", "start of the session since the Unix epoch: time + wall_offset is a wall-clock time";
        phase: Phase, "1", "phase";
        cause: StopCause, "1", "cause of the stop";
        flags: u32, "bits", "bits: 1 armed, 2 overrun, 4 latch closed, 8 records of the log were lost before this one";
        busy: Nanos, "ns", "duration of the cycle's work";
        overruns: u64, "1", "overruns so far";
        log_dropped: u64, "1", "records lost by the log so far";
        robot_1: RobotRecord, "1", "robot 1";
        robot_2: RobotRecord, "1", "robot 2";
        emulated_1: RobotRecord, "1", "emulated robot 1";
        emulated_2: RobotRecord, "1", "emulated robot 2";
        ft: ForceRecord, "1", "sensor";
        emulated_ft: ForceRecord, "1", "emulated sensor";
        part_a: Pose<f64>, "1", "part A as held by the robots, contact frame";
        part_b: Pose<f64>, "1", "part B as held by the robots, contact frame";
        commanded_part_a: Pose<f64>, "1", "part A by the limited commands of the robots' axes, contact frame; null without a command";
        commanded_part_b: Pose<f64>, "1", "part B by the limited commands of the robots' axes, contact frame; null without a command";
        simulated_part_a: Motion<f64>, "1", "simulated part A, contact frame";
        simulated_part_b: Motion<f64>, "1", "simulated part B, contact frame";
        fed_back: Wrench<f64>, "1", "wrench on part A as fed to the simulation, part A's axes and origin";
        contact_energy: f64, "J", "energy injected by the facility so far, as observed at the port";
        broken: u32, "bits", "bits: failed links of the commanded devices: 1 robot 1, 2 robot 2, 4 sensor";
        request: StopCause, "1", "requested cause of a stop";
        go: u32, "1", "1 after the operator's GO";
    }
}

impl RobotRecord {
    /// Stores a report of this cycle, or marks the last one as repeated.
    ///
    /// `start` is the start of the session on the clock of [`RobotState::received`].
    pub fn take(&mut self, report: Option<&RobotState>, start: Nanos) {
        let Some(report) = report else {
            self.flags &= !robot_flags::FRESH;
            return;
        };
        let bit = |set: bool, bit: u32| if set { bit } else { 0 };
        self.flags = robot_flags::PRESENT
            | robot_flags::FRESH
            | bit(report.ready, robot_flags::READY)
            | bit(report.reported_set_point.is_some(), robot_flags::ASKED)
            | bit(report.torque.is_some(), robot_flags::TORQUE)
            | bit(report.pose.is_some(), robot_flags::POSE);
        self.stamp = report.stamp;
        self.received = report.received - start;
        self.position = report.position;
        self.asked = report.reported_set_point.unwrap_or(Logged::BLANK);
        self.torque = report.torque.unwrap_or(Logged::BLANK);
        self.tool = report.pose.unwrap_or(Logged::BLANK);
        self.late_answers = report.late_answers;
    }

    /// Stores the command that was sent.
    pub fn set_command(&mut self, order: Option<&Order>) {
        (self.order, self.command) = match order {
            None => (OrderKind::None, Logged::BLANK),
            Some(Order::Hold) => (OrderKind::Hold, Logged::BLANK),
            Some(Order::Move(axes)) => (OrderKind::Move, *axes),
            Some(Order::End(axes)) => (OrderKind::End, *axes),
        };
    }

    /// Returns the report that arrived in this cycle, unchanged; for a replay.
    pub fn report(&self, start: Nanos) -> Option<RobotState> {
        let has_flag = |bit: u32| self.flags & bit != 0;
        has_flag(robot_flags::FRESH).then(|| RobotState {
            stamp: self.stamp,
            received: self.received + start,
            position: self.position,
            reported_set_point: has_flag(robot_flags::ASKED).then_some(self.asked),
            torque: has_flag(robot_flags::TORQUE).then_some(self.torque),
            pose: has_flag(robot_flags::POSE).then_some(self.tool),
            late_answers: self.late_answers,
            ready: has_flag(robot_flags::READY),
        })
    }

    /// Returns the set-point, or the measured axes if none is reported; see [`RobotState::set_point`].
    pub fn set_point(&self) -> [f64; AXES] {
        if self.flags & robot_flags::ASKED != 0 { self.asked } else { self.position }
    }

    /// Whether the robot exists in the session.
    pub fn present(&self) -> bool {
        self.flags & robot_flags::PRESENT != 0
    }
}

impl ForceRecord {
    /// Stores the newest sample, or marks the last one as repeated.
    ///
    /// `start` is the start of the session on the clock of [`ForceSample::received`].
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

    /// Returns the sample that arrived in this cycle, unchanged; for a replay.
    pub fn sample(&self, start: Nanos) -> Option<ForceSample> {
        let has_flag = |bit: u32| self.flags & bit != 0;
        has_flag(force_flags::FRESH).then(|| ForceSample {
            received: self.received + start,
            sequence: self.sequence,
            wrench: self.raw,
            peak: self.peak,
            saturated: has_flag(force_flags::SATURATED),
            invalid: has_flag(force_flags::INVALID),
        })
    }
}

#[cfg(test)]
mod tests;
