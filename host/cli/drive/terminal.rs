//! The terminal as the operator of a session, with the page beside it if one is served; signals and panics.

use crate::words::{say, warn};
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

/// SIGINT, SIGTERM and panics of any thread end in a controlled stop.
pub(super) fn listen(alarms: &Arc<Alarms>, controls: &Arc<Controls>) {
    let (for_signals, view) = (Arc::clone(alarms), Arc::clone(controls));
    // Without a handler the signal ends the process, and the controllers' own time-outs stop the robots.
    let _ = ctrlc::set_handler(move || {
        for_signals.signals.fetch_add(1, Ordering::Relaxed);
        view.leave();
    });
    let (for_panics, before) = (Arc::clone(alarms), std::panic::take_hook());
    std::panic::set_hook(Box::new(move |info| {
        for_panics.panicked.store(true, Ordering::Relaxed);
        before(info);
    }));
}

/// The terminal of the command, and the page if one is served.
pub(super) struct Terminal {
    pub(super) page: Option<OperatorPage>,
}

impl Operator for Terminal {
    fn notice(&self, notice: &SessionNotice) {
        if notice.is_warning() { warn(notice) } else { say(notice) }
    }

    fn watch(&self, samples: Samples, budgets: Budgets, controls: &Controls) {
        let mut watch = |view: &View| self.page.iter().for_each(|page| page.board().show(view));
        if let Err(error) = show(samples, budgets, controls, &mut watch) {
            warn(format!("the view has failed ({error}); the run goes on, Ctrl-C stops it"));
        }
    }

    fn answered(&self, answer: &SessionAnswer) {
        self.page.iter().for_each(|page| page.board().finish(answer));
    }
}
