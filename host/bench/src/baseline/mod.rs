//! Baseline methods on the same recordings of a drive. They get the nominal plant, its controller, and recordings of
//! the healthy plant with its session-to-session variation.

mod least_squares;
mod signals;
mod sparse;

use crate::Result;
use crate::plan::Case;
use crate::record::Baseline;
use crate::recordings_folder::RecordingsFolder;
use signals::Signals;
use softdock_gauntlet::{NoiseColour, generate};
use std::path::Path;
use std::time::Instant;

/// Seeds of the healthy recordings: above those of all cases.
const HEALTHY_SEEDS: [u64; 4] = [1 << 32, (1 << 32) + 1, (1 << 32) + 2, (1 << 32) + 3];

/// Baseline methods with their prior information.
#[derive(Default)]
pub(crate) struct Baselines {
    /// Healthy recordings in each colour of noise.
    healthy: Vec<(NoiseColour, Vec<Signals>)>,
}

impl Baselines {
    /// Returns the answers of the baseline methods for the training recordings of a folder.
    ///
    /// # Errors
    /// Recordings that cannot be made or read.
    pub(crate) fn answers(&mut self, case: &Case, folder: &Path) -> Result<Vec<Baseline>> {
        if !self.healthy.iter().any(|(colour, _)| *colour == case.noise) {
            let of =
                |seed| Signals::read(RecordingsFolder::of(&generate(case.plant.rig, &[], case.noise, seed)?)?.path());
            self.healthy.push((case.noise, HEALTHY_SEEDS.into_iter().map(of).collect::<Result<_>>()?));
        }
        let Some((_, healthy)) = self.healthy.iter().find(|(colour, _)| *colour == case.noise) else {
            return Ok(Vec::new());
        };
        let signals = Signals::read(folder)?;
        let timed = |method: &str, name: fn(&Signals, &[Signals]) -> Option<&'static str>| {
            let start = Instant::now();
            let named = name(&signals, healthy).map(ToOwned::to_owned);
            Baseline { method: method.to_owned(), named, seconds: start.elapsed().as_secs_f64() }
        };
        Ok(vec![timed("least squares", least_squares::name), timed("sparse regression", sparse::name)])
    }
}
