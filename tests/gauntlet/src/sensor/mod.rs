//! The sensor rig: a force/torque sensor under known loads.

mod chain;
mod effects;
mod motions;
mod nominal;

use crate::catalogue::{Parameter, Sizes};
use crate::instrument::Instrument;
use crate::random::Disturbance;
use crate::session::{Ageing, Run, SimulatedRig};
use crate::space::{cross, difference, sum, times};
use crate::table::{Column, Table, column};
use chain::{Chain, Nuisances, SCALES, Wrench, direction};
pub(crate) use effects::{EFFECTS, OUTSIDE};
use motions::{Experiment, Moving, joined};

/// Tick of the log \[s\], and the finer grid on which blows and filter run, in steps of a tick.
const TICK: f64 = 1e-3;
const STEPS: usize = 20;
/// Ticks by which motion and fine grid begin before a record and end behind it.
const LEAD: i32 = 2;
/// White noise of the sensor \[N\], coloured noise \[N\], quantum \[N\]; moments 0.1 m times these.
const NOISE: f64 = 0.3;
const COLOURED_NOISE: f64 = 0.1;
const QUANTUM: f64 = 0.02;
/// Noise of the reference \[N\].
const REFERENCE_NOISE: f64 = 0.05;
/// Noise of accelerometer \[m/s^2\] and gyroscope \[rad/s\].
const ACCELERATION_NOISE: f64 = 0.005;
const RATE_NOISE: f64 = 0.0005;
/// Correlation time \[s\] of the noise that may be hidden.
const HIDDEN_NOISE_S: f64 = 0.05;

const COLUMNS: [Column; 23] = [
    column("t_s", 3),
    column("f_ref_x_n", 3),
    column("f_ref_y_n", 3),
    column("f_ref_z_n", 3),
    column("m_ref_x_nm", 4),
    column("m_ref_y_nm", 4),
    column("m_ref_z_nm", 4),
    column("qw", 7),
    column("qx", 7),
    column("qy", 7),
    column("qz", 7),
    column("ax_m_per_s2", 4),
    column("ay_m_per_s2", 4),
    column("az_m_per_s2", 4),
    column("wx_rad_per_s", 5),
    column("wy_rad_per_s", 5),
    column("wz_rad_per_s", 5),
    column("f_x_n", 3),
    column("f_y_n", 3),
    column("f_z_n", 3),
    column("m_x_nm", 4),
    column("m_y_nm", 4),
    column("m_z_nm", 4),
];

/// The rig with its effects and nuisances.
pub(crate) struct SensorRig {
    nuisances: Nuisances,
    chain: Chain,
    /// Standard deviation of the hidden noise \[N\].
    hidden_noise: f64,
    seed: u64,
}

fn plus(a: Wrench, b: Wrench) -> Wrench {
    std::array::from_fn(|i| a[i] + b[i])
}

/// Wrench of a tool of so much mass \[kg\] on the sensor; its inertia about the centre stays the nominal one's.
fn tool_wrench(moving: &Moving, mass: f64) -> Wrench {
    let wrench = joined(moving.carried_force(mass, nominal::TOOL_CENTRE), nominal::TOOL_CENTRE);
    let [x, y, z] = nominal::TOOL_INERTIA;
    let inertia = [[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]];
    let spin = times(&inertia, moving.rate);
    let turning = sum(times(&inertia, moving.angular_acceleration), cross(moving.rate, spin));
    let moment = difference([wrench[3], wrench[4], wrench[5]], turning);
    [wrench[0], wrench[1], wrench[2], moment[0], moment[1], moment[2]]
}

/// Noise of the six channels.
struct Noise {
    coloured: Vec<Disturbance>,
    hidden: Vec<Disturbance>,
}

impl SensorRig {
    pub(crate) fn new(sizes: &Sizes, seed: u64) -> Self {
        let nuisances = Nuisances::draw(seed);
        let chain = Chain::new(sizes, &nuisances, seed);
        Self { nuisances, chain, hidden_noise: sizes.of("S7_noise"), seed }
    }

    /// The sensing element's signal on the fine grid, beginning and ending with a motion's ticks.
    fn signal(&self, experiment: &Experiment, motion: &[Moving], run: &Run) -> Vec<Wrench> {
        let mut chain = self.chain.clone();
        // What moves slowly is taken once a tick and interpolated; blows are not.
        let slow = |moving: &Moving| plus(experiment.hung_wrench(moving), tool_wrench(moving, chain.tool_mass));
        let slow: Vec<Wrench> = motion.iter().map(slow).collect();
        let mut signal = Vec::with_capacity(slow.len() * STEPS);
        for (tick, pair) in (-LEAD..).zip(slow.windows(2)) {
            for step in 0..STEPS {
                let share = step as f64 / STEPS as f64;
                let time = (f64::from(tick) + share) * TICK;
                let slow: Wrench = std::array::from_fn(|i| pair[0][i] + share * (pair[1][i] - pair[0][i]));
                let wrench = plus(slow, experiment.blow_wrench(time));
                signal.push(chain.element(wrench, TICK / STEPS as f64, run.start_s + time));
            }
        }
        signal
    }

    fn noise(&self, run: &Run) -> Noise {
        let stream = |purpose: &str, i: usize| run.stream(&format!("{purpose} {i}"));
        let coloured = |i: usize| {
            let deviation = COLOURED_NOISE * SCALES[i];
            run.noise.map(|colour| Disturbance::new(colour, deviation, TICK, stream("coloured noise", i)))
        };
        let hidden = |i: usize| {
            let deviation = self.hidden_noise * SCALES[i];
            Disturbance::first_order(HIDDEN_NOISE_S, deviation, TICK, stream("hidden noise", i))
        };
        let hidden = if self.hidden_noise > 0.0 { (0..6).map(hidden).collect() } else { Vec::new() };
        Noise { coloured: (0..6).filter_map(coloured).collect(), hidden }
    }
}

/// What a converter gives that averages over the tick about its stamp, as those of bridges do: what a blow holds above
/// half the tick rate would else be folded back, and two channels that are a part of a tick apart would differ by it.
fn averaged(value: impl Fn(f64) -> Wrench) -> Wrench {
    let mut sum = [0.0; 6];
    for step in 0..STEPS {
        sum = plus(sum, value((step as f64 + 0.5) / STEPS as f64 - 0.5));
    }
    sum.map(|sum| sum / STEPS as f64)
}

/// The signal at a time in ticks; neighbours on the fine grid are interpolated.
fn sampled(signal: &[Wrench], ticks: f64) -> Wrench {
    let place = (ticks + f64::from(LEAD)) * STEPS as f64;
    let (at, share) = (place.floor() as usize, place.fract());
    std::array::from_fn(|i| signal[at][i] + share * (signal[at + 1][i] - signal[at][i]))
}

impl SimulatedRig for SensorRig {
    fn model(&self) -> String {
        nominal::MODEL.into()
    }

    fn training(&self) -> &'static [&'static str] {
        motions::TRAINING
    }

    fn ageing(&self) -> Ageing {
        let ages = self.chain.drift != [0.0; 6] || self.chain.warm_gain != 0.0 || self.hidden_noise != 0.0;
        if ages { Ageing::Rig } else { Ageing::Time }
    }

    fn record(&self, experiment: &str, run: &Run) -> Table {
        let experiment = motions::experiment(experiment);
        let ticks = (motions::DURATION_S / TICK).round() as i32;
        let motion: Vec<Moving> =
            (-LEAD..=ticks + LEAD).map(|tick| experiment.moving(f64::from(tick) * TICK)).collect();
        let signal = self.signal(&experiment, &motion, run);
        let mut noise = self.noise(run);
        let unseen = if run.noise.is_some() { 0.0 } else { NOISE.hypot(COLOURED_NOISE) };
        let mut reference = Instrument::new(run, "reference", REFERENCE_NOISE, 0.1 * QUANTUM);
        let mut sensor = Instrument::new(run, "sensor", NOISE, QUANTUM);
        let mut acceleration = Instrument::new(run, "accelerometer", ACCELERATION_NOISE, 1e-4);
        let mut rate = Instrument::new(run, "gyroscope", RATE_NOISE, 1e-5);
        let mut table = Table::new(&COLUMNS);
        for (tick, moving) in (0..ticks).zip(&motion[LEAD as usize..]) {
            let time = f64::from(tick) * TICK;
            let blow = averaged(|share| experiment.blow_wrench(time + share * TICK));
            let load = plus(experiment.hung_wrench(moving), blow);
            let offset = self.nuisances.clock_offset / TICK;
            let signal = averaged(|share| sampled(&signal, f64::from(tick) + offset + share));
            let noisy = std::array::from_fn(|i| {
                let coloured = noise.coloured.get_mut(i).map_or(0.0, Disturbance::next);
                let hidden = noise.hidden.get_mut(i).map_or(0.0, Disturbance::next);
                sensor.read(signal[i] / SCALES[i]) * SCALES[i] + coloured + hidden
            });
            let reading = self.chain.reading(noisy, unseen, run.start_s + time);
            let compensated = tool_wrench(moving, nominal::TOOL_MASS);
            let mut row = vec![run.start_s + time];
            row.extend((0..6).map(|i| reference.read(load[i] / SCALES[i]) * SCALES[i]));
            row.extend(moving.orientation);
            row.extend(moving.acceleration.map(|value| acceleration.read(value)));
            row.extend(moving.rate.map(|value| rate.read(value)));
            row.extend((0..6).map(|i| reading[i] - compensated[i]));
            table.push(&row);
        }
        table
    }

    fn further(&self, id: &str) -> Vec<Parameter> {
        const NAMES: [&str; 6] = ["unit_x", "unit_y", "unit_z", "unit_moment_x", "unit_moment_y", "unit_moment_z"];
        let along = |purpose| {
            let direction = direction(self.seed, purpose);
            let unit = |i: usize| if i < 3 { "" } else { "m" };
            (0..6).map(|i| Parameter::new(NAMES[i], direction[i], unit(i))).collect()
        };
        match id {
            "S1_bias" => along("direction of bias"),
            "S2_drift" => along("direction of drift"),
            "S7_noise" => vec![Parameter::new("correlation_time", HIDDEN_NOISE_S, "s")],
            "hysteresis" => vec![Parameter::new("turn", chain::HYSTERESIS_TURN, "N")],
            "temperature_gain" => vec![Parameter::new("time_constant", chain::WARM_UP_S, "s")],
            _ => Vec::new(),
        }
    }

    fn nuisances(&self) -> Vec<Parameter> {
        const NAMES: [(&str, &str); 6] = [
            ("bias_force_x", "N"),
            ("bias_force_y", "N"),
            ("bias_force_z", "N"),
            ("bias_moment_x", "N m"),
            ("bias_moment_y", "N m"),
            ("bias_moment_z", "N m"),
        ];
        let bias = NAMES.iter().zip(self.nuisances.bias).map(|((name, unit), bias)| Parameter::new(name, bias, unit));
        let others = [
            Parameter::new("gain", self.nuisances.gain, ""),
            Parameter::new("tool_mass", self.nuisances.tool_mass, "kg"),
            Parameter::new("clock_offset", self.nuisances.clock_offset, "s"),
        ];
        bias.chain(others).collect()
    }
}
