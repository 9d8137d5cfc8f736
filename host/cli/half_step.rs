//! Runs repeated at half the substep, so that the step size is checked and not believed.

use crate::farm::Farm;
use crate::folder::Folder;
use crate::parity::spread;
use crate::progress::Progress;
use crate::traces::input_of;
use miette::IntoDiagnostic;
use softdock_engine::{Choice, RunInput};
use softdock_kernels::metrics::flags;
use softdock_results::parity::{HALF_STEP, RepeatedRow, write_repetition};
use softdock_results::runs::RunRow;
use softdock_results::shards::ShardIndex;

/// Collects the runs to be repeated: evenly spread over the campaign, whoever made them.
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
    pub(crate) fn of(folder: &Folder, index: &ShardIndex) -> Self {
        let campaign = &folder.campaign;
        Self {
            wanted: (campaign.half_step_runs(), campaign.runs),
            shard_runs: campaign.execution.shard_runs,
            by_cpu: index.complete.values().map(|file| file.backend == "cpu").collect(),
            rows: Vec::new(),
        }
    }

    /// Keeps the row if its run is one of the chosen.
    pub(crate) fn see(&mut self, place: u64, row: &RunRow) {
        if spread(place, self.wanted.0, self.wanted.1) {
            let by_cpu = self.by_cpu.get((place / self.shard_runs) as usize) == Some(&true);
            self.rows.push((row.clone(), by_cpu || row.flags & flags::RETRIED != 0));
        }
    }
}

/// Makes the chosen runs in f64 at the campaign's substep and at half of it, and writes both; without any, no file.
pub(crate) fn write_half_step_of(
    folder: &Folder,
    truth: &mut Farm,
    index: &ShardIndex,
    chosen: HalfStepRuns,
) -> miette::Result<()> {
    if chosen.rows.is_empty() {
        return Ok(());
    }
    let inputs: Vec<RunInput> = chosen.rows.iter().map(|(row, _)| input_of(row)).collect();
    let in_f32: Vec<RunInput> =
        chosen.rows.iter().filter(|(_, in_f64)| !in_f64).map(|(row, _)| input_of(row)).collect();
    let mut repeated = truth.make_rows(&in_f32, &|_| true).map_err(crate::run::unusable)?.into_iter();
    let first = chosen.rows.into_iter().map(|(row, in_f64)| if in_f64 { Some(row) } else { repeated.next() });
    let first: Vec<RunRow> = first.flatten().collect();

    let halved = folder.campaign.at_half_step();
    let mut finer = Farm::open(&halved, Choice::Cpu).map_err(crate::run::unusable)?;
    let progress = Progress::new("half step", inputs.len() as u64);
    let second = finer.make_rows(&inputs, &|ended| progress.add(ended)).map_err(crate::run::unusable)?;
    let rows = first.into_iter().zip(second).map(|(first, second)| RepeatedRow { first, second }).collect();
    write_repetition(&HALF_STEP, &folder.path, &truth.ledger.schema, rows, &truth.provenance(), index).into_diagnostic()
}
