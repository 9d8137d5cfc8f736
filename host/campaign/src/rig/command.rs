//! A command's way: what is known of it, and how well.

use super::{missing, with_effects};
use crate::check::Checker;
use crate::written::rig::{CommandTable, RigFile};
use softdock_kernels::block::command::CommandValues;
use softdock_kernels::range::{ANGLE, MAX_DELAY_S, Range};

/// Commands of one axis between sender and receiver.
#[derive(Clone, Debug)]
pub struct CommandRig {
    /// Whether the axis is prismatic: then read m for rad.
    pub prismatic: bool,
    /// Whether the receiver's echo is recorded; if not, events alone are timed.
    pub echoed: bool,
    /// Whether the servo's position is recorded in the place of the receiver's echo.
    pub is_servo: bool,
    /// From one packet to the next \[s\].
    pub period: f64,
    /// Step in which a command is written \[rad\].
    pub quantum: f64,
    /// The way as far as it is known.
    pub values: CommandValues<f64>,
    /// Standard deviation of the healthy delay's jitter \[s\], if it is known.
    pub delay_noise: Option<f64>,
    /// Standard deviation of what that is known to, as a share of it.
    pub noise_share: f64,
    /// Standard deviations of what may differ, by field of [`CommandValues`], in the field's unit.
    pub tolerance: Vec<(&'static str, f64)>,
}

/// Signals of a command's way: name, unit of a turning and of a sliding axis, meaning.
pub const COMMAND_SIGNALS: [(&str, &str, &str, &str); 9] = [
    ("t", "s", "s", "time by the sender's clock"),
    ("sent", "rad", "m", "command as it was sent"),
    ("sent.sequence", "1", "1", "number of its packet"),
    ("received", "rad", "m", "command in force at the receiver's tick of the same row"),
    ("received.sequence", "1", "1", "number of the packet that it came with"),
    ("received.t", "s", "s", "time by the other clock in the same row"),
    ("sent.event", "1", "1", "1 from the row in which a command left, 0 before"),
    ("target.rate", "rad/s", "m/s", "rate that the robot's controller wants"),
    ("motion.rate", "rad/s", "m/s", "rate that the robot has"),
];

/// Required signals of an echo.
const ECHO: [&str; 3] = ["t", "sent", "received"];

impl CommandRig {
    /// The model file's units of the signals.
    pub(super) fn signals(prismatic: bool) -> Vec<(&'static str, &'static str)> {
        COMMAND_SIGNALS.iter().map(|row| (row.0, if prismatic { row.2 } else { row.1 })).collect()
    }
}

pub(super) fn command(c: &mut Checker, file: &RigFile) -> Option<CommandRig> {
    let Some(written) = &file.command else {
        c.refuse(&file.kind.span, "a rig of kind \"command\" needs the table [command]", "add [command] with period");
        return None;
    };
    needed(c, file);
    let t = &written.value;
    let choice = |c: &mut Checker, motion| c.choice(motion, &[("revolute", false), ("prismatic", true)]);
    let prismatic = t.motion.as_ref().is_some_and(|motion| choice(c, motion));
    let angle = if prismatic { "m" } else { "rad" };
    let values = values(c, t);
    let values = with_effects(c, prismatic, file, values);
    let noise = &file.tolerance.delay_noise;
    let delay_noise = noise.as_ref().map(|noise| c.number(noise, "s", Range::above(0.0, 1.0)));
    Some(CommandRig {
        prismatic,
        is_servo: t.received.as_ref().is_some_and(|what| c.choice(what, &[("echo", false), ("position", true)])),
        echoed: ECHO.iter().all(|name| file.log.contains_key(*name)),
        period: c.number(&t.period, "s", Range::above(0.0, 1.0)),
        quantum: c.number_or(&t.quantum, 0.0, angle, Range::within(0.0, ANGLE)),
        values,
        delay_noise,
        noise_share: c.number_or(&file.tolerance.noise, 0.1, "1", Range::within(0.0, 1.0)),
        tolerance: tolerance(c, file),
    })
}

/// An echo, or an event and what it moved.
fn needed(c: &mut Checker, file: &RigFile) {
    let has = |name: &str| file.log.contains_key(name);
    if !has("sent.event") {
        missing(c, file, &ECHO);
    } else if !has("target.rate") && !has("motion.rate") {
        let message = "[log] names a column for `sent.event` and none for what it moved";
        c.refuse(&file.kind.span, message, "add \"target.rate\" or \"motion.rate\", or both");
    }
}

fn values(c: &mut Checker, t: &CommandTable) -> CommandValues<f64> {
    let delay = Range::within(0.0, MAX_DELAY_S);
    CommandValues { transport_delay: c.number_or(&t.transport_delay, 0.0, "s", delay), ..CommandValues::null() }
}

/// What is known exactly is left out.
fn tolerance(c: &mut Checker, file: &RigFile) -> Vec<(&'static str, f64)> {
    let offset = c.number_or(&file.tolerance.clock_offset, 0.0, "s", Range::within(0.0, 1.0));
    let mut all = vec![("clock_offset", offset)];
    all.retain(|(_, sd)| *sd > 0.0);
    all
}
