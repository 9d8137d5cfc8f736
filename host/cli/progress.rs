//! Progress on the terminal: a bar where there is a terminal, plain lines elsewhere; and Ctrl-C.

use crate::words::warn;
use indicatif::{ProgressBar, ProgressStyle};
use softdock_farm::{Cancel, Context, Note, Observer, Work};
use std::io::IsTerminal;
use std::sync::{LazyLock, Mutex};
use std::time::{Duration, Instant};

/// Seconds between two plain lines.
const LINE_SECONDS: u64 = 10;

/// Cancelled by Ctrl-C or SIGTERM, which the process gets as a whole.
static CANCEL: LazyLock<Cancel> = LazyLock::new(Cancel::default);

/// From now on Ctrl-C asks for an orderly end, which keeps every finished run; a second one ends at once and loses the
/// runs of the last seconds. Files are whole in both cases.
pub(crate) fn listen() {
    let on_signal = || {
        if CANCEL.is_cancelled() {
            std::process::exit(crate::words::Exit::Incomplete as i32);
        }
        CANCEL.cancel();
    };
    // A handler can fail to be set only where one is set already.
    let _ = ctrlc::set_handler(on_signal);
}

/// True after Ctrl-C.
pub(crate) fn stopped() -> bool {
    CANCEL.is_cancelled()
}

/// Shows progress and notes on standard error; one piece of work at a time.
#[derive(Default)]
pub(crate) struct Terminal {
    work: Mutex<Option<Shown>>,
}

/// A piece of work on the terminal.
struct Shown {
    bar: Option<ProgressBar>,
    total: u64,
    begin: Instant,
    /// Lines that were due so far.
    lines: u64,
}

impl Terminal {
    /// A terminal that listens to Ctrl-C.
    pub(crate) fn new() -> Self {
        listen();
        Self::default()
    }

    /// What campaign functions take.
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
        let shown = Shown { bar, total, begin: Instant::now(), lines: 0 };
        *self.work.lock().expect("no holder panics") = Some(shown);
    }

    fn progress(&self, work: Work, done: u64) {
        let mut shown = self.work.lock().expect("no holder panics");
        let Some(shown) = &mut *shown else { return };
        if let Some(bar) = &shown.bar {
            return bar.set_position(done.min(shown.total));
        }
        // One line every few seconds, and one at the end.
        let lines = shown.begin.elapsed().as_secs() / LINE_SECONDS;
        if lines > shown.lines || done >= shown.total {
            shown.lines = lines;
            let rate = done as f64 / shown.begin.elapsed().as_secs_f64().max(1e-3);
            let left = shown.total.saturating_sub(done) as f64 / rate.max(1e-9);
            warn(format!("{} {done} of {} runs  {rate:.1}/s  {left:.0} s left", work.name(), shown.total));
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
