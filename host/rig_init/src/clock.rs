//! Clock of a log: its column, unit, rate and jitter.

use crate::figures::{median, rms, short, slope};
use crate::names::Meaning;
use crate::recorded_table::{LogColumn, RecordedTable};

/// Share of the steps that a clock increases.
const INCREASING: f64 = 0.9;

/// The clock of a log.
#[derive(Clone, Debug)]
pub(crate) struct Clock {
    /// Column and unit; none if no column is a clock.
    pub(crate) column: Option<(String, &'static str)>,
    /// Seconds per unit of a frame number, if the column is one; 0 if it is unknown.
    pub(crate) frame: Option<f64>,
    /// A second clock.
    pub(crate) other: Option<(String, &'static str)>,
    /// Time of each row \[s\], from the first; row numbers without a clock.
    pub(crate) time: Vec<f64>,
    /// Median step \[s\].
    pub(crate) step: f64,
    /// The figures on which the guess is based.
    pub(crate) basis: String,
}

impl Clock {
    pub(crate) fn of(table: &RecordedTable) -> Self {
        let mut found: Vec<(Steps, &LogColumn)> = table
            .of(Meaning::Time)
            .filter_map(|column| Some((Steps::of(&column.values)?, column)))
            .filter(|(steps, _)| steps.increasing >= INCREASING)
            .collect();
        // The most even clock is that of the sender or the controller.
        found.sort_by(|a, b| a.0.jitter.total_cmp(&b.0.jitter));
        if let Some((steps, column)) = found.first() {
            let (unit, why) = unit(column, steps);
            let per_unit = seconds(unit);
            let other = found.get(1).map(|(steps, column)| (column.name.clone(), self::unit(column, steps).0));
            let time = column.values.iter().map(|value| (value - first(column)) * per_unit).collect();
            let step = steps.median * per_unit;
            let basis = format!(
                "{} rows at {} Hz, {} s; steps deviate by {} % from {} ms on average, the longest is {} ms; {why}",
                table.rows(),
                short(1.0 / step),
                short(step * table.rows() as f64),
                short((1e4 * steps.jitter).round() / 100.0),
                short(1e3 * step),
                short(1e3 * per_unit * steps.longest)
            );
            return Self { column: Some((column.name.clone(), unit)), frame: None, other, time, step, basis };
        }
        Self::of_frames(table)
    }

    /// A clock by frame numbers, whose rate follows from positions and speeds if both are recorded.
    fn of_frames(table: &RecordedTable) -> Self {
        let rows = (0..table.rows()).map(|row| row as f64).collect();
        let frame = table.of(Meaning::Frame).find(|column| Steps::of(&column.values).is_some_and(|s| s.median == 1.0));
        let rounded = table.of(Meaning::Time).next();
        let Some(frame) = frame else {
            let basis = match rounded {
                Some(column) => {
                    format!("`{}` does not increase from row to row: it is rounded or constant", column.name)
                }
                None => "no column has the name of a clock".to_owned(),
            };
            return Self { column: None, frame: None, other: None, time: rows, step: 1.0, basis };
        };
        let step = ['x', 'y', 'z'].into_iter().find_map(|axis| {
            let place = table.component(Meaning::Place, axis, false)?;
            let speed = table.component(Meaning::Speed, axis, false)?;
            let is_next = |row: usize| frame.values[row + 1] == frame.values[row] + 1.0;
            let last = table.rows() - 1;
            let moved = |row: usize| if is_next(row) { place.values[row + 1] - place.values[row] } else { f64::NAN };
            let mean = |row: usize| 0.5 * (speed.values[row] + speed.values[row + 1]);
            let moved: Vec<f64> = (0..last).map(moved).collect();
            let speeds: Vec<f64> = (0..last).map(mean).collect();
            let (_, rest) = slope(&speeds, &moved).filter(|(step, rest)| *step > 0.0 && *rest < 0.3)?;
            // Impacts within a frame spoil a mean, not a median.
            let fast = 0.5 * rms(&speeds);
            let ratios = (0..last).filter(|row| speeds[*row].abs() > fast).map(|row| moved[row] / speeds[row]);
            Some((median(ratios), rest)).filter(|(step, _)| *step > 0.0)
        });
        let basis = match step {
            Some((step, rest)) => format!(
                "frame numbers; {} frames a second, by the ratio of speeds and positions ({} % of the motion unexplained)",
                short(1.0 / step),
                short(100.0 * rest)
            ),
            None => "frame numbers; the rate of the camera is not in the log".to_owned(),
        };
        let step = step.map_or(0.0, |step| step.0);
        let usable = if step > 0.0 { step } else { 1.0 };
        let time = frame.values.iter().map(|value| value * usable).collect();
        Self { column: Some((frame.name.clone(), "s")), frame: Some(step), other: None, time, step: usable, basis }
    }
}

/// Steps of a column from row to row.
struct Steps {
    median: f64,
    longest: f64,
    /// Mean deviation from the median, as a share of it.
    jitter: f64,
    /// Share that increases.
    increasing: f64,
}

impl Steps {
    fn of(values: &[f64]) -> Option<Self> {
        let steps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| step.is_finite()).collect();
        let median = median(steps.iter().copied());
        (median > 0.0).then(|| Self {
            median,
            longest: steps.iter().copied().fold(0.0, f64::max),
            jitter: steps.iter().map(|step| (step / median - 1.0).abs()).sum::<f64>() / steps.len() as f64,
            increasing: steps.iter().filter(|step| **step > 0.0).count() as f64 / steps.len() as f64,
        })
    }
}

/// Unit of a clock by its name, by its count since 1970, or by its step.
fn unit(column: &LogColumn, steps: &Steps) -> (&'static str, String) {
    if let Some(unit) = column.parsed.unit.filter(|unit| ["s", "ms", "us", "ns"].contains(unit)) {
        return (unit, "unit by its name".to_owned());
    }
    let first = first(column);
    for (unit, second) in [("ns", 1e9), ("us", 1e6), ("ms", 1e3), ("s", 1.0)] {
        // Between 2001 and 2096.
        if (1e9 * second..4e9 * second).contains(&first) {
            return (unit, format!("{unit} since 1970 by its first value {first:e}"));
        }
    }
    let unit = match steps.median {
        step if step < 1.0 => "s",
        step if step < 50.0 => "ms",
        step if step < 5e4 => "us",
        _ => "ns",
    };
    (unit, format!("unit by its step of {}", short(steps.median)))
}

/// First finite value.
fn first(column: &LogColumn) -> f64 {
    column.values.iter().copied().find(|value| value.is_finite()).unwrap_or(0.0)
}

/// Seconds per unit.
fn seconds(unit: &str) -> f64 {
    match unit {
        "ms" => 1e-3,
        "us" => 1e-6,
        "ns" => 1e-9,
        _ => 1.0,
    }
}
