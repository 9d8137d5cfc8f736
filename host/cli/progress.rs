//! Progress on the terminal: a bar where there is a terminal, plain lines elsewhere; and Ctrl-C.

use crate::terminal::{BAR, Exit, warn};
use indicatif::{ProgressBar, ProgressStyle};
use softdock_farm::{Cancel, Context, Note, Observer, ProgressLines, Work};
use std::io::IsTerminal;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, LazyLock, Mutex, MutexGuard};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Cancelled by Ctrl-C or SIGTERM; global because a signal belongs to the process.
static CANCEL: LazyLock<Cancel> = LazyLock::new(Cancel::default);

/// Time without a sign of work after which one is shown.
const QUIET: Duration = Duration::from_secs(2);

/// Time between two lines where there is no terminal.
const LINE: Duration = Duration::from_secs(10);

/// Time between two looks at the work.
const LOOK: Duration = Duration::from_millis(200);

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

/// Prints progress and notes to standard error; one piece of work at a time. Work that reports nothing for two seconds has a
/// clock.
pub(crate) struct Terminal {
    state: Arc<Mutex<State>>,
    clock: Clock,
}

/// What the terminal shows of the work.
struct State {
    name: &'static str,
    begin: Instant,
    work: Option<ProgressLines>,
    /// When the work was last seen, and the next line of the clock.
    seen: Instant,
}

/// The thread that shows the time of silent work; it ends with its value.
struct Clock {
    stop: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Drop for Clock {
    fn drop(&mut self) {
        drop(self.stop.take());
        self.thread.take().map(JoinHandle::join);
        clear_bar();
    }
}

/// Removes the bar from the terminal.
fn clear_bar() {
    if let Some(bar) = BAR.lock().ok().and_then(|mut bar| bar.take()) {
        bar.finish_and_clear();
    }
}

/// Shows a bar in place of the one that is shown, if standard error is a terminal.
fn show_bar(bar: ProgressBar, template: &str, message: String) {
    clear_bar();
    let bar = bar.with_style(ProgressStyle::with_template(template).expect("a fixed template")).with_message(message);
    bar.enable_steady_tick(LOOK);
    if let Ok(mut shown) = BAR.lock() {
        *shown = Some(bar);
    }
}

fn is_terminal() -> bool {
    std::io::stderr().is_terminal()
}

impl State {
    /// Shows that silent work goes on.
    fn look(&mut self) {
        if self.work.is_some() || self.seen.elapsed() < QUIET {
            return;
        }
        if !is_terminal() {
            warn(format!("{} works, {:.0} s", self.name, self.begin.elapsed().as_secs_f64()));
            self.seen = Instant::now() + LINE - QUIET;
        } else if BAR.lock().is_ok_and(|bar| bar.is_none()) {
            let bar = ProgressBar::new_spinner().with_elapsed(self.begin.elapsed());
            show_bar(bar, "{spinner} {msg}  {elapsed}", self.name.to_owned());
        }
    }
}

impl Terminal {
    /// Creates the observer of a command and handles Ctrl-C.
    pub(crate) fn new(name: &'static str) -> Self {
        listen();
        let now = Instant::now();
        let state = Arc::new(Mutex::new(State { name, begin: now, work: None, seen: now }));
        let (stop, stopped) = channel();
        let looked = Arc::clone(&state);
        let look = move || {
            while stopped.recv_timeout(LOOK) == Err(RecvTimeoutError::Timeout) {
                if let Ok(mut state) = looked.lock() {
                    state.look();
                }
            }
        };
        let thread = Some(std::thread::spawn(look));
        Self { state, clock: Clock { stop: Some(stop), thread } }
    }

    /// Returns observer and cancel token for campaign functions.
    pub(crate) fn context(&self) -> Context<'_> {
        Context { observer: self, cancel: &CANCEL }
    }

    /// Ends the signs of work: an answer follows.
    pub(crate) fn end(self) {
        drop(self.clock);
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().expect("no holder panics")
    }
}

impl Observer for Terminal {
    fn begin(&self, work: Work, total: u64) {
        let mut state = self.state();
        state.work = Some(ProgressLines::new(work, total));
        if is_terminal() {
            let template = format!(
                "{{msg}} {{wide_bar}} {{human_pos}} of {{human_len}} {}  {{per_sec}}  {{eta}} left",
                work.unit()
            );
            show_bar(ProgressBar::new(total), &template, work.name().to_owned());
        }
    }

    fn progress(&self, _: Work, done: u64) {
        let mut state = self.state();
        let Some(lines) = &mut state.work else { return };
        let bar = BAR.lock().ok().and_then(|bar| bar.clone());
        match bar {
            Some(bar) => bar.set_position(done.min(bar.length().unwrap_or(done))),
            None => lines.next(done).iter().for_each(warn),
        }
    }

    fn end(&self, _: Work) {
        let mut state = self.state();
        (state.work, state.seen) = (None, Instant::now());
        clear_bar();
    }

    fn note(&self, note: &Note) {
        warn(note);
    }
}
