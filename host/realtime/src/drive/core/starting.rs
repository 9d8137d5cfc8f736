//! Start-up phases: checks, enabling of the drives, weighing of the tool, motion to the start, tare.

use super::{Core, CycleInputs, Orders, State};
use crate::drive::checklist::{Check, CheckKind, CheckOutcome, Checklist};
use crate::drive::guard::{Alarm, Guard};
use crate::drive::motion::JointMove;
use crate::drive::start::{CheckedLinks, StartUpContext, StartUpResult, Weighing, moved, start_errors};
use crate::limiter::Limiter;
use crate::log::codes::StopCause;
use crate::log::record::RobotRecord;
use crate::signals::{AXES, RAIL};
use crate::time::Nanos;
use softdock_kernels::contact::overlap::deepest_overlap;
use std::sync::Arc;

/// Time for enabling the drives and opening the brakes \[s\].
const ENABLE_TIME: f64 = 0.5;
/// Duration of the sensor's reading at rest \[s\].
const TARE_TIME: f64 = 0.5;
/// Settling time of the robots after a turn of the tool \[s\].
const SETTLE_TIME: f64 = 0.5;
/// Poses of a turn at which the distance of the parts is computed.
const TURN_POSES: u32 = 10;

/// Phase of a weighing in a second attitude.
#[derive(Clone, Copy, Debug)]
pub(super) enum Leg {
    /// Robot 1 turns its tool.
    Out,
    /// The sensor is read.
    Reading(Weighing),
    /// Robot 1 turns its tool back.
    Back,
}

impl Core {
    pub(super) fn start_up(&mut self, inputs: &CycleInputs) -> Orders {
        let cell = StartUpContext {
            arms: &self.arms,
            limits: &self.limits,
            robots: &self.capabilities,
            station: &self.task.station,
            plant: &self.task.plant,
            sensing: &self.sensing,
            start: &self.run_in.at(&self.task.plant, 0.0),
            to_start: self.task.to_start,
            now: inputs.now,
        };
        let [moved, real] = &mut self.checks;
        let moved = moved.check(&CheckedLinks::moved(&self.record, inputs.moved.broken), &cell);
        let of_real = StartUpContext { robots: &self.exercised, ..cell };
        let real = inputs
            .exercised
            .map(|arrived| real.check(&CheckedLinks::exercised(&self.record, arrived.broken), &of_real));
        // A dry run lists the checks of the real links, unless only the emulated ones have failed.
        let found = [real.flatten(), moved];
        let decided = || found.iter().flatten().filter(|found| found.decides).map(|found| &found.list);
        let failed = decided().find_map(Checklist::failed);
        let of_failed = decided().find(|list| list.failed().is_some());
        if let Some(list) = of_failed.or(found.iter().flatten().map(|found| &found.list).next()) {
            self.checklist = *list;
        }
        if let Some(failed) = failed {
            return self.refuse(failed);
        }
        let whole = |found: Option<StartUpResult>| found.is_some_and(|found| found.decides);
        let passed = whole(moved) && real.is_none_or(whole);
        self.ready = passed && self.task.armed && !inputs.go && !self.task.check_only;
        match (passed, self.ready) {
            (true, false) if self.task.check_only => {
                self.stop(Alarm::of(StopCause::Checked));
                Orders::HOLD
            }
            (true, false) => self.begin(inputs.now),
            (true, true) | (false, _) => Orders::HOLD,
        }
    }

    pub(super) fn refuse(&mut self, refusal: Check) -> Orders {
        self.refusal = Some(refusal);
        self.checklist.set(refusal);
        self.record.cause = StopCause::StartRefused;
        self.state = State::Ending { cycles: 0 };
        self.end(0)
    }

    /// Starts the motion phases from the robots' present rest position: creates limiters and guard, plans the path to
    /// the start.
    pub(super) fn begin(&mut self, now: Nanos) -> Orders {
        // Starts at the controllers' set-points, not at the measured positions: the first command then requests no
        // motion, whatever the servo error.
        let at = moved(&self.record).map(RobotRecord::set_point);
        self.begun_at = at;
        self.sent = [self.tools_at(&at); 2];
        let cycle = self.capabilities[0].cycle;
        self.limiters = Some(at.map(|axes| Limiter::new(self.limits, cycle.seconds(), axes)));
        let (plant, cycles) = (Arc::clone(&self.task.plant), self.capabilities.map(|c| c.cycle));
        self.guard = Some(Guard::new(plant, &self.task.station, cycles, now));
        self.state = State::Enabling { begun: now };
        self.hold_position()
    }

    /// Holds position while the drives are enabled and the brakes open.
    pub(super) fn enable(&mut self, begun: Nanos, now: Nanos) -> Orders {
        if (now - begun).seconds() >= ENABLE_TIME {
            self.state = match self.turn().filter(|_| self.task.armed) {
                Some(to) => {
                    let path = JointMove::new(self.begun_at, to, &self.limits);
                    State::Weighing { path, begun: now, leg: Leg::Out }
                }
                None => self.after_weighing(now),
            };
        }
        self.hold_position()
    }

    fn after_weighing(&self, now: Nanos) -> State {
        let path = JointMove::new(self.begun_at, self.start_axes().0, &self.limits);
        if self.off_start().is_some() { State::ToStart { path, begun: now } } else { resting(now) }
    }

    /// Returns axes at which the tool has another attitude on the sensor: a wrist axis of robot 1 is turned, if that
    /// changes the weight enough, stays within the limits and keeps the parts apart.
    fn turn(&self) -> Option<[[f64; AXES]; 2]> {
        let station = &self.task.station;
        let (angle, least) = (station.sensor.weighing_turn, 2.0 * station.sensor.weighing[0]);
        let weight_at = |axes: &[f64; AXES]| self.sensing.weight(&self.arms.part_on(0, axes, &[0.0; AXES])).force;
        let distance = |axes: &[[f64; AXES]; 2]| {
            let parts = self.arms.parts_on(axes, &[[0.0; AXES]; 2]);
            deepest_overlap(&self.task.plant, &parts).map_or(f64::INFINITY, |overlap| -overlap.depth)
        };
        let from = self.begun_at;
        let clear = distance(&from).min(station.links.contact.free_distance).max(0.0);
        let turned = |axis: usize, by: f64| {
            let mut to = from;
            to[0][axis] += by;
            to
        };
        let possible = |(axis, by): &(usize, f64)| {
            let (to, limit) = (turned(*axis, *by), &self.limits[*axis]);
            let inside =
                (limit.lower..=limit.upper).contains(&to[0][*axis]) && by.abs() <= station.robots[0].correction;
            let shares = (1..=TURN_POSES).map(|k| f64::from(k) / f64::from(TURN_POSES));
            inside
                && (weight_at(&to[0]) - weight_at(&from[0])).norm() >= least
                && shares.map(|share| distance(&turned(*axis, share * by))).all(|distance| distance >= clear)
        };
        let turns = (0..RAIL).rev().take(3).flat_map(|axis| [(axis, angle), (axis, -angle)]);
        turns.into_iter().find(possible).map(|(axis, by)| turned(axis, by))
    }

    /// Weighs the tool in a second attitude: one attitude alone does not reveal sensor axes exchanged about the
    /// vertical.
    pub(super) fn weigh(&mut self, inputs: &CycleInputs) -> Orders {
        let State::Weighing { path, begun, leg } = self.state else {
            return self.hold_position();
        };
        let time = (inputs.now - begun).seconds();
        let there = time > path.duration() + SETTLE_TIME;
        match leg {
            Leg::Out | Leg::Back => {
                let orders = self.limited(&path.at(time + self.capabilities[0].cycle.seconds()), true);
                if there && matches!(self.state, State::Weighing { .. }) {
                    let read = State::Weighing { path, begun: inputs.now, leg: Leg::Reading(Weighing::default()) };
                    self.state = if matches!(leg, Leg::Out) { read } else { self.after_weighing(inputs.now) };
                }
                orders
            }
            Leg::Reading(mut weighing) => {
                self.take_reading(inputs, &mut weighing);
                let leg = Leg::Reading(weighing);
                self.state = State::Weighing { path, begun, leg };
                if time >= TARE_TIME && weighing.samples() > 0 {
                    let change = weighing.mean() - self.checks[0].weighing().mean();
                    let limits = self.task.station.sensor.weighing;
                    let force = Check::new(CheckKind::TurnedForce, change.force.norm(), limits[0]);
                    let moment = Check::new(CheckKind::TurnedMoment, change.moment.norm(), limits[1]);
                    if let Some(refusal) = self.first_failed(&[force, moment]) {
                        return self.refuse(refusal);
                    }
                    let path = JointMove::new(path.at(path.duration()), self.begun_at, &self.limits);
                    self.state = State::Weighing { path, begun: inputs.now, leg: Leg::Back };
                }
                self.hold_position()
            }
        }
    }

    /// Adds the sample of a cycle, if there is one, without the weight of the tool.
    fn take_reading(&self, inputs: &CycleInputs, weighing: &mut Weighing) {
        if let Some(sample) = inputs.moved.sample {
            let a = self.arms.part_on(0, &self.axes[0][0], &[0.0; AXES]);
            weighing.take(sample.wrench - self.sensing.weight(&a));
        }
    }

    /// Stores checks in the list; returns the first that has failed.
    fn first_failed(&mut self, checks: &[Check]) -> Option<Check> {
        checks.iter().for_each(|check| self.checklist.set(*check));
        // Refuses NaN values too.
        checks.iter().copied().find(|check| check.answer() != CheckOutcome::Passed)
    }

    /// Returns the check of a robot whose part is too far from the start of the run.
    pub(super) fn off_start(&self) -> Option<Check> {
        let start = self.run_in.at(&self.task.plant, 0.0);
        let errors = |r: usize| start_errors(r, &self.axes[0][r], &self.arms, &start);
        (0..2).flat_map(errors).find(|check| check.answer() == CheckOutcome::Failed)
    }

    pub(super) fn move_to_start(&mut self, path: &JointMove, begun: Nanos, now: Nanos) -> Orders {
        let time = (now - begun).seconds() + self.capabilities[0].cycle.seconds();
        let orders = self.limited(&path.at(time), true);
        // The robots lag behind their commands and get a second to settle.
        if time > path.duration() {
            match self.off_start() {
                None => self.state = resting(now),
                Some(refusal) if time > path.duration() + 3.0 => return self.refuse(refusal),
                Some(_) => {}
            }
        }
        orders
    }

    /// Reads the sensor at rest, then begins the run.
    pub(super) fn tare(&mut self, inputs: &CycleInputs) -> Orders {
        let State::Taring { begun, mut weighing } = self.state else {
            return self.hold_position();
        };
        self.take_reading(inputs, &mut weighing);
        self.torques.tare(&self.arms, &inputs.moved.robots);
        self.state = State::Taring { begun, weighing };
        if (inputs.now - begun).seconds() >= TARE_TIME && weighing.samples() > 0 {
            let checks = weighing.checks(&self.task.station);
            if let Some(refusal) = self.first_failed(&checks) {
                return self.refuse(refusal);
            }
            self.sensing.tare = weighing.mean();
            self.tared = true;
            self.state = State::RunIn { cycles: 0 };
        }
        self.hold_position()
    }
}

fn resting(now: Nanos) -> State {
    State::Taring { begun: now, weighing: Weighing::default() }
}
