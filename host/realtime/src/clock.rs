//! The clock of a session: the machine's monotonic clock, or virtual time that advances when a caller waits.

use crate::time::Nanos;
use std::cell::Cell;
use std::rc::Rc;

/// A clock that can be read and waited for.
pub trait Clock {
    /// Returns the present time.
    fn now(&self) -> Nanos;

    /// Waits until a time; returns at once if it has passed.
    fn sleep_until(&self, time: Nanos);
}

/// The machine's monotonic clock.
#[derive(Clone, Copy, Debug, Default)]
pub struct Monotonic;

impl Clock for Monotonic {
    fn now(&self) -> Nanos {
        let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
        // SAFETY: the pointer is to a local timespec; the call writes it and stores nothing.
        unsafe { libc::clock_gettime(libc::CLOCK_MONOTONIC, &raw mut time) };
        Nanos(time.tv_sec * 1_000_000_000 + time.tv_nsec)
    }

    fn sleep_until(&self, time: Nanos) {
        let until =
            libc::timespec { tv_sec: time.0.div_euclid(1_000_000_000), tv_nsec: time.0.rem_euclid(1_000_000_000) };
        // An absolute time: a signal that interrupts the sleep does not extend it.
        // SAFETY: the timespec outlives the call; no remainder is asked for.
        while unsafe {
            libc::clock_nanosleep(libc::CLOCK_MONOTONIC, libc::TIMER_ABSTIME, &raw const until, std::ptr::null_mut())
        } == libc::EINTR
        {}
    }
}

/// Virtual time, shared by all clones.
#[derive(Clone, Debug, Default)]
pub struct Virtual(Rc<Cell<i64>>);

impl Clock for Virtual {
    fn now(&self) -> Nanos {
        Nanos(self.0.get())
    }

    fn sleep_until(&self, time: Nanos) {
        self.0.set(self.0.get().max(time.0));
    }
}
