//! The contact rig: a body pressed, bounced and slid against a plate, with position and force measured.

mod course;
mod effects;
mod law;
mod motions;
mod nominal;
mod plant;
#[cfg(test)]
mod tests;

use crate::catalogue::{Parameter, Sizes};
use crate::instrument::{Instrument, stamped};
use crate::ode::advance;
use crate::random::{Disturbance, Stream};
use crate::session::{Ageing, Run, SimulatedRig};
use crate::table::{Column, Table, column};
use course::Course;
pub(crate) use effects::{EFFECTS, OUTSIDE};
use law::Law;
use motions::Experiment;
use nominal::tolerance;
use plant::{Inputs, PLATE_MASS, POSITION, Plant};
use std::f64::consts::TAU;

/// Tick of the log \[s\] and integration steps in it: 50 us.
const TICK: f64 = 5e-4;
const STEPS: usize = 10;
/// Position: standard deviation of the noise and quantum \[m\].
const POSITION_NOISE: f64 = 3e-7;
const POSITION_QUANTUM: f64 = 1e-7;
/// Force: the same \[N\].
const FORCE_NOISE: f64 = 0.3;
const FORCE_QUANTUM: f64 = 0.05;
/// Standard deviation of the disturbance on the body, each axis \[N\].
const DISTURBANCE: f64 = 0.2;
/// Damping ratio of a plate on a spring.
const FIXTURE_DAMPING_RATIO: f64 = 0.02;
/// A clock offset stays below a tick \[s\].
const LARGEST_CLOCK_OFFSET: f64 = 4.9e-4;

const COLUMNS: [Column; 10] = [
    column("t_s", 4),
    column("push_n", 4),
    column("carriage_x_m", 8),
    column("carriage_y_m", 8),
    column("x_m", 7),
    column("y_m", 7),
    column("z_m", 7),
    column("fx_n", 2),
    column("fy_n", 2),
    column("fz_n", 2),
];

/// Nuisance parameters that a data set draws within the model's tolerances.
#[derive(Clone, Copy, Debug)]
struct Nuisances {
    /// Factors on the model's values.
    stiffness: f64,
    damping: f64,
    friction: f64,
    travel: f64,
    /// Place of the plate \[m\], bias of the force \[N\], the force stamped t was there at t + this \[s\].
    surface: f64,
    bias: [f64; 3],
    clock_offset: f64,
}

impl Nuisances {
    fn draw(seed: u64) -> Self {
        let mut stream = Stream::new(seed, "nuisances of the contact", 0);
        let [stiffness, damping, friction, travel, surface, clock] = stream.normals();
        let clock_offset: f64 = tolerance::CLOCK_OFFSET * clock;
        Self {
            stiffness: 1.0 + tolerance::STIFFNESS * stiffness,
            damping: 1.0 + tolerance::DAMPING * damping,
            friction: 1.0 + tolerance::FRICTION * friction,
            // Log-normal: a travel cannot be negative.
            travel: (tolerance::PRESLIDING_TRAVEL * travel).exp(),
            surface: tolerance::SURFACE * surface,
            bias: stream.normals().map(|bias: f64| tolerance::BIAS * bias),
            clock_offset: clock_offset.clamp(-LARGEST_CLOCK_OFFSET, LARGEST_CLOCK_OFFSET),
        }
    }
}

/// The plant with its hidden effects.
fn plant(sizes: &Sizes, nuisances: &Nuisances, map: [[f64; 3]; 3]) -> Plant {
    let compliance = sizes.of("K10_fixture");
    let fixture = if compliance > 0.0 {
        (1.0 / compliance, 2.0 * FIXTURE_DAMPING_RATIO * (PLATE_MASS / compliance).sqrt())
    } else {
        (f64::INFINITY, 0.0)
    };
    Plant {
        law: Law {
            stiffness: nominal::STIFFNESS * nuisances.stiffness + sizes.of("K1_stiffness"),
            exponent: 1.0 + sizes.of("K2_exponent"),
            damping: nominal::DAMPING * nuisances.damping,
            depth_damping: sizes.of("K3_damping"),
            speed_damping: sizes.of("quadratic_damping"),
            plastic: sizes.of("K9_plastic"),
            adhesion: sizes.of("K8_adhesion"),
            memory: sizes.of("contact_memory"),
            friction: nominal::FRICTION * nuisances.friction + sizes.of("K4_friction"),
            stribeck: sizes.of("K5_stick_slip"),
            anisotropy: sizes.of("K6_anisotropy"),
            map_deviation: sizes.of("friction_map"),
            travel: nominal::PRESLIDING_TRAVEL * nuisances.travel,
            map,
        },
        surface: nuisances.surface + sizes.of("K7_surface_offset"),
        fixture,
        filter: sizes.of("S5_low_pass"),
        deepest: 0.0,
        inputs: Inputs::default(),
    }
}

/// The rig with its effects and nuisances.
pub(crate) struct ContactRig {
    nuisances: Nuisances,
    plant: Plant,
    /// The plate with nothing hidden.
    healthy: Plant,
}

impl ContactRig {
    pub(crate) fn new(sizes: &Sizes, seed: u64) -> Self {
        let nuisances = Nuisances::draw(seed);
        let mut stream = Stream::new(seed, "friction map of the plate", 0);
        // Waves of 10 to 40 mm in any direction.
        let map = std::array::from_fn(|_| {
            let (number, angle) = (TAU / stream.between(0.01, 0.04), stream.between(0.0, TAU));
            [number * angle.cos(), number * angle.sin(), stream.between(0.0, TAU)]
        });
        let of = |sizes: &Sizes| plant(sizes, &nuisances, map);
        Self { nuisances, plant: of(sizes), healthy: of(&Sizes::none()) }
    }

    /// Position \[m\] and force that the sensor shows by its own clock \[N\], tick by tick, one tick longer than the record.
    fn simulate(&self, experiment: &Experiment, run: &Run, steps: usize) -> [Vec<f64>; 6] {
        let mut disturbance: Vec<Disturbance> = run.noise.map_or(Vec::new(), |colour| {
            let of = |axis| Disturbance::new(colour, DISTURBANCE, TICK, run.stream(axis));
            ["disturbance x", "disturbance y", "disturbance z"].map(of).into()
        });
        let mut course = self.course(run);
        let mut state = [0.0; 22];
        state[POSITION..POSITION + 3].copy_from_slice(&[
            experiment.carriage[0].at(0.0)[0],
            experiment.carriage[1].at(0.0)[0],
            experiment.height,
        ]);
        let mut trace: [Vec<f64>; 6] = Default::default();
        let mut fine: [Vec<f64>; 3] = Default::default();
        for tick in 0..=(motions::DURATION_S / TICK).round() as usize {
            let time = tick as f64 * TICK;
            (0..3).for_each(|axis| trace[axis].push(state[POSITION + axis]));
            let [x, y] = [0, 1].map(|axis| experiment.carriage[axis].at(time));
            course.act(Inputs {
                push: experiment.push.at(time)[0],
                carriage: [[x[0], y[0]], [x[1], y[1]]],
                disturbance: std::array::from_fn(|axis| disturbance.get_mut(axis).map_or(0.0, Disturbance::next)),
            });
            for _ in 0..steps {
                let sensed = course.sensed(&state);
                fine.iter_mut().zip(sensed).for_each(|(fine, force)| fine.push(force));
                state = advance(&course, &state, TICK / steps as f64);
                course.dent(&state);
            }
        }
        for (trace, fine) in trace[3..].iter_mut().zip(&fine) {
            *trace = (0..fine.len() / steps).map(|tick| self.by_its_clock(fine, tick, steps)).collect();
        }
        trace
    }

    /// The body in a run: moved by the plate as it is, or as it would be with nothing hidden.
    fn course(&self, run: &Run) -> Course {
        match run.unmoved {
            true => Course { mover: self.healthy.clone(), shown: Some(self.plant.clone()) },
            false => Course { mover: self.plant.clone(), shown: None },
        }
    }

    /// Returns the force at a tick by its own clock. Steps are interpolated, not ticks: a blow begins between two
    /// ticks, and their mean would be a low-pass that is not in the model.
    fn by_its_clock(&self, fine: &[f64], tick: usize, steps: usize) -> f64 {
        let place = (tick as f64 + self.nuisances.clock_offset / TICK) * steps as f64;
        let place = place.clamp(0.0, (fine.len() - 2) as f64);
        stamped(fine, place.floor() as usize, place.fract())
    }
}

impl SimulatedRig for ContactRig {
    fn ageing(&self) -> Ageing {
        Ageing::Time
    }

    fn model(&self) -> String {
        nominal::MODEL.into()
    }

    fn training(&self) -> &'static [&'static str] {
        motions::TRAINING
    }

    fn record(&self, experiment: &str, run: &Run) -> Table {
        let experiment = motions::experiment(experiment);
        let trace = self.simulate(&experiment, run, STEPS);
        let mut position = Instrument::new(run, "position", POSITION_NOISE, POSITION_QUANTUM);
        let mut force = Instrument::new(run, "force", FORCE_NOISE, FORCE_QUANTUM);
        let mut table = Table::new(&COLUMNS);
        let shown = |tick: usize| -> [f64; 6] { std::array::from_fn(|i| trace[i][tick]) };
        for tick in 0..trace[0].len() - 1 {
            let shown = shown(tick);
            let time = tick as f64 * TICK;
            let mut row = [0.0; 10];
            row[0] = run.start_s + time;
            row[1] = experiment.push.at(time)[0];
            for axis in 0..2 {
                row[2 + axis] = experiment.carriage[axis].at(time)[0];
            }
            for axis in 0..3 {
                row[4 + axis] = position.read(shown[axis]);
                row[7 + axis] = force.read(shown[3 + axis] + self.nuisances.bias[axis]);
            }
            table.push(&row);
        }
        table
    }

    fn further(&self, id: &str) -> Vec<Parameter> {
        match id {
            "K2_exponent" => vec![Parameter::new("reference_depth", law::REFERENCE_DEPTH, "m")],
            "K5_stick_slip" => vec![Parameter::new("speed", law::STRIBECK_SPEED, "m/s")],
            "K8_adhesion" => vec![Parameter::new("range", law::TENSION_RANGE, "m")],
            "K10_fixture" => vec![Parameter::new("mass", PLATE_MASS, "kg")],
            "contact_memory" => vec![Parameter::new("time_constant", law::MEMORY_TIME, "s")],
            _ => Vec::new(),
        }
    }

    fn nuisances(&self) -> Vec<Parameter> {
        let of = &self.nuisances;
        vec![
            Parameter::new("stiffness_factor", of.stiffness, ""),
            Parameter::new("damping_factor", of.damping, ""),
            Parameter::new("friction_factor", of.friction, ""),
            Parameter::new("presliding_travel_factor", of.travel, ""),
            Parameter::new("surface", of.surface, "m"),
            Parameter::new("force_bias_x", of.bias[0], "N"),
            Parameter::new("force_bias_y", of.bias[1], "N"),
            Parameter::new("force_bias_z", of.bias[2], "N"),
            Parameter::new("clock_offset", of.clock_offset, "s"),
        ]
    }
}
