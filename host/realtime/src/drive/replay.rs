//! Replays a session's log: computes the decisions again from the logged inputs and compares them with the log.
//!
//! The decisions are pure: on the machine type that wrote the log every bit must be equal. Values that only the session
//! knows (lateness, busy time, commands on the wire) are not decisions and are not compared.

use super::core::{Core, CycleInputs, LinkInputs, SessionTask, Unprepared};
use super::start::moved;
use crate::log::codes::{OrderKind, StopCause, cycle_flags};
use crate::log::record::{CycleRecord, RobotRecord};
use crate::log::table::{LogValue, Logged, columns, store};
use crate::signals::Capabilities;
use crate::time::Nanos;
use std::fmt;

/// A value that differs.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// Logged cycle number.
    pub cycle: u64,
    /// Column of the log, with its unit as a suffix.
    pub column: String,
    /// Value in the log.
    pub logged: LogValue,
    /// Value in the replay.
    pub replayed: LogValue,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { cycle, column, logged, replayed } = self;
        write!(f, "cycle {cycle}, {column}: {} in the log, {} in the replay", text(*logged), text(*replayed))
    }
}

/// Formats a value with all its digits.
fn text(value: LogValue) -> String {
    match value {
        LogValue::Real(real) => format!("{real:?}"),
        LogValue::Signed(whole) => whole.to_string(),
        LogValue::Whole(whole) => whole.to_string(),
        LogValue::Word(word) => word.to_string(),
    }
}

/// Error of replaying a log.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Unplayed {
    /// The run cannot be prepared: the task is not the one that was driven.
    #[error(transparent)]
    Unprepared(#[from] Unprepared),
    /// The log holds no cycle to compare.
    #[error(
        "the log holds no cycle: name the log.mcap of a session that has begun, or copy the \
         file again if it was cut"
    )]
    NoCycle,
}

/// Result of a replay.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Replayed {
    /// Cycles replayed.
    pub cycles: u64,
    /// Cycles in which every decided column is equal bit for bit.
    pub equal: u64,
    /// The first difference. Records that the log has lost show here as a difference of `cycle`.
    pub first: Option<Difference>,
}

/// Replays a log: `capabilities` are those of the robots that received the commands, `records` the whole log in order.
///
/// # Errors
/// If the run cannot be prepared: the task is not the one that was driven. If the log holds no cycle.
pub fn replay(
    task: SessionTask,
    capabilities: [Capabilities; 2],
    mut records: impl Iterator<Item = CycleRecord>,
) -> Result<Replayed, Unplayed> {
    let mut core = Core::new(task, capabilities)?;
    let mut replayed = Replayed::default();
    let names = columns::<CycleRecord>();
    let [mut before, mut after] = [(); 2].map(|()| vec![LogValue::Whole(0); names.len()]);
    while let Some(record) = records.next() {
        if record.cycle == core.record().cycle {
            // The session ended without decisions, after a second stop request or a panic; no cycle follows.
            if let (Some(next), None) = (records.next(), &replayed.first) {
                let logged = LogValue::Whole(next.cycle);
                let replayed_as = LogValue::Whole(record.cycle + 1);
                replayed.first =
                    Some(Difference { cycle: next.cycle, column: "cycle".to_owned(), logged, replayed: replayed_as });
            }
            break;
        }
        core.step(&inputs(&record));
        store(&decided(&record), &mut before);
        store(&decided(core.record()), &mut after);
        let differs = before.iter().zip(&after).position(|(logged, replayed)| logged != replayed);
        replayed.cycles += 1;
        replayed.equal += u64::from(differs.is_none());
        if let (Some(at), None) = (differs, &replayed.first) {
            let (column, logged) = (names[at].name.clone(), before[at]);
            replayed.first = Some(Difference { cycle: record.cycle, column, logged, replayed: after[at] });
        }
    }
    if replayed.cycles == 0 {
        return Err(Unplayed::NoCycle);
    }
    Ok(replayed)
}

/// Reconstructs the inputs of a cycle from its record.
pub fn inputs(record: &CycleRecord) -> CycleInputs {
    let robots = |robots: [&RobotRecord; 2]| robots.map(|robot| robot.report(Nanos(0)));
    let broken = std::array::from_fn(|link| record.broken & (1 << link) != 0);
    // Only a dry run has real and emulated robots together, from its first cycle on.
    let dry = record.emulated_1.present() || record.emulated_2.present();
    let real = LinkInputs {
        robots: robots([&record.robot_1, &record.robot_2]),
        sample: record.ft.sample(Nanos(0)),
        links: [record.robot_1.link, record.robot_2.link, record.ft.link],
        broken: [false; 3],
        wires: [record.robot_1.wire, record.robot_2.wire],
    };
    let emulated = LinkInputs {
        robots: robots(moved(record)),
        sample: record.emulated_ft.sample(Nanos(0)),
        wires: moved(record).map(|robot| robot.wire),
        ..LinkInputs::default()
    };
    let request = (record.request != StopCause::None).then_some(record.request);
    let moved = LinkInputs { broken, ..if dry { emulated } else { real } };
    CycleInputs { now: record.time, moved, exercised: dry.then_some(real), request, go: record.go != 0 }
}

/// Clears the fields of a record that session and log add.
fn decided(record: &CycleRecord) -> CycleRecord {
    let robot = |robot: RobotRecord| RobotRecord {
        order: OrderKind::None,
        command: Logged::BLANK,
        lateness: Nanos(0),
        round_trip: Nanos(0),
        ..robot
    };
    CycleRecord {
        wall_offset: Nanos(0),
        flags: record.flags & !(cycle_flags::OVERRUN | cycle_flags::AFTER_GAP),
        busy: Nanos(0),
        overruns: 0,
        log_dropped: 0,
        robot_1: robot(record.robot_1),
        robot_2: robot(record.robot_2),
        emulated_1: robot(record.emulated_1),
        emulated_2: robot(record.emulated_2),
        ..*record
    }
}
