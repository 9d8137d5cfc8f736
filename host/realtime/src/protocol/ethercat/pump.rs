//! Transfers ethercrab's frames and runs its timers, in the thread that waits for an answer.
//!
//! ethercrab is a set of futures over a store of frames; its own `std` support uses a second thread for the frames and
//! a third one for the timers. Here the cycle's thread does both while it waits: no hand-over between threads, no
//! allocation, and the deadline of the wait is the cycle's own.

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

/// Period of polling ethercrab's timers while waiting for frames; only its start-up uses them.
const TIMERS: Nanos = Nanos::from_millis(1);

/// Set by wakers when a future can make progress.
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

/// Time source of ethercrab's timers: the machine's monotonic clock.
struct Timers;

impl embassy_time_driver::Driver for Timers {
    fn now(&self) -> u64 {
        // Nanoseconds fit 64 bit for centuries; the product needs more.
        (u128::from(Monotonic.now().0 as u64) * u128::from(embassy_time_driver::TICK_HZ) / 1_000_000_000) as u64
    }

    fn schedule_wake(&self, at: u64, waker: &Waker) {
        // `Pump::run` polls every millisecond, which covers later times.
        if at <= self.now() {
            waker.wake_by_ref();
        }
    }
}

embassy_time_driver::time_driver_impl!(static TIMER_DRIVER: Timers = Timers);

/// Counters of the socket.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Passed {
    /// Frames that ethercrab no longer awaits, or could not parse.
    pub(super) stale: u64,
    /// Foreign frames.
    pub(super) foreign: u64,
}

/// Transfers frames between ethercrab and an interface.
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

    /// Runs a future to its end, or drops it at the deadline: its frames may be reused, late answers are ignored.
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
            // After a delay of this thread, checks received frames once more, even past the deadline.
            let now = Monotonic.now();
            over = now >= deadline;
            self.take()?;
            if !over && !self.flag.0.load(Ordering::Relaxed) {
                self.socket.wait(deadline.min(now + TIMERS))?;
                self.take()?;
            }
        }
    }

    /// Sends all ready frames; one that exceeds the queue stays ready.
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

    /// Passes all received frames to ethercrab.
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
