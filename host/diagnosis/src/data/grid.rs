//! Recording of a rig: its signals in SI units on an even grid, with findings about the conversion.

use crate::data::clock::{EvenRecording, EvenSegment, FEWEST_BETWEEN_GAPS, SignalTable};
use crate::data::outliers::{isolated, isolated_positions};
use crate::data::quality::RecordingQuality;
use crate::data::stamps::with_clock;
use crate::data::table::{Gaps, Named, ReadTable, Wanted};
use crate::{DiagnosisError, Result};
use softdock_campaign::Rig;
use softdock_campaign::rig::RigModel;
use std::collections::BTreeMap;
use std::path::Path;

/// Fewest samples of a piece: less holds no motion that could be judged.
const FEWEST: usize = 200;
/// Fewest samples of a toss, which is over in half a second.
const FEWEST_OF_A_TOSS: usize = 30;
/// Damaged cells of a signal that are listed; the rest is counted.
const LISTED: usize = 3;

/// Piece of a recording without gaps, at equal steps, in SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct Piece {
    /// Name of the experiment: recordings of one command share it.
    pub experiment: String,
    /// Number of the repeat, from 1.
    pub repeat: usize,
    /// Clock at the first sample \[s\].
    pub start: f64,
    /// Time from the recording's first sample to that of the piece \[s\].
    pub offset: f64,
    /// Sampling period \[s\].
    pub step: f64,
    /// Signals by name.
    pub signals: BTreeMap<String, Vec<f64>>,
}

impl Piece {
    /// Returns the clock at the end of the last sample's period \[s\].
    pub fn end(&self) -> f64 {
        self.start + self.samples() as f64 * self.step
    }

    /// Returns the samples `from..to`; `None` if they are too few.
    pub fn between(&self, from: usize, to: usize) -> Option<Self> {
        let cut = |(name, values): (&String, &Vec<f64>)| (name.clone(), values[from..to].to_vec());
        // A segment between gaps may be shorter than a recording.
        let fewest = if self.samples() < FEWEST { FEWEST_BETWEEN_GAPS } else { FEWEST };
        (to >= from + fewest).then(|| Self {
            start: self.start + from as f64 * self.step,
            offset: self.offset + from as f64 * self.step,
            signals: self.signals.iter().map(cut).collect(),
            ..self.clone()
        })
    }

    /// Returns the number of samples.
    pub fn samples(&self) -> usize {
        self.signals.values().next().map_or(0, Vec::len)
    }
}

/// Finding about a recording.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Finding {
    /// The recording's name.
    pub recording: String,
    /// Finding, and its treatment.
    pub what: String,
}

/// Recording that was read.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ReadRecording {
    /// Its pieces without gaps.
    pub(crate) pieces: Vec<Piece>,
    /// Findings about the conversion.
    pub(crate) findings: Vec<Finding>,
    /// Quality of its signals as recorded, of each experiment in it.
    pub(crate) quality: Vec<RecordingQuality>,
}

/// Reads a recording: `NAME_REPEAT.csv` is a repeat of the experiment `NAME`; where a column numbers the experiments, one
/// file holds several.
///
/// # Errors
/// A file that cannot be read, a column that is missing, a clock that does not run, too few samples.
pub fn read(path: &Path, rig: &Rig) -> Result<(Vec<Piece>, Vec<Finding>)> {
    read_with_quality(path, rig).map(|read| (read.pieces, read.findings))
}

/// Reads a recording as [`read`] does, with its quality.
pub(crate) fn read_with_quality(path: &Path, rig: &Rig) -> Result<ReadRecording> {
    if !rig.log.contains_key("t") {
        let remedy = "add it: \"t\" = { column = \"...\", unit = \"s\" }";
        return Err(DiagnosisError::log(path, None, format!("[log] of {} names no column for `t`", rig.file), remedy));
    }
    let columns = rig.log.iter().map(|(signal, column)| (signal.as_str(), column.name.as_str())).collect();
    let named = Named::By(&rig.file);
    let table = Wanted { columns, named, gaps: Gaps::Kept, order: &rig.column_order }.read(path)?;
    let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let mut findings = FindingLog { recording: name, findings: Vec::new() };
    table.assumed.iter().for_each(|what| findings.note(what.clone()));
    let mut signals = in_si(rig, &table, &mut findings);
    let time = signals.remove("t").expect("asked for above");
    let fewest = if matches!(rig.plant, RigModel::Toss(_)) { FEWEST_OF_A_TOSS } else { FEWEST };
    let rows = time.len();
    let (mut pieces, mut quality) = (Vec::new(), Vec::new());
    for (name, time, signals) in experiments(path, time, signals)? {
        let (time, signals, notes) = with_clock(time, signals);
        notes.into_iter().for_each(|note| findings.note(note));
        let even = EvenRecording::of(&time, &signals, fewest)
            .map_err(|(what, remedy)| DiagnosisError::log(path, None, what, remedy))?;
        quality.push(RecordingQuality::of(&findings.recording, time.len(), &signals, &even));
        even.notes.into_iter().for_each(|note| findings.note(note));
        let ((experiment, repeat), step) = (name, even.step);
        let piece = |segment: EvenSegment| {
            let EvenSegment { start, signals } = segment;
            Piece { experiment: experiment.clone(), repeat, start, offset: start - time[0], step, signals }
        };
        pieces.extend(even.segments.into_iter().map(piece));
    }
    if pieces.is_empty() {
        let what = format!("{rows} rows contain no {fewest} consecutive samples without a gap");
        return Err(DiagnosisError::log(path, None, what, "record longer, or without interruptions"));
    }
    Ok(ReadRecording { pieces, findings: findings.findings, quality })
}

/// Returns the signals in SI units, the clock among them, with isolated outliers as missing numbers, which are noted.
fn in_si(rig: &Rig, table: &ReadTable, findings: &mut FindingLog) -> SignalTable {
    let mut signals = SignalTable::new();
    for ((name, column), recorded) in rig.log.iter().zip(&table.columns) {
        // Dates are in seconds already, whatever the unit of the column.
        let factor = if table.has_dates && name == "t" { 1.0 } else { column.factor };
        let mut values: Vec<f64> = recorded.iter().map(|value| value * factor + column.offset).collect();
        let found = match (name.as_str(), column.unit) {
            ("t" | "experiment", _) => Vec::new(),
            (_, "m" | "rad") => isolated_positions(&values),
            _ => isolated(&values),
        };
        if !found.is_empty() {
            let cell = |row: &usize| format!("{}: {}", table.place(*row), recorded[*row]);
            let listed: Vec<String> = found.iter().take(LISTED).map(cell).collect();
            let more = if found.len() > LISTED { ", ..." } else { "" };
            findings.note(format!(
                "{} isolated outliers in column `{}` are treated as missing ({}{more})",
                found.len(),
                column.name,
                listed.join(", ")
            ));
            found.into_iter().for_each(|row| values[row] = f64::NAN);
        }
        signals.insert(name.clone(), values);
    }
    signals
}

/// An experiment of a file: its name and repeat, its clock and its signals.
type Experiment = ((String, usize), Vec<f64>, SignalTable);

/// The experiments that a file holds, each with its name and repeat, its clock and its signals: one by the file's name, or
/// as many as a column numbers.
///
/// # Errors
/// A number that is none.
fn experiments(path: &Path, time: Vec<f64>, mut signals: SignalTable) -> Result<Vec<Experiment>> {
    let Some(numbers) = signals.remove("experiment") else {
        return Ok(vec![(numbered(path), time, signals)]);
    };
    if let Some(row) = numbers.iter().position(|number| *number < 0.0 || number.fract() != 0.0 || number.is_nan()) {
        let what = format!("row {}: the experiment number {} is not an integer", row + 1, numbers[row]);
        return Err(DiagnosisError::log(path, None, what, "number the experiments from 0 or 1 on in that column"));
    }
    let mut bounds: Vec<usize> = (1..numbers.len()).filter(|row| numbers[*row] != numbers[row - 1]).collect();
    bounds.insert(0, 0);
    bounds.push(numbers.len());
    let cut = |pair: &[usize]| {
        let (from, to) = (pair[0], pair[1]);
        let own = signals.iter().map(|(name, values)| (name.clone(), values[from..to].to_vec())).collect();
        ((format!("{}", numbers[from]), 1), time[from..to].to_vec(), own)
    };
    Ok(bounds.windows(2).filter(|pair| pair[0] < pair[1]).map(cut).collect())
}

/// Experiment and repeat from a file's name.
fn numbered(path: &Path) -> (String, usize) {
    let stem = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    let split = stem.rsplit_once('_').and_then(|(name, number)| Some((name.to_owned(), number.parse().ok()?)));
    split.unwrap_or((stem, 1))
}

struct FindingLog {
    recording: String,
    findings: Vec<Finding>,
}

impl FindingLog {
    fn note(&mut self, what: String) {
        self.findings.push(Finding { recording: self.recording.clone(), what });
    }
}
