//! Serves a segment on an interface: a thread that receives frames, passes them through the segment, and sends them
//! back.

use super::super::raw::{MAX_FRAME, RawSocket};
use super::EthercatSegment;
use crate::clock::{Clock, Monotonic};
use crate::time::Nanos;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

/// Longest wait for a frame: the period of checking the end flag and the watchdogs.
const WAIT: Nanos = Nanos::from_millis(20);

/// Serves an interface until dropped.
#[derive(Debug)]
pub struct Responder {
    segment: Arc<Mutex<EthercatSegment>>,
    ending: Arc<AtomicBool>,
    thread: Option<JoinHandle<io::Result<()>>>,
}

impl Responder {
    /// Starts serving an interface.
    ///
    /// # Errors
    /// If the interface does not exist or raw sockets are not permitted.
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

    /// Returns the segment for inspection or fault injection; frames wait meanwhile.
    pub fn segment(&self) -> MutexGuard<'_, EthercatSegment> {
        self.segment.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Responder {
    fn drop(&mut self) {
        self.ending.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // The thread's result is not needed.
            let _ = thread.join();
        }
    }
}

/// Hardware answers at once: raises this thread above all others, where permitted.
fn raise_priority() {
    let parameters = libc::sched_param { sched_priority: 60 };
    // SAFETY: the parameters outlive the call; 0 is the calling thread. A refusal changes nothing.
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
