//! One run with its two halves apart: the simulation computer that drives real robots, and a facility in their place.
//!
//! Both step the farm's own tile with one lane, so that a drive of emulated robots gives the bits of the farm's HIL loop.

use super::{Batch, Loops, Tile};
use crate::metrics::Metrics;
use crate::monitor::{self, Touch, Watch};
use crate::params::Params;
use crate::plant::Plant;
use crate::robot::mounted_parts;
use crate::space::{Motion, Parts, Wrench};
use crate::staged::{command, displaced, followed, in_place, kinematics, latch, metrics, with_test};
use crate::vector::Vec3;
use std::collections::VecDeque;
use std::sync::Arc;

/// What a facility measures of a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Actual motion of the parts on the robots' tools, laboratory.
    pub parts: Parts<f64>,
    /// Wrench on part A about its origin, part A's axes, without the load behind the sensor.
    pub wrench: Wrench<f64>,
}

/// What the simulation computer of a run has come to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Time of the run \[s\].
    pub time: f64,
    /// Simulated parts, inertial axes.
    pub parts: Parts<f64>,
    /// Wrench that acts on the simulated part A, part A's axes.
    pub fed_back: Wrench<f64>,
    /// The parts have touched.
    pub touched: bool,
    /// The parts touch.
    pub touching: bool,
    /// The latch has closed.
    pub captured: bool,
    /// The run is over.
    pub over: bool,
    /// It ended by divergence.
    pub unstable: bool,
    /// Energy that the facility has created so far \[J\].
    pub created_energy: f64,
}

/// The simulation computer: space dynamics, compensator and commands of one run, tick by tick.
pub trait SimulationComputer: Send {
    /// Laboratory motions that the parts shall have now.
    fn told(&self) -> Parts<f64>;

    /// One tick under what the facility has measured now.
    fn tick(&mut self, measured: &Measured);

    /// What the run has come to.
    fn progress(&self) -> Progress;

    /// Metrics of the run as the facility sees it; the depth of a real contact is not measured, and stays 0.
    fn metrics(&self) -> Metrics<f64>;
}

/// A facility that stands in for a real one: both robots, contact and sensor, tick by tick.
pub trait EmulatedFacility: Send {
    /// Puts both robots at rest where they are told.
    fn stand(&mut self, told: &Parts<f64>);

    /// One tick towards the motions that the parts shall have at its end.
    fn tick(&mut self, told: &Parts<f64>) -> Measured;

    /// What the contact really did so far: peaks and events of the true parts.
    fn watch(&self) -> Watch<f64>;

    /// Positions of the motors, torques of the drives; only robots with joints have them.
    fn drives(&self) -> Option<[crate::manipulator::cell::Drives<f64>; 2]>;
}

/// How a facility's measurements are read as events.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Measured force above which the parts count as touching \[N\].
    pub touch_force: f64,
    /// Ticks by which poses may be older than the wrench: a force counts as contact only if no latch has closed by then.
    pub hold_back: usize,
}

/// The simulation computer of a run.
pub fn simulation_computer(
    plant: &Arc<Plant>,
    run: u64,
    params: &Params<f64>,
    reading: Reading,
) -> Box<dyn SimulationComputer> {
    crate::with_joints!(plant.joints(), boxed_computer(plant, run, params, reading))
}

/// A facility in the place of a real one, with the errors and delays that the parameters give it.
///
/// What a simulation computer does against them (impedance, test motion) is not its business.
pub fn emulated_facility(
    plant: &Arc<Plant>,
    key: [u32; 2],
    run: u64,
    params: &Params<f64>,
) -> Box<dyn EmulatedFacility> {
    crate::with_joints!(plant.joints(), boxed_facility(plant, key, run, params))
}

fn boxed_computer<const N: usize>(
    plant: &Arc<Plant>,
    run: u64,
    params: &Params<f64>,
    reading: Reading,
) -> Box<dyn SimulationComputer> {
    let batch = Batch { key: [0; 2], noisy: false, loops: Loops::Both };
    let mut tile = Tile::<f64, N>::new(plant, batch);
    // Real links have their own delays.
    let params = Params { sensor_delay: 0.0, sensor_delay_error: 0.0, ..*params };
    tile.load(plant, &[(0, run, params)]);
    // Room for the newest before the oldest goes: a tick takes nothing from the heap.
    let mut late = VecDeque::with_capacity(reading.hold_back + 1);
    late.resize(reading.hold_back, Wrench::zero());
    Box::new(Computer { plant: Arc::clone(plant), tile, reading, late })
}

fn boxed_facility<const N: usize>(
    plant: &Arc<Plant>,
    key: [u32; 2],
    run: u64,
    params: &Params<f64>,
) -> Box<dyn EmulatedFacility> {
    let mut model = (***plant).clone();
    (model.facility.impedance, model.facility.test_motion) = (None, None);
    let plant = Plant::new(model);
    let mut tile = Tile::<f64, N>::new(&plant, Batch { key, noisy: true, loops: Loops::Both });
    tile.load(&plant, &[(0, run, *params)]);
    Box::new(Facility { plant, tile })
}

struct Computer<const N: usize> {
    plant: Arc<Plant>,
    tile: Tile<f64, N>,
    reading: Reading,
    /// Wrenches on part A of the last ticks, inertial axes, oldest first.
    late: VecDeque<Wrench<f64>>,
}

impl<const N: usize> Computer<N> {
    fn now(&self) -> f64 {
        self.tile.tick * self.plant.timing.tick()
    }

    fn simulated(&self) -> Parts<f64> {
        kinematics(&self.plant, &self.tile.hil.masses, &self.tile.hil.bodies).parts
    }

    /// Watches the parts over the tick that ends now, as far as a facility can see them.
    fn watch(&mut self, measured: &Measured, simulated: &Parts<f64>) {
        let (m, t) = (&*self.plant, &mut self.tile);
        self.late.push_back(crate::sensor::feed_back(measured.parts.a, measured.wrench));
        let felt = self.late.pop_front().unwrap_or_else(Wrench::zero);
        let contact = felt_touch(felt, self.reading.touch_force);
        let held_back = self.reading.hold_back as f64;
        for substep in 1..=m.timing.substeps {
            let ago = f64::from(m.timing.substeps - substep) * m.timing.substep;
            let time = (t.tick - held_back) * m.timing.tick() - ago;
            let mut gate = latch(m, &t.params, &measured.parts, t.hil.watch.closed);
            // A sensor cannot tell contact from latch: what it measures is the one before capture, the other after.
            let (pull, push) = if gate.closed > 0.0 { (felt, Wrench::zero()) } else { (Wrench::zero(), felt) };
            gate.wrench = pull;
            let touch = Touch { wrench: push, ..contact };
            in_place::observe(m, &mut t.hil.watch, time, &measured.parts, simulated, &touch, &gate);
            in_place::yield_to(m, &mut t.yielding, measured.parts.a, measured.wrench);
        }
        let seen = &mut t.hil.watch;
        if seen.closed > 0.0 && seen.touch_time < 0.0 {
            // Captured at the first touch, whose force the latch has hidden.
            seen.touch_time = seen.capture_time;
        }
    }
}

/// A wrench on part A about its origin as a contact: its line of action passes the point nearest to the origin.
fn felt_touch(wrench: Wrench<f64>, least: f64) -> Touch<f64> {
    let force = wrench.force.norm();
    if force < least {
        return monitor::no_touch();
    }
    let (normal, lever) = (wrench.force * (1.0 / force), wrench.force.cross(wrench.moment) * (1.0 / (force * force)));
    Touch { wrench, force, depth: 0.0, normal, lever }
}

impl<const N: usize> SimulationComputer for Computer<N> {
    fn told(&self) -> Parts<f64> {
        let m = &*self.plant;
        let sent = with_test(m, &self.tile.params, &command(m, &self.simulated()), self.now());
        displaced(m, &sent, &self.tile.yielding)
    }

    fn tick(&mut self, measured: &Measured) {
        let now = self.now();
        let simulated = self.simulated();
        self.watch(measured, &simulated);
        let (m, t) = (&*self.plant, &mut self.tile);
        let live = t.hil.watch.done <= 0.0;
        crate::staged::update_kinematics(m, &t.hil.masses, &t.hil.bodies, &mut t.hil.kinematics);
        t.send_command(m, &simulated, now, live);
        t.sensor.output = measured.wrench;
        t.receive_wrench(m, &simulated, live);
        t.tick_simulation(m, live);
        let last = f64::from(u8::from(f64::from(m.timing.max_ticks) - 1.0 <= t.tick));
        in_place::finish(m, &mut t.hil.watch, now + m.timing.tick(), &t.hil.kinematics.parts, last);
        t.tick += 1.0;
        t.step = (t.step + 1) % t.slots;
    }

    fn progress(&self) -> Progress {
        let watch = &self.tile.hil.watch;
        Progress {
            time: self.now(),
            parts: self.simulated(),
            fed_back: self.tile.held,
            touched: watch.touch_time >= 0.0,
            touching: watch.touching > 0.0,
            captured: watch.closed > 0.0,
            over: watch.done > 0.0,
            unstable: watch.unstable > 0.0,
            created_energy: watch.port_energy - watch.hardware_energy,
        }
    }

    fn metrics(&self) -> Metrics<f64> {
        let (m, t) = (&*self.plant, &self.tile);
        let seen = followed(m, &t.params, &t.tracking);
        metrics(m, &t.hil.watch, &t.hil.bodies, &seen, 1.0)
    }
}

struct Facility<const N: usize> {
    plant: Plant,
    tile: Tile<f64, N>,
}

impl<const N: usize> EmulatedFacility for Facility<N> {
    fn stand(&mut self, told: &Parts<f64>) {
        let (m, t) = (&self.plant, &mut self.tile);
        let rest = |motion: Motion<f64>| Motion { velocity: Vec3::zero(), omega: Vec3::zero(), ..motion };
        let told = Parts { a: rest(told.a), b: rest(told.b) };
        for slot in 0..t.slots {
            t.commands.put(slot, &told, true);
            t.wrenches.put(slot, &Wrench::zero(), true);
        }
        t.place_robots(m, &told, true);
    }

    fn tick(&mut self, told: &Parts<f64>) -> Measured {
        let (m, t) = (&self.plant, &mut self.tile);
        let now = t.tick * m.timing.tick();
        let jitter = t.transmit(m, told, true);
        t.tick_facility(m, told, now, jitter, true);
        let wrench = t.arriving_wrench(m, true);
        t.tick += 1.0;
        t.step = (t.step + 1) % t.slots;
        Measured { parts: mounted_parts(m, &t.params, &t.robots), wrench }
    }

    fn watch(&self) -> Watch<f64> {
        self.tile.hil.watch
    }

    fn drives(&self) -> Option<[crate::manipulator::cell::Drives<f64>; 2]> {
        self.tile.arms.as_ref().map(|arms| arms.drives)
    }
}
