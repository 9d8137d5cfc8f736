//! Joints of a log: their columns, units and torques.

use crate::clock::Clock;
use crate::figures::{Smoothed, extent, regress, rms, short, slope, smoothed};
use crate::names::{Meaning, Origin};
use crate::recorded_table::{LogColumn, RecordedTable};
use std::f64::consts::PI;

/// A revolute joint moves less in one log \[rad\].
const MOST_RADIANS: f64 = 7.0;
/// Below this motion the direction of a joint is noise \[rad, m\].
const LEAST_MOTION: f64 = 1e-4;
/// Agreement of a ratio with a change of units.
const AGREE: f64 = 0.05;
/// A rate that explains the derivative of the position less well is not compared.
const COMPARABLE: f64 = 0.35;

/// A guess with the figure on which it is based.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Guess<T> {
    pub(crate) value: T,
    pub(crate) basis: String,
}

/// Torque of a joint as the log holds it.
#[derive(Clone, Debug)]
pub(crate) struct TorqueColumn {
    pub(crate) name: String,
    /// As recorded.
    pub(crate) values: Vec<f64>,
    /// N m or N per unit of the column; none if the log does not show it.
    pub(crate) scale: Option<f64>,
    /// Unit as recorded.
    pub(crate) recorded: &'static str,
    pub(crate) basis: String,
}

impl TorqueColumn {
    /// Sets the scale to the user's.
    pub(crate) fn rescale(&mut self, scale: f64) {
        self.scale = Some(scale);
        self.basis = format!("recorded in {}; scale as requested", self.recorded);
    }
}

/// Columns of a joint.
#[derive(Clone, Debug)]
pub(crate) struct JointColumns {
    /// Number from 1; none if the log has one joint.
    pub(crate) axis: Option<u32>,
    pub(crate) position: String,
    pub(crate) unit: Guess<&'static str>,
    /// Whether the joint slides; none if the log does not show it.
    pub(crate) prismatic: Option<bool>,
    /// Position in rad or m with its derivatives.
    pub(crate) motion: Smoothed,
    pub(crate) link: Option<(String, &'static str)>,
    pub(crate) reference: Option<(String, &'static str)>,
    pub(crate) torque: Option<TorqueColumn>,
    /// What should be known of the columns.
    pub(crate) notes: Vec<String>,
}

impl JointColumns {
    /// All joints with a measured position.
    pub(crate) fn all(table: &RecordedTable, clock: &Clock) -> Vec<Self> {
        let mut axes: Vec<Option<u32>> = table
            .of(Meaning::Position)
            .filter(|column| column.parsed.component.is_none())
            .map(|column| column.parsed.axis)
            .collect();
        axes.sort_unstable();
        axes.dedup();
        axes.into_iter().filter_map(|axis| Self::of(table, clock, axis)).collect()
    }

    fn of(table: &RecordedTable, clock: &Clock, axis: Option<u32>) -> Option<Self> {
        let measured = [Origin::Measured, Origin::Plain];
        let position = table
            .joint(Meaning::Position, axis, &measured)
            .or_else(|| table.joint(Meaning::Position, axis, &[Origin::Link]))?;
        let rate = table.joint(Meaning::Rate, axis, &measured);
        let raw = smoothed(&clock.time, &position.values, clock.step);
        let mut notes = Vec::new();
        let unit = unit(position, rate, &raw, &mut notes);
        let factor = si(unit.value);
        let in_si = |values: &[f64]| values.iter().map(|value| value * factor).collect();
        let motion =
            Smoothed { value: in_si(&raw.value), rate: in_si(&raw.rate), acceleration: in_si(&raw.acceleration) };
        let beside = |origin| {
            let column = table.joint(Meaning::Position, axis, &[origin])?;
            let named = column.parsed.unit.filter(|unit| si_unit(unit).is_some());
            (column.name != position.name).then(|| (column.name.clone(), named.unwrap_or(unit.value)))
        };
        let prismatic = match unit.value {
            "m" | "mm" => Some(true),
            _ if position.parsed.unit.is_some() || axis.is_some() || is_angle(&position.name) => Some(false),
            _ => None,
        };
        let torque = torque(table, axis, &motion, &mut notes);
        let (link, reference) = (beside(Origin::Link), beside(Origin::Reference));
        Some(Self { axis, position: position.name.clone(), unit, prismatic, motion, link, reference, torque, notes })
    }

    /// "axis 3", or "the joint".
    pub(crate) fn title(&self) -> String {
        self.axis.map_or_else(|| "the joint".to_owned(), |axis| format!("axis {axis}"))
    }
}

/// Whether a name is that of an angle.
fn is_angle(name: &str) -> bool {
    let name = name.to_ascii_lowercase();
    ["angle", "theta", "phi", "joint", "axis"].iter().any(|word| name.contains(word)) || name.starts_with('q')
}

/// Factor of a position's unit to rad or m.
fn si(unit: &str) -> f64 {
    si_unit(unit).unwrap_or(1.0)
}

fn si_unit(unit: &str) -> Option<f64> {
    match unit {
        "deg" => Some(PI / 180.0),
        "mm" => Some(1e-3),
        "rad" | "m" => Some(1.0),
        _ => None,
    }
}

/// Unit of a position by its name, by the rate beside it, or by its size.
fn unit(
    position: &LogColumn,
    rate: Option<&LogColumn>,
    raw: &Smoothed,
    notes: &mut Vec<String>,
) -> Guess<&'static str> {
    // The ratio of the position's derivative to the recorded rate.
    let ratio = rate.and_then(|rate| {
        let (ratio, rest) = slope(&rate.values, &raw.rate)?;
        (rest < COMPARABLE).then_some((rate, ratio))
    });
    let named = position.parsed.unit.filter(|unit| si_unit(unit).is_some());
    let by_rate = ratio.and_then(|(rate, ratio)| {
        let near = |factor: f64| (ratio / factor - 1.0).abs() < AGREE;
        let units: [(&str, f64, &'static str); 6] = [
            ("rad/s", 1.0, "rad"),
            ("rad/s", 180.0 / PI, "deg"),
            ("deg/s", 1.0, "deg"),
            ("deg/s", PI / 180.0, "rad"),
            ("m/s", 1.0, "m"),
            ("m/s", 1e3, "mm"),
        ];
        let unit = match rate.parsed.unit {
            Some(unit) => units.iter().find(|row| row.0 == unit && near(row.1)).map(|row| row.2),
            None if near(180.0 / PI) => Some("deg"),
            None if near(PI / 180.0) => Some("rad"),
            None => None,
        }?;
        Some((unit, format!("its derivative is {} times `{}`", short(ratio), rate.name)))
    });
    if let (Some(named), Some((unit, why))) = (named, &by_rate)
        && named != *unit
    {
        notes.push(format!("`{}` has the unit {named} by its name and {unit} by its rate: {why}", position.name));
    }
    if let Some(unit) = named {
        let check = ratio.map_or(String::new(), |(rate, ratio)| {
            format!("; its derivative is {} times `{}`", short(ratio), rate.name)
        });
        return Guess { value: unit, basis: format!("{unit} by the name{check}") };
    }
    if let Some((unit, why)) = by_rate {
        return Guess { value: unit, basis: format!("{unit}: {why}") };
    }
    let (low, high) = position.extent();
    let size = low.abs().max(high.abs());
    let unit = if size > MOST_RADIANS { "deg" } else { "rad" };
    let basis = format!("{unit} by its values from {} to {}: check it", short(low), short(high));
    Guess { value: unit, basis }
}

/// The torque of a joint, or the current or voltage in its place.
fn torque(
    table: &RecordedTable,
    axis: Option<u32>,
    motion: &Smoothed,
    notes: &mut Vec<String>,
) -> Option<TorqueColumn> {
    let measured = [Origin::Measured, Origin::Plain];
    let quantities = [(Meaning::Torque, "N m"), (Meaning::Current, "A"), (Meaning::Voltage, "V")];
    let magnitude = table.joint(Meaning::Torque, axis, &[Origin::Magnitude]);
    if let Some(column) = magnitude {
        notes.push(format!("`{}` has no sign by its name: it is not used as a torque", column.name));
    }
    for (meaning, recorded) in quantities {
        let Some(column) = table.joint(meaning, axis, &measured) else { continue };
        if is_unsigned(column, motion) {
            notes.push(format!(
                "`{}` is never negative although the joint moves both ways: it is not used",
                column.name
            ));
            continue;
        }
        let name = column.name.clone();
        let values = column.values.clone();
        if meaning == Meaning::Torque {
            let basis = match column.parsed.unit {
                Some(unit) => format!("{unit} by the name"),
                None => "N m by the word for a torque: check it".to_owned(),
            };
            let basis = basis + "; if it is the motor's torque, the gear ratio is its scale";
            let recorded = column.parsed.unit.filter(|unit| *unit == "N").unwrap_or(recorded);
            return Some(TorqueColumn { name, values, scale: Some(1.0), recorded, basis });
        }
        let constant = constant(table, axis, meaning, motion);
        let (scale, basis) = match constant {
            Some((scale, basis)) => (Some(scale), basis),
            None => (None, format!("recorded in {recorded}: the torque per {recorded} is not in the log")),
        };
        return Some(TorqueColumn { name, values, scale, recorded, basis });
    }
    None
}

/// Whether a torque has no sign although the joint moves both ways.
fn is_unsigned(column: &LogColumn, motion: &Smoothed) -> bool {
    let (low, high) = extent(&motion.value);
    if high - low < LEAST_MOTION {
        return false;
    }
    let size = rms(&motion.rate);
    let moving = |sign: f64| motion.rate.iter().filter(|rate| **rate * sign > 0.3 * size).count();
    let (there, back) = (moving(1.0), moving(-1.0));
    column.extent().0 >= 0.0 && there.min(back) * 10 > (there + back).max(1)
}

/// Torque per current by the controller's own pair of wanted torque and wanted current, which also covers friction.
fn constant(table: &RecordedTable, axis: Option<u32>, meaning: Meaning, motion: &Smoothed) -> Option<(f64, String)> {
    let torque = table.joint(Meaning::Torque, axis, &[Origin::Reference])?;
    let current = table.joint(meaning, axis, &[Origin::Reference])?;
    let size = rms(&motion.rate).max(f64::MIN_POSITIVE);
    let sign = motion.rate.iter().map(|rate| (rate / (0.05 * size)).tanh()).collect();
    let columns = [torque.values.clone(), motion.rate.clone(), sign, vec![1.0; motion.rate.len()]];
    let fit = regress(&columns, &current.values)?;
    let per_torque = fit.coefficients[0];
    let is_sharp = fit.errors[0] < 0.02 * per_torque.abs() && fit.unexplained < 0.1;
    (is_sharp && per_torque != 0.0).then(|| {
        let constant = 1.0 / per_torque;
        let basis = format!(
            "`{}` is `{}` over {} and friction ({} % unexplained): start value of the torque per unit",
            current.name,
            torque.name,
            short(constant),
            short(100.0 * fit.unexplained)
        );
        (constant, basis)
    })
}
