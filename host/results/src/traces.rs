//! Time histories of kept runs: `traces/NAME.parquet`, long form, one row per instant.

use std::path::{Path, PathBuf};

use crate::read::TableReader;
use crate::shards::{Provenance, ShardIndex, parquet_files};
use crate::table::{Column, ColumnKind, Table, Values};
use crate::write::write_table;
use crate::{Result, ResultsError};

/// Version of the trace table.
pub const TRACE_SCHEMA: &str = "trace/1";

/// Run number of the nominal case, which is no draw of the campaign.
pub const NOMINAL_RUN: u64 = u64::MAX;

/// One quantity over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Signal {
    /// Column name with its unit as a suffix (`hil_contact_force_n`).
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// What it means, with its frame.
    pub description: String,
    /// One value per instant.
    pub values: Vec<Option<f64>>,
}

/// The time history of one run.
#[derive(Clone, Debug, PartialEq)]
pub struct Trace {
    /// Run number, or [`NOMINAL_RUN`].
    pub run: u64,
    /// Why it was kept: `nominal`, `worst ARM-CON-110`, `random`, `replay`, `failed`, `invalid`.
    pub kept_as: String,
    /// Instants, s.
    pub time: Vec<f64>,
    /// The signals.
    pub signals: Vec<Signal>,
}

impl Trace {
    /// Path of the trace below a results folder.
    pub fn path(&self, results: &Path) -> PathBuf {
        let name = match self.run {
            NOMINAL_RUN => "nominal.parquet".to_owned(),
            run => format!("run={run:09}.parquet"),
        };
        results.join("traces").join(name)
    }

    /// A signal's values by name.
    pub fn signal(&self, name: &str) -> Option<&[Option<f64>]> {
        self.signals.iter().find(|signal| signal.name == name).map(|signal| signal.values.as_slice())
    }

    fn table(&self) -> Table {
        let column = |name: &str, unit: &str, description: &str, kind, values| Column {
            name: name.to_owned(),
            unit: unit.to_owned(),
            description: description.to_owned(),
            source: "engine".to_owned(),
            kind,
            values,
        };
        let run = format!("run number; {NOMINAL_RUN} is the nominal case");
        let mut columns = vec![
            column("run", "1", &run, ColumnKind::Key, Values::U64(vec![self.run; self.time.len()])),
            column(
                "t_s",
                "s",
                "time since the start of the run",
                ColumnKind::Key,
                Values::F64(self.time.iter().copied().map(Some).collect()),
            ),
        ];
        columns.extend(self.signals.iter().map(|signal| {
            let values = Values::F64(signal.values.clone());
            column(&signal.name, &signal.unit, &signal.description, ColumnKind::Signal, values)
        }));
        Table { columns }
    }
}

/// Writes a trace to a file of the user's choice.
///
/// # Errors
/// If the file cannot be written.
pub fn write_trace_to(path: &Path, trace: &Trace, provenance: &Provenance) -> Result<()> {
    write_with(path, trace, provenance, [])
}

/// Writes a trace to its place below a results folder, for runs of the shards there.
///
/// # Errors
/// If the file cannot be written.
pub fn write_trace(results: &Path, trace: &Trace, provenance: &Provenance, index: &ShardIndex) -> Result<()> {
    write_with(&trace.path(results), trace, provenance, index.stated_rows())
}

fn write_with(
    path: &Path,
    trace: &Trace,
    provenance: &Provenance,
    origin: impl IntoIterator<Item = (String, String)>,
) -> Result<()> {
    let mut metadata = provenance.metadata(TRACE_SCHEMA);
    metadata.push(("softdock.kept_as".to_owned(), trace.kept_as.clone()));
    metadata.extend(origin);
    write_table(path, &trace.table(), &metadata)
}

/// Reads one trace file.
///
/// # Errors
/// If the file is damaged or is no trace.
pub fn read_trace(path: &Path) -> Result<Trace> {
    of_reader(path, TableReader::open(path)?)
}

fn of_reader(path: &Path, reader: TableReader) -> Result<Trace> {
    let kept_as = reader.metadata().remove("softdock.kept_as").unwrap_or_default();
    let table = reader.read()?;
    let lacking = |name: &str| ResultsError::contract(path, format!("no column `{name}`"));
    let run = *table.u64s("run").and_then(<[u64]>::first).ok_or_else(|| lacking("run"))?;
    let time = table.f64s("t_s").ok_or_else(|| lacking("t_s"))?.iter().map(|time| time.unwrap_or(f64::NAN)).collect();
    let signals = table.columns.into_iter().filter_map(|column| match (column.kind, column.values) {
        (ColumnKind::Signal, Values::F64(values)) => {
            Some(Signal { name: column.name, unit: column.unit, description: column.description, values })
        }
        _ => None,
    });
    Ok(Trace { run, kept_as, time, signals: signals.collect() })
}

/// The traces of a results folder.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Traces {
    /// Those of runs of the shards there, by file name.
    pub kept: Vec<Trace>,
    /// Files that are none, each with the reason.
    pub foreign: Vec<(PathBuf, String)>,
}

/// Reads the traces of a results folder; damaged files, and those of other runs than the shards', are listed apart.
///
/// # Errors
/// If the folder cannot be read.
pub fn read_traces(results: &Path, index: &ShardIndex) -> Result<Traces> {
    let mut traces = Traces::default();
    for path in parquet_files(&results.join("traces"))? {
        let trace = TableReader::open(&path).and_then(|reader| {
            index.check_origin(&path, &reader.metadata(), TRACE_SCHEMA)?;
            let trace = of_reader(&path, reader)?;
            let is_named = trace.path(results) == path;
            if is_named { Ok(trace) } else { Err(ResultsError::contract(&path, "its name is not that of its run")) }
        });
        match trace {
            Ok(trace) => traces.kept.push(trace),
            Err(error) => traces.foreign.push((path, error.to_string())),
        }
    }
    Ok(traces)
}
