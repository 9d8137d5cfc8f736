//! Recordings: CSV or Parquet, any columns, read through the model file's `[log]` into joint-side SI.

use crate::{Error, Result};
use softdock_campaign::Robot;
use softdock_campaign::robot::{Channel, Quantity};
use std::collections::BTreeMap;
use std::path::Path;

/// Fewest rows of a recording: the low-pass needs some seconds.
const FEWEST_ROWS: usize = 50;

/// Steps of the clock may differ by this share of the mean step.
const JITTER: f64 = 0.02;

/// One recording at equal steps, in SI; columns by joint.
#[derive(Clone, Debug)]
pub struct Recording {
    /// The file's name, without its folder.
    pub name: String,
    /// Sampling period \[s\].
    pub step: f64,
    /// Joint angles by the motors' encoders \[rad\]; one column per joint.
    pub angle: Vec<Vec<f64>>,
    /// Torques of the drives at the joints' side \[N m\]; one column per joint.
    pub torque: Vec<Vec<f64>>,
    /// Joint angles behind the gear \[rad\], for the joints that have such an encoder.
    pub link_angle: BTreeMap<usize, Vec<f64>>,
}

impl Recording {
    /// Number of samples.
    pub fn rows(&self) -> usize {
        self.angle.first().map_or(0, Vec::len)
    }

    /// Reads a recording of a robot; the ending `.parquet` tells Parquet from CSV.
    pub fn read(path: &Path, robot: &Robot) -> Result<Self> {
        let joints = robot.model.joints.len();
        let columns = Columns::read(path, robot)?;
        let time = columns.signal(Quantity::Time, 0).ok_or_else(|| missing(path, robot, "t"))?;
        let step = equal_step(path, &time.values)?;
        let mut recording = Self {
            name: path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned()),
            step,
            angle: Vec::new(),
            torque: Vec::new(),
            link_angle: BTreeMap::new(),
        };
        for joint in 0..joints {
            let angle = columns.signal(Quantity::Angle, joint);
            let angle = angle.ok_or_else(|| missing(path, robot, &format!("r1.q.{}", joint + 1)))?;
            recording.angle.push(angle.values.clone());
            let ratio = robot.model.joints[joint].drive.gear_ratio;
            let motor = columns.signal(Quantity::MotorTorque, joint).map(|column| scaled(&column.values, ratio));
            let own = columns.signal(Quantity::JointTorque, joint).map(|column| column.values.clone());
            let torque = own.or(motor);
            let wanted = format!("r1.tau_motor.{0}` or `r1.tau.{0}", joint + 1);
            recording.torque.push(torque.ok_or_else(|| missing(path, robot, &wanted))?);
            if let Some(link) = columns.signal(Quantity::LinkAngle, joint) {
                recording.link_angle.insert(joint, link.values.clone());
            }
        }
        Ok(recording)
    }
}

fn scaled(values: &[f64], factor: f64) -> Vec<f64> {
    values.iter().map(|value| value * factor).collect()
}

fn missing(path: &Path, robot: &Robot, signal: &str) -> Error {
    let what = format!("the signal `{signal}` is not mapped to any column");
    let remedy = format!("add it to [log] of {}: \"r1.q.1\" = {{ column = \"...\", unit = \"deg\" }}", robot.file);
    Error::log(path, None, what, remedy)
}

/// A mapped column in SI.
struct Column {
    channel: Channel,
    values: Vec<f64>,
}

struct Columns(Vec<Column>);

impl Columns {
    fn signal(&self, quantity: Quantity, joint: usize) -> Option<&Column> {
        self.0.iter().find(|column| column.channel.signal.quantity == quantity && column.channel.signal.joint == joint)
    }

    fn read(path: &Path, robot: &Robot) -> Result<Self> {
        let names: Vec<&str> = robot.log.iter().map(|channel| channel.column.as_str()).collect();
        let is_parquet = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("parquet"));
        let columns = if is_parquet { parquet(path, &names, robot)? } else { csv(path, &names, robot)? };
        let column = |(channel, values): (&Channel, Vec<f64>)| {
            let values = values.iter().map(|value| value * channel.factor + channel.offset).collect();
            Column { channel: channel.clone(), values }
        };
        Ok(Self(robot.log.iter().zip(columns).map(column).collect()))
    }
}

/// The error for a column that the file lacks.
fn no_column(path: &Path, line: Option<usize>, name: &str, robot: &Robot, known: &[String]) -> Error {
    let signal = robot.log.iter().find(|channel| channel.column == name).map_or("", |channel| channel.name.as_str());
    let what = format!("there is no column `{name}`, which [log] of {} names for `{signal}`", robot.file);
    let shown: Vec<&str> = known.iter().take(12).map(String::as_str).collect();
    let more = if known.len() > shown.len() { ", ..." } else { "" };
    Error::log(path, line, what, format!("name one of its columns there: {}{more}", shown.join(", ")))
}

fn parquet(path: &Path, names: &[&str], robot: &Robot) -> Result<Vec<Vec<f64>>> {
    let known = softdock_results::foreign::column_names(path)?;
    if let Some(name) = names.iter().find(|name| !known.iter().any(|column| column == *name)) {
        return Err(no_column(path, None, name, robot, &known));
    }
    let columns = softdock_results::foreign::number_columns(path, names).map_err(|error| match error {
        softdock_results::Error::Contract { what, .. } => {
            Error::log(path, None, what, format!("name columns of numbers in [log] of {}", robot.file))
        }
        other => other.into(),
    })?;
    for (name, values) in names.iter().zip(&columns) {
        if let Some(row) = values.iter().position(|value| !value.is_finite()) {
            let what = format!("row {} of column `{name}` is no finite number", row + 1);
            return Err(Error::log(path, None, what, "cut the recording so that every row is complete"));
        }
    }
    Ok(columns)
}

fn csv(path: &Path, names: &[&str], robot: &Robot) -> Result<Vec<Vec<f64>>> {
    let bytes = std::fs::read(path)
        .map_err(|error| Error::log(path, None, format!("cannot be read: {error}"), "check the path"))?;
    let text = String::from_utf8(bytes).map_err(|_| {
        Error::log(path, None, "is not UTF-8 text", "save it as UTF-8, or as Parquet with the ending .parquet")
    })?;
    let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let Some((_, header)) = lines.next() else {
        return Err(Error::log(path, None, "the file is empty", "name a CSV file with a header, or a Parquet file"));
    };
    let known: Vec<String> = header.split(',').map(|cell| clean(cell).to_owned()).collect();
    let places: Vec<usize> = names
        .iter()
        .map(|name| {
            let place = known.iter().position(|column| column == name);
            place.ok_or_else(|| no_column(path, Some(1), name, robot, &known))
        })
        .collect::<Result<_>>()?;
    let mut columns = vec![Vec::new(); names.len()];
    for (number, line) in lines {
        let cells: Vec<&str> = line.split(',').collect();
        if cells.len() != known.len() {
            let what = format!("{} values where the header names {} columns", cells.len(), known.len());
            return Err(Error::log(path, Some(number + 1), what, "complete or remove the row"));
        }
        for ((name, place), column) in names.iter().zip(&places).zip(&mut columns) {
            let cell = clean(cells[*place]);
            let value: Option<f64> = cell.parse().ok().filter(|value: &f64| value.is_finite());
            let value = value.ok_or_else(|| {
                let what = format!("`{cell}` in column `{name}` is no finite number");
                Error::log(path, Some(number + 1), what, "cut the recording so that every row is complete")
            })?;
            column.push(value);
        }
    }
    Ok(columns)
}

/// A cell without spaces and quotes.
fn clean(cell: &str) -> &str {
    cell.trim().trim_start_matches('\u{feff}').trim_matches('"').trim()
}

/// The mean step; the clock must run forwards in equal steps.
fn equal_step(path: &Path, time: &[f64]) -> Result<f64> {
    if time.len() < FEWEST_ROWS {
        let what = format!("{} rows are too few to filter", time.len());
        return Err(Error::log(
            path,
            None,
            what,
            format!("record at least {FEWEST_ROWS} rows, better several seconds"),
        ));
    }
    let step = (time[time.len() - 1] - time[0]) / (time.len() - 1) as f64;
    let unequal = time.windows(2).position(|pair| ((pair[1] - pair[0]) - step).abs() > JITTER * step.abs());
    match unequal {
        None if step > 0.0 => Ok(step),
        _ => {
            let row = unequal.unwrap_or(0);
            let what = format!(
                "the time steps are not equal: {:.6} s after row {}, {step:.6} s on the average",
                time[row + 1] - time[row],
                row + 1
            );
            let remedy = "resample the recording to equal steps, or cut it where rows are lost";
            Err(Error::log(path, None, what, remedy))
        }
    }
}
