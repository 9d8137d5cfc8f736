//! Replay of a run in f64, from exactly the inputs of its row.

use crate::error::Result;
use crate::folder::ResultsFolder;
use crate::run_engine::RunEngine;
use crate::traces::record;
use softdock_analysis::number::with_unit;
use softdock_kernels::metrics::flags;
use softdock_results::runs::{RunRow, RunsSchema};
use softdock_results::traces::write_trace_to;
use softdock_results::{Column, Table, Values, content_hash};
use std::path::{Path, PathBuf};

/// Replayed run.
#[derive(Clone, Debug)]
pub struct ReplayedRun {
    /// Number of the run.
    pub run: u64,
    /// Columns whose bits differ, each with both values.
    pub differences: Vec<String>,
    /// Whether the row was made in f64, so that nothing may differ.
    pub is_f64: bool,
    /// Path of the time history.
    pub history: PathBuf,
}

impl ReplayedRun {
    /// Returns whether the row differs although it was made in f64.
    pub fn is_wrong(&self) -> bool {
        self.is_f64 && !self.differences.is_empty()
    }

    /// Returns the result, each column that differs, and the path of the time history.
    pub fn text(&self) -> String {
        let result = match (self.differences.is_empty(), self.is_f64) {
            (true, _) => "equal, bit for bit",
            (false, true) => "DIFFERENT from the row, which the same f64 code computed",
            (false, false) => "the row was computed in f32; the differences to f64 are",
        };
        let differences: String = self.differences.iter().map(|line| format!("  {line}\n")).collect();
        format!("run {}: {result}\n{differences}time history  {}", self.run, self.history.display())
    }
}

/// Repeats a run of a results folder in f64 and writes its time history to `out`, or below `replays/`.
///
/// # Errors
/// If the folder cannot be read, or does not contain the run.
pub fn replay_run(results: &Path, run: u64, out: Option<&Path>) -> Result<ReplayedRun> {
    let folder = ResultsFolder::open(results)?;
    folder.refuse_variants()?;
    let index = folder.shards()?;
    let row = index.read_run(run)?.ok_or_else(|| folder.no_run(run))?;
    let shard = (folder.campaign.place_of(run).unwrap_or(run) / folder.campaign.execution.shard_runs) as u32;
    let by_cpu = index.complete.get(&shard).is_some_and(|file| file.backend == "cpu");
    let reference = RunEngine::reference(&folder.campaign);
    let (finished, trace) = record(
        &reference.builder,
        folder.campaign.traces.every_ticks,
        reference.builder.input_of(&row)?,
        "replay".to_owned(),
    );
    let mut again = reference.builder.row(&finished);
    again.flags |= row.flags & flags::RETRIED;
    let history = out.map_or_else(|| folder.path.join("replays").join(format!("run={run:09}.parquet")), Path::to_owned);
    write_trace_to(&history, &trace, &reference.provenance())?;
    let differences = differences(&reference.builder.schema, &row, &again);
    Ok(ReplayedRun { run, differences, is_f64: by_cpu || row.flags & flags::RETRIED != 0, history })
}

/// The columns whose bits differ, each with both values.
fn differences(schema: &RunsSchema, row: &RunRow, again: &RunRow) -> Vec<String> {
    let [one, two] = [row, again].map(|row| schema.table(std::slice::from_ref(row)));
    let bits = |column: &Column| content_hash(&Table { columns: vec![column.clone()] });
    let pairs = one.columns.iter().zip(&two.columns).filter(|(one, two)| bits(one) != bits(two));
    pairs.map(|(one, two)| format!("{}: {} in the row, {} now", one.name, shown(one), shown(two))).collect()
}

/// The only value of a column.
fn shown(column: &Column) -> String {
    match &column.values {
        Values::F64(values) => values[0].map_or("none".to_owned(), |value| with_unit(value, &column.unit)),
        Values::Bool(values) => format!("{:?}", values[0]),
        Values::U32(values) => values[0].to_string(),
        Values::U64(values) => values[0].to_string(),
        Values::I64(values) => values[0].to_string(),
        Values::Words { .. } => column.values.word(0).unwrap_or_default().to_owned(),
    }
}
