//! Other methods on the same recordings of a drive, as generous to them as can be: they are told the nominal plant, its
//! controller, and a recording of the healthy bench.

mod least_squares;
mod signals;
mod sparse;

use crate::Result;
use crate::exhibit::Exhibit;
use crate::plan::Case;
use crate::record::Baseline;
use signals::Signals;
use softdock_gauntlet::{NoiseColour, generate};
use std::path::Path;
use std::time::Instant;

/// Seed of the healthy recordings, which no case has.
const HEALTHY_SEED: u64 = 4_294_967_311;

/// The other methods with what they are told beforehand.
#[derive(Default)]
pub(crate) struct Baselines {
    /// Healthy recordings in each colour of noise.
    healthy: Vec<(NoiseColour, Signals)>,
}

impl Baselines {
    /// What every other method says of a folder's training recordings.
    ///
    /// # Errors
    /// Recordings that cannot be made or read.
    pub(crate) fn answers(&mut self, case: &Case, folder: &Path) -> Result<Vec<Baseline>> {
        if !self.healthy.iter().any(|(colour, _)| *colour == case.noise) {
            let healthy = Exhibit::of(&generate(case.plant.rig, &[], case.noise, HEALTHY_SEED)?)?;
            self.healthy.push((case.noise, Signals::read(healthy.path())?));
        }
        let Some((_, healthy)) = self.healthy.iter().find(|(colour, _)| *colour == case.noise) else {
            return Ok(Vec::new());
        };
        let signals = Signals::read(folder)?;
        let timed = |method: &str, name: fn(&Signals, &Signals) -> Option<&'static str>| {
            let start = Instant::now();
            let named = name(&signals, healthy).map(ToOwned::to_owned);
            Baseline { method: method.to_owned(), named, seconds: start.elapsed().as_secs_f64() }
        };
        Ok(vec![timed("least squares", least_squares::name), timed("sparse regression", sparse::name)])
    }
}
