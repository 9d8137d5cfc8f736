//! The column map of recordings: column and unit of each signal.

use crate::check::Checker;
use crate::columns::RecordedColumn;
use crate::suggest::suggestion;
use crate::written::At;
use crate::written::robot::LogTable;
use std::collections::{BTreeMap, BTreeSet};

/// What a signal measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Quantity {
    /// Time \[s\].
    Time,
    /// Joint angle by the motor's encoder \[rad\].
    Angle,
    /// Joint angle by an encoder behind the gear \[rad\].
    LinkAngle,
    /// Commanded joint angle \[rad\].
    Reference,
    /// Drive torque at the motor's side \[N m\].
    MotorTorque,
    /// Drive torque at the joint's side \[N m\].
    JointTorque,
}

/// Names of the signals, their SI units and meanings; a robot's number and an axis from 1 complete all but `t`.
pub const SIGNALS: [(&str, Quantity, &str, &str); 6] = [
    ("t", Quantity::Time, "s", "time"),
    ("q", Quantity::Angle, "rad", "joint angle by the motor's encoder"),
    ("q_link", Quantity::LinkAngle, "rad", "joint angle by an encoder behind the gear"),
    ("q_ref", Quantity::Reference, "rad", "commanded joint angle"),
    ("tau_motor", Quantity::MotorTorque, "N m", "drive torque at the motor's side"),
    ("tau", Quantity::JointTorque, "N m", "drive torque at the joint's side"),
];

/// A signal of one joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct LogSignal {
    /// What is measured.
    pub quantity: Quantity,
    /// Joint, from 0; 0 for time.
    pub joint: usize,
}

/// A signal and the column that holds it.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// What the column holds.
    pub signal: LogSignal,
    /// The signal's name in the file (`r1.q.1`).
    pub name: String,
    /// The column.
    pub column: RecordedColumn,
}

pub(super) fn read(c: &mut Checker, table: &BTreeMap<String, At<LogTable>>, joints: usize) -> Vec<Channel> {
    let robots: BTreeSet<&str> = table.keys().filter_map(|name| name.split_once('.')).map(|(robot, _)| robot).collect();
    let last = table.iter().rfind(|(name, _)| name.contains('.'));
    if let (true, Some((_, written))) = (robots.len() > 1, last) {
        let message = "the columns of more than one robot are mapped here";
        c.refuse(&written.span, message, "keep one robot's; each robot has a model file of its own");
    }
    let mut channels: Vec<Channel> =
        table.iter().filter_map(|(name, written)| channel(c, name, written, joints)).collect();
    channels.sort_by_key(|channel| channel.signal);
    channels
}

fn channel(c: &mut Checker, name: &str, written: &At<LogTable>, joints: usize) -> Option<Channel> {
    let Some((signal, si)) = signal(name, joints) else {
        let known: Vec<String> =
            SIGNALS.iter().map(|row| if row.0 == "t" { "t".into() } else { format!("r1.{}.1", row.0) }).collect();
        let known: Vec<&str> = known.iter().map(String::as_str).collect();
        let message = format!("there is no signal `{name}` of a robot with {joints} joints");
        c.refuse(&written.span, message, suggestion(name, &known));
        return None;
    };
    let column = RecordedColumn::read(c, written, si)?;
    Some(Channel { signal, name: name.to_owned(), column })
}

/// `t`, or `r1.q.3`: the signal and its SI unit.
fn signal(name: &str, joints: usize) -> Option<(LogSignal, &'static str)> {
    let row = |word: &str| SIGNALS.iter().find(|row| row.0 == word);
    if name == "t" {
        return row("t").map(|row| (LogSignal { quantity: row.1, joint: 0 }, row.2));
    }
    let (_, rest) = name.strip_prefix('r')?.split_once('.').filter(|(robot, _)| robot.parse::<u32>().is_ok())?;
    let (word, axis) = rest.split_once('.')?;
    let joint = axis.parse::<usize>().ok().filter(|axis| (1..=joints).contains(axis))? - 1;
    row(word).filter(|row| row.0 != "t").map(|row| (LogSignal { quantity: row.1, joint }, row.2))
}
