//! Recordings in CSV or Parquet, mapped by the model file's `[log]` to joint-side SI units.

use crate::{DiagnosisError, Result};
use softdock_campaign::Robot;
use softdock_campaign::robot::{Channel, Quantity};
use softdock_diagnosis::data::clock::EvenRecording;
use softdock_diagnosis::data::table::{Gaps, Named, Wanted};
use std::collections::BTreeMap;
use std::path::Path;

/// Fewest rows of a recording: the low-pass needs some seconds.
const FEWEST_ROWS: usize = 50;

/// Steps of the clock may differ by this share of the mean step.
const JITTER: f64 = 0.02;

/// Recording at equal steps, in SI units; one column per joint.
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
    /// Statements about what was changed, such as unequal steps that were resampled.
    pub notes: Vec<String>,
}

impl Recording {
    /// Returns the number of samples.
    pub fn rows(&self) -> usize {
        self.angle.first().map_or(0, Vec::len)
    }

    /// Reads a recording of a robot: Parquet if the file name ends in `.parquet`, otherwise CSV.
    pub fn read(path: &Path, robot: &Robot) -> Result<Self> {
        let joints = robot.model.joints.len();
        let mut columns = Columns::read(path, robot)?;
        let time = columns.signal(Quantity::Time, 0).ok_or_else(|| missing(path, robot, "t"))?.values.clone();
        let (step, notes) = columns.at_equal_steps(path, &time)?;
        let mut recording = Self {
            name: path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned()),
            step,
            angle: Vec::new(),
            torque: Vec::new(),
            link_angle: BTreeMap::new(),
            notes,
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

fn missing(path: &Path, robot: &Robot, signal: &str) -> DiagnosisError {
    let what = format!("the signal `{signal}` is not mapped to any column");
    let remedy = format!("add it to [log] of {}: \"r1.q.1\" = {{ column = \"...\", unit = \"deg\" }}", robot.file);
    DiagnosisError::log(path, None, what, remedy)
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
        let named = robot.log.iter().map(|channel| (channel.name.as_str(), channel.column.name.as_str())).collect();
        let wanted = Wanted { columns: named, named: Named::By(&robot.file), gaps: Gaps::Refused, order: &[] };
        let columns = wanted.read(path)?.columns;
        let column = |(channel, values): (&Channel, Vec<f64>)| {
            let values = values.iter().map(|value| value * channel.column.factor + channel.column.offset).collect();
            Column { channel: channel.clone(), values }
        };
        Ok(Self(robot.log.iter().zip(columns).map(column).collect()))
    }
}

impl Columns {
    /// Resamples the columns to equal steps where those of the clock differ; returns the step \[s\] and what was changed.
    fn at_equal_steps(&mut self, path: &Path, time: &[f64]) -> Result<(f64, Vec<String>)> {
        if time.len() < FEWEST_ROWS {
            let what = format!("{} rows are too few for the low-pass", time.len());
            let remedy = format!("record at least {FEWEST_ROWS} rows, better several seconds");
            return Err(DiagnosisError::log(path, None, what, remedy));
        }
        let step = (time[time.len() - 1] - time[0]) / (time.len() - 1) as f64;
        if time.windows(2).all(|pair| ((pair[1] - pair[0]) - step).abs() <= JITTER * step) {
            return Ok((step, Vec::new()));
        }
        let signals = self.0.iter().map(|own| (own.channel.name.clone(), own.values.clone())).collect();
        let even = EvenRecording::of(time, &signals, FEWEST_ROWS)
            .map_err(|(what, remedy)| DiagnosisError::log(path, None, what, remedy))?;
        let [segment] = &even.segments[..] else {
            let what = format!("{}: a low-pass needs one stretch without gaps", even.notes.join("; "));
            return Err(DiagnosisError::log(path, None, what, "cut the recording at its gaps, and name each part"));
        };
        for column in &mut self.0 {
            column.values = segment.signals[&column.channel.name].clone();
        }
        Ok((even.step, even.notes))
    }
}
