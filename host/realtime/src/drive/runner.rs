//! A session to its end: cycle after cycle, with log, evidence, view and whoever wants it stopped.

use super::controls::Controls;
use super::feed::Feed;
use super::session::Session;
use crate::log::codes::StopCause;
use crate::log::evidence::EvidenceBuffer;
use crate::log::writer::LogWriter;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

/// What the cycle hands its records to.
pub struct Keeping {
    /// The log's ring.
    pub log: Option<LogWriter>,
    /// The last seconds.
    pub evidence: EvidenceBuffer,
    /// The operator's view.
    pub feed: Option<Feed>,
}

impl Keeping {
    fn take(&mut self, session: &Session) {
        let record = session.record();
        if let Some(log) = &mut self.log {
            // A record that the log loses is counted there, and the evidence has it.
            let _ = log.push(*record);
        }
        self.evidence.push(record);
        if let Some(feed) = &mut self.feed {
            feed.push(record);
            feed.notice(session.core());
        }
    }
}

/// Who may want the run stopped, besides the operator at the view.
#[derive(Debug, Default)]
pub struct Alarms {
    /// SIGINT and SIGTERM so far.
    pub signals: AtomicU32,
    /// Some thread has panicked.
    pub panicked: AtomicBool,
}

/// Drives to the end of the session; the protocols' own end comes at once if a stop is asked for twice.
///
/// A panic of the cycle itself is caught: what was sent last is ramped down by the limiters of the wire alone.
pub fn run(session: &mut Session, keeping: &mut Keeping, controls: &Controls, alarms: &Alarms) {
    loop {
        if controls.has_go() {
            session.go();
        }
        let (keys, signals) = (controls.stops(), alarms.signals.load(Ordering::Relaxed));
        if keys + signals > 1 {
            session.end_at_once(StopCause::Operator);
            keeping.take(session);
            return;
        }
        let request = if alarms.panicked.load(Ordering::Relaxed) {
            Some(StopCause::Panic)
        } else if signals > 0 {
            Some(StopCause::Signal)
        } else {
            (keys > 0).then_some(StopCause::Operator)
        };
        let Ok(over) = catch_unwind(AssertUnwindSafe(|| session.cycle(request))) else {
            session.ramp_down_blind();
            keeping.take(session);
            return;
        };
        keeping.take(session);
        if over {
            return;
        }
    }
}
