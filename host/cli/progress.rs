//! How far the work is: a bar on a terminal, plain lines elsewhere; and the wish to stop.

use crate::words::warn;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Seconds between two plain lines.
const LINE_SECONDS: u64 = 10;

static STOP: AtomicBool = AtomicBool::new(false);

/// From now on Ctrl-C asks for an orderly end, which keeps every finished run; a second one ends at once and loses the
/// finished runs of the batch under way. Files are whole in both cases.
pub(crate) fn listen() {
    let heard = || {
        if STOP.swap(true, Ordering::Relaxed) {
            std::process::exit(crate::words::Exit::Incomplete as i32);
        }
    };
    // A handler can fail to be set only where one is set already.
    let _ = ctrlc::set_handler(heard);
}

/// True after Ctrl-C.
pub(crate) fn stopped() -> bool {
    STOP.load(Ordering::Relaxed)
}

/// Counts the runs of a piece of work.
pub(crate) struct Progress {
    bar: Option<ProgressBar>,
    what: &'static str,
    total: u64,
    done: AtomicU64,
    spoken: AtomicU64,
    begin: Instant,
}

impl Progress {
    /// Starts to count `total` runs.
    pub(crate) fn new(what: &'static str, total: u64) -> Self {
        let style =
            ProgressStyle::with_template("{msg} {wide_bar} {human_pos} of {human_len} runs  {per_sec}  {eta} left");
        let bar = std::io::stderr().is_terminal().then(|| {
            let bar = ProgressBar::new(total).with_style(style.expect("a fixed template")).with_message(what);
            bar.enable_steady_tick(Duration::from_millis(200));
            bar
        });
        Self { bar, what, total, done: AtomicU64::new(0), spoken: AtomicU64::new(0), begin: Instant::now() }
    }

    /// Counts runs that have ended; false if the work should stop.
    pub(crate) fn add(&self, runs: usize) -> bool {
        let done = self.done.fetch_add(runs as u64, Ordering::Relaxed) + runs as u64;
        match &self.bar {
            Some(bar) => bar.set_position(done.min(self.total)),
            None => self.speak(done),
        }
        !stopped()
    }

    /// Takes back what a dropped batch had counted.
    pub(crate) fn set(&self, done: u64) {
        self.done.store(done, Ordering::Relaxed);
    }

    /// One line every few seconds, and one at the end.
    fn speak(&self, done: u64) {
        let elapsed = self.begin.elapsed();
        let slot = elapsed.as_secs() / LINE_SECONDS;
        let due = self.spoken.fetch_max(slot, Ordering::Relaxed) < slot;
        if due || done >= self.total {
            let seconds = elapsed.as_secs_f64().max(1e-3);
            let rate = done as f64 / seconds;
            let left = (self.total.saturating_sub(done)) as f64 / rate.max(1e-9);
            warn(format!("{} {done} of {} runs  {rate:.1}/s  {left:.0} s left", self.what, self.total));
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
