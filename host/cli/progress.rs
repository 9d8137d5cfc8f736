//! Progress on the terminal: a bar where there is a terminal, plain lines elsewhere; and Ctrl-C.

use crate::terminal::{Exit, warn};
use indicatif::{ProgressBar, ProgressStyle};
use softdock_farm::{Cancel, Context, Note, Observer, ProgressLines, Work};
use std::io::IsTerminal;
use std::sync::{LazyLock, Mutex};
use std::time::Duration;

/// Cancelled by Ctrl-C or SIGTERM; global because a signal belongs to the process.
static CANCEL: LazyLock<Cancel> = LazyLock::new(Cancel::default);

/// Handles Ctrl-C: the first cancels the work and keeps every finished run; the second exits at once and loses the runs
/// of the last seconds. Files stay valid in both cases.
pub(crate) fn listen() {
    let on_signal = || {
        if CANCEL.is_cancelled() {
            std::process::exit(Exit::Incomplete as i32);
        }
        CANCEL.cancel();
    };
    // Fails only if a handler is set already.
    let _ = ctrlc::set_handler(on_signal);
}

/// Whether Ctrl-C was pressed.
pub(crate) fn stopped() -> bool {
    CANCEL.is_cancelled()
}

/// Prints progress and notes to standard error; one piece of work at a time.
#[derive(Default)]
pub(crate) struct Terminal {
    work: Mutex<Option<Shown>>,
}

/// A piece of work on the terminal.
struct Shown {
    bar: Option<ProgressBar>,
    lines: ProgressLines,
}

impl Terminal {
    /// Creates the observer and handles Ctrl-C.
    pub(crate) fn new() -> Self {
        listen();
        Self::default()
    }

    /// Returns observer and cancel token for campaign functions.
    pub(crate) fn context(&self) -> Context<'_> {
        Context { observer: self, cancel: &CANCEL }
    }
}

impl Observer for Terminal {
    fn begin(&self, work: Work, total: u64) {
        let style =
            ProgressStyle::with_template("{msg} {wide_bar} {human_pos} of {human_len} runs  {per_sec}  {eta} left");
        let bar = std::io::stderr().is_terminal().then(|| {
            let bar = ProgressBar::new(total).with_style(style.expect("a fixed template")).with_message(work.name());
            bar.enable_steady_tick(Duration::from_millis(200));
            bar
        });
        let lines = ProgressLines::new(work, total);
        *self.work.lock().expect("no holder panics") = Some(Shown { bar, lines });
    }

    fn progress(&self, _: Work, done: u64) {
        let mut shown = self.work.lock().expect("no holder panics");
        let Some(shown) = &mut *shown else { return };
        match &shown.bar {
            Some(bar) => bar.set_position(done.min(bar.length().unwrap_or(done))),
            None => shown.lines.next(done).iter().for_each(warn),
        }
    }

    fn end(&self, _: Work) {
        if let Some(Shown { bar: Some(bar), .. }) = self.work.lock().expect("no holder panics").take() {
            bar.finish_and_clear();
        }
    }

    fn note(&self, note: &Note) {
        match &*self.work.lock().expect("no holder panics") {
            Some(Shown { bar: Some(bar), .. }) => bar.suspend(|| warn(note)),
            _ => warn(note),
        }
    }
}
