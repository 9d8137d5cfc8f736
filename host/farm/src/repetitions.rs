//! Runs that are repeated to check the numbers: those of a GPU in f64, and runs of any backend at half the substep.

use crate::error::Result;
use crate::folder::ResultsFolder;
use crate::observer::{Context, Progress, Work};
use crate::run_engine::{RunEngine, counting};
use softdock_kernels::metrics::flags;
use softdock_results::parity::{HALF_STEP, PARITY, RepeatedRow, write_repetition};
use softdock_results::runs::RunRow;
use softdock_results::shards::ShardIndex;

/// Whether a run is one of `wanted` runs spread evenly over `runs`.
pub(crate) fn is_chosen(run: u64, wanted: u64, runs: u64) -> bool {
    let before = |run: u64| u128::from(run) * u128::from(wanted) / u128::from(runs.max(1));
    before(run + 1) > before(run)
}

/// Collects the runs to be repeated in f64: evenly spread over the campaign, as far as a GPU made them.
pub(crate) struct ParityRuns {
    /// Runs to repeat and runs of the campaign.
    wanted: (u64, u64),
    shard_runs: u64,
    by_gpu: Vec<bool>,
    rows: Vec<RunRow>,
    /// Backend and device of the rows.
    made_on: Option<(String, String)>,
}

impl ParityRuns {
    /// The choice for a whole campaign.
    pub(crate) fn of(folder: &ResultsFolder, index: &ShardIndex) -> Self {
        let campaign = &folder.campaign;
        let gpu = index.complete.values().find(|file| file.backend == "gpu");
        Self {
            wanted: ((campaign.execution.parity * campaign.runs as f64).ceil() as u64, campaign.runs),
            shard_runs: campaign.execution.shard_runs,
            by_gpu: index.complete.values().map(|file| file.backend == "gpu").collect(),
            rows: Vec::new(),
            made_on: gpu.map(|file| (file.backend.clone(), file.device.clone())),
        }
    }

    /// Keeps the row at its place among the campaign's runs if its run is one of the chosen.
    pub(crate) fn see(&mut self, place: u64, row: RunRow) {
        let by_gpu = self.by_gpu.get((place / self.shard_runs) as usize) == Some(&true);
        if by_gpu && row.flags & flags::RETRIED == 0 && is_chosen(place, self.wanted.0, self.wanted.1) {
            self.rows.push(row);
        }
    }

    /// Repeats the chosen runs on the inputs that the GPU applied, and writes them beside their rows; without any, no
    /// file.
    pub(crate) fn write(
        self,
        folder: &ResultsFolder,
        reference: &mut RunEngine,
        index: &ShardIndex,
        context: Context,
    ) -> Result<()> {
        let Some((backend, device)) = self.made_on.filter(|_| !self.rows.is_empty()) else {
            return Ok(());
        };
        let inputs = reference.inputs_of(&self.rows)?;
        let progress = Progress::new(context, Work::Parity, inputs.len() as u64);
        let repeated = reference.make_rows(&inputs, &counting(&progress))?;
        let rows = self.rows.into_iter().zip(repeated);
        let rows = rows.map(|(first, second)| RepeatedRow { first, second }).collect();
        let mut provenance = reference.provenance();
        (provenance.backend, provenance.device) = (backend, device);
        Ok(write_repetition(&PARITY, &folder.path, &reference.builder.schema, rows, &provenance, index)?)
    }
}

/// Collects the runs to be repeated at half the substep: evenly spread over the campaign, on whichever backend.
pub(crate) struct HalfStepRuns {
    /// Runs to repeat and runs of the campaign.
    wanted: (u64, u64),
    shard_runs: u64,
    by_cpu: Vec<bool>,
    /// Each row, and whether it is in f64 already.
    rows: Vec<(RunRow, bool)>,
}

impl HalfStepRuns {
    /// The choice for a whole campaign.
    pub(crate) fn of(folder: &ResultsFolder, index: &ShardIndex) -> Self {
        let campaign = &folder.campaign;
        Self {
            wanted: (campaign.half_step_runs(), campaign.runs),
            shard_runs: campaign.execution.shard_runs,
            by_cpu: index.complete.values().map(|file| file.backend == "cpu").collect(),
            rows: Vec::new(),
        }
    }

    /// Keeps the row at its place among the campaign's runs if its run is one of the chosen.
    pub(crate) fn see(&mut self, place: u64, row: &RunRow) {
        if is_chosen(place, self.wanted.0, self.wanted.1) {
            let by_cpu = self.by_cpu.get((place / self.shard_runs) as usize) == Some(&true);
            self.rows.push((row.clone(), by_cpu || row.flags & flags::RETRIED != 0));
        }
    }

    /// Makes the chosen runs in f64 at the campaign's substep and at half of it, and writes both; without any, no file.
    pub(crate) fn write(
        self,
        folder: &ResultsFolder,
        reference: &mut RunEngine,
        index: &ShardIndex,
        context: Context,
    ) -> Result<()> {
        if self.rows.is_empty() {
            return Ok(());
        }
        let in_f32 = self.rows.iter().filter(|(_, in_f64)| !in_f64).map(|(row, _)| row);
        let in_f32 = reference.inputs_of(in_f32)?;
        let mut repeated = reference.make_rows(&in_f32, &|_, _| !context.cancel.is_cancelled())?.into_iter();
        let halved = folder.campaign.at_half_step();
        let mut finer = RunEngine::reference(&halved);
        let inputs = finer.inputs_of(self.rows.iter().map(|(row, _)| row))?;
        let first = self.rows.into_iter().map(|(row, in_f64)| if in_f64 { Some(row) } else { repeated.next() });
        let first: Vec<RunRow> = first.flatten().collect();

        let progress = Progress::new(context, Work::HalfStep, inputs.len() as u64);
        let second = finer.make_rows(&inputs, &counting(&progress))?;
        let rows = first.into_iter().zip(second).map(|(first, second)| RepeatedRow { first, second }).collect();
        let (schema, provenance) = (&reference.builder.schema, reference.provenance());
        Ok(write_repetition(&HALF_STEP, &folder.path, schema, rows, &provenance, index)?)
    }
}
