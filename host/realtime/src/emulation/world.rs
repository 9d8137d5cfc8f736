//! The emulated facility's one physics clock: both robots, the contact between their parts, and the sensor.

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

/// Places that are looked at on a way apart.
const WAY_STEPS: u32 = 50;
/// Ticks in which parts that touch there, or a latch that closes, show.
const WAY_TICKS: u32 = 20;

/// What one emulated robot measures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmulatedReading {
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
    /// Key of the noise, run and draw.
    made_of: ([u32; 2], u64, Params<f64>),
    arms: Arms,
    sensing: Sensing,
    facility: Box<dyn SimulatedFacility>,
    /// Commanded poses of the last ticks, newest first.
    past: [Parts<f64>; 2],
    /// The robots' axes, as they follow their targets by themselves.
    axes: [LateAxes; 2],
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
        let axes = [0, 1].map(|robot| LateAxes::new(plant, params, robot));
        let made_of = (key, run, *params);
        let mut world =
            Self { plant: Arc::clone(plant), made_of, arms, sensing, facility, past: [start; 2], axes, measured };
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
        self.axes.iter_mut().zip(position).for_each(|(axes, position)| axes.stand(*position));
        self.facility.stand(&parts);
        self.measured = Measured { parts, wrench: Wrench::zero(), saturated: false };
    }

    /// Opens the latch and puts the robots somewhere, as somebody does by hand between two sessions: nothing has been
    /// touched yet. Takes from the heap.
    pub fn release(&mut self, position: &[[f64; AXES]; 2]) {
        let (key, run, params) = &self.made_of;
        self.facility = emulated_facility(&self.plant, *key, *run, params);
        self.stand(position);
    }

    /// The first places of the axes, on a line from some to others, at which the parts do not touch and no latch closes;
    /// the last ones if that is nowhere so. Takes from the heap.
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
        self.axes.iter_mut().zip(targets).for_each(|(axes, target)| axes.tick(*target));
        self.measured = self.facility.tick(&told);
    }

    /// The parts on robots that stand on these axes.
    fn parts_at(&self, axes: &[[f64; AXES]; 2]) -> Parts<f64> {
        self.arms.parts_on(axes, &[[0.0; AXES]; 2])
    }

    /// What robot 1 or 2 (0 or 1 here) measures.
    pub fn robot(&self, robot: usize) -> EmulatedReading {
        self.reading_of(robot, &self.measured.parts, 0.0)
    }

    /// The same so long after the last tick \[s\]: controllers do not share the physics' clock.
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
        let params = campaign.draw(1244).params;
        World::new(&plant, station, philox::key(1), 1244, &params, Wrench::zero()).expect("in reach")
    }

    /// Lets both robots come to their targets over so many ticks, on a smooth way, and to rest.
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
    fn the_rail_moves_by_itself_and_the_joints_stay() {
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
    fn a_commanded_configuration_is_reported_and_its_pose_is_its_joints() {
        let mut world = world();
        let start = [0, 1].map(|robot| world.robot(robot).position);
        let mut targets = start;
        // Axis 6 by a whole turn, axis 4 far round: no inverse of a pose would tell these.
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
    fn joints_hold_the_part_where_it_is_in_any_configuration() {
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
