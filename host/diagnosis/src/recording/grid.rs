//! A recording of a rig: its signals in SI on an even grid, and what had to be done to get them there.

use super::table::{Gaps, Wanted};
use crate::{Error, Result};
use softdock_campaign::Rig;
use std::collections::BTreeMap;
use std::path::Path;

/// Fewest samples of a piece: less holds no motion that could be judged.
const FEWEST: usize = 200;
/// A pause of the clock longer than this many steps cuts a recording; a shorter one is bridged.
const LONGEST_GAP: f64 = 3.5;
/// Steps that differ from the usual one by this share of it are uneven.
const JITTER: f64 = 0.02;

/// One piece of a recording without gaps, at equal steps, in SI.
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
    /// The samples from one number up to another; `None` if they are too few to be judged.
    pub fn between(&self, from: usize, to: usize) -> Option<Self> {
        let cut = |(name, values): (&String, &Vec<f64>)| (name.clone(), values[from..to].to_vec());
        (to >= from + FEWEST).then(|| Self {
            start: self.start + from as f64 * self.step,
            signals: self.signals.iter().map(cut).collect(),
            ..self.clone()
        })
    }

    /// Number of samples.
    pub fn samples(&self) -> usize {
        self.signals.values().next().map_or(0, Vec::len)
    }
}

/// Something worth telling about a recording.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Finding {
    /// The recording's name.
    pub recording: String,
    /// What was found, and what was done about it.
    pub what: String,
}

/// Reads a recording: `NAME_REPEAT.csv` is a repeat of the experiment `NAME`.
///
/// # Errors
/// A file that cannot be read, a column that is missing, a clock that does not run, too few samples.
pub fn read(path: &Path, rig: &Rig) -> Result<(Vec<Piece>, Vec<Finding>)> {
    if !rig.log.contains_key("t") {
        let remedy = "add it: \"t\" = { column = \"...\", unit = \"s\" }";
        return Err(Error::log(path, None, format!("[log] of {} names no column for `t`", rig.file), remedy));
    }
    let columns = rig.log.iter().map(|(signal, column)| (signal.as_str(), column.name.as_str())).collect();
    let raw = Wanted { columns, model: &rig.file, gaps: Gaps::Kept }.read(path)?;
    let in_si = |((name, column), values): ((&String, &softdock_campaign::columns::Column), Vec<f64>)| {
        let values = values.iter().map(|value| value * column.factor + column.offset).collect();
        (name.clone(), values)
    };
    let mut signals: BTreeMap<String, Vec<f64>> = rig.log.iter().zip(raw).map(in_si).collect();
    let time = signals.remove("t").expect("asked for above");
    let (experiment, repeat) = numbered(path);
    let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let mut told = Told { recording: name, findings: Vec::new() };
    let clock = Clock::of(path, &time, &mut told)?;
    let spans = clock.spans(&time, &signals, &mut told);
    let mut pieces = Vec::new();
    for span in spans {
        let (from, to) = (time[span[0]], time[span[span.len() - 1]]);
        let count = ((to - from) / clock.step + 0.5) as usize + 1;
        if count < FEWEST {
            told.note(format!("{count} samples from {from:.3} s on are too few and left out"));
            continue;
        }
        let even = |values: &Vec<f64>| resampled(&time, values, &span, clock.step, count);
        let signals = signals.iter().map(|(name, values)| (name.clone(), even(values))).collect();
        pieces.push(Piece { experiment: experiment.clone(), repeat, start: from, step: clock.step, signals });
    }
    if pieces.is_empty() {
        let what = format!("{} rows hold no stretch of {FEWEST} samples without a gap", time.len());
        return Err(Error::log(path, None, what, "record longer, or without interruptions"));
    }
    Ok((pieces, told.findings))
}

/// Experiment and repeat from a file's name.
fn numbered(path: &Path) -> (String, usize) {
    let stem = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    let split = stem.rsplit_once('_').and_then(|(name, number)| Some((name.to_owned(), number.parse().ok()?)));
    split.unwrap_or((stem, 1))
}

struct Told {
    recording: String,
    findings: Vec<Finding>,
}

impl Told {
    fn note(&mut self, what: String) {
        self.findings.push(Finding { recording: self.recording.clone(), what });
    }
}

/// The clock of a recording.
struct Clock {
    step: f64,
}

impl Clock {
    /// The usual step; a clock that runs backwards or not at all is an error.
    fn of(path: &Path, time: &[f64], told: &mut Told) -> Result<Self> {
        if time.len() < FEWEST {
            let what = format!("{} rows are too few: nothing could be told apart from noise", time.len());
            return Err(Error::log(path, None, what, format!("record at least {FEWEST} rows, better several seconds")));
        }
        let mut steps: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
        if let Some(row) = steps.iter().position(|step| step.is_nan() || *step <= 0.0) {
            let what = format!("the clock does not run forwards after row {}: {} s", row + 1, time[row]);
            return Err(Error::log(path, None, what, "sort the rows by time and remove those that stand twice"));
        }
        let uneven = steps.clone();
        steps.sort_by(f64::total_cmp);
        let usual = steps[steps.len() / 2];
        let regular: Vec<f64> = uneven.iter().copied().filter(|step| *step < LONGEST_GAP * usual).collect();
        let step = regular.iter().sum::<f64>() / regular.len() as f64;
        let irregular = regular.iter().filter(|s| (*s - step).abs() > JITTER * step).count();
        if irregular > 0 {
            told.note(format!(
                "{irregular} of {} time steps differ from {step:.6} s by more than 2 %: resampled to equal steps",
                uneven.len()
            ));
        }
        Ok(Self { step })
    }

    /// Rows with a number in every signal, cut where the clock pauses.
    fn spans(&self, time: &[f64], signals: &BTreeMap<String, Vec<f64>>, told: &mut Told) -> Vec<Vec<usize>> {
        let whole = |row: &usize| signals.values().all(|values| values[*row].is_finite());
        let rows: Vec<usize> = (0..time.len()).filter(whole).collect();
        if rows.len() < time.len() {
            told.note(format!("{} of {} rows lack a number: they count as gaps", time.len() - rows.len(), time.len()));
        }
        let mut spans: Vec<Vec<usize>> = Vec::new();
        for row in rows {
            match spans.last_mut() {
                Some(span) if time[row] - time[span[span.len() - 1]] < LONGEST_GAP * self.step => span.push(row),
                _ => spans.push(vec![row]),
            }
        }
        if spans.len() > 1 {
            told.note(format!("cut at {} gaps into {} pieces", spans.len() - 1, spans.len()));
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
