//! From open links to a run that begins: checks, drives that come up, the way to the start, the tare.

use super::{Core, Inputs, Orders, State, pose};
use crate::drive::guard::Guard;
use crate::drive::motion::JointMove;
use crate::drive::start::{Refusal, START_TOLERANCE, StartUp, Watched, apart, moved, moved_sensor};
use crate::limiter::Limiter;
use crate::log::codes::StopCause;
use crate::log::record::RobotRecord;
use crate::signals::AXES;
use crate::time::Nanos;
use softdock_kernels::session::clearance_at;
use softdock_kernels::space::Wrench;
use std::sync::Arc;

/// Time in which drives come up and brakes open \[s\].
const ENABLE_TIME: f64 = 0.5;
/// A way to the start is looked at in so many parts.
const WAY_POSTURES: u32 = 200;
/// How long the sensor is read for its tare \[s\].
const TARE_TIME: f64 = 0.5;
/// Spread of the force during the tare that still counts as rest, as a share of the touch force.
const RESTLESS: f64 = 2.0;

impl Core {
    pub(super) fn start_up(&mut self, inputs: &Inputs) -> Orders {
        let [moved, real] = &mut self.checks;
        let check = |of: &mut StartUp, links: Watched| of.check(&links, &self.arms, &self.limits, &self.capabilities);
        let moved = check(moved, Watched::moved(&self.record, inputs.moved.broken));
        let real = match &inputs.exercised {
            Some(arrived) => check(real, Watched::exercised(&self.record, arrived.broken)),
            None => Some(Ok(())),
        };
        let passed = matches!((moved, real), (Some(Ok(())), Some(Ok(()))));
        self.ready = passed && self.task.armed && !inputs.go;
        match (moved, real) {
            (Some(Err(refusal)), _) | (_, Some(Err(refusal))) => self.refuse(refusal),
            (Some(Ok(())), Some(Ok(()))) if !self.ready => self.begin(inputs.now),
            _ => Orders::HOLD,
        }
    }

    pub(super) fn refuse(&mut self, refusal: Refusal) -> Orders {
        self.refusal = Some(refusal);
        self.record.cause = StopCause::StartRefused;
        self.state = State::Ending { cycles: 0 };
        self.end(0)
    }

    /// From rest where the robots are: limits and guard are set, and the way to the start is found.
    pub(super) fn begin(&mut self, now: Nanos) -> Orders {
        // From where the robots' controllers hold them, not from where they are measured: the first command asks for
        // nothing, whatever the servo error.
        let at = moved(&self.record).map(RobotRecord::set_point);
        self.begun_at = at;
        self.sent = [self.tools_at(&at); 2];
        // Before anything moves: a wrong tool, reversed axes or a load against the tool show in a single reading.
        let a = self.arms.part_on(0, &self.axes[0][0], &[0.0; AXES]);
        if let Some(refusal) = self.biased(moved_sensor(&self.record).raw - self.sensing.weight(&a)) {
            return self.refuse(refusal);
        }
        let cycle = self.capabilities[0].cycle;
        self.limiters = Some(at.map(|axes| Limiter::new(self.limits, cycle.seconds(), axes)));
        let (plant, cycles) = (Arc::clone(&self.task.plant), self.capabilities.map(|c| c.cycle));
        self.guard = Some(Guard::new(plant, &self.task.station, cycles, now));
        if !self.start_axes().1 {
            let first = self.arms.axes_for(0, &self.run_in.at(&self.task.plant, 0.0).a).1;
            return self.refuse(Refusal::Unreachable(if first { 2 } else { 1 }));
        }
        if let (Some(refusal), false) = (self.off_start(), self.task.to_start) {
            return self.refuse(refusal);
        }
        if let Some(refusal) = self.blocked() {
            return self.refuse(refusal);
        }
        self.state = State::Enabling { begun: now };
        self.hold_position()
    }

    /// A way to the start that a rule of the workspace forbids, by so many postures on it.
    fn blocked(&self) -> Option<Refusal> {
        self.off_start()?;
        let way = JointMove::new(self.begun_at, self.start_axes().0, &self.limits);
        let least = self.task.plant.facility.rules.arm_distance;
        (0..=WAY_POSTURES).find_map(|posture| {
            let axes = way.at(way.duration() * f64::from(posture) / f64::from(WAY_POSTURES));
            let axes: [[f64; AXES]; 2] = std::array::from_fn(|robot| self.arms.in_model(robot, &axes[robot]));
            let found = clearance_at(&self.task.plant, [&axes[0], &axes[1]]);
            let arms = (least.is_finite() && found.arms < least).then_some(Refusal::ArmsOnWay([found.arms, least]));
            arms.or_else(|| (found.depth > 0.0).then_some(Refusal::BoxOnWay(found.depth)))
        })
    }

    /// Drives that have to be enabled and brakes that have to open get their time, told to stay where they are.
    pub(super) fn enable(&mut self, begun: Nanos, now: Nanos) -> Orders {
        if (now - begun).seconds() >= ENABLE_TIME {
            let way = JointMove::new(self.begun_at, self.start_axes().0, &self.limits);
            self.state = if self.off_start().is_some() { State::ToStart { way, begun: now } } else { resting(now) };
        }
        self.hold_position()
    }

    /// A sensor that reads more at rest, beside the weight of its tool, than it may.
    fn biased(&self, net: Wrench<f64>) -> Option<Refusal> {
        let (found, most) = ([net.force.norm(), net.moment.norm()], self.task.station.sensor.bias);
        // Not "greater than": a NaN is refused too.
        (!(found[0] <= most[0] && found[1] <= most[1])).then_some(Refusal::Bias(found, most))
    }

    /// The robot that holds its part too far from the start of the run.
    pub(super) fn off_start(&self) -> Option<Refusal> {
        let want = self.run_in.at(&self.task.plant, 0.0);
        let at = self.arms.parts_on(&self.axes[0], &[[0.0; AXES]; 2]);
        [(want.a, at.a), (want.b, at.b)].iter().enumerate().find_map(|(r, (want, at))| {
            let (distance, angle) = apart(&pose(want), &pose(at));
            (distance > START_TOLERANCE[0] || angle > START_TOLERANCE[1]).then_some(Refusal::NotAtStart(
                r + 1,
                distance,
                angle,
            ))
        })
    }

    pub(super) fn move_to_start(&mut self, way: &JointMove, begun: Nanos, now: Nanos) -> Orders {
        let time = (now - begun).seconds() + self.capabilities[0].cycle.seconds();
        let orders = self.limited(&way.at(time), true);
        // The robots lag behind their commands: they get a second to come in.
        if time > way.duration() {
            match self.off_start() {
                None => self.state = resting(now),
                Some(refusal) if time > way.duration() + 3.0 => return self.refuse(refusal),
                Some(_) => {}
            }
        }
        orders
    }

    /// Reads the sensor at rest; then the run begins.
    pub(super) fn tare(&mut self, inputs: &Inputs) -> Orders {
        let State::Taring { begun, mut sum, mut least, mut most, mut samples } = self.state else {
            return self.hold_position();
        };
        if let Some(sample) = inputs.moved.sample {
            let a = self.arms.part_on(0, &self.axes[0][0], &[0.0; AXES]);
            let net = sample.wrench - self.sensing.weight(&a);
            (sum, samples) = (sum + net, samples + 1);
            let force = net.force.norm();
            (least, most) = (least.min(force), most.max(force));
        }
        self.state = State::Taring { begun, sum, least, most, samples };
        if (inputs.now - begun).seconds() >= TARE_TIME && samples > 0 {
            let spread = most - least;
            if spread > RESTLESS * self.task.station.sensor.touch_force {
                return self.refuse(Refusal::Restless(spread));
            }
            let tare = sum.scale_add(1.0 / f64::from(samples), Wrench::zero());
            if let Some(refusal) = self.biased(tare) {
                return self.refuse(refusal);
            }
            self.sensing.tare = tare;
            self.state = State::RunIn { cycles: 0 };
        }
        self.hold_position()
    }
}

fn resting(now: Nanos) -> State {
    State::Taring { begun: now, sum: Wrench::zero(), least: f64::INFINITY, most: 0.0, samples: 0 }
}
