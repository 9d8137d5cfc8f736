//! The clock of a drive: the machine's, or one of virtual time that moves when somebody waits.

use crate::time::Nanos;
use std::cell::Cell;
use std::rc::Rc;

/// Tells the time and waits for it.
pub trait Clock {
    /// The time now.
    fn now(&self) -> Nanos;

    /// Returns at a time, or at once if it has gone by.
    fn sleep_until(&self, time: Nanos);
}

/// The machine's monotonic clock.
#[derive(Clone, Copy, Debug, Default)]
pub struct Monotonic;

impl Clock for Monotonic {
    fn now(&self) -> Nanos {
        let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
        // SAFETY: the pointer is to a timespec of ours; the call writes it and keeps nothing.
        unsafe { libc::clock_gettime(libc::CLOCK_MONOTONIC, &raw mut time) };
        Nanos(time.tv_sec * 1_000_000_000 + time.tv_nsec)
    }

    fn sleep_until(&self, time: Nanos) {
        let until =
            libc::timespec { tv_sec: time.0.div_euclid(1_000_000_000), tv_nsec: time.0.rem_euclid(1_000_000_000) };
        // An absolute time: a signal that interrupts the sleep does not stretch it.
        // SAFETY: the timespec outlives the call; no remainder is asked for.
        while unsafe {
            libc::clock_nanosleep(libc::CLOCK_MONOTONIC, libc::TIMER_ABSTIME, &raw const until, std::ptr::null_mut())
        } == libc::EINTR
        {}
    }
}

/// Virtual time, shared by all that hold a clone.
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
