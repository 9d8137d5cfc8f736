//! The robot rig: three coupled axes with elastic gears under gravity, each with its sampled controller.

mod arm;
mod effects;
mod motions;
mod nominal;
mod plant;
#[cfg(test)]
mod tests;

use crate::catalogue::{Parameter, Sizes};
use crate::drive::{BRISTLE_DAMPING_RATIO, Friction, Inner, STRIBECK_SPEED};
use crate::instrument::{Instrument, stamped};
use crate::ode::advance;
use crate::random::{Disturbance, Stream};
use crate::session::{Ageing, Run, SimulatedRig};
use crate::table::{Column, Table, column};
use arm::{Axes, Dynamics, dynamics};
pub(crate) use effects::{EFFECTS, OUTSIDE};
use nominal::{AXES, PRESLIDING_TRAVEL, ROBOT, tolerance};
use plant::{Drive, Plant, motors};
use std::f64::consts::TAU;

/// Period of the controllers \[s\], integration steps in it, and periods in one of the log: 250 Hz.
const PERIOD: f64 = 0.001;
const STEPS: usize = 10;
const LOGGED: usize = 4;
/// Encoders: quantum and standard deviation of the noise \[rad\].
const ENCODER_QUANTUM: f64 = 6e-6;
const ENCODER_NOISE: f64 = 5e-6;
/// Torque channels: standard deviation of the noise and quantum \[N m\].
const TORQUE_NOISE: Axes = [1.0, 1.0, 0.3];
const TORQUE_QUANTUM: f64 = 0.01;
/// Standard deviation of the disturbances inside the drives \[N m\].
const DISTURBANCE: Axes = [0.6, 0.6, 0.2];
/// Bandwidth \[rad/s\] and damping ratio of the position loops.
const LOOP: (f64, f64) = (TAU * 6.0, 0.7);
/// Corner of the measured rates' filter \[Hz\].
const FILTER_HZ: f64 = 100.0;
/// Speed over which the feedforward's Coulomb torque changes sign \[rad/s\].
const COULOMB_SPEED: f64 = 0.02;
/// The axis in which effects are hidden: the shoulder.
const HIDING: usize = 1;

const COLUMNS: [Column; 7] = [
    column("t_s", 3),
    column("q_rad_1", 7),
    column("q_rad_2", 7),
    column("q_rad_3", 7),
    column("tau_nm_1", 4),
    column("tau_nm_2", 4),
    column("tau_nm_3", 4),
];

/// Nuisance parameters that a data set draws within the model's tolerances: factors on the model's values, axis by axis.
#[derive(Clone, Copy, Debug)]
struct Nuisances {
    coulomb: Axes,
    viscous: Axes,
    torque_constant: Axes,
    presliding_travel: Axes,
    /// The torques stamped t were there at t + this \[s\].
    clock_offset: f64,
}

impl Nuisances {
    fn draw(seed: u64) -> Self {
        let mut stream = Stream::new(seed, "nuisances of the robot", 0);
        let mut share = |deviation: f64| stream.normals::<AXES>().map(|normal| 1.0 + deviation * normal);
        let (coulomb, viscous) = (share(tolerance::COULOMB), share(tolerance::VISCOUS));
        let torque_constant = share(tolerance::TORQUE_CONSTANT);
        let travel: Axes = stream.normals();
        let clock_offset: f64 = tolerance::CLOCK_OFFSET * stream.normal();
        Self {
            coulomb,
            viscous,
            torque_constant,
            presliding_travel: travel.map(|normal| (tolerance::PRESLIDING_TRAVEL * normal).exp()),
            // A stamp never passes its neighbour's.
            clock_offset: clock_offset.clamp(-0.9 * PERIOD, 0.9 * PERIOD),
        }
    }
}

/// The rig with its effects and nuisances.
pub(crate) struct RobotRig {
    nuisances: Nuisances,
    plant: Plant,
}

impl RobotRig {
    pub(crate) fn new(sizes: &Sizes, seed: u64) -> Self {
        let (nuisances, inner) = (Nuisances::draw(seed), Inner::draw(seed));
        let none = Sizes::none();
        let drive = |axis| drive(axis, if axis == HIDING { sizes } else { &none }, &nuisances, &inner);
        let plant = Plant { drives: std::array::from_fn(drive), torque: [0.0; AXES], disturbance: [0.0; AXES] };
        Self { nuisances, plant }
    }

    /// The closed loops over an experiment, one period longer than the record: angles as read and torques, by periods.
    fn simulate(&self, experiment: &str, run: &Run) -> [Vec<Axes>; 2] {
        let motions = motions::motions(experiment);
        let at = |time: f64, order: usize| -> Axes { std::array::from_fn(|axis| motions[axis].at(time)[order]) };
        let purpose = |what: &str, axis: usize| format!("{what} {}", ROBOT[axis].name);
        let mut disturbance: Vec<Option<Disturbance>> = (0..AXES)
            .map(|axis| {
                let stream = run.stream(&purpose("disturbance of the", axis));
                run.noise.map(|colour| Disturbance::new(colour, DISTURBANCE[axis], PERIOD, stream))
            })
            .collect();
        let encoder = |axis| Instrument::new(run, &purpose("encoder of the", axis), ENCODER_NOISE, ENCODER_QUANTUM);
        let mut encoders: [Instrument; AXES] = std::array::from_fn(encoder);
        let (mut plant, mut state) = (self.plant.clone(), self.plant.at_rest(at(0.0, 0)));
        let (mut last, mut rate): (Option<Axes>, Axes) = (None, [0.0; AXES]);
        let keep = (-TAU * FILTER_HZ * PERIOD).exp();
        let [mut angles, mut torques] = [Vec::new(), Vec::new()];
        for tick in 0..=(motions::DURATION_S / PERIOD).round() as usize {
            let time = tick as f64 * PERIOD;
            let motor = motors(&state);
            let measured: Axes = std::array::from_fn(|axis| encoders[axis].read(motor[axis]));
            let before = last.replace(measured).unwrap_or(measured);
            rate =
                std::array::from_fn(|axis| keep * rate[axis] + (1.0 - keep) * (measured[axis] - before[axis]) / PERIOD);
            plant.torque = torque([at(time, 0), at(time, 1), at(time, 2)], &measured, &rate);
            plant.disturbance = std::array::from_fn(|axis| disturbance[axis].as_mut().map_or(0.0, Disturbance::next));
            angles.push(measured);
            torques.push(plant.torque);
            for _ in 0..STEPS {
                state = advance(&plant, &state, PERIOD / STEPS as f64);
            }
        }
        [angles, torques]
    }
}

/// What the controllers ask for \[N m\]: position and rate errors, and the nominal robot along the reference.
fn torque([angle, rate, acceleration]: [Axes; 3], measured: &Axes, measured_rate: &Axes) -> Axes {
    let Dynamics { mass_matrix, bias, .. } = dynamics(&angle, &rate);
    let (omega, damping) = LOOP;
    std::array::from_fn(|axis| {
        let own = &ROBOT[axis];
        let links: f64 = (0..AXES).map(|other| mass_matrix[axis][other] * acceleration[other]).sum();
        let dry = own.coulomb * (rate[axis] / COULOMB_SPEED).tanh();
        let ahead = links + own.rotor * acceleration[axis] + bias[axis] + own.viscous * rate[axis] + dry;
        let error = omega * omega * (angle[axis] - measured[axis]);
        let rate_error = 2.0 * damping * omega * (rate[axis] - measured_rate[axis]);
        ahead + own.moved * (error + rate_error)
    })
}

/// The drive of an axis with what it hides and what was drawn for it.
fn drive(axis: usize, sizes: &Sizes, nuisances: &Nuisances, inner: &Inner) -> Drive {
    let own = &ROBOT[axis];
    let coulomb = own.coulomb * nuisances.coulomb[axis] + sizes.of("J1_coulomb");
    let stiffness = coulomb / (PRESLIDING_TRAVEL * nuisances.presliding_travel[axis]);
    Drive {
        constant: nuisances.torque_constant[axis] * (1.0 + sizes.of("J11_torque_constant")),
        friction: Friction {
            coulomb,
            half_difference: sizes.of("J18_direction_friction"),
            stribeck: sizes.of("J3_stribeck"),
            stribeck_squared: 0.0,
            map_deviation: sizes.of("friction_map"),
            map: inner.map,
            load_share: sizes.of("J5_load_friction"),
            warm_load_share: 0.0,
            stiffness,
            damping: 2.0 * BRISTLE_DAMPING_RATIO * (stiffness * own.moved).sqrt(),
            viscous: own.viscous * nuisances.viscous[axis] + sizes.of("J2_viscous"),
            warm_loss: 0.0,
            quadratic: sizes.of("quadratic_drag"),
            cubic: 0.0,
        },
        stiffness: 1.0 / (1.0 / own.stiffness + sizes.of("J8_elasticity")),
        inertia: sizes.of("J15_link_inertia"),
        gravity: sizes.of("J16_gravity_compensation"),
        cable: sizes.of("J17_cable"),
    }
}

impl SimulatedRig for RobotRig {
    fn ageing(&self) -> Ageing {
        Ageing::Time
    }

    fn model(&self) -> String {
        nominal::RIG.to_owned()
    }

    fn beside(&self) -> Vec<(String, String)> {
        vec![(nominal::FILE.to_owned(), nominal::robot())]
    }

    fn training(&self) -> &'static [&'static str] {
        motions::TRAINING
    }

    fn record(&self, experiment: &str, run: &Run) -> Table {
        let [angles, torques] = self.simulate(experiment, run);
        let channel = |axis: usize| {
            Instrument::new(run, &format!("torque of the {}", ROBOT[axis].name), TORQUE_NOISE[axis], TORQUE_QUANTUM)
        };
        let mut channels: [Instrument; AXES] = std::array::from_fn(channel);
        let series: Vec<Vec<f64>> = (0..AXES).map(|axis| torques.iter().map(|torque| torque[axis]).collect()).collect();
        let mut table = Table::new(&COLUMNS);
        for tick in (0..angles.len() - 1).step_by(LOGGED) {
            let mut row = vec![run.start_s + tick as f64 * PERIOD];
            row.extend(angles[tick]);
            let share = self.nuisances.clock_offset / PERIOD;
            row.extend(
                channels.iter_mut().zip(&series).map(|(channel, torque)| channel.read(stamped(torque, tick, share))),
            );
            table.push(&row);
        }
        table
    }

    fn further(&self, id: &str) -> Vec<Parameter> {
        match id {
            "J3_stribeck" => vec![Parameter::new("speed", STRIBECK_SPEED, "rad/s")],
            _ => Vec::new(),
        }
    }

    fn nuisances(&self) -> Vec<Parameter> {
        let own = &self.nuisances;
        vec![
            Parameter::new("coulomb_factor", own.coulomb[HIDING], ""),
            Parameter::new("viscous_factor", own.viscous[HIDING], ""),
            Parameter::new("torque_constant_factor", own.torque_constant[HIDING], ""),
            Parameter::new("presliding_travel_factor", own.presliding_travel[HIDING], ""),
            Parameter::new("clock_offset", own.clock_offset, "s"),
        ]
    }
}
