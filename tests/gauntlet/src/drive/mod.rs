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
use crate::motion::Motion;
use crate::ode::advance;
use crate::random::{Disturbance, Stream};
use crate::session::{Bench, Run};
use crate::table::{Column, Table, column};
use build::{Inner, Nuisances};
use command::CommandPath;
use controller::Controller;
pub(crate) use effects::{EFFECTS, OUTSIDE};
use nominal::PERIOD;
use plant::{MOTOR, Plant};

/// Integration steps in a period of the controller: 0.1 ms.
const STEPS: usize = 10;
/// Periods of the controller in one of the log: 250 Hz.
const LOGGED: usize = 4;
/// Encoder: quantum and standard deviation of the noise \[rad\].
const QUANTUM: f64 = 6e-6;
const ENCODER_NOISE: f64 = 5e-6;
/// Standard deviation of the noise on the logged torque, and of the disturbance inside the plant \[N m\].
const TORQUE_NOISE: f64 = 1.0;
const DISTURBANCE: f64 = 0.6;

const COLUMNS: [Column; 4] = [column("t_s", 3), column("ref_rad", 9), column("q_rad", 7), column("tau_nm", 4)];
const LINK_COLUMN: Column = column("ql_rad", 7);

/// An encoder: quantised and noisy, or exact.
struct Encoder(Option<Stream>);

impl Encoder {
    /// The reading of an angle \[rad\].
    fn read(&mut self, angle: f64) -> f64 {
        let Some(noise) = &mut self.0 else { return angle };
        ((angle + ENCODER_NOISE * noise.normal()) / QUANTUM).round() * QUANTUM
    }
}

/// What happened at each tick.
#[derive(Default)]
struct Trace {
    /// Motor angle as read, link angle as read \[rad\], commanded torque \[N m\].
    motor: Vec<f64>,
    link: Vec<f64>,
    torque: Vec<f64>,
}

/// The bench with its effects and nuisances.
pub(crate) struct DriveBench {
    sizes: Sizes,
    nuisances: Nuisances,
    inner: Inner,
    plant: Plant,
    link_encoder: bool,
}

impl DriveBench {
    pub(crate) fn new(sizes: &Sizes, link_encoder: bool, seed: u64) -> Self {
        let (nuisances, inner) = (Nuisances::draw(seed), Inner::draw(seed));
        let plant = build::plant(sizes, &nuisances, &inner);
        Self { sizes: sizes.clone(), nuisances, inner, plant, link_encoder }
    }

    /// The closed loop over a motion, one tick longer than the record, in so many integration steps a tick.
    fn simulate(&self, motion: &Motion, run: &Run, steps: usize) -> Trace {
        let mut disturbance =
            run.noise.map(|colour| Disturbance::new(colour, DISTURBANCE, PERIOD, run.stream("disturbance torque")));
        let mut motor = Encoder(run.noise.map(|_| run.stream("motor encoder")));
        let mut link = Encoder(run.noise.map(|_| run.stream("link encoder")));
        let start = motion.at(0.0)[0];
        let (mut plant, mut state) = (self.plant.clone(), self.plant.at_rest(start));
        let (mut path, mut controller) = (CommandPath::new(&self.sizes, start), Controller::new());
        let (mut trace, mut torque) = (Trace::default(), 0.0);
        for tick in 0..=(motions::DURATION_S / PERIOD).round() as usize {
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
}

/// The torque \[N m\] at a tick, off by a clock offset \[s\] smaller than a tick; the drive's monitor interpolates.
fn stamped(torque: &[f64], tick: usize, offset: f64) -> f64 {
    let other = if offset >= 0.0 { tick + 1 } else { tick.saturating_sub(1) };
    torque[tick] + (offset / PERIOD).abs() * (torque[other] - torque[tick])
}

impl Bench for DriveBench {
    fn model(&self) -> String {
        nominal::text(self.link_encoder)
    }

    fn training(&self) -> &'static [&'static str] {
        motions::TRAINING
    }

    fn record(&self, experiment: &str, run: &Run) -> Table {
        let motion = motions::motion(experiment);
        let trace = self.simulate(&motion, run, STEPS);
        let mut noise = run.noise.map(|_| run.stream("torque channel"));
        let columns = if self.link_encoder { [&COLUMNS[..], &[LINK_COLUMN]].concat() } else { COLUMNS.to_vec() };
        let mut table = Table::new(&columns);
        for tick in (0..trace.motor.len() - 1).step_by(LOGGED) {
            let time = tick as f64 * PERIOD;
            let noise = noise.as_mut().map_or(0.0, |noise| TORQUE_NOISE * noise.normal());
            let torque = stamped(&trace.torque, tick, self.nuisances.clock_offset) + noise;
            let row = [run.start_s + time, motion.at(time)[0], trace.motor[tick], torque, trace.link[tick]];
            table.push(&row[..columns.len()]);
        }
        table
    }

    fn further(&self, id: &str) -> Vec<Parameter> {
        self.inner.parameters(id)
    }

    fn nuisances(&self) -> Vec<Parameter> {
        self.nuisances.parameters()
    }
}
