//! The body rig: a free body under known wrenches, with tracker, accelerometer and gyroscope.

mod effects;
mod nominal;
mod plant;

use crate::catalogue::{Parameter, Sizes};
use crate::instrument::Instrument;
use crate::ode::advance;
use crate::random::{Disturbance, Stream};
use crate::session::{Ageing, FRESH, HOLDOUT, Run, SimulatedRig};
use crate::space::{Vector, sum};
use crate::table::{Column, Table, column};
pub(crate) use effects::{EFFECTS, OUTSIDE};
use nominal::tolerance;
use plant::{POSITION, Plant, QUATERNION, RATE, Sprung, State};
use std::f64::consts::TAU;

/// Tick of the log \[s\] and integration steps in it: 0.1 ms.
const TICK: f64 = 4e-3;
const STEPS: usize = 40;
/// Length of a record \[s\].
const DURATION_S: f64 = 9.0;
/// Standard deviations of the disturbance on the body \[N, N m\].
const DISTURBANCE: [f64; 2] = [0.05, 0.01];
/// Sloshing liquid and boom: where \[m\], frequency with the body held \[Hz\], damping ratio.
const SLOSH: (Vector, f64, f64) = ([0.1, 0.05, 0.3], 0.5, 0.02);
const BOOM: (Vector, f64, f64) = ([2.5, 0.0, 0.1], 2.8, 0.004);

const COLUMNS: [Column; 20] = [
    column("t_s", 3),
    column("f_x_n", 3),
    column("f_y_n", 3),
    column("f_z_n", 3),
    column("m_x_nm", 4),
    column("m_y_nm", 4),
    column("m_z_nm", 4),
    column("x_m", 6),
    column("y_m", 6),
    column("z_m", 6),
    column("qw", 7),
    column("qx", 7),
    column("qy", 7),
    column("qz", 7),
    column("ax_m_per_s2", 6),
    column("ay_m_per_s2", 6),
    column("az_m_per_s2", 6),
    column("wx_rad_per_s", 7),
    column("wy_rad_per_s", 7),
    column("wz_rad_per_s", 7),
];

const TRAINING: &[&str] = &["forces", "moments", "drift"];

/// A constant force \[N\] or moment \[N m\] on one of the six axes, from and until a time \[s\] (whole ticks).
struct Pulse {
    axis: usize,
    value: f64,
    from_s: f64,
    until_s: f64,
}

fn pulse(axis: usize, value: f64, from_s: f64, until_s: f64) -> Pulse {
    Pulse { axis, value, from_s, until_s }
}

/// The pulses of an experiment.
fn pulses(experiment: &str) -> Vec<Pulse> {
    match experiment {
        "forces" => (0..6)
            .map(|i| pulse(i % 3, if i < 3 { 90.0 } else { -90.0 }, 0.4 + 0.8 * i as f64, 0.8 + 0.8 * i as f64))
            .collect(),
        "moments" => (0..6)
            .map(|i| pulse(3 + i % 3, if i < 3 { 25.0 } else { -20.0 }, 0.4 + 0.9 * i as f64, 1.0 + 0.9 * i as f64))
            .collect(),
        // Both at once, then three periods of slosh without any wrench.
        "drift" => vec![pulse(0, 120.0, 0.4, 1.2), pulse(1, -70.0, 0.6, 1.4), pulse(5, 30.0, 1.0, 1.4)],
        HOLDOUT => vec![
            pulse(0, -60.0, 0.4, 1.0),
            pulse(3, 18.0, 0.8, 1.6),
            pulse(2, 80.0, 2.0, 2.2),
            pulse(4, -22.0, 2.6, 3.2),
            pulse(1, 50.0, 4.0, 5.2),
        ],
        FRESH => vec![
            pulse(1, 70.0, 0.4, 0.9),
            pulse(5, -16.0, 0.7, 1.5),
            pulse(0, 45.0, 1.8, 3.0),
            pulse(4, 20.0, 3.4, 3.8),
            pulse(2, -55.0, 4.4, 5.0),
        ],
        _ => unreachable!("experiments come from the list above"),
    }
}

/// Wrench at a time \[s\]; a nanosecond keeps edges on their side of a tick.
fn wrench(pulses: &[Pulse], time: f64) -> [f64; 6] {
    let mut out = [0.0; 6];
    for pulse in pulses.iter().filter(|pulse| time > pulse.from_s - 1e-9 && time < pulse.until_s - 1e-9) {
        out[pulse.axis] += pulse.value;
    }
    out
}

/// Nuisance parameters that a data set draws within the model's tolerances.
#[derive(Clone, Copy, Debug)]
struct Nuisances {
    /// Factors on mass and moments of inertia.
    mass: f64,
    inertia: Vector,
    /// Centre of mass \[m\], biases \[m/s^2, rad/s\], the wrench stamped t acts from t + this \[s\].
    centre: Vector,
    accelerometer: Vector,
    gyroscope: Vector,
    clock_offset: f64,
}

impl Nuisances {
    fn draw(seed: u64) -> Self {
        let mut stream = Stream::new(seed, "nuisances of the body", 0);
        let [mass, clock] = stream.normals();
        let mut spread = |deviation: f64| stream.normals().map(|draw: f64| deviation * draw);
        // Whole steps of the integration, so that a pulse begins where a step does.
        let step = TICK / STEPS as f64;
        let clock_offset = (tolerance::CLOCK_OFFSET * clock / step).round() * step;
        Self {
            mass: 1.0 + tolerance::MASS * mass,
            inertia: spread(tolerance::INERTIA).map(|share| 1.0 + share),
            centre: spread(tolerance::CENTRE),
            accelerometer: spread(tolerance::ACCELEROMETER_BIAS),
            gyroscope: spread(tolerance::GYROSCOPE_BIAS),
            clock_offset,
        }
    }
}

/// The body with its hidden effects.
fn plant(sizes: &Sizes, nuisances: &Nuisances) -> Plant {
    let share = 1.0 + sizes.of("P1_inertia");
    let [x, y, z]: Vector = std::array::from_fn(|i| nominal::INERTIA[i] * nuisances.inertia[i] * share);
    let sprung =
        |id, (place, hz, damping_ratio)| Sprung { mass: sizes.of(id), place, frequency: TAU * hz, damping_ratio };
    Plant::new(
        nominal::MASS * nuisances.mass + sizes.of("P1_mass"),
        sum(nuisances.centre, [sizes.of("P1_centre"), 0.0, 0.0]),
        [[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]],
        [sprung("P2_slosh", SLOSH), sprung("P3_appendage", BOOM)],
        [sizes.of("quadratic_drag"), sizes.of("umbilical")],
    )
}

/// The rig with its effects and nuisances.
pub(crate) struct BodyRig {
    nuisances: Nuisances,
    plant: Plant,
}

impl BodyRig {
    pub(crate) fn new(sizes: &Sizes, seed: u64) -> Self {
        let nuisances = Nuisances::draw(seed);
        Self { nuisances, plant: plant(sizes, &nuisances) }
    }

    /// One tick of the plant from a time \[s\] on, under the pulses and a disturbance (force, moment).
    fn tick(&self, plant: &mut Plant, mut state: State, pulses: &[Pulse], time: f64, disturbance: [f64; 6]) -> State {
        let step = TICK / STEPS as f64;
        for i in 0..STEPS {
            let wrench = wrench(pulses, time + i as f64 * step - self.nuisances.clock_offset);
            plant.force = std::array::from_fn(|axis| wrench[axis] + disturbance[axis]);
            plant.moment = std::array::from_fn(|axis| wrench[3 + axis] + disturbance[3 + axis]);
            state = advance(plant, &state, step);
        }
        state
    }
}

/// The six instruments of the rig.
struct Instruments {
    force: Instrument,
    moment: Instrument,
    position: Instrument,
    orientation: Instrument,
    accelerometer: Instrument,
    gyroscope: Instrument,
}

impl Instruments {
    fn new(run: &Run) -> Self {
        let of = |purpose, deviation, quantum| Instrument::new(run, purpose, deviation, quantum);
        Self {
            force: of("force", 0.05, 1e-2),
            moment: of("moment", 0.01, 1e-3),
            position: of("position", 5e-5, 1e-5),
            orientation: of("orientation", 3e-5, 1e-6),
            accelerometer: of("accelerometer", 5e-4, 1e-5),
            gyroscope: of("gyroscope", 5e-5, 1e-6),
        }
    }
}

impl SimulatedRig for BodyRig {
    fn ageing(&self) -> Ageing {
        Ageing::Time
    }

    fn model(&self) -> String {
        nominal::MODEL.into()
    }

    fn training(&self) -> &'static [&'static str] {
        TRAINING
    }

    fn record(&self, experiment: &str, run: &Run) -> Table {
        let pulses = pulses(experiment);
        let mut instruments = Instruments::new(run);
        let mut disturbances: Vec<Disturbance> = run.noise.map_or(Vec::new(), |colour| {
            let of =
                |i: usize| Disturbance::new(colour, DISTURBANCE[i / 3], TICK, run.stream(&format!("disturbance {i}")));
            (0..6).map(of).collect()
        });
        let (mut plant, mut state) = (self.plant.clone(), Plant::at_rest());
        let mut table = Table::new(&COLUMNS);
        for tick in 0..(DURATION_S / TICK).round() as usize {
            let time = tick as f64 * TICK;
            let disturbance = std::array::from_fn(|i| disturbances.get_mut(i).map_or(0.0, Disturbance::next));
            let acting = wrench(&pulses, time - self.nuisances.clock_offset);
            plant.force = std::array::from_fn(|axis| acting[axis] + disturbance[axis]);
            plant.moment = std::array::from_fn(|axis| acting[3 + axis] + disturbance[3 + axis]);
            let acceleration = plant.accelerations(&state).origin;
            let sent = wrench(&pulses, time);
            let mut row = vec![run.start_s + time];
            row.extend((0..3).map(|axis| instruments.force.read(sent[axis])));
            row.extend((3..6).map(|axis| instruments.moment.read(sent[axis])));
            row.extend((0..3).map(|axis| instruments.position.read(state[POSITION + axis])));
            row.extend((0..4).map(|i| instruments.orientation.read(state[QUATERNION + i])));
            row.extend(
                (0..3).map(|i| instruments.accelerometer.read(acceleration[i] + self.nuisances.accelerometer[i])),
            );
            row.extend((0..3).map(|i| instruments.gyroscope.read(state[RATE + i] + self.nuisances.gyroscope[i])));
            table.push(&row);
            state = self.tick(&mut plant, state, &pulses, time, disturbance);
        }
        table
    }

    fn further(&self, id: &str) -> Vec<Parameter> {
        let sprung = |(place, hz, damping_ratio): (Vector, f64, f64)| {
            vec![
                Parameter::new("frequency", hz, "Hz"),
                Parameter::new("damping_ratio", damping_ratio, ""),
                Parameter::new("place_x", place[0], "m"),
                Parameter::new("place_y", place[1], "m"),
                Parameter::new("place_z", place[2], "m"),
            ]
        };
        match id {
            "P2_slosh" => sprung(SLOSH),
            "P3_appendage" => sprung(BOOM),
            _ => Vec::new(),
        }
    }

    fn nuisances(&self) -> Vec<Parameter> {
        let of = &self.nuisances;
        let each = |names: [&'static str; 3], values: Vector, unit| {
            names.into_iter().zip(values).map(move |(name, value)| Parameter::new(name, value, unit))
        };
        let mut out =
            vec![Parameter::new("mass_factor", of.mass, ""), Parameter::new("clock_offset", of.clock_offset, "s")];
        out.extend(each(["inertia_factor_x", "inertia_factor_y", "inertia_factor_z"], of.inertia, ""));
        out.extend(each(["centre_x", "centre_y", "centre_z"], of.centre, "m"));
        let names = ["accelerometer_bias_x", "accelerometer_bias_y", "accelerometer_bias_z"];
        out.extend(each(names, of.accelerometer, "m/s^2"));
        out.extend(each(["gyroscope_bias_x", "gyroscope_bias_y", "gyroscope_bias_z"], of.gyroscope, "rad/s"));
        out
    }
}
