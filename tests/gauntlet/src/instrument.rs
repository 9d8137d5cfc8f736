//! Instruments: noise, a quantum, and a clock of their own.

use crate::random::Stream;
use crate::session::Run;

/// A reading with noise and a quantum; exact in a run without noise.
pub(crate) struct Instrument {
    noise: Option<Stream>,
    /// Standard deviation of the noise, and quantum, in the unit of the reading.
    deviation: f64,
    quantum: f64,
}

impl Instrument {
    pub(crate) fn new(run: &Run, purpose: &str, deviation: f64, quantum: f64) -> Self {
        Self { noise: run.noise.map(|_| run.stream(purpose)), deviation, quantum }
    }

    /// What is read for a value.
    pub(crate) fn read(&mut self, value: f64) -> f64 {
        let Some(noise) = &mut self.noise else { return value };
        ((value + self.deviation * noise.normal()) / self.quantum).round() * self.quantum
    }
}

/// What a channel shows at a tick when its clock is off by a share of a tick between -1 and 1; it interpolates.
pub(crate) fn stamped(values: &[f64], tick: usize, share: f64) -> f64 {
    let other = if share >= 0.0 { tick + 1 } else { tick.saturating_sub(1) };
    values[tick] + share.abs() * (values[other] - values[tick])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::NoiseColour;

    #[test]
    fn readings_are_whole_quanta_about_the_value() {
        let run = Run { seed: 1, number: 0, start_s: 0.0, noise: Some(NoiseColour::White), unmoved: false };
        let mut instrument = Instrument::new(&run, "a reading", 5e-6, 6e-6);
        let readings: Vec<f64> = (0..10_000).map(|_| instrument.read(0.1)).collect();
        let error = |reading: &f64| reading - 0.1;
        assert!(readings.iter().all(|reading| ((reading / 6e-6).round() * 6e-6 - reading).abs() < 1e-15));
        let mean = readings.iter().map(error).sum::<f64>() / 1e4;
        let power = readings.iter().map(|reading| error(reading).powi(2)).sum::<f64>() / 1e4;
        assert!(mean.abs() < 3e-7, "{mean}");
        // Noise and rounding add: 5^2 + 6^2 / 12 = 5.29^2 square microradians.
        assert!((power.sqrt() - 5.29e-6).abs() < 2e-7, "{}", power.sqrt());
    }

    #[test]
    fn clock_offset_interpolates_neighbours() {
        let values = [0.0, 1.0, 4.0];
        assert_eq!([0.2, -0.2, 0.0].map(|share| stamped(&values, 1, share)), [1.6, 0.8, 1.0]);
        assert_eq!(stamped(&values, 0, -0.5), 0.0);
    }
}
