//! Force/torque sensor behind its filter: delay, reading errors, noise.

use super::nominal::SENSOR_DELAY;
use crate::catalogue::Sizes;
use crate::instrument::Instrument;
use crate::random::Disturbance;
use crate::session::Run;

/// A wrench: force \[N\], moment \[N m\].
pub(crate) type Wrench = [f64; 6];

/// Lever by which numbers in newtons become moments \[m\].
const LEVER: f64 = 0.1;
/// Newtons over which a hysteresis turns.
pub(crate) const HYSTERESIS_TURN: f64 = 10.0;
/// Standard deviation of a sample's own noise, of the noise that lasts, and of what the tare leaves \[N\].
const NOISE: f64 = 0.3;
const LASTING_NOISE: f64 = 0.01;
const TARE: f64 = 0.05;
/// Quantum of a reading \[N\].
const QUANTUM: f64 = 0.02;

/// The sensor's nature; the memory of a record is apart.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sensor {
    /// From the filter's output to the simulation \[s\].
    pub(crate) delay: f64,
    gain: f64,
    crosstalk: f64,
    /// Half-width \[N\].
    hysteresis: f64,
}

/// Unit of each channel in terms of a force's.
fn scale(channel: usize) -> f64 {
    if channel < 3 { 1.0 } else { LEVER }
}

impl Sensor {
    pub(crate) fn new(sizes: &Sizes) -> Self {
        Self {
            delay: SENSOR_DELAY + sizes.of("S5_delay"),
            gain: sizes.of("S3_gain"),
            crosstalk: sizes.of("S4_crosstalk"),
            hysteresis: sizes.of("sensor_hysteresis"),
        }
    }

    /// Returns the noiseless reading of a wrench; `play` is the centre of the hysteresis.
    pub(crate) fn read(&self, wrench: Wrench, play: &mut Wrench) -> Wrench {
        std::array::from_fn(|i| {
            let block = 3 * (i / 3);
            let others: f64 = wrench[block..block + 3].iter().sum::<f64>() - wrench[i];
            let gain = if i == 0 { 1.0 + self.gain } else { 1.0 };
            let signal = gain * wrench[i] + self.crosstalk * others;
            let turn = scale(i) * HYSTERESIS_TURN;
            play[i] = play[i].clamp(signal - turn, signal + turn);
            signal + scale(i) * self.hysteresis * (play[i] - signal) / turn
        })
    }
}

/// Noise of a record, and what its tare has left.
pub(crate) struct Noise {
    channels: Vec<(Instrument, Option<Disturbance>, f64)>,
}

impl Noise {
    pub(crate) fn new(run: &Run, tick: f64) -> Self {
        let channel = |i: usize| {
            let purpose = |what: &str| format!("{what} of sensor channel {i}");
            let own = Instrument::new(run, &purpose("noise"), scale(i) * NOISE, scale(i) * QUANTUM);
            let lasting = run.noise.map(|colour| {
                Disturbance::new(colour, scale(i) * LASTING_NOISE, tick, run.stream(&purpose("lasting noise")))
            });
            let tare = run.noise.map_or(0.0, |_| scale(i) * TARE * run.stream(&purpose("tare")).normal());
            (own, lasting, tare)
        };
        Self { channels: (0..6).map(channel).collect() }
    }

    /// A reading with its noise.
    pub(crate) fn on(&mut self, wrench: Wrench) -> Wrench {
        std::array::from_fn(|i| {
            let (own, lasting, tare) = &mut self.channels[i];
            own.read(wrench[i] + lasting.as_mut().map_or(0.0, Disturbance::next) + *tare)
        })
    }
}
