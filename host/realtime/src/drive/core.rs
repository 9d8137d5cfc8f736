//! Decisions of a session: maps the inputs of a cycle to robot commands and the cycle's record.
//!
//! Pure: equal inputs give equal commands and records, bit for bit, independent of clock and links.

mod recording;
mod retracting;
mod starting;

use super::checklist::{Check, Checklist};
use super::guard::{Alarm, Guard, GuardInputs, LimitViolation, ToolError};
use super::motion::{JointMove, RunIn};
use super::start::{StartUp, Weighing, apart, moved};
use super::torque::TorqueWatch;
use crate::arms::Arms;
use crate::limiter::{Cut, Limiter};
use crate::log::codes::{StopCause, cycle_flags};
use crate::log::record::CycleRecord;
use crate::log::table::Logged;
use crate::sensing::Sensing;
use crate::signals::WireState;
use crate::signals::{AXES, Capabilities, ForceSample, LinkCounters, Order, RobotState};
use crate::time::Nanos;
use retracting::Retreat;
use softdock_campaign::Station;
use softdock_campaign::station::AxisLimits;
use softdock_kernels::frame::single::{Measured, Progress, SimulationComputer, TouchThreshold, simulation_computer};
use softdock_kernels::manipulator::cell::Misplaced;
use softdock_kernels::metrics::Metrics;
use softdock_kernels::outcome::Stop;
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use softdock_kernels::space::{Motion, Parts, Wrench};
use softdock_kernels::vector::{Pose, Vec3};
use starting::Leg;
use std::sync::Arc;

/// Duration of the run-in from rest, half of it at constant speed \[s\].
const RUN_IN_TIME: f64 = 2.0;
/// Cycles for which the end of the protocol session is sent.
const END_CYCLES: u32 = 5;
/// Longest duration of a stop; then the session ends in any state \[s\].
const LONGEST_STOP: f64 = 10.0;

/// Definition of a session.
#[derive(Clone)]
pub struct SessionTask {
    /// The scenario.
    pub plant: Arc<Plant>,
    /// The facility.
    pub station: Arc<Station>,
    /// Number of the run.
    pub run: u64,
    /// Parameters of its draw.
    pub params: Params<f64>,
    /// The commands move real robots.
    pub armed: bool,
    /// Robots away from the start of the run are moved there.
    pub to_start: bool,
    /// Only the start-up checks are made: nothing moves.
    pub check_only: bool,
    /// Distance by which robot 1 retracts its part after a stop \[m\]; 0: none.
    pub retract: f64,
}

impl SessionTask {
    /// Creates a session of emulated robots that may move to the start from any position.
    pub fn new(plant: Arc<Plant>, station: Arc<Station>, run: u64, params: Params<f64>) -> Self {
        Self { plant, station, run, params, armed: false, to_start: true, check_only: false, retract: 0.0 }
    }
}

/// Inputs of a cycle from three links: those that receive the commands, or the real ones of a dry run.
#[derive(Clone, Copy, Debug, Default)]
pub struct LinkInputs {
    /// Reports of robots 1 and 2.
    pub robots: [Option<RobotState>; 2],
    /// The sensor's newest sample.
    pub sample: Option<ForceSample>,
    /// Counters of robots 1 and 2 and of the sensor.
    pub links: [LinkCounters; 3],
    /// Failed links: robots 1 and 2 and the sensor.
    pub broken: [bool; 3],
    /// State of robots 1 and 2 relative to their commands.
    pub wires: [WireState; 2],
}

/// All inputs of a cycle's decisions.
#[derive(Clone, Copy, Debug)]
pub struct CycleInputs {
    /// Start of the cycle since the start of the drive.
    pub now: Nanos,
    /// From the links that receive the commands.
    pub moved: LinkInputs,
    /// From the real links of a dry run.
    pub exercised: Option<LinkInputs>,
    /// Requested stop.
    pub request: Option<StopCause>,
    /// The operator's GO; armed robots do not move before it.
    pub go: bool,
}

/// Commands of a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orders {
    /// Robots 1 and 2; a dead link receives none.
    pub moved: [Option<Order>; 2],
    /// The session is stopping: a robot away from its commands ramps to rest where it is.
    pub stopping: bool,
    /// The session is over.
    pub over: bool,
}

impl Orders {
    /// Commands no motion.
    pub const HOLD: Self = Self { moved: [Some(Order::Hold); 2], stopping: false, over: false };
}

/// Error of preparing a session.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Unprepared {
    /// A robot cannot hold its part at the scenario's start.
    #[error("robot {0} of the facility file cannot hold its part at the start of the scenario ({1:?}): move its base")]
    Misplaced(usize, MisplacedWhy),
    /// The robot's cycle is not a whole number of ticks.
    #[error("a robot's cycle of {0} ms is not a whole number of ticks of {1} ms: change the scenario's timing.tick")]
    Cycle(f64, f64),
    /// Scenario and facility have different session rules.
    #[error(
        "the scenario's facility has other session rules than the facility that is driven: name this facility file in the scenario"
    )]
    Rules,
}

/// Reason of the kernels for an unreachable placement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MisplacedWhy {
    /// Not six joints with a spherical wrist.
    NoWrist,
    /// Out of reach.
    OutOfReach,
}

impl From<(usize, Misplaced)> for Unprepared {
    fn from((robot, why): (usize, Misplaced)) -> Self {
        let why = if why == Misplaced::NoWrist { MisplacedWhy::NoWrist } else { MisplacedWhy::OutOfReach };
        Self::Misplaced(robot, why)
    }
}

/// Phase of the session, with its data.
#[derive(Clone, Copy, Debug)]
enum State {
    StartUp,
    Enabling {
        begun: Nanos,
    },
    ToStart {
        path: JointMove,
        begun: Nanos,
    },
    /// Robot 1 turns its tool, reads the sensor and turns back.
    Weighing {
        path: JointMove,
        begun: Nanos,
        leg: Leg,
    },
    Taring {
        begun: Nanos,
        weighing: Weighing,
    },
    RunIn {
        cycles: u32,
    },
    Running,
    /// The run is over; one more report completes the energy of its last cycle.
    Closing {
        port_energy: f64,
    },
    Stopping,
    /// After a stop, robot 1 retracts its part along the approach.
    Retracting {
        retreat: Retreat,
        begun: Nanos,
    },
    Ending {
        cycles: u32,
    },
    Over,
}

/// Measurements of a cycle.
struct Read {
    /// Parts as held by the robots, and the wrench of the newest sample, tared as far as the tare is known.
    measured: Measured,
    /// Wrench on part A of the largest change in the cycle.
    peak: Wrench<f64>,
}

/// The decisions of a session.
pub struct Core {
    task: SessionTask,
    arms: Arms,
    sensing: Sensing,
    /// Whether the sensor is tared.
    tared: bool,
    computer: Box<dyn SimulationComputer>,
    run_in: RunIn,
    limits: [AxisLimits; AXES],
    capabilities: [Capabilities; 2],
    /// Capabilities of the real robots of a dry run.
    exercised: [Capabilities; 2],
    ticks: u32,
    limiters: Option<[Limiter; 2]>,
    guard: Option<Guard>,
    torques: TorqueWatch,
    /// Measured axes of the last two reports, newest first.
    axes: [[[f64; AXES]; 2]; 2],
    /// Cycles without data from the real links of a dry run: robots 1 and 2 and the sensor.
    silent: [u32; 3],
    /// Tool poses of the last two cycles' commands, newest first.
    sent: [[Pose<f64>; 2]; 2],
    /// Commanded motion of the parts at the end of the last cycle.
    commanded: Parts<f64>,
    state: State,
    /// Checks of the links that receive the commands, and of the real links of a dry run.
    checks: [StartUp; 2],
    /// All checks have passed; the robots wait for GO.
    ready: bool,
    dead: [bool; 2],
    begun_at: [[f64; AXES]; 2],
    refusal: Option<Check>,
    /// The start-up checks with their values so far.
    checklist: Checklist,
    /// Direction of part A's first motion relative to part B, laboratory.
    approach: Vec3<f64>,
    /// Distance by which robot 1 has retracted its part \[m\]; `None` before a retraction.
    retracted: Option<f64>,
    /// Time and cause of the stop.
    stopped: Option<(Nanos, Alarm)>,
    /// Start of the last ramp to rest; a retraction has its own.
    ramp_begun: Nanos,
    record: CycleRecord,
}

impl Core {
    /// Prepares a session; `capabilities` are those of the robots that receive the commands.
    ///
    /// # Errors
    /// If the robots cannot hold their parts, or their cycle does not fit the scenario.
    pub fn new(task: SessionTask, capabilities: [Capabilities; 2]) -> Result<Self, Unprepared> {
        let arms = Arms::new(&task.plant, &task.station)?;
        let (cycle, tick) = (capabilities[0].cycle.seconds(), task.plant.timing.tick());
        let ticks = (cycle / tick).round();
        if ticks < 1.0 || (cycle - ticks * tick).abs() > 1e-9 {
            return Err(Unprepared::Cycle(cycle * 1e3, tick * 1e3));
        }
        let reading = TouchThreshold { touch_force: task.station.sensor.touch_force, hold_back: ticks as usize };
        let computer = simulation_computer(&task.plant, task.run, &task.params, reading);
        if task.plant.facility.rules != task.station.rules {
            return Err(Unprepared::Rules);
        }
        let run_in = RunIn::new(computer.reference(), RUN_IN_TIME);
        let commanded = run_in.at(&task.plant, 0.0);
        let mut record = CycleRecord::BLANK;
        record.flags = if task.armed { cycle_flags::ARMED } else { 0 };
        Ok(Self {
            limits: arms.limits(&task.station),
            sensing: Sensing::new(&task.station),
            tared: false,
            arms,
            computer,
            run_in,
            capabilities,
            exercised: capabilities,
            ticks: ticks as u32,
            limiters: None,
            guard: None,
            torques: TorqueWatch::new(task.station.torques),
            axes: [[[0.0; AXES]; 2]; 2],
            silent: [0; 3],
            sent: [[Pose::identity(); 2]; 2],
            commanded,
            state: State::StartUp,
            checks: [StartUp::default(); 2],
            ready: false,
            dead: [false; 2],
            begun_at: [[0.0; AXES]; 2],
            refusal: None,
            checklist: Checklist::default(),
            approach: approach(&commanded),
            retracted: None,
            stopped: None,
            ramp_begun: Nanos(0),
            record,
            task,
        })
    }

    /// Sets the capabilities of the real robots of a dry run, if they differ from those that receive the commands.
    pub fn exercise(&mut self, capabilities: [Capabilities; 2]) {
        self.exercised = capabilities;
    }

    /// Returns the axes of both robots at rest at the start of the run-in, in controller coordinates.
    pub fn start_axes(&self) -> ([[f64; AXES]; 2], bool) {
        self.arms.positions_for(&self.run_in.at(&self.task.plant, 0.0))
    }

    /// Returns the limits of the axes in controller coordinates.
    pub fn limits(&self) -> [AxisLimits; AXES] {
        self.limits
    }

    /// Returns the capabilities of the robots that receive the commands; a replay needs them.
    pub fn capabilities(&self) -> [Capabilities; 2] {
        self.capabilities
    }

    /// Returns the record of the last cycle.
    pub fn record(&self) -> &CycleRecord {
        &self.record
    }

    /// Returns the record for values that only the links know: lateness, round trips, wall clock.
    pub fn record_mut(&mut self) -> &mut CycleRecord {
        &mut self.record
    }

    /// Returns the check that refused the session.
    pub fn refusal(&self) -> Option<Check> {
        self.refusal
    }

    /// Returns the start-up checks with their values so far; in a dry run those of the real links.
    pub fn checklist(&self) -> &Checklist {
        &self.checklist
    }

    /// Returns the distance by which robot 1 has retracted its part after the stop \[m\].
    pub fn retracted(&self) -> Option<f64> {
        self.retracted
    }

    /// Returns time since the start and cause of the stop.
    pub fn stopped(&self) -> Option<(Nanos, Alarm)> {
        self.stopped
    }

    /// Returns the greatest distance \[m\] and angle \[rad\] of each robot's tool from its command.
    pub fn worst_tracking(&self) -> [[f64; 2]; 2] {
        self.guard.as_ref().map_or([[0.0; 2]; 2], Guard::worst_tracking)
    }

    /// Returns the greatest share of its limit that an unexplained torque has reached, robots 1 and 2.
    pub fn worst_torques(&self) -> [f64; 2] {
        self.torques.worst()
    }

    /// Returns the session rule that was met, with its value.
    pub fn rule_met(&self) -> Option<Stop> {
        self.guard.as_ref().and_then(Guard::stop)
    }

    /// Returns the energy injected by the facility since the run began \[J\].
    pub fn injected_energy(&self) -> f64 {
        let progress = self.computer.progress();
        self.guard.as_ref().map_or(0.0, |guard| guard.injected_energy(&progress))
    }

    /// Returns the tare: the sensor's reading at rest without the tool's weight, sensor axes.
    pub fn tare_found(&self) -> Wrench<f64> {
        self.sensing.tare
    }

    /// Whether the next cycle is the first of the run itself.
    pub fn begins(&self) -> bool {
        matches!(self.state, State::Running) && self.record.tick == 0
    }

    /// Returns the progress of the run.
    pub fn progress(&self) -> Progress {
        self.computer.progress()
    }

    /// Returns the metrics of the run as measured by the facility.
    pub fn metrics(&self) -> Metrics<f64> {
        self.computer.metrics()
    }

    /// Steps one cycle: takes the inputs, decides, and records both.
    pub fn step(&mut self, inputs: &CycleInputs) -> Orders {
        self.record.cycle += 1;
        self.record.time = inputs.now;
        self.take(inputs);
        let read = self.measure(inputs);
        if let Some(alarm) = self.alarm(inputs, &read) {
            self.stop(alarm);
        }
        let orders = self.decide(inputs, self.tared.then_some(read.measured));
        self.note(&orders);
        orders
    }

    /// Stores the inputs in the record and the history.
    fn take(&mut self, inputs: &CycleInputs) {
        let dry = inputs.exercised.is_some();
        let r = &mut self.record;
        let bits = inputs.moved.broken.iter().enumerate().map(|(link, broken)| u32::from(*broken) << link);
        (r.broken, r.request) = (bits.sum(), inputs.request.unwrap_or(StopCause::None));
        r.go = u32::from(inputs.go);
        let real = inputs.exercised.unwrap_or(inputs.moved);
        r.robot_1.take(real.robots[0].as_ref(), Nanos(0));
        r.robot_2.take(real.robots[1].as_ref(), Nanos(0));
        r.ft.take(real.sample.as_ref(), Nanos(0));
        (r.robot_1.link, r.robot_2.link, r.ft.link) = (real.links[0], real.links[1], real.links[2]);
        if dry {
            let moved = &inputs.moved;
            r.emulated_1.take(moved.robots[0].as_ref(), Nanos(0));
            r.emulated_2.take(moved.robots[1].as_ref(), Nanos(0));
            r.emulated_ft.take(moved.sample.as_ref(), Nanos(0));
        }
        for (record, wire) in self.moved_records().into_iter().zip(inputs.moved.wires) {
            record.wire = wire;
        }
        self.axes[1] = self.axes[0];
        for (axes, report) in self.axes[0].iter_mut().zip(&inputs.moved.robots) {
            *axes = report.map_or(*axes, |report| report.position);
        }
    }

    /// Returns the parts as held by the robots and the wrench between them.
    fn measure(&mut self, inputs: &CycleInputs) -> Read {
        let cycle = self.capabilities[0].cycle.seconds();
        let rates =
            std::array::from_fn(|r| std::array::from_fn(|i| (self.axes[0][r][i] - self.axes[1][r][i]) * (1.0 / cycle)));
        let parts = self.arms.parts_on(&self.axes[0], &rates);
        self.note_parts(&parts);
        let dry = inputs.exercised.is_some();
        let ft = if dry { &mut self.record.emulated_ft } else { &mut self.record.ft };
        ft.age = inputs.now - ft.received;
        let wrench = self.sensing.on_part(ft.raw, &parts.a);
        ft.compensated = wrench;
        let peak = self.sensing.on_part(ft.peak, &parts.a);
        let saturated = inputs.moved.sample.is_some_and(|sample| sample.saturated);
        Read { measured: Measured { parts, wrench, saturated }, peak }
    }

    /// Returns the first reason to stop; none before and after the motion.
    fn alarm(&mut self, inputs: &CycleInputs, read: &Read) -> Option<Alarm> {
        if matches!(self.state, State::Ending { .. } | State::Over) {
            return None;
        }
        if let Some(cause) = inputs.request {
            return Some(Alarm::of(cause));
        }
        let started = !matches!(self.state, State::StartUp);
        if let Some(link) = inputs.moved.broken.iter().position(|broken| *broken && started) {
            return Some(Alarm { dead: (link < 2).then_some(link), ..Alarm::of(StopCause::LinkFault) });
        }
        if let Some(alarm) = self.of_exercised(inputs).filter(|_| started) {
            return Some(alarm);
        }
        let running = matches!(self.state, State::Running);
        let retracting = matches!(self.state, State::Retracting { .. });
        let stopping = matches!(self.state, State::Closing { .. } | State::Stopping) || retracting;
        let seen = GuardInputs {
            now: inputs.now,
            wrenches: [read.measured.wrench, read.peak],
            tools: self.tool_errors(&read.measured.parts),
            robots: &inputs.moved.robots,
            wires: &inputs.moved.wires,
            lost: std::array::from_fn(|r| inputs.moved.links[r].lost),
            sample: inputs.moved.sample.as_ref(),
            stopping,
            measured: self.tared.then_some(&read.measured),
            commanded: &self.commanded,
            progress: running.then(|| self.computer.progress()),
        };
        let alarm = self.guard.as_mut()?.check(&seen).or_else(|| {
            let Measured { parts, wrench, .. } = &read.measured;
            let watched = self.tared && !stopping;
            watched.then(|| self.torques.check(&self.arms, &inputs.moved.robots, parts, *wrench, inputs.now))?
        })?;
        // Of the links only a dead one matters here; a retraction is a motion like any other.
        (!stopping || retracting || alarm.dead.is_some()).then_some(alarm)
    }

    /// Returns the tool errors relative to the commands that are due by now.
    fn tool_errors(&self, parts: &Parts<f64>) -> [ToolError; 2] {
        let (cycle, [now, before]) = (self.capabilities[0].cycle.seconds(), &self.sent);
        let held = [pose(&parts.a), pose(&parts.b)];
        std::array::from_fn(|r| {
            let ((distance, angle), (path, turn)) = (apart(&held[r], &now[r]), apart(&now[r], &before[r]));
            ToolError { distance, angle, speed: path / cycle, turn_rate: turn / cycle }
        })
    }

    /// Returns the tool poses of these axes.
    fn tools_at(&self, axes: &[[f64; AXES]; 2]) -> [Pose<f64>; 2] {
        let parts = self.arms.parts_on(axes, &[[0.0; AXES]; 2]);
        [pose(&parts.a), pose(&parts.b)]
    }

    /// Checks whether a real link of a dry run has fallen silent; the run then proves nothing about that link.
    fn of_exercised(&mut self, inputs: &CycleInputs) -> Option<Alarm> {
        let real = inputs.exercised.as_ref()?;
        let there = [real.robots[0].is_some(), real.robots[1].is_some(), real.sample.is_some()];
        // A robot slower than the master does not report in every cycle.
        let ratio = self.exercised[1].cycle.seconds() / self.exercised[0].cycle.seconds();
        for (link, there) in there.into_iter().enumerate() {
            self.silent[link] = if there { 0 } else { self.silent[link] + 1 };
            let slower = if link == 1 { ratio.ceil().max(1.0) } else { 1.0 };
            let most = self.task.station.links.stop_cycles * slower as u32;
            if self.silent[link] > most || real.broken[link] {
                let robot = (link < 2).then_some(link);
                let (value, limit) = (f64::from(self.silent[link]), f64::from(most));
                let found = Some(LimitViolation { robot, axis: None, value, limit, unit: "cycles" });
                return Some(Alarm { violation: found, ..Alarm::of(StopCause::LinkSilent) });
            }
        }
        None
    }

    /// Begins a controlled stop; the first cause is kept.
    fn stop(&mut self, alarm: Alarm) {
        if let Some(robot) = alarm.dead {
            self.dead[robot] = true;
        }
        if self.record.cause == StopCause::None {
            self.record.cause = alarm.cause;
            self.stopped = Some((self.record.time, alarm));
        }
        self.state = match (&self.state, &self.limiters) {
            (_, None) => State::Ending { cycles: 0 },
            (State::Ending { .. } | State::Over, _) => return,
            (State::Stopping, _) => State::Stopping,
            (
                State::StartUp
                | State::Enabling { .. }
                | State::ToStart { .. }
                | State::Weighing { .. }
                | State::Taring { .. }
                | State::RunIn { .. }
                | State::Running
                | State::Closing { .. }
                | State::Retracting { .. },
                _,
            ) => {
                self.ramp_begun = self.record.time;
                State::Stopping
            }
        };
    }

    /// Runs the state machine of the phase.
    fn decide(&mut self, inputs: &CycleInputs, net: Option<Measured>) -> Orders {
        match self.state {
            State::StartUp => self.start_up(inputs),
            State::Enabling { begun } => self.enable(begun, inputs.now),
            State::ToStart { path, begun } => self.move_to_start(&path, begun, inputs.now),
            State::Weighing { .. } => self.weigh(inputs),
            State::Taring { .. } => self.tare(inputs),
            State::RunIn { cycles } => {
                // In steps of cycles, like the run: after a late cycle no command jumps. The command is due at the
                // cycle's end.
                let at = f64::from(cycles + 1) * self.capabilities[0].cycle.seconds();
                self.state = State::RunIn { cycles: cycles + 1 };
                let motion = self.run_in.at(&self.task.plant, at);
                if at >= self.run_in.duration() - 1e-9 {
                    self.state = State::Running;
                    self.guard.iter_mut().for_each(Guard::begin_run);
                }
                self.command(&motion)
            }
            State::Running => self.run(net),
            State::Closing { port_energy } => {
                let judged = |guard: &mut Guard| guard.injected(port_energy, &net?, &self.commanded);
                let alarm = self.guard.as_mut().and_then(judged);
                self.stop(alarm.unwrap_or(Alarm::of(StopCause::Completed)));
                self.ramp_down()
            }
            State::Stopping => self.ramp_down(),
            State::Retracting { retreat, begun } => self.retract(&retreat, begun, inputs.now, net),
            State::Ending { cycles } => self.end(cycles),
            State::Over => Orders { moved: [None; 2], stopping: true, over: true },
        }
    }

    /// Steps the run by the ticks of the cycle; returns the command for the cycle's end.
    fn run(&mut self, net: Option<Measured>) -> Orders {
        let Some(measured) = net else {
            return self.hold_position();
        };
        // The farm judges the energy of every tick but the last, at the start of the next one.
        let mut port_energy = 0.0;
        for _ in 0..self.ticks {
            let progress = self.computer.progress();
            port_energy = if progress.over { port_energy } else { progress.port_energy };
            self.computer.tick(&measured);
        }
        self.record.tick += u64::from(self.ticks);
        let reference = self.computer.reference();
        let progress = self.computer.progress();
        // The next cycle's check stops a diverged loop by its rule.
        if progress.unstable {
            return self.hold_position();
        }
        if progress.over {
            if self.ticks > 1 {
                self.state = State::Closing { port_energy };
                return self.command(&reference);
            }
            self.stop(Alarm::of(StopCause::Completed));
            return self.ramp_down();
        }
        self.command(&reference)
    }

    /// Commands a motion of the parts.
    fn command(&mut self, motion: &Parts<f64>) -> Orders {
        self.commanded = *motion;
        let (wanted, reachable) = self.arms.positions_for(motion);
        self.limited(&wanted, reachable)
    }

    /// Clamps the wanted axes.
    fn limited(&mut self, wanted: &[[f64; AXES]; 2], reachable: bool) -> Orders {
        let (Some(limiters), Some(guard)) = (&mut self.limiters, &mut self.guard) else {
            return Orders::HOLD;
        };
        let mut cuts = [Cut::default(); 2];
        let mut sent = [[0.0; AXES]; 2];
        for r in 0..2 {
            (sent[r], cuts[r]) = limiters[r].approach(&wanted[r]);
        }
        let stop = guard.of_command(&cuts, reachable);
        self.note_cuts(&cuts);
        let beyond = self.beyond_correction(&sent);
        if matches!(stop, Some(StopCause::AxisLimit)) || beyond.is_some() {
            self.guard.iter_mut().for_each(Guard::meet_joint_range);
        }
        if let Some(cause) = stop.or(beyond) {
            // The clamped command is valid: the ramp continues from it in the next cycle.
            self.stop(Alarm::of(cause));
        }
        self.orders(sent)
    }

    /// Whether a joint has left its permitted range around the position at the start of the session.
    fn beyond_correction(&self, sent: &[[f64; AXES]; 2]) -> Option<StopCause> {
        let beyond = (0..2).any(|r| {
            let most = self.task.station.robots[r].correction;
            (0..AXES - 1).any(|i| (sent[r][i] - self.begun_at[r][i]).abs() > most)
        });
        beyond.then_some(StopCause::ToolLimit)
    }

    fn hold_position(&mut self) -> Orders {
        match &self.limiters {
            Some(limiters) => {
                let at = limiters.each_ref().map(Limiter::position);
                self.limited(&at, true)
            }
            None => Orders::HOLD,
        }
    }

    fn ramp_down(&mut self) -> Orders {
        let Some(limiters) = &mut self.limiters else {
            self.state = State::Ending { cycles: 0 };
            return self.end(0);
        };
        let sent = limiters.each_mut().map(Limiter::stop);
        // No command brings a dead link to rest.
        let moving = moved(&self.record).map(|robot| robot.wire.moving != 0);
        let still = (0..2).all(|r| limiters[r].at_rest() && (!moving[r] || self.dead[r]));
        let late = (self.record.time - self.ramp_begun).seconds() > LONGEST_STOP;
        if still || late {
            let retreat = self.retreat().filter(|_| still);
            let begun = self.record.time;
            self.state = retreat.map_or(State::Ending { cycles: 0 }, |retreat| State::Retracting { retreat, begun });
        }
        self.orders(sent)
    }

    /// Sends the protocols' own end of session several times, then nothing.
    fn end(&mut self, cycles: u32) -> Orders {
        self.state = if cycles + 1 >= END_CYCLES { State::Over } else { State::Ending { cycles: cycles + 1 } };
        let at = self.limiters.as_ref().map_or(self.axes[0], |limiters| limiters.each_ref().map(Limiter::position));
        let moved = std::array::from_fn(|r| (!self.dead[r]).then_some(Order::End(at[r])));
        Orders { moved, stopping: true, over: false }
    }

    fn orders(&mut self, sent: [[f64; AXES]; 2]) -> Orders {
        self.sent = [self.tools_at(&sent), self.sent[0]];
        let stopping = matches!(self.state, State::Stopping | State::Ending { .. });
        Orders {
            moved: std::array::from_fn(|r| (!self.dead[r]).then_some(Order::Move(sent[r]))),
            stopping,
            over: false,
        }
    }
}

/// Returns the direction of part A's motion relative to part B, or from B to A if both are at rest.
fn approach(first: &Parts<f64>) -> Vec3<f64> {
    let (speed, apart) = (first.a.velocity - first.b.velocity, first.b.position - first.a.position);
    let path = if speed.norm() > 1e-6 { speed } else { apart };
    path * (1.0 / path.norm().max(1e-12))
}

fn pose(motion: &Motion<f64>) -> Pose<f64> {
    Pose { position: motion.position, attitude: motion.attitude }
}
