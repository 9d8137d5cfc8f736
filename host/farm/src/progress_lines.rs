//! Progress as plain lines, for output that is no terminal.

use crate::observer::Work;
use std::time::Instant;

/// Seconds between two lines.
const LINE_SECONDS: u64 = 10;

/// Progress of one piece of work as lines of text.
#[derive(Clone, Debug)]
pub struct ProgressLines {
    work: Work,
    total: u64,
    begin: Instant,
    /// Number of intervals of [`LINE_SECONDS`] that have a line.
    intervals: u64,
}

impl ProgressLines {
    /// Starts the clock of a piece of work with `total` runs.
    pub fn new(work: Work, total: u64) -> Self {
        Self { work, total, begin: Instant::now(), intervals: 0 }
    }

    /// Returns a line if ten seconds have passed since the last one, or if all runs are done.
    pub fn next(&mut self, done: u64) -> Option<String> {
        let elapsed = self.begin.elapsed();
        let intervals = elapsed.as_secs() / LINE_SECONDS;
        if intervals <= self.intervals && done < self.total {
            return None;
        }
        self.intervals = intervals;
        let rate = done as f64 / elapsed.as_secs_f64().max(1e-3);
        let left = self.total.saturating_sub(done) as f64 / rate.max(1e-9);
        let (name, unit) = (self.work.name(), self.work.unit());
        Some(format!("{name} {done} of {} {unit}  {rate:.1}/s  {left:.0} s left", self.total))
    }
}
