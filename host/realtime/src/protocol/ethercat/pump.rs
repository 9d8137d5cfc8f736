//! Moves ethercrab's frames and feeds its timers, in the thread that waits for an answer.
//!
//! ethercrab is a set of futures over a store of frames; with its own `std` support a second thread moves the frames
//! and a third one the timers. Here the thread of the cycle does both while it waits: no hand-over between threads, no
//! heap, and the deadline of the wait is the cycle's own.

use super::raw::{MAX_FRAME, RawSocket};
use crate::clock::{Clock, Monotonic};
use crate::time::Nanos;
use ethercrab::error::Error;
use ethercrab::{PduRx, PduTx, ReceiveAction};
use std::io;
use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::{Context, Poll, Wake, Waker};

/// ethercrab's timers are looked at so often while frames are waited for; only its start-up uses them.
const TIMERS: Nanos = Nanos::from_millis(1);

/// Something has happened that a future waits for.
#[derive(Debug, Default)]
struct Flag(AtomicBool);

impl Wake for Flag {
    fn wake(self: Arc<Self>) {
        self.wake_by_ref();
    }

    fn wake_by_ref(self: &Arc<Self>) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// The time of ethercrab's timers: the machine's monotonic clock.
struct Timers;

impl embassy_time_driver::Driver for Timers {
    fn now(&self) -> u64 {
        // Nanoseconds fit 64 bit for centuries; the product needs more.
        (u128::from(Monotonic.now().0 as u64) * u128::from(embassy_time_driver::TICK_HZ) / 1_000_000_000) as u64
    }

    fn schedule_wake(&self, at: u64, waker: &Waker) {
        // Later times are found by polling again: `Pump::run` does so every millisecond.
        if at <= self.now() {
            waker.wake_by_ref();
        }
    }
}

embassy_time_driver::time_driver_impl!(static TIMER_DRIVER: Timers = Timers);

/// What has passed the socket.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Passed {
    /// Frames that ethercrab did not await any more, or could not read.
    pub(super) stale: u64,
    /// Frames of others.
    pub(super) foreign: u64,
}

/// The way of frames between ethercrab and an interface.
pub(super) struct Pump {
    socket: RawSocket,
    tx: PduTx<'static>,
    rx: PduRx<'static>,
    flag: Arc<Flag>,
    waker: Waker,
    frame: [u8; MAX_FRAME],
    passed: Passed,
}

impl Pump {
    pub(super) fn new(socket: RawSocket, tx: PduTx<'static>, rx: PduRx<'static>) -> Self {
        let flag = Arc::new(Flag::default());
        let waker = Waker::from(Arc::clone(&flag));
        Self { socket, tx, rx, flag, waker, frame: [0; MAX_FRAME], passed: Passed::default() }
    }

    pub(super) fn passed(&self) -> Passed {
        self.passed
    }

    /// Runs a future to its end, or drops it at the deadline: its frames may be used again, late answers are ignored.
    ///
    /// # Errors
    /// If the interface fails.
    pub(super) fn run<F: Future>(&mut self, future: F, deadline: Nanos) -> io::Result<Option<F::Output>> {
        let mut future = pin!(future);
        let waker = self.waker.clone();
        let mut context = Context::from_waker(&waker);
        let mut over = false;
        loop {
            self.flag.0.store(false, Ordering::Relaxed);
            if let Poll::Ready(output) = future.as_mut().poll(&mut context) {
                return Ok(Some(output));
            }
            if over {
                return Ok(None);
            }
            self.transmit()?;
            // What has come while this thread was held up is looked at once more, deadline or not.
            let now = Monotonic.now();
            over = now >= deadline;
            self.take()?;
            if !over && !self.flag.0.load(Ordering::Relaxed) {
                self.socket.wait(deadline.min(now + TIMERS))?;
                self.take()?;
            }
        }
    }

    /// Sends all frames that are ready; one for which there is no room stays ready.
    fn transmit(&mut self) -> io::Result<()> {
        let mut failure = None;
        while let Some(frame) = self.tx.next_sendable_frame() {
            let sent = frame.send_blocking(|bytes| match self.socket.send(bytes) {
                Ok(true) => Ok(bytes.len()),
                Ok(false) => Ok(0),
                Err(error) => {
                    failure = Some(error);
                    Err(Error::SendFrame)
                }
            });
            if sent.is_err() {
                break;
            }
        }
        failure.map_or(Ok(()), Err)
    }

    /// Hands all frames that have come to ethercrab.
    fn take(&mut self) -> io::Result<()> {
        while let Some(length) = self.socket.receive(&mut self.frame)? {
            match self.rx.receive_frame(self.frame.get(..length).unwrap_or_default()) {
                Ok(ReceiveAction::Processed) => {}
                Ok(ReceiveAction::Ignored) => self.passed.foreign += 1,
                Err(_) => self.passed.stale += 1,
            }
        }
        Ok(())
    }
}
