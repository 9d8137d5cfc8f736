//! The facility rig: a whole loop of simulation computer, two lagging robots, real contact and force/torque sensor.

mod bodies;
mod columns;
mod effects;
mod law;
mod motions;
mod nominal;
mod path;
mod plant;
mod sensor;
#[cfg(test)]
mod tests;

use crate::catalogue::{Parameter, Sizes};
use crate::instrument::Instrument;
use crate::ode::advance;
use crate::random::{Disturbance, Stream};
use crate::session::{Ageing, Run, SimulatedRig};
use crate::space::{Quaternion, Vector, difference, sum};
use crate::table::Table;
use bodies::{Bodies, Part};
use columns::columns;
pub(crate) use effects::{EFFECTS, OUTSIDE};
use law::Law;
use motions::Start;
use nominal::{CLOCK_OFFSET, LOOP_DELAY, SENSOR_DELAY};
use path::{Path, shared};
use plant::{Plant, State};
use sensor::{Noise, Sensor, Wrench};

/// Cycle of the simulation computer \[s\], and integration steps in it: 0.1 ms.
const CYCLE: f64 = 1e-3;
const STEPS: usize = 10;
/// Cycles before the start over which the robots reach a steady pace: many times their slowest response.
const RUN_UP: usize = 500;
/// Standard deviation of what disturbs the drives: of a speed \[m/s\], of a rate \[rad/s\].
const DISTURBANCE: [f64; 2] = [4e-4, 4e-4];
/// The robots' axes as a pose: standard deviation of the noise and quantum \[m\], and of half an angle \[rad\].
const POSE_NOISE: f64 = 2e-6;
const POSE_QUANTUM: f64 = 2e-6;

/// What lies between the simulation and a reading.
#[derive(Clone, Debug)]
struct Chain {
    /// From the simulation to the robots, by the facility's clocks \[s\].
    transport: f64,
    plant: Plant,
    sensor: Sensor,
}

impl Chain {
    fn new(sizes: &Sizes, seed: u64, clock_offset: f64) -> Self {
        // The loop's dead time is also that of the sensor and, the wrench being held over a cycle, half of that.
        let transport = LOOP_DELAY - SENSOR_DELAY - 0.5 * CYCLE + sizes.of("C1_transport_delay") + clock_offset;
        Self { transport, plant: Plant::new(sizes, Law::new(sizes, seed)), sensor: Sensor::new(sizes) }
    }
}

/// The rig with its effects and nuisances.
pub(crate) struct FacilityRig {
    chain: Chain,
    /// With nothing hidden.
    healthy: Chain,
    /// What the clocks add to the loop's delay \[s\].
    clock_offset: f64,
}

impl FacilityRig {
    pub(crate) fn new(sizes: &Sizes, seed: u64) -> Self {
        let draw: f64 = Stream::new(seed, "nuisances of the facility", 0).normal();
        let clock_offset = CLOCK_OFFSET * draw;
        let of = |sizes: &Sizes| Chain::new(sizes, seed, clock_offset);
        Self { chain: of(sizes), healthy: of(&Sizes::none()), clock_offset }
    }
}

/// A loop in motion.
struct Loop {
    plant: Plant,
    state: State,
    path: Path,
    sensor: Sensor,
    /// Centre of the sensor's hysteresis.
    play: Wrench,
    disturbances: Vec<Disturbance>,
    /// What the sensor's filter gave, step by step since the run-up began.
    history: Vec<Wrench>,
}

impl Loop {
    /// Robots at the end of their run-up.
    fn of(chain: &Chain, start: &Start, run: &Run) -> Self {
        let begin = -(RUN_UP as f64) * CYCLE;
        let mut path = Path::new(CYCLE, chain.transport, begin);
        path.send(&start.coasting(-begin));
        path.send(&start.coasting(-begin - CYCLE));
        let mut plant = chain.plant.clone();
        plant.commanded = path.at(begin);
        let disturbances = run.noise.map_or(Vec::new(), |colour| {
            let of = |i: usize| {
                let stream = run.stream(&format!("disturbance of drive {i}"));
                Disturbance::new(colour, DISTURBANCE[i % 6 / 3], CYCLE, stream)
            };
            (0..12).map(of).collect()
        });
        let (state, sensor) = (plant.at_command(), chain.sensor);
        let mut own = Self { plant, state, path, sensor, play: [0.0; 6], disturbances, history: Vec::new() };
        for cycle in 0..RUN_UP {
            let to_go = (RUN_UP - cycle) as f64;
            if cycle > 0 {
                own.path.send(&start.coasting((to_go - 1.0) * CYCLE));
            }
            own.cycle(-to_go * CYCLE);
        }
        own
    }

    /// Robots, contact and filter over the cycle that begins at a time \[s\].
    fn cycle(&mut self, begin: f64) {
        for (i, disturbance) in self.disturbances.iter_mut().enumerate() {
            self.plant.disturbance[i / 6][i % 6] = disturbance.next();
        }
        let step = CYCLE / STEPS as f64;
        for i in 0..STEPS {
            self.history.push(self.plant.filtered(&self.state));
            self.plant.commanded = self.path.at(begin + i as f64 * step);
            self.state = self.plant.settled(advance(&self.plant, &self.state, step));
        }
    }

    /// What the filter gave a delay \[s\] ago; nothing before the run-up.
    fn delayed(&self, delay: f64) -> Wrench {
        let place = (self.history.len() as f64 - delay * STEPS as f64 / CYCLE).max(0.0);
        let at = |place: usize| *self.history.get(place).unwrap_or(&self.plant.filtered(&self.state));
        let (older, newer) = (at(place as usize), at(place as usize + 1));
        std::array::from_fn(|i| older[i] + place.fract() * (newer[i] - older[i]))
    }

    /// What the sensor reads without noise.
    fn reading(&mut self) -> Wrench {
        self.sensor.read(self.delayed(self.sensor.delay), &mut self.play)
    }
}

/// Poses of both parts, measured by the robots' axes.
struct Axes {
    channels: Vec<Instrument>,
}

impl Axes {
    fn new(run: &Run) -> Self {
        let of = |i: usize| Instrument::new(run, &format!("axes {i}"), POSE_NOISE, POSE_QUANTUM);
        Self { channels: (0..12).map(of).collect() }
    }

    /// Reads a robot's pose: noise on the position and on the vector part of the attitude.
    fn read(&mut self, robot: usize, position: Vector, [_, x, y, z]: Quaternion) -> (Vector, Quaternion) {
        let own = &mut self.channels[6 * robot..6 * robot + 6];
        let read: Vec<f64> = own.iter_mut().zip([position, [x, y, z]].concat()).map(|(own, x)| own.read(x)).collect();
        let [x, y, z] = [read[3], read[4], read[5]];
        ([read[0], read[1], read[2]], [(1.0 - x * x - y * y - z * z).sqrt(), x, y, z])
    }
}

/// A row of the log: where in the drive, parts as simulated, parts as held, wrench.
fn row(tick: usize, time: f64, simulated: &[Part; 2], held: &[(Vector, Quaternion); 2], wrench: Wrench) -> Vec<f64> {
    let mut row = vec![tick as f64, (time * 1e9).round()];
    for part in simulated {
        row.extend(part.position.iter().chain(&part.attitude).chain(&part.velocity).chain(&part.omega));
    }
    for (position, attitude) in held {
        row.extend(position.iter().chain(attitude));
    }
    row.extend(wrench);
    row
}

impl SimulatedRig for FacilityRig {
    fn ageing(&self) -> Ageing {
        Ageing::Nothing
    }

    fn model(&self) -> String {
        nominal::MODEL.into()
    }

    fn training(&self) -> &'static [&'static str] {
        motions::TRAINING
    }

    /// The log of a drive: its first row is the last cycle before the run.
    fn record(&self, experiment: &str, run: &Run) -> Table {
        let start = Start::of(experiment);
        let (mut bodies, mut under_way) = (Bodies::at(&start), Loop::of(&self.chain, &start, run));
        // What moves the bodies where what is hidden does not: it gets the same commands.
        let mut mover = run.unmoved.then(|| Loop::of(&self.healthy, &start, run));
        let (mut axes, mut noise) = (Axes::new(run), Noise::new(run, CYCLE));
        let mut table = Table::new(&columns());
        let mut simulated = bodies.parts();
        for tick in 0..=(motions::DURATION_S / CYCLE).round() as usize {
            let laboratory = shared(&simulated);
            let held = under_way.plant.held(&under_way.state);
            let held = std::array::from_fn(|robot| {
                let (position, attitude) = axes.read(robot, held[robot].position, held[robot].attitude);
                // The share that the robot makes is laid back onto its part.
                (sum(position, difference(simulated[robot].position, laboratory[robot].0)), attitude)
            });
            let wrench = noise.on(under_way.reading());
            let felt = mover.as_mut().map_or(wrench, Loop::reading);
            if tick > 0 {
                bodies.advance(felt, CYCLE);
                simulated = bodies.parts();
                for own in std::iter::once(&mut under_way).chain(&mut mover) {
                    own.path.send(&simulated);
                    own.cycle((tick - 1) as f64 * CYCLE);
                }
            }
            table.push(&row(tick, tick as f64 * CYCLE, &simulated, &held, wrench));
        }
        table
    }

    fn further(&self, id: &str) -> Vec<Parameter> {
        match id {
            "K2_exponent" => vec![Parameter::new("reference_depth", law::REFERENCE_DEPTH, "m")],
            "K10_fixture" => vec![
                Parameter::new("frequency", plant::MOUNT_HZ, "Hz"),
                Parameter::new("damping_ratio", plant::MOUNT_DAMPING_RATIO, ""),
            ],
            "contact_memory" => vec![Parameter::new("time_constant", law::MEMORY_TIME, "s")],
            "sensor_hysteresis" => vec![Parameter::new("turn", sensor::HYSTERESIS_TURN, "N")],
            _ => Vec::new(),
        }
    }

    fn nuisances(&self) -> Vec<Parameter> {
        vec![Parameter::new("loop_delay_factor", 1.0 + self.clock_offset / LOOP_DELAY, "")]
    }
}
