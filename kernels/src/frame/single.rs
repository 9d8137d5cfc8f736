//! One run with its two halves apart: the simulation computer that drives real robots, and a facility in their place.
//!
//! Both step the farm's own tile with one lane, so that a drive of emulated robots gives the bits of the farm's HIL loop.

use super::{Batch, FacilityLanes, Interface, Loops, Tile, has_noisy_camera};
use crate::metrics::Metrics;
use crate::monitor::{self, Touch, Watch};
use crate::params::Params;
use crate::plant::Plant;
use crate::robot::parts_by_axes;
use crate::space::{Motion, Parts, Wrench};
use crate::staged::{displaced, extrapolate, followed, in_place, kinematics, latch, metrics, on_course};
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
    /// A channel of the sensor has saturated.
    pub saturated: bool,
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
    /// Relative speed of the simulated parts when it ended \[m/s\].
    pub speed: f64,
    /// Energy through the port on the simulated side so far \[J\].
    pub port_energy: f64,
}

/// The simulation computer: space dynamics, compensator and commands of one run, tick by tick.
pub trait SimulationComputer: Send {
    /// Laboratory motions that the parts shall have now.
    fn reference(&self) -> Parts<f64>;

    /// One tick under what the facility has measured now.
    fn tick(&mut self, measured: &Measured);

    /// What the run has come to.
    fn progress(&self) -> Progress;

    /// Metrics of the run as the facility sees it; the depth of a real contact is not measured, and stays 0.
    fn metrics(&self) -> Metrics<f64>;
}

/// A facility that stands in for a real one: both robots, contact and sensor, tick by tick.
pub trait SimulatedFacility: Send {
    /// Puts both robots at rest at their references.
    fn stand(&mut self, reference: &Parts<f64>);

    /// The run begins with the next tick: clock, random numbers and readings of the sensor start as in the farm's run,
    /// and the robots where the farm's are: on the commanded course, without what is left of the run-in's transient.
    fn begin_run(&mut self);

    /// One tick towards the motions that the parts shall have at its end.
    fn tick(&mut self, reference: &Parts<f64>) -> Measured;

    /// What the contact really did so far: peaks and events of the true parts.
    fn watch(&self) -> Watch<f64>;

    /// Positions of the motors, torques of the drives; only robots with joints have them.
    fn drives(&self) -> Option<[crate::manipulator::cell::Drives<f64>; 2]>;
}

/// How a facility's measurements are read as events.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TouchThreshold {
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
    reading: TouchThreshold,
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
) -> Box<dyn SimulatedFacility> {
    let mut model = (***plant).clone();
    (model.facility.impedance, model.facility.test_motion) = (None, None);
    let plant = Plant::new(model);
    let batch = Batch { key, noisy: true, loops: Loops::Both };
    let (lanes, interface) = FacilityLanes::alone(&plant, batch, &[(0, run, *params)]);
    Box::new(Facility { plant, lanes, interface })
}

fn boxed_computer<const N: usize>(
    plant: &Arc<Plant>,
    run: u64,
    params: &Params<f64>,
    reading: TouchThreshold,
) -> Box<dyn SimulationComputer> {
    // Of the loop's noise only the camera's is the computer's own.
    let batch = Batch { key: [0; 2], noisy: has_noisy_camera(plant), loops: Loops::Both };
    let mut tile = Tile::<f64, N>::new(plant, batch);
    // Real links have their own delays.
    let params = Params { sensor_delay: 0.0, sensor_delay_error: 0.0, ..*params };
    tile.load(plant, &[(0, run, params)]);
    // Capacity for one more entry: a tick allocates nothing.
    let mut late = VecDeque::with_capacity(reading.hold_back + 1);
    late.resize(reading.hold_back, Wrench::zero());
    Box::new(Computer { plant: Arc::clone(plant), tile, reading, late })
}

struct Computer<const N: usize> {
    plant: Arc<Plant>,
    tile: Tile<f64, N>,
    reading: TouchThreshold,
    /// Wrenches on part A of the last ticks, inertial axes, oldest first.
    late: VecDeque<Wrench<f64>>,
}

impl<const N: usize> Computer<N> {
    fn now(&self) -> f64 {
        self.tile.facility.now(&self.plant)
    }

    fn simulated(&self) -> Parts<f64> {
        kinematics(&self.plant, &self.tile.hil.masses, &self.tile.hil.bodies).parts
    }

    /// Watches the parts over the tick that ends now, as far as a facility can see them.
    fn watch(&mut self, measured: &Measured, simulated: &Parts<f64>) {
        let (m, hil, t) = (&*self.plant, &mut self.tile.hil, &mut self.tile.facility);
        self.late.push_back(crate::sensor::feed_back(measured.parts.a, measured.wrench));
        let felt = self.late.pop_front().unwrap_or_else(Wrench::zero);
        let contact = felt_touch(felt, self.reading.touch_force);
        let held_back = self.reading.hold_back as f64;
        for substep in 1..=m.timing.substeps {
            let ago = f64::from(m.timing.substeps - substep) * m.timing.substep;
            let time = (t.tick - held_back) * m.timing.tick() - ago;
            let mut gate = latch(m, &t.params, &measured.parts, hil.interface.watch.closed, hil.interface.grip.share);
            // A sensor measures the sum of contact and latch: before capture it is the contact, afterwards the latch.
            let (pull, push) = if gate.closed > 0.0 { (felt, Wrench::zero()) } else { (Wrench::zero(), felt) };
            gate.wrench = pull;
            let touch = Touch { wrench: push, ..contact };
            in_place::observe(m, &mut hil.interface.watch, time, &measured.parts, simulated, &touch, &gate);
            in_place::step_admittance(m, &mut t.admittance, measured.parts.a, measured.wrench);
        }
        let seen = &mut hil.interface.watch;
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
    Touch { wrench, force, sum: force, depth: 0.0, normal, lever, finger_power: 0.0 }
}

impl<const N: usize> SimulationComputer for Computer<N> {
    fn reference(&self) -> Parts<f64> {
        let m = &*self.plant;
        let sent = self.tile.facility.reference(m, &self.simulated(), self.now());
        displaced(m, &sent, &self.tile.facility.admittance)
    }

    fn tick(&mut self, measured: &Measured) {
        let now = self.now();
        let simulated = self.simulated();
        self.watch(measured, &simulated);
        let m = &*self.plant;
        let Tile { hil, facility, .. } = &mut self.tile;
        let live = hil.interface.watch.done <= 0.0;
        crate::staged::update_kinematics(m, &hil.masses, &hil.bodies, &mut hil.kinematics);
        let reference = facility.reference(m, &simulated, now);
        facility.send_command(m, &reference, live);
        facility.receive_wrench(m, &mut hil.interface.watch, &simulated, measured.wrench, live);
        self.tile.tick_simulation(m, live);
        let Tile { hil, facility, .. } = &mut self.tile;
        let (last, end) = (facility.is_last(m), now + m.timing.tick());
        in_place::finish(m, &mut hil.interface.watch, end, &hil.kinematics.parts, last, 1.0);
        facility.end_tick();
    }

    fn progress(&self) -> Progress {
        let watch = &self.tile.hil.interface.watch;
        Progress {
            time: self.now(),
            parts: self.simulated(),
            fed_back: self.tile.facility.held,
            touched: watch.touch_time >= 0.0,
            touching: watch.touching > 0.0,
            captured: watch.closed > 0.0,
            over: watch.done > 0.0,
            unstable: watch.unstable > 0.0,
            speed: watch.end_speed,
            port_energy: watch.port_energy,
        }
    }

    fn metrics(&self) -> Metrics<f64> {
        let (m, hil, facility) = (&*self.plant, &self.tile.hil, &self.tile.facility);
        let seen = followed(m, &facility.params, &facility.tracking);
        metrics(m, &hil.interface.watch, &hil.bodies, &hil.interface.ring, &seen, 1.0)
    }
}

struct Facility {
    plant: Plant,
    lanes: FacilityLanes<f64>,
    interface: Interface<f64>,
}

impl SimulatedFacility for Facility {
    fn stand(&mut self, reference: &Parts<f64>) {
        let (m, t) = (&self.plant, &mut self.lanes);
        let rest = |motion: Motion<f64>| Motion { velocity: Vec3::zero(), omega: Vec3::zero(), ..motion };
        let reference = Parts { a: rest(reference.a), b: rest(reference.b) };
        for slot in 0..t.slots {
            t.commands.put(slot, &reference, true);
            t.wrenches.put(slot, &Wrench::zero(), true);
        }
        t.place_robots(m, &reference, true);
    }

    fn begin_run(&mut self) {
        let (m, t) = (&self.plant, &mut self.lanes);
        let first = extrapolate(m, &t.commands.at(t.step, 1), 1.0);
        t.place_robots(m, &on_course(m, &t.params, &first), true);
        t.begin_readings(m, true);
        t.tick = 0.0;
    }

    fn tick(&mut self, reference: &Parts<f64>) -> Measured {
        let (m, t) = (&self.plant, &mut self.lanes);
        let wrench = t.follow(m, &mut self.interface, reference);
        Measured { parts: parts_by_axes(m, &t.robots), wrench, saturated: t.sensor.saturated > 0.0 }
    }

    fn watch(&self) -> Watch<f64> {
        self.interface.watch
    }

    fn drives(&self) -> Option<[crate::manipulator::cell::Drives<f64>; 2]> {
        self.lanes.arms.as_ref().map(|arms| arms.drives)
    }
}
