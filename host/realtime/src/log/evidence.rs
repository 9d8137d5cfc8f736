//! Evidence of a stop: its cause, the limits in force, the clock used, and the last seconds of all signals.
//!
//! The records are in memory allocated before the session began, apart from the log and its thread: they exist even if
//! the log is slow, full or broken.

use super::codes::StopCause;
use super::record::CycleRecord;
use super::table::{LogColumn, LogValue, Logged, Type, columns, store};
use crate::time::Nanos;
use std::fmt::Write as _;
use std::io::{self, Write};

/// Header above the signals.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Circumstances {
    /// The limits in force, line by line as printed before arming.
    pub limits: String,
    /// The clock of the cycle (`CLOCK_MONOTONIC, SCHED_FIFO 80`, `virtual`).
    pub clock: String,
    /// Further facts: text of the fault, versions.
    pub remarks: String,
}

/// The last records, and the one of the stop.
pub struct EvidenceBuffer {
    ring: Box<[CycleRecord]>,
    pushed: u64,
    stop: Option<(StopCause, u64, Nanos)>,
    /// Number of records still accepted after the stop.
    after: u64,
}

/// Share of the span recorded after the stop: enough to show the begin of the ramp.
const AFTER: usize = 8;

impl EvidenceBuffer {
    /// Allocates memory for `span` of records before a stop, one each `cycle`, and an eighth of it after; touches all
    /// of it.
    pub fn new(span: Nanos, cycle: Nanos) -> Self {
        let records = (span.0 / cycle.0.max(1)).max(1) as usize;
        let after = records / AFTER;
        let ring = vec![CycleRecord::BLANK; records + after].into_boxed_slice();
        Self { ring, pushed: 0, stop: None, after: after as u64 }
    }

    /// Takes a cycle's record; one with a cause is the stop. Only copies it.
    ///
    /// Takes the first records after the stop, then no more.
    pub fn push(&mut self, record: &CycleRecord) {
        if self.stop.is_some() {
            if self.after == 0 {
                return;
            }
            self.after -= 1;
        } else if record.cause != StopCause::None {
            self.stop = Some((record.cause, record.cycle, record.time));
        }
        let place = (self.pushed % self.ring.len() as u64) as usize;
        self.ring[place] = *record;
        self.pushed += 1;
    }

    /// Returns cause, cycle and time since the start of the stop.
    pub fn stop(&self) -> Option<(StopCause, u64, Nanos)> {
        self.stop
    }

    /// Returns the records, oldest first.
    pub fn records(&self) -> impl Iterator<Item = &CycleRecord> {
        let length = self.ring.len();
        let (newer, older) = match usize::try_from(self.pushed) {
            Ok(pushed) if pushed < length => (&self.ring[..pushed], &self.ring[..0]),
            _ => self.ring.split_at((self.pushed % length as u64) as usize),
        };
        older.iter().chain(newer)
    }

    /// Writes the evidence as text: lines with `#`, then CSV with a header line; missing values are empty. Not for the
    /// cycle.
    ///
    /// # Errors
    /// If the medium cannot be written.
    pub fn write(&self, out: &mut impl Write, circumstances: &Circumstances) -> io::Result<()> {
        let columns = columns::<CycleRecord>();
        writeln!(out, "# evidence of a stop")?;
        match self.stop {
            Some((cause, cycle, time)) => {
                writeln!(out, "# cause: {} ({})", cause.word(), cause.meaning())?;
                writeln!(out, "# cycle: {cycle}")?;
                writeln!(out, "# time_s: {:.9}", time.seconds())?;
            }
            None => writeln!(out, "# cause: none")?,
        }
        for (name, text) in [
            ("clock", &circumstances.clock),
            ("limits in force", &circumstances.limits),
            ("remarks", &circumstances.remarks),
        ] {
            writeln!(out, "# {name}:")?;
            text.lines().try_for_each(|line| writeln!(out, "#   {line}"))?;
        }
        let names: Vec<&str> = columns.iter().map(|column| column.name.as_str()).collect();
        writeln!(out, "{}", names.join(","))?;
        let (mut values, mut line) = (vec![LogValue::Word(0); columns.len()], String::new());
        for record in self.records() {
            store(record, &mut values);
            row(&mut line, &columns, &values);
            out.write_all(line.as_bytes())?;
        }
        out.flush()
    }
}

/// Writes one line of CSV. Real numbers round-trip exactly.
fn row(line: &mut String, columns: &[LogColumn], values: &[LogValue]) {
    line.clear();
    for (place, (column, value)) in columns.iter().zip(values).enumerate() {
        if place > 0 {
            line.push(',');
        }
        // Writing to a String cannot fail.
        let _ = match (column.kind, value) {
            (_, LogValue::Real(real)) if real.is_nan() => Ok(()),
            (_, LogValue::Real(real)) => write!(line, "{real}"),
            (_, LogValue::Signed(time)) => write!(line, "{time}"),
            (_, LogValue::Whole(count)) => write!(line, "{count}"),
            (Type::Code(words), LogValue::Word(code)) => write!(line, "{}", words.get(*code as usize).unwrap_or(&"")),
            (_, LogValue::Word(word)) => write!(line, "{word}"),
        };
    }
    line.push('\n');
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::sample;

    const CYCLE: Nanos = Nanos::from_millis(1);

    fn text(evidence: &EvidenceBuffer) -> String {
        let circumstances = Circumstances {
            limits: "robot_1 axis 1: 1.22 rad/s\nsensor age: 5 ms".to_owned(),
            clock: "virtual".to_owned(),
            remarks: String::new(),
        };
        let mut out = Vec::new();
        evidence.write(&mut out, &circumstances).expect("memory");
        String::from_utf8(out).expect("text")
    }

    #[test]
    fn records_around_a_stop_are_kept() {
        let mut evidence = EvidenceBuffer::new(Nanos::from_millis(2_000), CYCLE);
        (0..5_000).for_each(|n| evidence.push(&sample::cycle(n)));
        (5_000..9_000).for_each(|n| evidence.push(&sample::stopping(n)));
        assert_eq!(evidence.stop(), Some((StopCause::AxisLimit, 5_000, Nanos::from_millis(5_000))));
        let cycles: Vec<u64> = evidence.records().map(|record| record.cycle).collect();
        assert_eq!(cycles, (3_001..=5_250).collect::<Vec<_>>());
    }

    #[test]
    fn text_states_cause_limits_clock_and_every_column() {
        let mut evidence = EvidenceBuffer::new(Nanos::from_millis(10), CYCLE);
        (0..3).for_each(|n| evidence.push(&sample::cycle(n)));
        evidence.push(&sample::stopping(3));
        let text = text(&evidence);
        for line in [
            "# cause: axis_limit (a command outside the limits of an axis)",
            "# cycle: 3",
            "# time_s: 0.003000000",
            "#   virtual",
            "#   robot_1 axis 1: 1.22 rad/s",
            "#   sensor age: 5 ms",
        ] {
            assert!(text.lines().any(|found| found == line), "no `{line}` in {text}");
        }
        let mut rows =
            text.lines().filter(|line| !line.starts_with('#')).map(|line| line.split(',').collect::<Vec<_>>());
        let names = rows.next().expect("names");
        assert_eq!(names.len(), columns::<CycleRecord>().len());
        let rows: Vec<Vec<&str>> = rows.collect();
        assert_eq!(rows.len(), 4);
        let cell = |row: usize, name: &str| {
            rows[row][names.iter().position(|other| *other == name).unwrap_or_else(|| panic!("no `{name}`"))]
        };
        assert_eq!((cell(0, "phase"), cell(3, "phase")), ("approach", "stopping"));
        assert_eq!(cell(2, "time_ns"), "2000000");
        assert_eq!(cell(2, "robot_1_command_1_rad"), "", "a hold has no command");
        let position: f64 = cell(1, "robot_2_position_3_rad").parse().expect("a number");
        assert_eq!(position.to_bits(), sample::cycle(1).robot_2.position[2].to_bits());
    }

    #[test]
    fn evidence_of_a_short_session_and_without_a_stop() {
        let mut evidence = EvidenceBuffer::new(Nanos::from_millis(2_000), CYCLE);
        assert_eq!(evidence.records().count(), 0);
        (0..7).for_each(|n| evidence.push(&sample::cycle(n)));
        assert_eq!(evidence.records().map(|record| record.cycle).collect::<Vec<_>>(), (0..7).collect::<Vec<_>>());
        assert!(text(&evidence).contains("# cause: none"));
    }
}
