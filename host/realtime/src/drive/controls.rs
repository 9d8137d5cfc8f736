//! What the operator asks of a session, and what the session answers: flags that neither side waits for.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

/// What operator and session exchange.
#[derive(Debug, Default)]
pub struct Controls {
    stops: AtomicU32,
    ended: AtomicBool,
    leaves: AtomicBool,
    go: AtomicBool,
}

impl Controls {
    /// The operator (or a signal) wants a stop: the first time a controlled one, the second time at once.
    pub fn request_stop(&self) {
        self.stops.fetch_add(1, Ordering::SeqCst);
    }

    /// How often a stop was asked for; for the cycle, which neither waits nor locks here.
    pub fn stops(&self) -> u32 {
        self.stops.load(Ordering::SeqCst)
    }

    /// The drive is over: nothing moves any more.
    pub fn end(&self) {
        self.ended.store(true, Ordering::SeqCst);
    }

    /// The operator lets the robots move.
    pub fn go(&self) {
        self.go.store(true, Ordering::SeqCst);
    }

    /// Whether the operator has let the robots move.
    pub fn has_go(&self) -> bool {
        self.go.load(Ordering::SeqCst)
    }

    /// A signal wants the view gone, once the drive is over.
    pub fn leave(&self) {
        self.leaves.store(true, Ordering::SeqCst);
    }

    /// Whether a signal wants the view gone.
    pub fn leaves(&self) -> bool {
        self.leaves.load(Ordering::SeqCst)
    }

    /// Whether the drive is over.
    pub fn ended(&self) -> bool {
        self.ended.load(Ordering::SeqCst)
    }
}
