//! The physics of the emulated facility on one clock: both robots, the contact between their parts, and the sensor.

use super::axes::LateAxes;
use crate::arms::Arms;
use crate::sensing::Sensing;
use crate::signals::AXES;
use softdock_campaign::Station;
use softdock_kernels::frame::single::{Measured, SimulatedFacility, emulated_facility};
use softdock_kernels::manipulator::cell::Misplaced;
use softdock_kernels::monitor::Watch;
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use softdock_kernels::robot::{by_differences, extrapolate};
use softdock_kernels::space::{Parts, Wrench};
use softdock_kernels::vector::Pose;
use std::sync::Arc;

/// Positions that are checked on a path of separation.
const WAY_STEPS: u32 = 50;
/// Ticks within which touching parts or a closing latch are detected.
const WAY_TICKS: u32 = 20;

/// Measurements of one emulated robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmulatedReading {
    /// Axes in controller coordinates: joints \[rad\], rail \[m\].
    pub position: [f64; AXES],
    /// Torques of the drives \[N m\], \[N\]; only for robots with joints.
    pub torque: Option<[f64; AXES]>,
    /// Pose of its tool in its base.
    pub pose: Pose<f64>,
}

/// Both emulated robots, contact and sensor.
pub struct World {
    plant: Arc<Plant>,
    /// Noise key, run and draw.
    made_of: ([u32; 2], u64, Params<f64>),
    arms: Arms,
    sensing: Sensing,
    facility: Box<dyn SimulatedFacility>,
    /// Commanded poses of the last ticks, newest first.
    past: [Parts<f64>; 2],
    /// Following positions of the robots' axes.
    axes: [LateAxes; 2],
    measured: Measured,
}

impl World {
    /// Creates a facility with the errors and delays of a draw; both robots stand at the scenario's start.
    ///
    /// `bias` is the sensor's reading without weight and contact. `key` and `run` seed its noise.
    ///
    /// # Errors
    /// Robot (1 or 2) that cannot hold its part at the scenario's start.
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
        let axes = [0, 1].map(|robot| LateAxes::new(plant, params, robot));
        let made_of = (key, run, *params);
        let mut world =
            Self { plant: Arc::clone(plant), made_of, arms, sensing, facility, past: [start; 2], axes, measured };
        world.set_axes(&home);
        Ok(world)
    }

    /// Returns the period of its clock \[s\].
    pub fn tick_seconds(&self) -> f64 {
        self.plant.timing.tick()
    }

    /// Puts both robots to rest at controller axes.
    pub fn set_axes(&mut self, position: &[[f64; AXES]; 2]) {
        let parts = self.parts_at(position);
        self.past = [parts; 2];
        self.axes.iter_mut().zip(position).for_each(|(axes, position)| axes.set_axes(*position));
        self.facility.stand(&parts);
        self.measured = Measured { parts, wrench: Wrench::zero(), saturated: false };
    }

    /// Opens the latch and moves the robots, as by hand between two sessions; resets the contact history. Allocates.
    pub fn release(&mut self, position: &[[f64; AXES]; 2]) {
        let (key, run, params) = &self.made_of;
        self.facility = emulated_facility(&self.plant, *key, *run, params);
        self.set_axes(position);
    }

    /// Returns the first axes on a line between two positions at which the parts do not touch and no latch closes; the
    /// last ones if there are none. Allocates.
    pub fn apart(&self, from: &[[f64; AXES]; 2], to: &[[f64; AXES]; 2]) -> [[f64; AXES]; 2] {
        let (key, run, params) = &self.made_of;
        let on_the_way = |step: u32| {
            let share = f64::from(step) / f64::from(WAY_STEPS);
            [0, 1].map(|r: usize| std::array::from_fn(|axis| from[r][axis] + share * (to[r][axis] - from[r][axis])))
        };
        let free = (0..=WAY_STEPS).map(on_the_way).find(|targets| {
            let parts = self.parts_at(targets);
            let mut facility = emulated_facility(&self.plant, *key, *run, params);
            facility.stand(&parts);
            (0..WAY_TICKS).for_each(|_| {
                facility.tick(&parts);
            });
            let watch = facility.watch();
            watch.touch_time < 0.0 && watch.closed <= 0.0
        });
        free.unwrap_or(*to)
    }

    /// Begins the run with the next tick, like the farm's run: same noise, and only the draw's tare error. `tare` is
    /// the session's reading at rest, sensor axes.
    pub fn begin_run(&mut self, tare: Wrench<f64>) {
        self.sensing.tare = tare;
        self.facility.begin_run();
    }

    /// Steps by one tick with these target axes.
    pub fn tick(&mut self, targets: &[[f64; AXES]; 2]) {
        let poses = self.parts_at(targets);
        let reference = by_differences(&self.plant, &self.past[1], &self.past[0], &poses);
        self.past = [poses, self.past[0]];
        self.axes.iter_mut().zip(targets).for_each(|(axes, target)| axes.tick(*target));
        self.measured = self.facility.tick(&reference);
    }

    /// Returns the parts of robots at these axes.
    fn parts_at(&self, axes: &[[f64; AXES]; 2]) -> Parts<f64> {
        self.arms.parts_on(axes, &[[0.0; AXES]; 2])
    }

    /// Returns the measurements of robot 0 or 1.
    pub fn robot(&self, robot: usize) -> EmulatedReading {
        self.reading_of(robot, &self.measured.parts, 0.0)
    }

    /// Returns the measurements at a time after the last tick \[s\]: controllers do not share the physics' clock.
    pub fn robot_after(&self, robot: usize, since: f64) -> EmulatedReading {
        if since == 0.0 {
            return self.robot(robot);
        }
        let parts = extrapolate(&self.plant, &self.measured.parts, since / self.plant.timing.tick());
        self.reading_of(robot, &parts, since)
    }

    fn reading_of(&self, robot: usize, parts: &Parts<f64>, since: f64) -> EmulatedReading {
        let motion = if robot == 0 { &parts.a } else { &parts.b };
        let position = self.axes[robot].holding(&self.arms, robot, motion, since);
        let torque = self.facility.drives().map(|drives| drives[robot].axis.map(|axis| axis.torque));
        EmulatedReading { position, torque, pose: self.arms.tool_pose(robot, &position) }
    }

    /// Returns the sensor's reading, its own axes and origin.
    pub fn reading(&self) -> Wrench<f64> {
        self.reading_under(self.measured.wrench)
    }

    /// Returns the reading of a sensor that measures no contact.
    pub fn reading_without_contact(&self) -> Wrench<f64> {
        self.reading_under(Wrench::zero())
    }

    fn reading_under(&self, on_part: Wrench<f64>) -> Wrench<f64> {
        self.sensing.reading(on_part, &self.measured.parts.a) + self.sensing.tare
    }

    /// Returns the contact wrench on part A as measured, about the part's origin in the part's axes.
    pub fn wrench(&self) -> Wrench<f64> {
        self.measured.wrench
    }

    /// Whether a channel of the sensor has saturated.
    pub fn saturated(&self) -> bool {
        self.measured.saturated
    }

    /// Returns the true parts.
    pub fn parts(&self) -> &Parts<f64> {
        &self.measured.parts
    }

    /// Returns the true contact history.
    pub fn watch(&self) -> Watch<f64> {
        self.facility.watch()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signals::RAIL;
    use softdock_kernels::philox;
    use std::path::Path;

    fn world() -> World {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../campaigns/probe_drogue.toml");
        let campaign = softdock_campaign::load(&file).expect("the shipped campaign");
        let plant = Arc::new(Plant::new(campaign.scenario.model.clone()));
        let station = campaign.scenario.station.as_ref().expect("it names its facility");
        let params = campaign.draw(1244).expect("a draw").params;
        World::new(&plant, station, philox::key(1), 1244, &params, Wrench::zero()).expect("in reach")
    }

    /// Moves both robots smoothly to their targets over this number of ticks, and to rest.
    fn go(world: &mut World, targets: [[f64; AXES]; 2], ticks: u32) {
        let from = [0, 1].map(|robot: usize| world.robot(robot).position);
        for tick in 1..=ticks + 3000 {
            let u = f64::from(tick.min(ticks)) / f64::from(ticks);
            let share = u * u * u * (10.0 - 15.0 * u + 6.0 * u * u);
            let way =
                |robot: usize, axis: usize| from[robot][axis] + share * (targets[robot][axis] - from[robot][axis]);
            world.tick(&[0, 1].map(|robot| std::array::from_fn(|axis| way(robot, axis))));
        }
    }

    #[test]
    fn rail_motion_leaves_joints_unchanged() {
        let mut world = world();
        let start = [0, 1].map(|robot| world.robot(robot));
        let part = world.parts().a.position;
        let mut targets = start.map(|reading| reading.position);
        // E1 by 99.7 mm, away from the other robot.
        targets[0][RAIL] -= 0.0997;
        let mut most = 0.0_f64;
        for tick in 1..=5000_u32 {
            let u = (f64::from(tick) / 2000.0).min(1.0);
            let mut now = targets;
            now[0][RAIL] = start[0].position[RAIL] - 0.0997 * u * u * (3.0 - 2.0 * u);
            world.tick(&now);
            let joints = world.robot(0).position;
            most = (0..RAIL).fold(most, |most, axis| most.max((joints[axis] - start[0].position[axis]).abs()));
        }
        let end = world.robot(0);
        println!("joints move by {most:.2e} rad while the rail moves by 99.7 mm");
        assert!((end.position[RAIL] - start[0].position[RAIL] + 0.0997).abs() < 1e-9);
        // The tool's error of this draw and the interpolation of late commands: micrometres.
        assert!(most < 1e-4, "{most} rad");
        assert!(((world.parts().a.position - part).norm() - 0.0997).abs() < 1e-6, "the part goes with it");
        let tool = (end.pose.position - start[0].pose.position).norm();
        assert!(tool < 1e-5, "the pose in the robot's base stays: {tool} m");
        assert_eq!(world.robot(1).position.map(f64::to_bits), start[1].position.map(f64::to_bits));
    }

    #[test]
    fn commanded_configuration_is_reported_with_its_pose() {
        let mut world = world();
        let start = [0, 1].map(|robot| world.robot(robot).position);
        let mut targets = start;
        // Axis 6 by a whole turn, axis 4 far round: the inverse of a pose does not distinguish these.
        targets[0][5] += std::f64::consts::TAU;
        targets[0][3] += 2.5;
        targets[1][0] += 0.2;
        go(&mut world, targets, 4000);
        for robot in [0, 1] {
            let reading = world.robot(robot);
            let off = (0..AXES).map(|axis| (reading.position[axis] - targets[robot][axis]).abs()).fold(0.0, f64::max);
            assert!(off < 1e-3, "robot {}: {:?} for {:?}", robot + 1, reading.position, targets[robot]);
            let tool = world.arms.tool_pose(robot, &reading.position);
            assert_eq!(tool.position, reading.pose.position);
        }
    }

    #[test]
    fn joints_hold_the_part_in_any_configuration() {
        let mut world = world();
        let mut targets = [0, 1].map(|robot| world.robot(robot).position);
        targets[0][3] += 2.5;
        targets[0][RAIL] -= 0.05;
        go(&mut world, targets, 3000);
        for since in [0.0, 0.3e-3] {
            for robot in [0, 1] {
                let held = world.arms.part_on(robot, &world.robot_after(robot, since).position, &[0.0; AXES]);
                let part = if robot == 0 { world.parts().a } else { world.parts().b };
                let off = (held.position - part.position).norm();
                assert!(off < 1e-9, "robot {}: {off} m after {since} s", robot + 1);
            }
        }
    }
}
