//! The command rig: commands as sent and as received, each stamped by its own clock.

mod effects;
mod path;

use crate::catalogue::{Parameter, Sizes};
use crate::instrument::Instrument;
use crate::motion::{Motion, burst, chirp, sine};
use crate::random::{Disturbance, Stream};
use crate::session::{FRESH, HOLDOUT, Run, SimulatedRig};
use crate::table::{Column, Table, column};
pub(crate) use effects::{EFFECTS, OUTSIDE};
use path::Path;

/// Tick of sender and receiver \[s\].
pub(crate) const TICK: f64 = 1e-3;
/// Length of a record \[s\].
const DURATION_S: f64 = 8.0;
/// Quantum of a command on the wire \[rad\].
const QUANTUM: f64 = 1e-6;
/// Standard deviation of the delay's own jitter \[s\].
const DELAY_JITTER: f64 = 2e-5;
/// Standard deviation between data sets of the receiver's clock against the sender's \[s\].
const CLOCK_OFFSET: f64 = 2e-4;

const TRAINING: &[&str] = &["multisine", "steps", "slow"];

const COLUMNS: [Column; 6] = [
    column("t_s", 3),
    column("sent_seq", 0),
    column("sent_rad", 6),
    column("received_t_s", 3),
    column("received_seq", 0),
    column("received_rad", 6),
];

const MODEL: &str = r#"schema = "rig/1"
kind = "command"
id = "bench-command"

# Commands of one axis, sent every millisecond and echoed by the receiver at its own ticks: the value in force, and the
# number of the packet that it came with (-1 before the first).
[command]
period = "1 ms"
transport_delay = "2 ms"
quantum = "0.001 mrad"

# Tolerances: standard deviations of the nuisance parameters.
[tolerance]
clock_offset = "0.2 ms"           # receiver's stamps against the sender's
delay_noise = "0.02 ms"

# 1 kHz; a row is one tick of each clock.
[log]
"t" = { column = "t_s", unit = "s" }
"sent.sequence" = { column = "sent_seq", unit = "1" }
"sent" = { column = "sent_rad", unit = "rad" }
"received.t" = { column = "received_t_s", unit = "s" }
"received.sequence" = { column = "received_seq", unit = "1" }
"received" = { column = "received_rad", unit = "rad" }
"#;

/// The command of an experiment \[rad\].
fn motion(experiment: &str) -> Motion {
    let (centre, waves) = match experiment {
        "multisine" => {
            (0.0, vec![sine(0.1, 0.4, 0.3), sine(0.04, 1.3, 2.0), sine(0.01, 4.1, 1.0), sine(0.003, 9.7, 0.0)])
        }
        // Large and fast, for limits; then small and fast.
        "steps" => (0.3, vec![burst(0.25, 0.8, 0.2, 4.0), chirp(0.02, 1.0, 12.0, 4.0, 7.9)]),
        "slow" => (-0.2, vec![sine(0.3, 0.15, 0.0), burst(0.02, 2.7, 2.0, 6.0)]),
        HOLDOUT => (0.1, vec![sine(0.12, 0.55, 1.0), chirp(0.02, 6.0, 2.0, 0.5, 7.5), burst(0.05, 1.6, 3.0, 6.0)]),
        FRESH => (0.0, vec![sine(0.15, 0.33, 2.0), sine(0.03, 1.9, 0.0), chirp(0.008, 3.0, 8.0, 1.0, 7.0)]),
        _ => unreachable!("experiments come from the list above"),
    };
    Motion { centre, waves }
}

/// The rig with its effects and its clock.
pub(crate) struct CommandRig {
    sizes: Sizes,
    clock_offset: f64,
}

impl CommandRig {
    pub(crate) fn new(sizes: &Sizes, seed: u64) -> Self {
        let clock_offset = CLOCK_OFFSET * Stream::new(seed, "nuisances of the command", 0).normal();
        Self { sizes: sizes.clone(), clock_offset }
    }
}

impl SimulatedRig for CommandRig {
    fn model(&self) -> String {
        MODEL.into()
    }

    fn training(&self) -> &'static [&'static str] {
        TRAINING
    }

    fn record(&self, experiment: &str, run: &Run) -> Table {
        let motion = motion(experiment);
        let mut jitter =
            run.noise.map(|colour| Disturbance::new(colour, DELAY_JITTER, TICK, run.stream("restlessness")));
        let mut wire = Instrument::new(run, "wire", 0.0, QUANTUM);
        let mut path = Path::new(&self.sizes, motion.at(0.0)[0], run.stream("command path"));
        let mut table = Table::new(&COLUMNS);
        for tick in 0..(DURATION_S / TICK).round() as usize {
            let time = tick as f64 * TICK;
            let disturbance = jitter.as_mut().map_or(0.0, Disturbance::next);
            let received = path.receive(&motion, tick, self.clock_offset, disturbance);
            let sent = wire.read(motion.at(time)[0]);
            let stamp = run.start_s + time;
            let value = wire.read(received.value);
            table.push(&[stamp, tick as f64, sent, stamp, received.packet as f64, value]);
        }
        table
    }

    fn further(&self, id: &str) -> Vec<Parameter> {
        match id {
            "long_tail_jitter" => vec![Parameter::new("exponent", path::TAIL_EXPONENT, "")],
            "beating_delay" => vec![Parameter::new("period", path::BEAT_S, "s")],
            _ => Vec::new(),
        }
    }

    fn nuisances(&self) -> Vec<Parameter> {
        vec![Parameter::new("clock_offset", self.clock_offset, "s")]
    }
}
