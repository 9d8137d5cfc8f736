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
use std::ops::Range;
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
    /// Parts A and B by the commands that the robots received in the cycle, contact frame, if the log has them.
    pub(crate) commanded: Option<[Pose<f64>; 2]>,
    /// Wrench on part A about its origin, its axes, as the simulation took it: tare and weight taken off.
    pub(crate) wrench: Wrench<f64>,
}

/// The running part of a drive; of one that ended before its run began, the move of the robots to the start.
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
    /// Whether the run began: before that the parts do not touch, and the sensor has no tare.
    pub(crate) has_run: bool,
    /// Cycle by cycle; the first one is the last before the run, or the move to the start, began.
    pub(crate) cycles: Vec<Cycle>,
}

/// Columns of a pose: position and attitude.
const POSE: usize = 7;
/// Columns of a wrench: force and moment.
const WRENCH: usize = 6;
/// Columns with the time of a row.
const PLACE: [&str; 2] = ["tick", "time_ns"];
/// Columns with the commands that met a limit; without them, none did.
const LIMITS: [&str; 2] = ["robot_1_limits", "robot_2_limits"];
/// Signals with the commands that the robots received, which not every driver logs.
const COMMANDED: [&str; 2] = ["commanded_part_a", "commanded_part_b"];
/// What to do about a log that lacks a column.
const REMEDY: &str = "pass the log.parquet of `softdock drive`, or a CSV or Parquet file with the same columns: tick, \
    time_ns, simulated_part_a_..., simulated_part_b_..., part_a_..., part_b_..., ft_compensated_...";

impl DriveLog {
    /// Reads the log of a drive: the `log.parquet` of softdock, or a table with the same columns. `tick` is the tick of the
    /// simulation \[s\].
    ///
    /// # Errors
    /// A file that lacks a signal, a run that hardly began.
    pub(crate) fn read(path: &Path, tick: f64, findings: &mut Vec<Finding>) -> Result<Self> {
        let metadata = metadata(path);
        let value = |key: &str| metadata.iter().find(|pair| pair.0 == key).map(|pair| pair.1.clone());
        let table = Table::read(path)?;
        let name = name(path);
        let running = table.running(path)?;
        let has_run = running.is_some();
        let rows = match running {
            Some(rows) => rows,
            None => table.moving_to_start(path)?,
        };
        let mut note = |what: String| findings.push(Finding { recording: name.clone(), what });
        if !has_run {
            note("the drive ended before its run began: the move of the robots to the start is judged".to_owned());
        }
        let own = if has_run { table.ticks_at(rows.start + 1) } else { 0 };
        let whole = (rows.start + 1..rows.end).take_while(|row| table.ticks_at(*row) == own).last();
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
        let cycles: Vec<Cycle> = (rows.start..end).map(|row| table.cycle(row, has_run)).collect();
        if cycles.len() < FEWEST {
            let what = format!("the run has {} cycles, too few for a diagnosis", cycles.len());
            return Err(DiagnosisError::log(path, None, what, format!("drive a run of at least {FEWEST} cycles")));
        }
        let cycle = (table.cell(1, end - 1) - table.cell(1, rows.start)) * 1e-9 / (cycles.len() - 1) as f64;
        let ticks = if has_run { own } else { (cycle / tick).round().max(1.0) as usize };
        let run = value("run").and_then(|run| run.parse().ok());
        Ok(Self { run, campaign_hash: value("campaign_hash"), cycle, ticks, has_run, cycles, name })
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
    /// Columns of the poses of both parts by the robots' commands, where the log has them.
    commanded: Vec<Vec<f64>>,
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
        // A pose is what a motion begins with.
        let of_part = |signal: &str| names::<Motion<f64>>(signal).into_iter().take(POSE).collect::<Vec<String>>();
        for part in ["part_a", "part_b"] {
            wanted.extend(of_part(part));
        }
        wanted.extend(names::<Wrench<f64>>("ft_compensated"));
        let needed = wanted.len();
        let known = column_names(path)?;
        let commanded: Vec<String> = COMMANDED.into_iter().flat_map(of_part).collect();
        let commanded = if commanded.iter().all(|name| known.contains(name)) { commanded } else { Vec::new() };
        wanted.extend(commanded.iter().cloned());
        wanted.extend(LIMITS.map(str::to_owned).into_iter().filter(|limits| known.contains(limits)));
        let columns = wanted.iter().map(|name| ("", name.as_str())).collect();
        let wanted = Wanted { columns, named: Named::Agreed(REMEDY), gaps: Gaps::Kept, order: &[] };
        let mut columns = wanted.read(path)?.columns;
        let limits = columns.split_off(needed + commanded.len());
        let commanded = columns.split_off(needed);
        Ok(Self { columns, commanded, limits })
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

    /// From the last row before the run to the last one of it; `None` if no run began.
    fn running(&self, path: &Path) -> Result<Option<Range<usize>>> {
        let rows = self.columns[0].len();
        let runs = |row: &usize| self.ticks_at(*row) > 0;
        let Some(first) = (1..rows).find(runs) else {
            return Ok(None);
        };
        let end = (first..rows).find(|row| !runs(row)).unwrap_or(rows);
        let whole = |row: &usize| self.columns.iter().all(|column| column[*row].is_finite());
        if let Some(row) = (first - 1..end).find(|row| !whole(row)) {
            let remedy = "record parts and wrench in every cycle of the run";
            return Err(DiagnosisError::log(path, None, format!("row {} lacks a signal", row + 1), remedy));
        }
        Ok(Some(first - 1..end))
    }

    /// From the last row before the robots' first motion to the last one with a command.
    fn moving_to_start(&self, path: &Path) -> Result<Range<usize>> {
        let is_whole = |row: usize| {
            let poses = &self.columns[..self.columns.len() - WRENCH];
            !self.commanded.is_empty() && poses.iter().chain(&self.commanded).all(|column| column[row].is_finite())
        };
        let is_moving = |row: &usize| {
            is_whole(row - 1) && is_whole(*row) && self.commanded.iter().any(|way| way[*row] != way[*row - 1])
        };
        let rows = self.columns[0].len();
        let Some(first) = (1..rows).find(is_moving) else {
            let remedy = "see its evidence.csv for why the run did not begin";
            return Err(DiagnosisError::log(path, None, "the drive ended before its run began", remedy));
        };
        let end = (first..rows).find(|row| !is_whole(*row)).unwrap_or(rows);
        Ok(first - 1..end)
    }

    /// The cycle of a row. Before the run there is no wrench without its tare.
    fn cycle(&self, row: usize, has_run: bool) -> Cycle {
        let mut at = PLACE.len();
        let values: Vec<f64> = self.columns.iter().map(|column| column[row]).collect();
        let commanded: Vec<f64> = self.commanded.iter().map(|column| column[row]).collect();
        let is_whole = !commanded.is_empty() && commanded.iter().all(|value| value.is_finite());
        Cycle {
            simulated: [bundle(&values, &mut at), bundle(&values, &mut at)],
            held: [pose(&values, &mut at), pose(&values, &mut at)],
            wrench: if has_run { bundle(&values, &mut at) } else { Wrench::zero() },
            commanded: is_whole.then(|| {
                let mut at = 0;
                [pose(&commanded, &mut at), pose(&commanded, &mut at)]
            }),
        }
    }
}

/// The next values as a pose.
fn pose(values: &[f64], at: &mut usize) -> Pose<f64> {
    Pose { position: bundle(values, at), attitude: bundle(values, at) }
}

/// The next values as a bundle.
fn bundle<B: Bundle<f64>>(values: &[f64], at: &mut usize) -> B {
    let width = fields::<f64, B>().len();
    let own = &values[*at..*at + width];
    *at += width;
    from_slice(own)
}
