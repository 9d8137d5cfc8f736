//! The drive rig: one geared joint under gravity and its sampled controller.

mod build;
mod command;
mod controller;
mod effects;
mod friction;
mod gear;
mod motions;
mod nominal;
mod plant;
#[cfg(test)]
mod tests;

use crate::catalogue::{Parameter, Sizes};
use crate::commanded_path::CommandedPath;
use crate::instrument::{Instrument, stamped};
use crate::motion::Reference;
use crate::ode::advance;
use crate::random::Disturbance;
use crate::session::{Ageing, Run, SimulatedRig};
use crate::table::{Column, Table, column};
pub(crate) use build::Inner;
use build::Nuisances;
use command::CommandPath;
use controller::Controller;
pub(crate) use effects::{EFFECTS, OUTSIDE};
pub(crate) use friction::{BRISTLE_DAMPING_RATIO, Friction, STRIBECK_SPEED, Sliding};
use nominal::PERIOD;
use plant::{MOTOR, Plant};

/// Integration steps in a period of the controller: 0.1 ms.
const STEPS: usize = 10;
/// Periods of the controller in one of the log: 250 Hz.
const LOGGED: usize = 4;
/// Encoder: quantum and standard deviation of the noise \[rad\].
const ENCODER_QUANTUM: f64 = 6e-6;
const ENCODER_NOISE: f64 = 5e-6;
/// Torque channel: standard deviation of the noise and quantum \[N m\].
const TORQUE_NOISE: f64 = 1.0;
const TORQUE_QUANTUM: f64 = 0.01;
/// Standard deviation of the disturbance inside the plant \[N m\].
const DISTURBANCE: f64 = 0.6;

const COLUMNS: [Column; 4] = [column("t_s", 3), column("ref_rad", 9), column("q_rad", 7), column("tau_nm", 4)];
const LINK_COLUMN: Column = column("ql_rad", 7);

/// What happened at each tick.
#[derive(Default)]
struct Trace {
    /// Motor angle as read, link angle as read \[rad\], commanded torque \[N m\].
    motor: Vec<f64>,
    link: Vec<f64>,
    torque: Vec<f64>,
}

/// The rig with its effects and nuisances.
pub(crate) struct DriveRig {
    sizes: Sizes,
    nuisances: Nuisances,
    inner: Inner,
    plant: Plant,
    link_encoder: bool,
}

impl DriveRig {
    pub(crate) fn new(sizes: &Sizes, link_encoder: bool, seed: u64) -> Self {
        let (nuisances, inner) = (Nuisances::draw(seed), Inner::draw(seed));
        let plant = build::plant(sizes, &nuisances, &inner);
        Self { sizes: sizes.clone(), nuisances, inner, plant, link_encoder }
    }

    /// The closed loop over a motion that lasts so long \[s\], one tick longer than the record, in so many integration
    /// steps a tick.
    fn simulate(&self, motion: &dyn Reference, duration: f64, run: &Run, steps: usize) -> Trace {
        let mut disturbance =
            run.noise.map(|colour| Disturbance::new(colour, DISTURBANCE, PERIOD, run.stream("disturbance torque")));
        let mut motor = Instrument::new(run, "motor encoder", ENCODER_NOISE, ENCODER_QUANTUM);
        let mut link = Instrument::new(run, "link encoder", ENCODER_NOISE, ENCODER_QUANTUM);
        let start = motion.at(0.0)[0];
        let (mut plant, mut state) = (self.plant.clone(), self.plant.at_rest(start));
        let (mut path, mut controller) = (CommandPath::new(&self.sizes, start), Controller::new());
        let (mut trace, mut torque) = (Trace::default(), 0.0);
        for tick in 0..=(duration / PERIOD).round() as usize {
            let time = tick as f64 * PERIOD;
            let measured = motor.read(state[MOTOR]);
            torque = controller.torque(path.received(motion, time, torque), measured);
            trace.motor.push(measured);
            trace.link.push(link.read(plant.link_angle(&state)));
            trace.torque.push(torque);
            plant.inputs.torque = torque;
            plant.inputs.disturbance = disturbance.as_mut().map_or(0.0, Disturbance::next);
            plant.inputs.warmth = 1.0 - (-(run.start_s + time) / build::WARM_UP_S).exp();
            for _ in 0..steps {
                state = advance(&plant, &state, PERIOD / steps as f64);
            }
        }
        trace
    }

    /// The log of a motion that lasts so long \[s\].
    fn recorded(&self, motion: &dyn Reference, duration: f64, run: &Run) -> Table {
        let trace = self.simulate(motion, duration, run, STEPS);
        let mut monitor = Instrument::new(run, "torque channel", TORQUE_NOISE, TORQUE_QUANTUM);
        let columns = if self.link_encoder { [&COLUMNS[..], &[LINK_COLUMN]].concat() } else { COLUMNS.to_vec() };
        let mut table = Table::new(&columns);
        for tick in (0..trace.motor.len() - 1).step_by(LOGGED) {
            let time = tick as f64 * PERIOD;
            let torque = monitor.read(stamped(&trace.torque, tick, self.nuisances.clock_offset / PERIOD));
            let row = [run.start_s + time, motion.at(time)[0], trace.motor[tick], torque, trace.link[tick]];
            table.push(&row[..columns.len()]);
        }
        table
    }
}

impl SimulatedRig for DriveRig {
    fn ageing(&self) -> Ageing {
        let Friction { warm_loss, warm_load_share, .. } = self.plant.friction;
        if warm_loss == 0.0 && warm_load_share == 0.0 { Ageing::Time } else { Ageing::Rig }
    }

    fn model(&self) -> String {
        nominal::text(self.link_encoder)
    }

    fn training(&self) -> &'static [&'static str] {
        motions::TRAINING
    }

    fn record(&self, experiment: &str, run: &Run) -> Table {
        self.recorded(&motions::motion(experiment), motions::DURATION_S, run)
    }

    fn follow(&self, commanded: &CommandedPath, run: &Run) -> Option<Table> {
        Some(self.recorded(commanded, commanded.duration_s(), run))
    }

    fn further(&self, id: &str) -> Vec<Parameter> {
        self.inner.parameters(id)
    }

    fn nuisances(&self) -> Vec<Parameter> {
        self.nuisances.parameters()
    }
}
