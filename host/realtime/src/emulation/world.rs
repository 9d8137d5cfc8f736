//! The emulated facility's one physics clock: both robots, the contact between their parts, and the sensor.

use crate::arms::Arms;
use crate::sensing::Sensing;
use crate::signals::AXES;
use softdock_campaign::Station;
use softdock_kernels::frame::single::{EmulatedFacility, Measured, emulated_facility};
use softdock_kernels::manipulator::cell::Misplaced;
use softdock_kernels::monitor::Watch;
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use softdock_kernels::robot::{by_differences, carry_on};
use softdock_kernels::space::{Parts, Wrench};
use softdock_kernels::vector::Pose;
use std::sync::Arc;

/// What one emulated robot measures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Axes as its controller counts them: joints \[rad\], rail \[m\].
    pub position: [f64; AXES],
    /// Torques of the drives \[N m\], \[N\]; only robots with joints have them.
    pub torque: Option<[f64; AXES]>,
    /// Pose of its tool in its base.
    pub pose: Pose<f64>,
}

/// Both emulated robots, contact and sensor.
pub struct World {
    plant: Arc<Plant>,
    arms: Arms,
    sensing: Sensing,
    facility: Box<dyn EmulatedFacility>,
    /// Commanded poses of the last ticks, newest first.
    past: [Parts<f64>; 2],
    measured: Measured,
}

impl World {
    /// A facility with the errors and delays of a draw; both robots stand where the scenario begins.
    ///
    /// `bias` is what the sensor reads without weight and contact. `key` and `run` make its noise.
    ///
    /// # Errors
    /// The robot (1 or 2) that cannot hold its part at the scenario's start.
    pub fn new(
        plant: &Arc<Plant>,
        station: &Station,
        key: [u32; 2],
        run: u64,
        params: &Params<f64>,
        bias: Wrench<f64>,
    ) -> Result<Self, (usize, Misplaced)> {
        let arms = Arms::new(plant, station)?;
        let facility = emulated_facility(plant, key, run, params);
        let mut sensing = Sensing::new(station);
        sensing.tare = bias;
        let start = plant.start;
        let (home, _) = arms.positions_for(&start);
        let measured = Measured { parts: start, wrench: Wrench::zero(), saturated: false };
        let mut world = Self { plant: Arc::clone(plant), arms, sensing, facility, past: [start; 2], measured };
        world.stand(&home);
        Ok(world)
    }

    /// Period of its clock \[s\].
    pub fn tick_seconds(&self) -> f64 {
        self.plant.timing.tick()
    }

    /// Puts both robots at rest, axes as their controllers count them.
    pub fn stand(&mut self, position: &[[f64; AXES]; 2]) {
        let parts = self.parts_at(position);
        self.past = [parts; 2];
        self.facility.stand(&parts);
        self.measured = Measured { parts, wrench: Wrench::zero(), saturated: false };
    }

    /// The run begins with the next tick, as the farm's run does: with the same noise, and with no error of the tare but
    /// the draw's. `tare` is what the drive has read at rest, the sensor's axes.
    pub fn begin_run(&mut self, tare: Wrench<f64>) {
        self.sensing.tare = tare;
        self.facility.begin_run();
    }

    /// One tick in which the controllers ask their robots to come to these axes.
    pub fn tick(&mut self, targets: &[[f64; AXES]; 2]) {
        let poses = self.parts_at(targets);
        let told = by_differences(&self.plant, &self.past[1], &self.past[0], &poses);
        self.past = [poses, self.past[0]];
        self.measured = self.facility.tick(&told);
    }

    /// The parts on robots that stand on these axes.
    fn parts_at(&self, axes: &[[f64; AXES]; 2]) -> Parts<f64> {
        self.arms.parts_on(axes, &[[0.0; AXES]; 2])
    }

    /// What robot 1 or 2 (0 or 1 here) measures.
    pub fn robot(&self, robot: usize) -> Reading {
        self.reading_of(robot, &self.measured.parts)
    }

    /// The same so long after the last tick \[s\]: controllers do not share the physics' clock.
    pub fn robot_after(&self, robot: usize, since: f64) -> Reading {
        if since == 0.0 {
            return self.robot(robot);
        }
        self.reading_of(robot, &carry_on(&self.plant, &self.measured.parts, since / self.plant.timing.tick()))
    }

    fn reading_of(&self, robot: usize, parts: &Parts<f64>) -> Reading {
        let motion = if robot == 0 { &parts.a } else { &parts.b };
        let position = self.arms.axes_for(robot, motion).0.position;
        let torque = self.facility.drives().map(|drives| drives[robot].axis.map(|axis| axis.torque));
        Reading { position, torque, pose: self.arms.tool_pose(robot, &position) }
    }

    /// What the sensor reads, its own axes and origin.
    pub fn reading(&self) -> Wrench<f64> {
        self.reading_under(self.measured.wrench)
    }

    /// The same of a sensor that feels no contact.
    pub fn reading_without_contact(&self) -> Wrench<f64> {
        self.reading_under(Wrench::zero())
    }

    fn reading_under(&self, on_part: Wrench<f64>) -> Wrench<f64> {
        self.sensing.reading(on_part, &self.measured.parts.a) + self.sensing.tare
    }

    /// The contact's wrench on part A as the sensor measures it, about the part's origin in the part's axes.
    pub fn wrench(&self) -> Wrench<f64> {
        self.measured.wrench
    }

    /// A channel of the sensor has saturated.
    pub fn saturated(&self) -> bool {
        self.measured.saturated
    }

    /// Where the parts really are.
    pub fn parts(&self) -> &Parts<f64> {
        &self.measured.parts
    }

    /// What the contact really did so far.
    pub fn watch(&self) -> Watch<f64> {
        self.facility.watch()
    }
}
