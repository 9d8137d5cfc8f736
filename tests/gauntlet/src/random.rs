//! Random numbers: one stream per purpose, so that hidden effects change no other draw, and noise of three colours.

use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};
use std::f64::consts::TAU;

/// A stream of draws that belongs to a seed, a purpose and a number (of the record, say).
pub(crate) struct Stream {
    source: Pcg64,
    /// The second normal number of a pair, kept for the next call.
    spare: Option<f64>,
}

impl Stream {
    pub(crate) fn new(seed: u64, purpose: &str, number: u64) -> Self {
        // FNV-1a over the three, so that streams of neighbouring seeds have nothing in common.
        let bytes = seed.to_le_bytes().into_iter().chain(number.to_le_bytes()).chain(purpose.bytes());
        let hash = bytes
            .fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3));
        Self { source: Pcg64::seed_from_u64(hash), spare: None }
    }

    /// Uniform in (0, 1).
    pub(crate) fn uniform(&mut self) -> f64 {
        ((self.source.next_u64() >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    /// Uniform between two bounds.
    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    /// Normal with mean 0 and standard deviation 1 (Box and Muller 1958).
    pub(crate) fn normal(&mut self) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        let radius = (-2.0 * self.uniform().ln()).sqrt();
        let (sin, cos) = (TAU * self.uniform()).sin_cos();
        self.spare = Some(radius * sin);
        radius * cos
    }

    /// Normal numbers for the axes of a vector.
    pub(crate) fn normals<const N: usize>(&mut self) -> [f64; N] {
        std::array::from_fn(|_| self.normal())
    }
}

/// Spectrum of the disturbance that acts inside the plant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoiseColour {
    /// First order, correlation time 0.1 s.
    FirstOrder,
    /// Independent from tick to tick.
    White,
    /// Power falling as 1/f from 0.1 Hz to half the tick rate.
    Pink,
}

impl NoiseColour {
    /// All colours.
    pub const ALL: [Self; 3] = [Self::FirstOrder, Self::White, Self::Pink];

    /// Correlation times \[s\] of the first-order processes whose equal sum has this spectrum; a factor of four from one
    /// to the next keeps a pink spectrum within half a decibel of 1/f.
    fn correlation_times(self) -> &'static [f64] {
        match self {
            Self::FirstOrder => &[0.1],
            Self::White => &[0.0],
            Self::Pink => &[0.0004, 0.0016, 0.0064, 0.0256, 0.1024, 0.4096, 1.6384],
        }
    }
}

/// A stationary coloured disturbance, one value per tick.
pub(crate) struct Disturbance {
    stream: Stream,
    /// Share kept from tick to tick, and standard deviation, of each first-order process.
    keep: Vec<f64>,
    deviation: f64,
    state: Vec<f64>,
}

impl Disturbance {
    /// With a standard deviation (any unit), for ticks of so many seconds.
    pub(crate) fn new(colour: NoiseColour, deviation: f64, tick: f64, stream: Stream) -> Self {
        Self::of_times(colour.correlation_times(), deviation, tick, stream)
    }

    /// First order with a correlation time \[s\] of its own.
    pub(crate) fn first_order(time: f64, deviation: f64, tick: f64, stream: Stream) -> Self {
        Self::of_times(&[time], deviation, tick, stream)
    }

    fn of_times(times: &[f64], deviation: f64, tick: f64, mut stream: Stream) -> Self {
        let keep = times.iter().map(|time| if *time > 0.0 { (-tick / time).exp() } else { 0.0 }).collect();
        let deviation = deviation / (times.len() as f64).sqrt();
        let state = times.iter().map(|_| deviation * stream.normal()).collect();
        Self { stream, keep, deviation, state }
    }

    /// The value of the next tick.
    pub(crate) fn next(&mut self) -> f64 {
        for (state, keep) in self.state.iter_mut().zip(&self.keep) {
            *state = keep * *state + self.deviation * (1.0 - keep * keep).sqrt() * self.stream.normal();
        }
        self.state.iter().sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_have_their_moments_and_streams_differ() {
        let mut stream = Stream::new(7, "moments", 0);
        let draws: Vec<f64> = (0..40_000).map(|_| stream.normal()).collect();
        let mean = draws.iter().sum::<f64>() / 40_000.0;
        let variance = draws.iter().map(|x| x * x).sum::<f64>() / 40_000.0;
        assert!(mean.abs() < 0.02 && (variance - 1.0).abs() < 0.03, "{mean} {variance}");
        assert_ne!(Stream::new(7, "a", 0).uniform(), Stream::new(7, "a", 1).uniform());
        assert_ne!(Stream::new(7, "a", 0).uniform(), Stream::new(7, "b", 0).uniform());
        assert_ne!(Stream::new(7, "a", 0).uniform(), Stream::new(8, "a", 0).uniform());
    }

    /// Share of the power that is left when neighbouring stretches of so many ticks are averaged.
    fn slow_share(colour: NoiseColour, stretch: usize) -> (f64, f64) {
        let mut disturbance = Disturbance::new(colour, 0.6, 1e-3, Stream::new(3, "colour", 0));
        let values: Vec<f64> = (0..200_000).map(|_| disturbance.next()).collect();
        let power = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>() / x.len() as f64;
        let means: Vec<f64> = values.chunks(stretch).map(|c| c.iter().sum::<f64>() / c.len() as f64).collect();
        (power(&values).sqrt(), power(&means) / power(&values))
    }

    #[test]
    fn noise_colours_have_equal_variance_and_their_spectra() {
        for colour in NoiseColour::ALL {
            let (size, _) = slow_share(colour, 10);
            assert!((size - 0.6).abs() < 0.06, "{colour:?}: {size}");
        }
        let (_, white) = slow_share(NoiseColour::White, 100);
        assert!((white - 0.01).abs() < 0.002, "{white}");
        let (_, slow) = slow_share(NoiseColour::FirstOrder, 100);
        // Mean of a first-order process over T = its correlation time: 2 (T - 1 + e^-T) / T^2 = 0.736.
        assert!((slow - 0.736).abs() < 0.06, "{slow}");
        let (_, pink) = slow_share(NoiseColour::Pink, 100);
        assert!(pink > 0.2 && pink < 0.5, "{pink}");
    }
}
