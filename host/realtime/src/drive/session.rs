//! A session: the decisions with their links and their clock.
//!
//! Robot 1 is the clock master, by its packets or by a timer. While the session waits for robot 1, robot 2 is answered
//! in its own cycle from the last command. The running session does not allocate, print or lock.

use super::core::{Core, CycleInputs, LinkInputs, Orders, SessionTask, Unprepared};
use super::wire::Wire;
use crate::clock::Clock;
use crate::limiter::Limiter;
use crate::log::codes::{OrderKind, Phase, StopCause, cycle_flags};
use crate::log::record::{CycleRecord, RobotRecord};
use crate::signals::{LinkFault, Links, Order};
use crate::time::Nanos;
use std::rc::Rc;

/// Period at which robot 2 is polled while waiting for robot 1.
const SLICE: Nanos = Nanos::from_micros(200);
/// Cycles for which the end of the protocol session is sent after the decisions have ended.
const END_CYCLES: u32 = 5;
/// Longest ramp without decisions.
const BLIND_TIME: Nanos = Nanos::from_millis(10_000);
/// A time in the unreachable future.
const NEVER: Nanos = Nanos(i64::MAX / 4);

/// A running session.
pub struct Session {
    core: Core,
    /// Links that receive the commands.
    moved: Links,
    /// Real links of a dry run: the protocols run, no motion is commanded.
    exercised: Option<Links>,
    clock: Rc<dyn Clock>,
    start: Nanos,
    /// Due time of robot 1's next report.
    due: Nanos,
    cycle: Nanos,
    last: Orders,
    /// Robot 2 reported together with robot 1 and needs the command of this cycle.
    pending: bool,
    /// Commands sent to the robots since the last cycle.
    wire: [Option<Order>; 2],
    /// Last stage before each robot's link, in the robot's own cycle.
    wires: [Wire; 2],
    overruns: u64,
    /// Time of the last answer to each robot, since the start.
    answered: [Nanos; 2],
    /// The operator has given GO.
    go: bool,
    /// First fault of robots 1 and 2 and of the sensor.
    faults: [Option<LinkFault>; 3],
}

impl Session {
    /// Opens a session on open links; sends nothing yet.
    ///
    /// # Errors
    /// If the run cannot be driven on these robots.
    pub fn new(
        task: SessionTask,
        moved: Links,
        exercised: Option<Links>,
        clock: Rc<dyn Clock>,
    ) -> Result<Self, Unprepared> {
        let capabilities = moved.robots.each_ref().map(|robot| robot.capabilities());
        let mut core = Core::new(task, capabilities)?;
        if let Some(links) = &exercised {
            core.exercise(links.robots.each_ref().map(|robot| robot.capabilities()));
        }
        let (start, cycle) = (clock.now(), capabilities[0].cycle);
        let last = Orders::HOLD;
        let wires = capabilities.map(|robot| Wire::new(core.limits(), robot, cycle));
        Ok(Self {
            core,
            moved,
            exercised,
            clock,
            start,
            due: start + cycle,
            cycle,
            last,
            pending: false,
            wire: [None; 2],
            wires,
            overruns: 0,
            answered: [Nanos(0); 2],
            go: false,
            faults: [None; 3],
        })
    }

    /// Gives GO: armed robots move once every check has passed.
    pub fn go(&mut self) {
        self.go = true;
    }

    /// Sets the wall clock at the start of the session \[ns since the Unix epoch\].
    pub fn begun_at(&mut self, wall: Nanos) {
        self.core.record_mut().wall_offset = wall;
    }

    /// Returns the decisions so far.
    pub fn core(&self) -> &Core {
        &self.core
    }

    /// Returns the faults of robots 1 and 2 and of the sensor.
    pub fn faults(&self) -> [Option<LinkFault>; 3] {
        self.faults
    }

    /// Runs one cycle; returns whether the session is over. `request` stops it.
    pub fn cycle(&mut self, request: Option<StopCause>) -> bool {
        let mut real = self.wait();
        let begun = self.clock.now();
        let beat = real.robots[0].map_or(self.due, |report| report.received);
        let lateness = begun - beat;
        self.due = beat.max(self.due - self.cycle) + self.cycle;
        let dry = self.exercised.is_some();
        let mut moved = if dry { self.shadows(begun) } else { real };
        moved.wires = self.wires.each_ref().map(Wire::state);
        localise(&mut real, self.start);
        localise(&mut moved, self.start);
        let inputs =
            CycleInputs { now: begun - self.start, moved, exercised: dry.then_some(real), request, go: self.go };
        self.last = self.core.step(&inputs);
        self.answer(&inputs);
        self.finish(&inputs, begun, lateness);
        self.last.over
    }

    /// Waits for robot 1; returns the inputs that have arrived by then.
    fn wait(&mut self) -> LinkInputs {
        let deadline = self.due + Nanos(self.cycle.0 / 2);
        let mut arrived = LinkInputs::default();
        let (dry, stopping) = (self.exercised.is_some(), self.last.stopping);
        let order = if dry { Some(Order::Hold) } else { self.last.moved[1] };
        let links = self.exercised.as_mut().unwrap_or(&mut self.moved);
        loop {
            let until = (self.clock.now() + SLICE).min(deadline);
            match links.robots[0].receive(until) {
                Ok(report) => {
                    arrived.robots[0] = report;
                    if let (Some(report), false) = (&report, dry) {
                        self.wires[0].reported(report, &links.robots[0].counters());
                    }
                }
                Err(fault) => {
                    self.faults[0].get_or_insert(fault);
                    self.clock.sleep_until(until);
                }
            }
            match links.robots[1].receive(Nanos(0)) {
                Ok(report) => {
                    arrived.robots[1] = report.or(arrived.robots[1]);
                    self.pending = report.is_some();
                    if let (Some(report), false) = (&report, dry) {
                        self.wires[1].reported(report, &links.robots[1].counters());
                    }
                }
                Err(fault) => {
                    self.faults[1].get_or_insert(fault);
                }
            }
            // After a late wake-up, read once what has arrived.
            if arrived.robots[0].is_some() || until >= deadline {
                break;
            }
            // Robot 2 does not wait for robot 1: it receives the last command.
            if let (true, Some(order)) = (self.pending, order) {
                let order = if dry { Some(order) } else { self.wires[1].answer(&order, stopping) };
                if let Some(Err(fault)) = order.map(|order| links.robots[1].send(&order)) {
                    self.faults[1].get_or_insert(fault);
                }
                self.answered[1] = self.clock.now() - self.start;
                self.wire[1] = order;
            }
        }
        match links.sensor.latest() {
            Ok(sample) => arrived.sample = sample,
            Err(fault) => {
                self.faults[2].get_or_insert(fault);
            }
        }
        arrived.broken = self.faults.map(|fault| fault.is_some());
        arrived.links = [links.robots[0].counters(), links.robots[1].counters(), links.sensor.counters()];
        arrived
    }

    /// Runs one cycle of a dry run's emulated robots in virtual time.
    fn shadows(&mut self, now: Nanos) -> LinkInputs {
        let mut arrived = LinkInputs::default();
        for ((robot, report), wire) in self.moved.robots.iter_mut().zip(&mut arrived.robots).zip(&mut self.wires) {
            *report = robot.receive(NEVER).ok().flatten();
            if let Some(report) = report {
                report.received = now;
                wire.reported(report, &robot.counters());
            }
        }
        arrived.sample = self.moved.sensor.latest().ok().flatten();
        if let Some(sample) = &mut arrived.sample {
            sample.received = now;
        }
        arrived
    }

    /// Sends the commands to the robots that reported in this cycle, and records what was sent.
    fn answer(&mut self, inputs: &CycleInputs) {
        if let (Some(links), Some(reported)) = (&mut self.exercised, &inputs.exercised) {
            for (r, robot) in links.robots.iter_mut().enumerate() {
                if reported.robots[r].is_some() && (r == 0 || self.pending) {
                    // In a dry run a dead link shows in its counters.
                    let _ = robot.send(&Order::Hold);
                    self.answered[r] = self.clock.now() - self.start;
                }
            }
        }
        for (r, order) in self.last.moved.into_iter().enumerate() {
            self.wires[r].command(&order.unwrap_or(Order::Hold));
            let answers = inputs.moved.robots[r].is_some() && (r == 0 || self.pending || self.exercised.is_some());
            let sent = order.filter(|_| answers).and_then(|order| {
                let order = self.wires[r].answer(&order, self.last.stopping)?;
                match self.moved.robots[r].send(&order) {
                    Ok(()) => {
                        if self.exercised.is_none() {
                            self.answered[r] = self.clock.now() - self.start;
                        }
                        Some(order)
                    }
                    Err(fault) => {
                        self.faults[r].get_or_insert(fault);
                        None
                    }
                }
            });
            self.core.sent(r, sent.or(self.wire[r].take()).as_ref());
        }
    }

    /// Records the values that only the session knows.
    fn finish(&mut self, inputs: &CycleInputs, begun: Nanos, lateness: Nanos) {
        let now = self.clock.now();
        let busy = now - begun;
        self.overruns += u64::from(busy > self.cycle);
        let overrun = if busy > self.cycle { cycle_flags::OVERRUN } else { 0 };
        let record = self.core.record_mut();
        (record.busy, record.overruns) = (busy, self.overruns);
        record.flags |= overrun;
        let reports = inputs.exercised.unwrap_or(inputs.moved).robots;
        let robots = [&mut record.robot_1, &mut record.robot_2].into_iter().zip(reports).zip(self.answered);
        for ((robot, report), answered) in robots {
            robot.lateness = lateness;
            if let (Some(report), true) = (report, robot.order != OrderKind::None) {
                robot.round_trip = answered - report.received;
            }
        }
    }

    /// Ends the protocol sessions without a ramp, after a second stop request.
    pub fn end_at_once(&mut self, cause: StopCause) {
        let links = &mut self.moved;
        for _ in 0..END_CYCLES {
            for (robot, wire) in links.robots.iter_mut().zip(&self.wires) {
                let reported = robot.receive(self.clock.now() + self.cycle);
                if let Ok(Some(report)) = reported {
                    let at = wire.limiter().map_or_else(|| report.set_point(), Limiter::position);
                    // A link fault has no consequence any more.
                    let _ = robot.send(&Order::End(at));
                }
            }
        }
        self.core.record_mut().cause = cause;
        self.core.record_mut().phase = Phase::Stopped;
    }

    /// Ramps to rest by the limiters of the wire alone: the decisions have failed.
    pub fn ramp_down_blind(&mut self) {
        let record = self.core.record_mut();
        (record.cause, record.phase) = (StopCause::Panic, Phase::Stopping);
        let deadline = self.clock.now() + BLIND_TIME;
        while self.clock.now() < deadline && self.wires.iter().any(|wire| wire.state().moving != 0) {
            for (robot, wire) in self.moved.robots.iter_mut().zip(&mut self.wires) {
                let reported = robot.receive(self.clock.now() + self.cycle);
                if let (Ok(Some(_)), Some(axes)) = (reported, wire.stop()) {
                    let _ = robot.send(&Order::Move(axes));
                }
            }
        }
        self.end_at_once(StopCause::Panic);
    }

    /// Returns the record of the last cycle.
    pub fn record(&self) -> &CycleRecord {
        self.core.record()
    }

    /// Returns the record of the clock master.
    pub fn master(&self) -> &RobotRecord {
        &self.core.record().robot_1
    }
}

/// Converts to times since the start of the session.
fn localise(arrived: &mut LinkInputs, start: Nanos) {
    arrived.robots.iter_mut().flatten().for_each(|report| report.received = report.received - start);
    if let Some(sample) = &mut arrived.sample {
        sample.received = sample.received - start;
    }
}
