//! Emulated robots and sensor without a protocol: one physics clock, links in the same thread.

use super::world::World;
use crate::clock::Clock;
use crate::protocol::Line;
use crate::signals::Links;
use crate::signals::{
    Capabilities, ForceSample, ForceSensor, LinkCounters, LinkFault, Order, Peak, RobotLink, RobotState,
};
use crate::time::Nanos;
use softdock_kernels::space::Wrench;
use std::cell::RefCell;
use std::rc::Rc;

/// Cycle of the robots.
pub const CYCLE: Nanos = Nanos::from_millis(1);

/// An emulated facility in the session's own thread.
pub struct InProcessRig {
    world: World,
    clock: Rc<dyn Clock>,
    cycle: Nanos,
    tick: Nanos,
    /// Time of the physics.
    time: Nanos,
    courses: [Line; 2],
    ended: [bool; 2],
    sequence: u32,
    peak: Peak,
}

impl InProcessRig {
    /// Creates a facility whose robots take commands every `cycle`, at their present positions.
    pub fn new(world: World, clock: Rc<dyn Clock>, cycle: Nanos) -> Rc<RefCell<Self>> {
        let time = clock.now();
        let courses = [0, 1].map(|robot| world.robot(robot).position).map(|at| Line { from: at, to: at, since: time });
        let tick = Nanos::from_seconds(world.tick_seconds());
        let (ended, sequence, mut peak) = ([false; 2], 0, Peak::default());
        peak.read(world.reading());
        Rc::new(RefCell::new(Self { world, clock, cycle, tick, time, courses, ended, sequence, peak }))
    }

    /// Returns the physical world.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Begins the run with the next tick, see [`World::begin_run`].
    pub fn begin_run(&mut self, tare: Wrench<f64>) {
        self.world.begin_run(tare);
    }

    /// Steps the physics up to a time.
    fn advance(&mut self, to: Nanos) {
        while self.time + self.tick <= to {
            self.time += self.tick;
            let targets = self.courses.map(|course| course.at(self.time, self.cycle));
            self.world.tick(&targets);
            self.sequence = self.sequence.wrapping_add(1);
            self.peak.see(self.world.reading());
        }
    }
}

/// Returns links to both robots and the sensor of a rig.
pub fn links(bench: &Rc<RefCell<InProcessRig>>) -> Links {
    Links {
        robots: [Box::new(EmulatedRobot::new(bench, 0)), Box::new(EmulatedRobot::new(bench, 1))],
        sensor: Box::new(EmulatedSensor::new(bench)),
    }
}

/// A link to one of the two robots.
pub struct EmulatedRobot {
    bench: Rc<RefCell<InProcessRig>>,
    index: usize,
    due: Nanos,
    counters: LinkCounters,
}

impl EmulatedRobot {
    /// Creates the link to robot 0 or 1 of an emulated facility.
    pub fn new(bench: &Rc<RefCell<InProcessRig>>, index: usize) -> Self {
        let due = bench.borrow().time + bench.borrow().cycle;
        Self { bench: Rc::clone(bench), index, due, counters: LinkCounters::default() }
    }
}

impl RobotLink for EmulatedRobot {
    fn capabilities(&self) -> Capabilities {
        let bench = self.bench.borrow();
        Capabilities { cycle: bench.cycle, master: true, rail: true, torque: false, pose: true }
    }

    fn receive(&mut self, deadline: Nanos) -> Result<Option<RobotState>, LinkFault> {
        let mut bench = self.bench.borrow_mut();
        if self.due > deadline && self.due > bench.clock.now() {
            bench.clock.sleep_until(deadline);
            return Ok(None);
        }
        bench.clock.sleep_until(self.due);
        let stamp = self.due;
        bench.advance(stamp);
        self.due += bench.cycle;
        self.counters.received += 1;
        let reading = bench.world.robot(self.index);
        Ok(Some(RobotState {
            stamp,
            received: stamp,
            position: reading.position,
            reported_set_point: Some(bench.courses[self.index].at(bench.time, bench.cycle)),
            torque: reading.torque,
            pose: Some(reading.pose),
            late_answers: 0,
            ready: !bench.ended[self.index],
        }))
    }

    fn send(&mut self, order: &Order) -> Result<(), LinkFault> {
        let mut bench = self.bench.borrow_mut();
        let (time, cycle) = (bench.time, bench.cycle);
        if let (Order::Move(to) | Order::End(to), false) = (order, bench.ended[self.index]) {
            let from = bench.courses[self.index].at(time, cycle);
            bench.courses[self.index] = Line { from, to: *to, since: time };
        }
        bench.ended[self.index] |= matches!(order, Order::End(_));
        Ok(())
    }

    fn counters(&self) -> LinkCounters {
        self.counters
    }
}

/// A link to the sensor between robot 1 and part A.
pub struct EmulatedSensor {
    bench: Rc<RefCell<InProcessRig>>,
    seen: u32,
    counters: LinkCounters,
}

impl EmulatedSensor {
    /// Creates the link to the sensor of an emulated facility.
    pub fn new(bench: &Rc<RefCell<InProcessRig>>) -> Self {
        Self { bench: Rc::clone(bench), seen: 0, counters: LinkCounters::default() }
    }
}

impl ForceSensor for EmulatedSensor {
    fn period(&self) -> Nanos {
        self.bench.borrow().tick
    }

    fn latest(&mut self) -> Result<Option<ForceSample>, LinkFault> {
        let mut bench = self.bench.borrow_mut();
        let now = bench.clock.now();
        bench.advance(now);
        if bench.sequence == self.seen {
            return Ok(None);
        }
        self.counters.received += u64::from(bench.sequence.wrapping_sub(self.seen));
        self.seen = bench.sequence;
        let (wrench, saturated) = (bench.world.reading(), bench.world.saturated());
        let peak = bench.peak.read(wrench);
        Ok(Some(ForceSample { peak, saturated, ..ForceSample::new(bench.time, self.seen, wrench) }))
    }

    fn counters(&self) -> LinkCounters {
        self.counters
    }
}
