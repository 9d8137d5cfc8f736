//! Log of a drive, by softdock or another driver with the same columns: simulated parts, measured parts, and the wrench
//! between them.

use crate::data::grid::Finding;
use crate::data::table::{Gaps, Named, Wanted, column_names, is_parquet};
use crate::{DiagnosisError, Result};
use softdock_kernels::fields::{Bundle, Field, fields, from_slice};
use softdock_kernels::space::{Motion, Wrench};
use softdock_kernels::vector::Pose;
use softdock_results::Metadata;
use softdock_results::drive_log::open_drive_log;
use std::path::Path;

/// Fewest cycles of a run that can be judged.
const FEWEST: usize = 200;

/// One cycle of the run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cycle {
    /// Parts A and B as they were simulated when the cycle's command was sent, contact frame.
    pub(crate) simulated: [Motion<f64>; 2],
    /// Parts A and B where the robots were measured to hold them when the cycle began, contact frame.
    pub(crate) held: [Pose<f64>; 2],
    /// Wrench on part A about its origin, its axes, as the simulation took it: tare and weight taken off.
    pub(crate) wrench: Wrench<f64>,
}

/// The running part of a drive.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct DriveLog {
    /// The recording's name.
    pub(crate) name: String,
    /// Number of the run that was driven.
    pub(crate) run: Option<u64>,
    /// Hash of the campaign that it belongs to.
    pub(crate) campaign_hash: Option<String>,
    /// Length of a cycle \[s\].
    pub(crate) cycle: f64,
    /// Ticks of the simulation in a cycle.
    pub(crate) ticks: usize,
    /// Cycle by cycle; the first one is the last before the run began.
    pub(crate) cycles: Vec<Cycle>,
}

/// Columns of a pose: position and attitude.
const POSE: usize = 7;
/// Columns with the time of a row.
const PLACE: [&str; 2] = ["tick", "time_ns"];
/// Columns with the commands that met a limit; without them, none did.
const LIMITS: [&str; 2] = ["robot_1_limits", "robot_2_limits"];
/// What to do about a log that lacks a column.
const REMEDY: &str = "pass the log.parquet of `softdock drive`, or a CSV or Parquet file with the same columns: tick, \
    time_ns, simulated_part_a_..., simulated_part_b_..., part_a_..., part_b_..., ft_compensated_...";

impl DriveLog {
    /// Reads the log of a drive: the `log.parquet` of softdock, or a table with the same columns.
    ///
    /// # Errors
    /// A file that lacks a signal, a run that hardly began.
    pub(crate) fn read(path: &Path, findings: &mut Vec<Finding>) -> Result<Self> {
        let metadata = metadata(path);
        let value = |key: &str| metadata.iter().find(|pair| pair.0 == key).map(|pair| pair.1.clone());
        let table = Table::read(path)?;
        let name = name(path);
        let rows = table.running(path)?;
        let mut note = |what: String| findings.push(Finding { recording: name.clone(), what });
        let ticks = table.ticks_at(rows.start + 1);
        let whole = (rows.start + 1..rows.end).take_while(|row| table.ticks_at(*row) == ticks).last();
        let end = whole.map_or(rows.start, |row| row + 1);
        if end < rows.end {
            note(format!(
                "the log lacks cycles after {:.3} s of the run: the rest of the log is ignored",
                table.time(end)
            ));
        }
        let cut = (rows.start..end).filter(|row| table.limits.iter().any(|limits| limits[*row] > 0.0)).count();
        if cut > 0 {
            note(format!(
                "{cut} of {} commands met a limit: the robots received smaller commands than the simulation",
                end - rows.start
            ));
        }
        let cycles: Vec<Cycle> = (rows.start..end).map(|row| table.cycle(row)).collect();
        if cycles.len() < FEWEST {
            let what = format!("the run has {} cycles, too few for a diagnosis", cycles.len());
            return Err(DiagnosisError::log(path, None, what, format!("drive a run of at least {FEWEST} cycles")));
        }
        let cycle = (table.cell(1, end - 1) - table.cell(1, rows.start)) * 1e-9 / (cycles.len() - 1) as f64;
        let run = value("run").and_then(|run| run.parse().ok());
        Ok(Self { run, campaign_hash: value("campaign_hash"), cycle, ticks, cycles, name })
    }
}

/// Returns the metadata of a softdock log; empty for other drivers.
fn metadata(path: &Path) -> Metadata {
    let own = is_parquet(path).then(|| open_drive_log(path).ok()).flatten();
    own.map_or_else(Metadata::new, |(_, metadata)| metadata)
}

/// A log is called as its file; one that softdock left, as its folder.
fn name(path: &Path) -> String {
    let folder = path.parent().and_then(Path::file_name).filter(|_| path.file_name() == Some("log.parquet".as_ref()));
    folder.or(path.file_stem()).unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

/// The columns of a log that are looked at.
struct Table {
    columns: Vec<Vec<f64>>,
    /// Of each robot, where the log has them.
    limits: Vec<Vec<f64>>,
}

/// Names of a signal's columns in the log.
fn names<B: Bundle<f64>>(signal: &str) -> Vec<String> {
    fields::<f64, B>().iter().map(|field: &Field| format!("{signal}_{}", field.column())).collect()
}

impl Table {
    fn read(path: &Path) -> Result<Self> {
        let mut wanted: Vec<String> = PLACE.map(str::to_owned).into();
        for part in ["simulated_part_a", "simulated_part_b"] {
            wanted.extend(names::<Motion<f64>>(part));
        }
        for part in ["part_a", "part_b"] {
            // A pose is what a motion begins with.
            wanted.extend(names::<Motion<f64>>(part).into_iter().take(POSE));
        }
        wanted.extend(names::<Wrench<f64>>("ft_compensated"));
        let needed = wanted.len();
        let known = column_names(path)?;
        wanted.extend(LIMITS.map(str::to_owned).into_iter().filter(|limits| known.contains(limits)));
        let columns = wanted.iter().map(|name| ("", name.as_str())).collect();
        let wanted = Wanted { columns, named: Named::Agreed(REMEDY), gaps: Gaps::Kept, order: &[] };
        let mut columns = wanted.read(path)?.columns;
        let limits = columns.split_off(needed);
        Ok(Self { columns, limits })
    }

    fn cell(&self, column: usize, row: usize) -> f64 {
        self.columns[column][row]
    }

    /// Ticks of the simulation in the cycle of a row.
    fn ticks_at(&self, row: usize) -> usize {
        (self.cell(0, row) - self.cell(0, row - 1)).max(0.0) as usize
    }

    /// Since the start of the drive \[s\].
    fn time(&self, row: usize) -> f64 {
        self.cell(1, row) * 1e-9
    }

    /// From the last row before the run to the last one of it.
    fn running(&self, path: &Path) -> Result<std::ops::Range<usize>> {
        let rows = self.columns[0].len();
        let runs = |row: &usize| self.ticks_at(*row) > 0;
        let Some(first) = (1..rows).find(runs) else {
            let remedy = "see its evidence.csv for why the run did not begin";
            return Err(DiagnosisError::log(path, None, "the drive ended before its run began", remedy));
        };
        let end = (first..rows).find(|row| !runs(row)).unwrap_or(rows);
        let whole = |row: &usize| self.columns.iter().all(|column| column[*row].is_finite());
        if let Some(row) = (first - 1..end).find(|row| !whole(row)) {
            let remedy = "record parts and wrench in every cycle of the run";
            return Err(DiagnosisError::log(path, None, format!("row {} lacks a signal", row + 1), remedy));
        }
        Ok(first - 1..end)
    }

    fn cycle(&self, row: usize) -> Cycle {
        let mut at = PLACE.len();
        Cycle {
            simulated: [self.bundle(&mut at, row), self.bundle(&mut at, row)],
            held: [self.pose(&mut at, row), self.pose(&mut at, row)],
            wrench: self.bundle(&mut at, row),
        }
    }

    fn pose(&self, at: &mut usize, row: usize) -> Pose<f64> {
        Pose { position: self.bundle(at, row), attitude: self.bundle(at, row) }
    }

    /// The next columns of a row as a bundle.
    fn bundle<B: Bundle<f64>>(&self, at: &mut usize, row: usize) -> B {
        let width = fields::<f64, B>().len();
        let values: Vec<f64> = (*at..*at + width).map(|column| self.cell(column, row)).collect();
        *at += width;
        from_slice(&values)
    }
}
