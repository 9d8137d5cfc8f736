//! The share of the GPU's runs that is repeated in f64, on the inputs that the GPU applied.

use crate::farm::Farm;
use crate::folder::Folder;
use crate::progress::Progress;
use crate::traces::input_of;
use miette::IntoDiagnostic;
use softdock_engine::RunInput;
use softdock_kernels::metrics::flags;
use softdock_results::parity::{PARITY, RepeatedRow, write_repetition};
use softdock_results::runs::RunRow;
use softdock_results::shards::ShardIndex;

/// Collects the runs to be repeated: evenly spread over the campaign, as far as a GPU made them.
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
    pub(crate) fn of(folder: &Folder, index: &ShardIndex) -> Self {
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

    /// Keeps the row if its run is one of the chosen.
    pub(crate) fn see(&mut self, place: u64, row: RunRow) {
        let by_gpu = self.by_gpu.get((place / self.shard_runs) as usize) == Some(&true);
        if by_gpu && row.flags & flags::RETRIED == 0 && spread(place, self.wanted.0, self.wanted.1) {
            self.rows.push(row);
        }
    }
}

/// Whether a run is one of `wanted` runs spread evenly over `runs`.
pub(crate) fn spread(run: u64, wanted: u64, runs: u64) -> bool {
    let before = |run: u64| u128::from(run) * u128::from(wanted) / u128::from(runs.max(1));
    before(run + 1) > before(run)
}

/// Repeats the chosen runs and writes them beside their rows; without any, no file.
pub(crate) fn write_parity_of(
    folder: &Folder,
    truth: &mut Farm,
    index: &ShardIndex,
    chosen: ParityRuns,
) -> miette::Result<()> {
    let Some((backend, device)) = chosen.made_on.filter(|_| !chosen.rows.is_empty()) else {
        return Ok(());
    };
    let inputs: Vec<RunInput> = chosen.rows.iter().map(input_of).collect();
    let progress = Progress::new("parity", inputs.len() as u64);
    let repeated = truth.make_rows(&inputs, &|ended| progress.add(ended)).map_err(crate::run::unusable)?;
    let rows = chosen.rows.into_iter().zip(repeated);
    let rows = rows.map(|(first, second)| RepeatedRow { first, second }).collect();
    let mut provenance = truth.provenance();
    (provenance.backend, provenance.device) = (backend, device);
    write_repetition(&PARITY, &folder.path, &truth.ledger.schema, rows, &provenance, index).into_diagnostic()
}
