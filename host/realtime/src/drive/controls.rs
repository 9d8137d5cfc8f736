//! Shared flags of operator and session; reading and writing them never blocks.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

/// Requests of the operator, and the state of the session.
#[derive(Debug, Default)]
pub struct Controls {
    stops: AtomicU32,
    ended: AtomicBool,
    close_requested: AtomicBool,
    go: AtomicBool,
}

impl Controls {
    /// Requests a stop: a controlled one the first time, at once the second time.
    pub fn request_stop(&self) {
        self.stops.fetch_add(1, Ordering::SeqCst);
    }

    /// Returns the number of stop requests; never blocks.
    pub fn stops(&self) -> u32 {
        self.stops.load(Ordering::SeqCst)
    }

    /// Marks the session as over: nothing moves any more.
    pub fn end(&self) {
        self.ended.store(true, Ordering::SeqCst);
    }

    /// Gives GO: the robots may move.
    pub fn go(&self) {
        self.go.store(true, Ordering::SeqCst);
    }

    /// Whether GO was given.
    pub fn has_go(&self) -> bool {
        self.go.load(Ordering::SeqCst)
    }

    /// Requests, on a signal, that the view closes once the session is over.
    pub fn request_close(&self) {
        self.close_requested.store(true, Ordering::SeqCst);
    }

    /// Whether a signal requests that the view closes.
    pub fn close_requested(&self) -> bool {
        self.close_requested.load(Ordering::SeqCst)
    }

    /// Whether the session is over.
    pub fn ended(&self) -> bool {
        self.ended.load(Ordering::SeqCst)
    }
}
