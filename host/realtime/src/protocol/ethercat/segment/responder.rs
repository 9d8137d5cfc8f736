//! A segment on an interface: a thread that takes frames, lets them pass, and sends them back.

use super::super::raw::{MAX_FRAME, RawSocket};
use super::EthercatSegment;
use crate::clock::{Clock, Monotonic};
use crate::time::Nanos;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

/// Longest wait for a frame: so often it looks whether it is to end, and at the watchdogs.
const WAIT: Nanos = Nanos::from_millis(20);

/// Answers on an interface until it is dropped.
#[derive(Debug)]
pub struct Responder {
    segment: Arc<Mutex<EthercatSegment>>,
    ending: Arc<AtomicBool>,
    thread: Option<JoinHandle<io::Result<()>>>,
}

impl Responder {
    /// Begins to answer on an interface.
    ///
    /// # Errors
    /// If there is no such interface or raw sockets are not permitted.
    pub fn start(interface: &str, segment: EthercatSegment) -> io::Result<Self> {
        let socket = RawSocket::open(interface)?;
        let segment = Arc::new(Mutex::new(segment));
        let ending = Arc::new(AtomicBool::new(false));
        let (behind, stop) = (Arc::clone(&segment), Arc::clone(&ending));
        let thread = std::thread::Builder::new().name("ethercat-segment".to_owned()).spawn(move || {
            raise_priority();
            serve(&socket, &behind, &stop)
        })?;
        Ok(Self { segment, ending, thread: Some(thread) })
    }

    /// The segment, to look at it or to inject a fault; frames wait meanwhile.
    pub fn segment(&self) -> MutexGuard<'_, EthercatSegment> {
        self.segment.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Responder {
    fn drop(&mut self) {
        self.ending.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // What it ended with is of no use any more.
            let _ = thread.join();
        }
    }
}

/// Hardware answers at once: the thread that stands for it goes before all others, where that is permitted.
fn raise_priority() {
    let parameters = libc::sched_param { sched_priority: 60 };
    // SAFETY: the parameters outlive the call; 0 is the calling thread. A refusal leaves it as it is.
    unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &raw const parameters) };
}

fn serve(socket: &RawSocket, segment: &Mutex<EthercatSegment>, ending: &AtomicBool) -> io::Result<()> {
    let mut frame = [0; MAX_FRAME];
    while !ending.load(Ordering::Relaxed) {
        socket.wait(Monotonic.now() + WAIT)?;
        while let Some(length) = socket.receive(&mut frame)? {
            let back =
                segment.lock().unwrap_or_else(PoisonError::into_inner).pass(Monotonic.now(), &mut frame[..length]);
            if back {
                socket.send(&frame[..length])?;
            }
        }
        segment.lock().unwrap_or_else(PoisonError::into_inner).idle(Monotonic.now());
    }
    Ok(())
}
