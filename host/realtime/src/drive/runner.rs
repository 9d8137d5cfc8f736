//! Runs a session to its end: cycles with log, evidence, view and stop requests.

use super::controls::Controls;
use super::feed::Feed;
use super::session::Session;
use crate::log::codes::StopCause;
use crate::log::evidence::EvidenceBuffer;
use crate::log::writer::LogWriter;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

/// Receivers of the cycle's records.
pub struct Keeping {
    /// Ring of the log.
    pub log: Option<LogWriter>,
    /// The last seconds.
    pub evidence: EvidenceBuffer,
    /// Operator's view.
    pub feed: Option<Feed>,
}

impl Keeping {
    fn take(&mut self, session: &Session) {
        let record = session.record();
        if let Some(log) = &mut self.log {
            // The log counts a record that it loses; the evidence still has it.
            let _ = log.push(*record);
        }
        self.evidence.push(record);
        if let Some(feed) = &mut self.feed {
            feed.push(record);
            feed.notice(session.core());
        }
    }
}

/// Stop requests other than the operator's.
#[derive(Debug, Default)]
pub struct Alarms {
    /// SIGINT and SIGTERM so far.
    pub signals: AtomicU32,
    /// Some thread has panicked.
    pub panicked: AtomicBool,
}

/// Runs a session to its end; a second stop request ends the protocol sessions at once.
///
/// Catches a panic of the cycle: the limiters of the wire then ramp the last commands to rest.
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
