//! What the model expects of a drive: the same draw on facilities as the campaign disperses them.

use crate::words::refuse;
use miette::IntoDiagnostic;
use rayon::prelude::*;
use softdock_campaign::Campaign;
use softdock_campaign::criteria::succeeds;
use softdock_kernels::fields::{fields, to_vec};
use softdock_kernels::metrics::Metrics;
use softdock_kernels::params::Params;
use softdock_kernels::philox;
use softdock_realtime::drive::core::Task;
use softdock_realtime::drive::prediction::{Expected, expect};
use softdock_realtime::log::codes::StopCause;
use softdock_realtime::log::export::{Cells, cells};
use softdock_realtime::log::reader::read_log;
use softdock_realtime::log::record::CycleRecord;
use softdock_realtime::time::Nanos;
use softdock_results::Values;
use softdock_results::drive_log::{signal, write_drive_log};
use std::path::Path;

/// Metrics that a facility does not measure, or that say nothing of a single run.
const UNSEEN: [&str; 9] = [
    "end_time",
    "peak_depth",
    "linear_momentum_error",
    "angular_momentum_error",
    "tracking_gain",
    "tracking_lag",
    "tracking_error",
    "tracking_overshoot",
    "restitution",
];
/// Rows of a Parquet part.
const PART: usize = 8192;

/// A metric of the run beside its 95 % band.
pub(crate) struct Line {
    pub(crate) name: String,
    pub(crate) unit: &'static str,
    pub(crate) value: f64,
    pub(crate) lo: f64,
    pub(crate) hi: f64,
}

impl Line {
    /// Whether the run is as the model expects.
    pub(crate) fn inside(&self) -> bool {
        (self.lo..=self.hi).contains(&self.value)
    }

    pub(crate) fn json(&self) -> serde_json::Value {
        let Self { name, unit, value, lo, hi } = self;
        serde_json::json!({ "name": name, "unit": unit, "value": value, "lo": lo, "hi": hi, "inside": self.inside() })
    }
}

/// The prediction of a drive.
pub(crate) struct Band {
    /// Share of the predictions that succeed.
    pub(crate) success: f64,
    /// How many there are.
    pub(crate) runs: u64,
    pub(crate) lines: Vec<Line>,
}

/// Drives the task on facilities of other draws, and sets the run's metrics beside what came of it.
pub(crate) fn compare(
    campaign: &Campaign,
    task: &Task,
    cycle: Nanos,
    metrics: &Metrics<f64>,
    runs: u64,
) -> miette::Result<Band> {
    let key = philox::key(campaign.seed);
    let all: Vec<(Metrics<f64>, bool)> = (0..runs)
        .into_par_iter()
        .map(|k| {
            // The draws behind this one, so that the same question has the same answer.
            let facility = campaign.draw((task.run + 1 + k) % campaign.runs).params;
            expect(task, key, &facility, cycle).map(|expected| (expected.metrics, passes(task, &expected)))
        })
        .collect::<Result<_, _>>()
        .into_diagnostic()?;
    let columns: Vec<Vec<f64>> = all.iter().map(|(metrics, _)| to_vec(metrics)).collect();
    let lines = fields::<f64, Metrics<f64>>().into_iter().zip(to_vec(metrics)).enumerate();
    let seen = |name: &str| !(UNSEEN.contains(&name) || name.starts_with("peak_") && name.ends_with("_time"));
    let lines = lines.filter(|(_, (field, _))| seen(&field.name)).map(|(i, (field, value))| {
        let mut seen: Vec<f64> = columns.iter().map(|row| row[i]).collect();
        seen.sort_by(f64::total_cmp);
        let at = |share: f64| seen[((seen.len() - 1) as f64 * share).round() as usize];
        Line { name: field.name, unit: field.unit, value, lo: at(0.025), hi: at(0.975) }
    });
    let success = all.iter().filter(|(_, passes)| *passes).count() as f64 / runs as f64;
    Ok(Band { success, runs, lines: lines.collect() })
}

/// Whether a drive came to its end and meets every criterion of the task.
fn passes(task: &Task, drive: &Expected) -> bool {
    drive.last.cause == StopCause::Completed && succeeds(&task.plant.task, &drive.metrics)
}

/// The parameters of a draw by their names.
pub(crate) fn parameters(params: &Params<f64>) -> serde_json::Map<String, serde_json::Value> {
    let fields = fields::<f64, Params<f64>>().into_iter().zip(to_vec(params));
    fields.map(|(field, value)| (field.name, value.into())).collect()
}

/// Writes a log's records as Parquet, one row per cycle.
pub(crate) fn export(log: &Path, parquet: &Path) -> miette::Result<()> {
    let log = read_log(log).into_diagnostic()?;
    if log.records.is_empty() {
        return Err(refuse("the log holds no cycle", "nothing was driven: see the evidence"));
    }
    let metadata: Vec<(String, String)> = log.prologue.provenance.into_iter().collect();
    write(parquet, &log.records, &metadata)
}

/// Writes records as Parquet, with what is said of them.
pub(crate) fn write(parquet: &Path, records: &[CycleRecord], metadata: &[(String, String)]) -> miette::Result<()> {
    let parts = records.chunks(PART).map(|records| Ok(table(records)));
    write_drive_log(parquet, parts, metadata).into_diagnostic()?;
    Ok(())
}

fn table(records: &[CycleRecord]) -> softdock_results::Table {
    let columns = cells(records).into_iter().map(|(column, cells)| {
        let values = match cells {
            Cells::Real(cells) => Values::F64(cells.into_iter().map(|v| v.is_finite().then_some(v)).collect()),
            Cells::Signed(cells) => Values::I64(cells),
            Cells::Whole(cells) => Values::U64(cells),
            Cells::Word(cells) => Values::U32(cells),
            Cells::Code(words, cells) => Values::words(words, cells),
        };
        signal(&column.name, column.unit, &column.meaning, values)
    });
    softdock_results::Table { columns: columns.collect() }
}
