//! The sensor itself: from the wrench that acts on it to the numbers that it gives.

use super::nominal::{self, tolerance};
use crate::catalogue::Sizes;
use crate::random::Stream;
use std::f64::consts::TAU;

/// A wrench on the sensor: force \[N\], moment \[N m\].
pub(crate) type Wrench = [f64; 6];

/// Lever by which sizes in newtons become moments \[m\].
pub(crate) const LEVER: f64 = 0.1;
/// Newtons over which a hysteresis turns.
pub(crate) const HYSTERESIS_TURN: f64 = 10.0;
/// Time constant of warming up \[s\].
pub(crate) const WARM_UP_S: f64 = 40.0;

/// Units of the channels in terms of those of a force.
pub(crate) const SCALES: Wrench = [1.0, 1.0, 1.0, LEVER, LEVER, LEVER];

/// Nuisance parameters that a data set draws within the model's tolerances, and the directions of hidden constants.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nuisances {
    pub(crate) bias: Wrench,
    /// Share.
    pub(crate) gain: f64,
    /// \[kg\]
    pub(crate) tool_mass: f64,
    /// The wrench stamped t was there at t + this \[s\].
    pub(crate) clock_offset: f64,
}

/// A clock offset stays below a tick \[s\].
const LARGEST_CLOCK_OFFSET: f64 = 9e-4;

impl Nuisances {
    pub(crate) fn draw(seed: u64) -> Self {
        let mut stream = Stream::new(seed, "nuisances of the sensor", 0);
        let [gain, mass, clock] = stream.normals();
        let bias: Wrench = stream.normals();
        let spread = [[tolerance::BIAS_FORCE; 3], [tolerance::BIAS_MOMENT; 3]].concat();
        let clock_offset: f64 = tolerance::CLOCK_OFFSET * clock;
        Self {
            bias: std::array::from_fn(|i| spread[i] * bias[i]),
            gain: tolerance::GAIN * gain,
            tool_mass: tolerance::TOOL_MASS * mass,
            clock_offset: clock_offset.clamp(-LARGEST_CLOCK_OFFSET, LARGEST_CLOCK_OFFSET),
        }
    }
}

/// A direction in the space of wrenches: force and moment of length 1, the moment in units of the lever.
pub(crate) fn direction(seed: u64, purpose: &str) -> Wrench {
    let mut stream = Stream::new(seed, purpose, 0);
    let mut unit = || {
        let draw: [f64; 3] = stream.normals();
        let length = draw.iter().map(|x| x * x).sum::<f64>().sqrt();
        draw.map(|x| x / length)
    };
    let (force, moment) = (unit(), unit());
    std::array::from_fn(|i| if i < 3 { force[i] } else { LEVER * moment[i - 3] })
}

/// The sensor with its hidden effects.
#[derive(Clone, Debug)]
pub(crate) struct Chain {
    /// Constant wrench, and its growth per second of the session.
    pub(crate) bias: Wrench,
    pub(crate) drift: Wrench,
    /// Gain error, and what warming up adds to it.
    pub(crate) gain: f64,
    pub(crate) warm_gain: f64,
    /// Share of f_z in f_x.
    pub(crate) crosstalk: f64,
    /// Force at which the reading is half the force \[N\].
    pub(crate) saturation: f64,
    /// Half-width of the hysteresis \[N\].
    pub(crate) hysteresis: f64,
    /// Time constant \[s\].
    pub(crate) low_pass: f64,
    /// Quantum \[N\]; 0 for none.
    pub(crate) quantum: f64,
    /// Mass of the tool \[kg\].
    pub(crate) tool_mass: f64,
    /// Memory: centre of the hysteresis; the last signal and what the filter made of it.
    play: Wrench,
    filtered: Option<(Wrench, Wrench)>,
}

impl Chain {
    pub(crate) fn new(sizes: &Sizes, nuisances: &Nuisances, seed: u64) -> Self {
        let (bias, drift) = (direction(seed, "direction of bias"), direction(seed, "direction of drift"));
        Self {
            bias: std::array::from_fn(|i| nuisances.bias[i] + sizes.of("S1_bias") * bias[i]),
            drift: drift.map(|x| sizes.of("S2_drift") * x),
            gain: nuisances.gain + sizes.of("S3_gain"),
            warm_gain: sizes.of("temperature_gain"),
            crosstalk: sizes.of("S4_crosstalk"),
            saturation: sizes.limit("soft_saturation"),
            hysteresis: sizes.of("hysteresis"),
            low_pass: sizes.of("S5_low_pass"),
            quantum: sizes.of("S6_quantisation"),
            tool_mass: nominal::TOOL_MASS + nuisances.tool_mass + sizes.of("S8_load"),
            play: [0.0; 6],
            filtered: None,
        }
    }

    /// Signal of the sensing element a step \[s\] later, under a wrench, at a time of the session \[s\]. The first call sets
    /// the memory as if the wrench had been there for long.
    pub(crate) fn element(&mut self, wrench: Wrench, step: f64, session: f64) -> Wrench {
        let warmth = 1.0 - (-session / WARM_UP_S).exp();
        let mut signal = wrench;
        signal[0] += self.crosstalk * wrench[2];
        for (i, signal) in signal.iter_mut().enumerate() {
            let scale = SCALES[i];
            *signal *= (1.0 + self.gain + self.warm_gain * warmth) / (1.0 + signal.abs() / (scale * self.saturation));
            if self.hysteresis > 0.0 {
                let turn = scale * HYSTERESIS_TURN;
                self.play[i] = self.play[i].clamp(*signal - turn, *signal + turn);
                // Rising signals pull the play behind them: the reading lags on the side it came from.
                *signal += scale * self.hysteresis * (self.play[i] - *signal) / turn;
            }
        }
        if self.low_pass == 0.0 {
            return signal;
        }
        // Exact for a signal that is linear over the step: the filter ends T slope behind it.
        let (before, filtered) = self.filtered.unwrap_or((signal, signal));
        let keep = (-step / self.low_pass).exp();
        let filtered = std::array::from_fn(|i| {
            let behind = self.low_pass * (signal[i] - before[i]) / step;
            signal[i] - behind + keep * (filtered[i] - before[i] + behind)
        });
        self.filtered = Some((signal, filtered));
        filtered
    }

    /// Reading at a time of the session \[s\] from the element's signal with its noise; or from the signal alone what is
    /// read on the average, behind a noise of such a deviation \[N\].
    pub(crate) fn reading(&self, signal: Wrench, noise: f64, session: f64) -> Wrench {
        std::array::from_fn(|i| {
            let value = signal[i] + self.bias[i] + self.drift[i] * session;
            let quantum = SCALES[i] * self.quantum;
            if quantum > 0.0 { rounded(value / quantum, noise / self.quantum) * quantum } else { value }
        })
    }
}

/// Most terms of the series below: without noise they come within half a per cent of a step but next to its edges.
const TERMS: u32 = 100;
/// Share of a term that counts as nothing.
const NOTHING: f64 = 1e-15;

/// A value behind normal noise of a deviation rounded to whole numbers, on the average: the noise takes each term of the
/// rounding's Fourier series down by its own factor (Widrow and Kollar 2008, 4).
fn rounded(value: f64, deviation: f64) -> f64 {
    if deviation == 0.0 {
        return value.round();
    }
    let term = |k: u32| {
        let turn = TAU * f64::from(k);
        let sign = if k.is_multiple_of(2) { 2.0 } else { -2.0 };
        let kept = (-0.5 * (turn * deviation).powi(2)).exp();
        (kept > NOTHING).then(|| sign / turn * (turn * value).sin() * kept)
    };
    value + (1..=TERMS).map_while(term).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::{Hidden, Rig};

    const NONE: Nuisances = Nuisances { bias: [0.0; 6], gain: 0.0, tool_mass: 0.0, clock_offset: 0.0 };
    const WRENCH: Wrench = [30.0, -10.0, 200.0, 2.0, -5.0, 0.5];

    fn chain(id: &'static str, size: f64) -> Chain {
        Chain::new(&Sizes::check(Rig::Sensor, &[Hidden { id, size }]).expect("an effect"), &NONE, 6)
    }

    /// Reading of a steady wrench at a time of the session \[s\].
    fn reading(id: &'static str, size: f64, session: f64) -> Wrench {
        let mut chain = chain(id, size);
        let signal = chain.element(WRENCH, 1e-4, session);
        chain.reading(signal, 0.0, session)
    }

    fn near(a: Wrench, b: Wrench) {
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9), "{a:?} {b:?}");
    }

    #[test]
    fn noise_smooths_quantisation() {
        assert_eq!(rounded(3.4, 0.0), 3.0);
        assert!((rounded(3.4, 0.02) - 3.0).abs() < 1e-3);
        // The mean of a fine grid of normal quantiles, by the chance to lie beyond the step's edge at 3.5.
        let beyond = 0.368_214;
        assert!((rounded(3.4, 0.3) - 3.0 - beyond).abs() < 1e-3);
        assert!((rounded(3.4, 0.8) - 3.4).abs() < 1e-5);
    }

    #[test]
    fn constants_gains_and_rounding_follow_their_laws() {
        let added = |id, size, session| -> Wrench {
            let reading = reading(id, size, session);
            std::array::from_fn(|i| reading[i] - WRENCH[i])
        };
        let length = |wrench: Wrench| wrench[..3].iter().map(|x| x * x).sum::<f64>().sqrt();
        assert!((length(added("S1_bias", 2.0, 5.0)) - 2.0).abs() < 1e-9);
        near(added("S1_bias", 2.0, 5.0), added("S1_bias", 2.0, 70.0));
        assert!((length(added("S2_drift", 0.02, 50.0)) - 1.0).abs() < 1e-9);
        near(reading("S3_gain", 0.02, 0.0), WRENCH.map(|x| 1.02 * x));
        near(added("S4_crosstalk", 0.02, 0.0), [4.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        near(reading("S6_quantisation", 4.0, 0.0), [32.0, -12.0, 200.0, 2.0, -5.2, 0.4]);
        near(reading("temperature_gain", 0.1, 0.0), WRENCH);
        let warm = 1.0 + 0.1 * (1.0 - (-2.0_f64).exp());
        near(reading("temperature_gain", 0.1, 80.0), WRENCH.map(|x| warm * x));
        assert!((reading("soft_saturation", 1000.0, 0.0)[2] - 200.0 / 1.2).abs() < 1e-9);
    }

    #[test]
    fn a_low_pass_rises_with_its_time_constant() {
        let mut chain = chain("S5_low_pass", 0.002);
        chain.element([0.0; 6], 1e-4, 0.0);
        chain.element(WRENCH, 1e-12, 0.0);
        let end = (0..20).fold([0.0; 6], |_, _| chain.element(WRENCH, 1e-4, 0.0));
        near(end, WRENCH.map(|x| x * (1.0 - (-1.0_f64).exp())));
    }

    #[test]
    fn hysteresis_reads_lower_while_rising() {
        let mut chain = chain("hysteresis", 2.0);
        let mut at = |force: f64| chain.element([force, 0.0, 0.0, 0.0, 0.0, 0.0], 1e-4, 0.0)[0];
        at(-50.0);
        assert!((at(50.0) - 48.0).abs() < 1e-9);
        at(100.0);
        assert!((at(50.0) - 52.0).abs() < 1e-9);
    }
}
