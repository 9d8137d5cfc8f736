//! Recording of a rig: its signals in SI units on an even grid, with findings about the conversion.

use crate::data::table::{Gaps, Named, Wanted};
use crate::{DiagnosisError, Result};
use softdock_campaign::Rig;
use softdock_campaign::rig::RigModel;
use std::collections::BTreeMap;
use std::path::Path;

/// Fewest samples of a piece: less holds no motion that could be judged.
const FEWEST: usize = 200;
/// Fewest samples of a toss, which is over in half a second.
const FEWEST_OF_A_TOSS: usize = 30;
/// A pause of the clock longer than this many steps cuts a recording; a shorter one is bridged.
const LONGEST_GAP: f64 = 3.5;
/// Steps that differ from the usual one by this share of it are uneven.
const JITTER: f64 = 0.02;

/// Piece of a recording without gaps, at equal steps, in SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct Piece {
    /// Name of the experiment: recordings of one command share it.
    pub experiment: String,
    /// Number of the repeat, from 1.
    pub repeat: usize,
    /// Clock at the first sample \[s\].
    pub start: f64,
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
        (to >= from + FEWEST).then(|| Self {
            start: self.start + from as f64 * self.step,
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

/// Reads a recording: `NAME_REPEAT.csv` is a repeat of the experiment `NAME`; where a column numbers the experiments, one
/// file holds several.
///
/// # Errors
/// A file that cannot be read, a column that is missing, a clock that does not run, too few samples.
pub fn read(path: &Path, rig: &Rig) -> Result<(Vec<Piece>, Vec<Finding>)> {
    if !rig.log.contains_key("t") {
        let remedy = "add it: \"t\" = { column = \"...\", unit = \"s\" }";
        return Err(DiagnosisError::log(path, None, format!("[log] of {} names no column for `t`", rig.file), remedy));
    }
    let columns = rig.log.iter().map(|(signal, column)| (signal.as_str(), column.name.as_str())).collect();
    let named = Named::By(&rig.file);
    let table = Wanted { columns, named, gaps: Gaps::Kept, order: &rig.column_order }.read(path)?;
    let in_si = |((name, column), values): ((&String, &softdock_campaign::columns::RecordedColumn), Vec<f64>)| {
        // Dates are in seconds already, whatever the unit of the column.
        let factor = if table.has_dates && name == "t" { 1.0 } else { column.factor };
        let values = values.iter().map(|value| value * factor + column.offset).collect();
        (name.clone(), values)
    };
    let mut signals: BTreeMap<String, Vec<f64>> =
        rig.log.iter().zip(table.columns.iter().cloned()).map(in_si).collect();
    let time = signals.remove("t").expect("asked for above");
    let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let mut findings = FindingLog { recording: name, findings: Vec::new() };
    table.assumed.into_iter().for_each(|what| findings.note(what));
    drop_damaged_cells(rig, &mut signals, &mut findings);
    let fewest = if matches!(rig.plant, RigModel::Toss(_)) { FEWEST_OF_A_TOSS } else { FEWEST };
    let rows = time.len();
    let mut pieces = Vec::new();
    for (name, time, signals) in experiments(path, time, signals)? {
        let (time, signals) = with_clock(time, signals, &mut findings);
        pieces.extend(even_pieces(path, name, &time, &signals, fewest, &mut findings)?);
    }
    if pieces.is_empty() {
        let what = format!("{rows} rows contain no {fewest} consecutive samples without a gap");
        return Err(DiagnosisError::log(path, None, what, "record longer, or without interruptions"));
    }
    Ok((pieces, findings.findings))
}

/// Quantile of the second differences of a signal, and how many times a damaged cell is off by it at least.
const USUAL: f64 = 0.97;
const OFF: f64 = 15.0;
/// Share of its deviation up to which the cells around a damaged one agree.
const AGREE: f64 = 0.1;
/// Damaged cells of a signal that are listed; the rest is counted.
const LISTED: usize = 3;

/// Replaces isolated outliers by missing numbers and notes them. The two cells on either side of an outlier agree with
/// each other: an impact or a jump of the motion takes several samples.
fn drop_damaged_cells(rig: &Rig, signals: &mut Signals, findings: &mut FindingLog) {
    for (name, values) in signals.iter_mut().filter(|(name, _)| *name != "experiment") {
        let found = isolated(values);
        if found.is_empty() {
            continue;
        }
        let listed: Vec<String> =
            found.iter().take(LISTED).map(|row| format!("row {}: {}", row + 1, values[*row])).collect();
        let more = if found.len() > LISTED { ", ..." } else { "" };
        let column = rig.log.get(name).map_or(name.as_str(), |column| column.name.as_str());
        findings.note(format!(
            "{} isolated outliers in column `{column}` are treated as missing ({}{more})",
            found.len(),
            listed.join(", ")
        ));
        found.into_iter().for_each(|row| values[row] = f64::NAN);
    }
}

/// Returns the rows of isolated outliers.
fn isolated(values: &[f64]) -> Vec<usize> {
    let deviation = |row: usize| (values[row] - 0.5 * (values[row - 1] + values[row + 1])).abs();
    let inner = 2..values.len().saturating_sub(2);
    let mut usual: Vec<f64> = inner.clone().map(deviation).filter(|deviation| deviation.is_finite()).collect();
    if usual.is_empty() {
        return Vec::new();
    }
    usual.sort_by(f64::total_cmp);
    let limit = OFF * usual[((usual.len() - 1) as f64 * USUAL) as usize];
    let is_isolated = |row: &usize| {
        let off = deviation(*row);
        let agree = |a: usize, b: usize| (values[a] - values[b]).abs() < AGREE * off;
        off > limit && agree(row - 1, row + 1) && agree(row - 2, row - 1) && agree(row + 1, row + 2)
    };
    inner.filter(is_isolated).collect()
}

/// Signals by name.
type Signals = BTreeMap<String, Vec<f64>>;
/// An experiment of a file: its name and repeat, its clock and its signals.
type Experiment = ((String, usize), Vec<f64>, Signals);

/// The experiments that a file holds, each with its name and repeat, its clock and its signals: one by the file's name, or
/// as many as a column numbers.
///
/// # Errors
/// A number that is none.
fn experiments(path: &Path, time: Vec<f64>, mut signals: Signals) -> Result<Vec<Experiment>> {
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

/// Largest share of rows with a repeated time stamp, or none, that are left out.
const MOST_STAMPS: f64 = 0.02;

/// Omits rows whose time stamp is missing or repeats that of the row before, if they are few: the others decide on the
/// clock.
fn with_clock(time: Vec<f64>, signals: Signals, findings: &mut FindingLog) -> (Vec<f64>, Signals) {
    let mut last = f64::NAN;
    let (mut rows, mut repeated) = (Vec::new(), 0);
    for (row, stamp) in time.iter().enumerate() {
        if *stamp == last {
            repeated += 1;
        } else if stamp.is_finite() {
            rows.push(row);
            last = *stamp;
        }
    }
    let absent = time.len() - rows.len() - repeated;
    if rows.len() == time.len() || (repeated + absent) as f64 > MOST_STAMPS * time.len() as f64 {
        return (time, signals);
    }
    for (count, what) in [(repeated, "repeat the time stamp of the row before"), (absent, "have no time stamp")] {
        if count > 0 {
            findings.note(format!("{count} of {} rows {what} and are omitted", time.len()));
        }
    }
    let of = |values: &Vec<f64>| rows.iter().map(|row| values[*row]).collect();
    (of(&time), signals.iter().map(|(name, values)| (name.clone(), of(values))).collect())
}

/// The stretches of an experiment without gaps, at equal steps.
fn even_pieces(
    path: &Path,
    (experiment, repeat): (String, usize),
    time: &[f64],
    signals: &Signals,
    fewest: usize,
    findings: &mut FindingLog,
) -> Result<Vec<Piece>> {
    let clock = Clock::of(path, time, fewest, findings)?;
    let mut pieces = Vec::new();
    for span in clock.spans(time, signals, findings) {
        let (from, to) = (time[span[0]], time[span[span.len() - 1]]);
        let count = ((to - from) / clock.step + 0.5) as usize + 1;
        if count < fewest {
            findings.note(format!("{count} samples from {from:.3} s on are too few and were ignored"));
            continue;
        }
        let even = |values: &Vec<f64>| resampled(time, values, &span, clock.step, count);
        let signals = signals.iter().map(|(name, values)| (name.clone(), even(values))).collect();
        pieces.push(Piece { experiment: experiment.clone(), repeat, start: from, step: clock.step, signals });
    }
    Ok(pieces)
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

/// The clock of a recording.
struct Clock {
    step: f64,
}

impl Clock {
    /// Determines the usual step; a time that does not increase is an error.
    fn of(path: &Path, time: &[f64], fewest: usize, findings: &mut FindingLog) -> Result<Self> {
        if time.len() < fewest {
            let what = format!("{} rows are too few to separate effects from noise", time.len());
            return Err(DiagnosisError::log(
                path,
                None,
                what,
                format!("record at least {fewest} rows, better several seconds"),
            ));
        }
        let mut steps: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
        if let Some(row) = steps.iter().position(|step| step.is_nan() || *step <= 0.0) {
            let what = format!("the time does not increase after row {}: {} s", row + 1, time[row]);
            return Err(DiagnosisError::log(path, None, what, "sort the rows by time and remove duplicates"));
        }
        let uneven = steps.clone();
        steps.sort_by(f64::total_cmp);
        let usual = steps[steps.len() / 2];
        let regular: Vec<f64> = uneven.iter().copied().filter(|step| *step < LONGEST_GAP * usual).collect();
        // A missing row makes a step of two.
        let count: f64 = regular.iter().map(|step| (step / usual).round()).sum();
        let step = regular.iter().sum::<f64>() / count;
        let irregular = regular.iter().filter(|s| (*s - step).abs() > JITTER * step).count();
        if irregular > 0 {
            findings.note(format!(
                "{irregular} of {} time steps differ from {step:.6} s by more than 2 %: resampled to equal steps",
                uneven.len()
            ));
        }
        Ok(Self { step })
    }

    /// Rows with a number in every signal, cut where the clock pauses.
    fn spans(&self, time: &[f64], signals: &BTreeMap<String, Vec<f64>>, findings: &mut FindingLog) -> Vec<Vec<usize>> {
        let whole = |row: &usize| signals.values().all(|values| values[*row].is_finite());
        let rows: Vec<usize> = (0..time.len()).filter(whole).collect();
        if rows.len() < time.len() {
            findings.note(format!(
                "{} of {} rows have missing numbers and are treated as gaps",
                time.len() - rows.len(),
                time.len()
            ));
        }
        let mut spans: Vec<Vec<usize>> = Vec::new();
        for row in rows {
            match spans.last_mut() {
                Some(span) if time[row] - time[span[span.len() - 1]] < LONGEST_GAP * self.step => span.push(row),
                _ => spans.push(vec![row]),
            }
        }
        if spans.len() > 1 {
            findings.note(format!("cut at {} gaps into {} pieces", spans.len() - 1, spans.len()));
        }
        spans
    }
}

/// A signal at equal steps: cubic between its neighbours (Catmull-Rom for unequal steps).
fn resampled(time: &[f64], values: &[f64], rows: &[usize], step: f64, count: usize) -> Vec<f64> {
    let last = rows.len() - 1;
    let slope = |k: usize| {
        let (before, after) = (rows[k.saturating_sub(1)], rows[(k + 1).min(last)]);
        (values[after] - values[before]) / (time[after] - time[before])
    };
    let mut k = 0;
    let at = |i: usize| {
        let t = time[rows[0]] + i as f64 * step;
        while k + 2 < rows.len() && time[rows[k + 1]] <= t {
            k += 1;
        }
        let (a, b) = (rows[k], rows[k + 1]);
        let width = time[b] - time[a];
        let u = ((t - time[a]) / width).clamp(0.0, 1.0);
        let (p, q) = (slope(k) * width, slope(k + 1) * width);
        let way = values[b] - values[a];
        values[a] + u * (p + u * (3.0 * way - 2.0 * p - q + u * (p + q - 2.0 * way)))
    };
    (0..count).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A slow sine with noise and quantisation.
    fn signal() -> Vec<f64> {
        let noise = |i: u32| (f64::from(i) * 12.9898).sin();
        (0..2000).map(|i| (1e3 * ((f64::from(i) * 0.01).sin() + 0.003 * noise(i))).round() / 1e3).collect()
    }

    #[test]
    fn isolated_outliers_are_found_and_nothing_else() {
        assert!(isolated(&signal()).is_empty());
        let mut damaged = signal();
        for (row, value) in [(300, 1e6), (700, 0.0), (1001, -damaged[1001]), (1500, 1000.0 * damaged[1500])] {
            damaged[row] = value;
        }
        assert_eq!(isolated(&damaged), [300, 700, 1001, 1500]);
    }

    #[test]
    fn impacts_jumps_and_late_samples_are_no_outliers() {
        let impact = |i: i32| (-0.5 * (f64::from(i - 1000) / 2.0).powi(2)).exp() * 500.0;
        assert!(isolated(&(0..2000).map(impact).collect::<Vec<_>>()).is_empty(), "an impact of some samples");
        let jump = |i: i32| if i < 1000 { 0.0 } else { 100.0 };
        assert!(isolated(&(0..2000).map(jump).collect::<Vec<_>>()).is_empty(), "a jump");
        let mut late = signal();
        (100..1900).step_by(50).for_each(|row| late[row] = late[row - 1]);
        assert!(isolated(&late).is_empty(), "lost packets");
    }
}
