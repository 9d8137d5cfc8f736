//! Long calls: without the interpreter's lock, with progress, and with Ctrl-C.

use pyo3::prelude::*;
use softdock_farm::{Cancel, Context, Note, Observer, Work};
use std::panic::resume_unwind;
use std::sync::Mutex;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

/// Time between two looks at Python's signals, and between two reports of progress.
const TICK: Duration = Duration::from_millis(100);

/// What the work reports to Python.
enum Event {
    /// Name of the work, runs that have ended, all runs.
    Progress(&'static str, u64, u64),
    /// A note for the user.
    Note(String),
}

/// Sends what the work reports to the thread of the caller.
struct Relay {
    events: Sender<Event>,
    /// Runs of the present work, and when it was last reported.
    state: Mutex<(u64, Option<Instant>)>,
}

impl Relay {
    /// The caller may have stopped listening.
    fn send(&self, event: Event) {
        let _ = self.events.send(event);
    }
}

impl Observer for Relay {
    fn begin(&self, work: Work, total: u64) {
        *self.state.lock().expect("no holder panics") = (total, None);
        self.send(Event::Progress(work.name(), 0, total));
    }

    fn progress(&self, work: Work, done: u64) {
        let mut state = self.state.lock().expect("no holder panics");
        let (total, last) = &mut *state;
        let is_due = done >= *total || last.is_none_or(|last| last.elapsed() >= TICK);
        if is_due {
            *last = Some(Instant::now());
            self.send(Event::Progress(work.name(), done, *total));
        }
    }

    fn note(&self, note: &Note) {
        self.send(Event::Note(note.to_string()));
    }
}

/// Does work on another thread, without the interpreter's lock. `progress(work, done, total)` and `note(text)` are
/// called on this thread. Ctrl-C, and an exception of a callback, cancel the work: finished runs are kept, and the
/// exception is raised when the work has ended.
pub(crate) fn interruptible<T: Send>(
    py: Python<'_>,
    (progress, note): (Option<&Py<PyAny>>, Option<&Py<PyAny>>),
    work: impl FnOnce(Context) -> T + Send,
) -> PyResult<T> {
    let (events, received) = channel();
    // No other thread receives; `detach` asks for what could.
    let received = Mutex::new(received);
    let cancel = Cancel::default();
    std::thread::scope(|scope| {
        let token = cancel.clone();
        let working = scope.spawn(move || {
            let relay = Relay { events, state: Mutex::default() };
            work(Context { observer: &relay, cancel: &token })
        });
        let mut raised: PyResult<()> = Ok(());
        loop {
            let handled = match py.detach(|| received.lock().expect("no holder panics").recv_timeout(TICK)) {
                Ok(Event::Progress(name, done, total)) => {
                    progress.map_or(Ok(()), |progress| progress.call1(py, (name, done, total)).map(drop))
                }
                Ok(Event::Note(text)) => note.map_or(Ok(()), |note| note.call1(py, (text,)).map(drop)),
                Err(RecvTimeoutError::Timeout) => Ok(()),
                Err(RecvTimeoutError::Disconnected) => break,
            };
            if raised.is_ok() {
                raised = handled.and_then(|()| py.check_signals());
                if raised.is_err() {
                    cancel.cancel();
                }
            }
        }
        let result = py.detach(|| working.join()).unwrap_or_else(|panic| resume_unwind(panic));
        raised.map(|()| result)
    })
}
