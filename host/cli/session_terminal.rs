//! The terminal as the operator of a session, with the web page if one is served; signals and panics.

use crate::terminal::{print, warn};
use softdock_realtime::drive::controls::Controls;
use softdock_realtime::drive::feed::Samples;
use softdock_realtime::drive::runner::Alarms;
use softdock_realtime::view::model::{Budgets, View};
use softdock_realtime::view::show;
use softdock_session::answer::SessionAnswer;
use softdock_session::operator::{Operator, SessionNotice};
use softdock_session::page::OperatorPage;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// Turns SIGINT, SIGTERM and panics of any thread into a controlled stop.
pub(crate) fn handle_alarms(alarms: &Arc<Alarms>, controls: &Arc<Controls>) {
    let (for_signals, view) = (Arc::clone(alarms), Arc::clone(controls));
    // Without a handler the signal ends the process, and the controllers' own time-outs stop the robots.
    let _ = ctrlc::set_handler(move || {
        for_signals.signals.fetch_add(1, Ordering::Relaxed);
        view.request_close();
    });
    let (for_panics, previous) = (Arc::clone(alarms), std::panic::take_hook());
    std::panic::set_hook(Box::new(move |info| {
        for_panics.panicked.store(true, Ordering::Relaxed);
        previous(info);
    }));
}

/// The terminal, and the web page if one is served.
pub(crate) struct SessionTerminal {
    pub(crate) page: Option<OperatorPage>,
    /// Whether standard output is kept for the answer as JSON.
    pub(crate) is_json: bool,
}

impl Operator for SessionTerminal {
    fn notice(&self, notice: &SessionNotice) {
        if notice.is_warning() || self.is_json { warn(notice) } else { print(notice) }
    }

    fn watch(&self, samples: Samples, budgets: Budgets, controls: &Controls) {
        let mut watch = |view: &View| self.page.iter().for_each(|page| page.board().show(view));
        if let Err(error) = show(samples, budgets, controls, &mut watch) {
            warn(format!("the terminal view failed ({error}); the run continues, Ctrl-C stops it"));
        }
    }

    fn answered(&self, answer: &SessionAnswer) {
        self.page.iter().for_each(|page| page.board().finish(answer));
    }
}
