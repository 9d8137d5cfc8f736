//! The thread that writes the log, and the cycle's end of its ring.
//!
//! Passing a record only copies it: no lock, no allocation, no system call. When the thread is slow the ring fills, and
//! records are dropped and counted. When the thread fails the cycle continues and gets the error.

use super::codes::cycle_flags;
use super::mcap::{LogError, LogFile, Setup, Totals};
use super::record::CycleRecord;
use super::table::Logged;
use rtrb::{Consumer, Producer, PushError, RingBuffer};
use std::fs::File;
use std::io::{BufWriter, Seek, Write};
use std::path::Path;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// Time between two flushes: the greatest loss at a power cut.
const FLUSH: Duration = Duration::from_secs(1);
/// Time between two reads of an empty ring. The cycle must not wake the thread: that is a system call.
const REST: Duration = Duration::from_millis(5);
/// Capacity of the ring: four seconds at 1 kHz, 11 MiB.
pub const RING_RECORDS: usize = 4096;

/// Receiver of the thread's records.
pub trait LogSink: Send + 'static {
    /// Adds a record.
    ///
    /// # Errors
    /// If the medium cannot be written; the thread then ends.
    fn write(&mut self, record: &CycleRecord) -> Result<(), LogError>;

    /// Makes all records so far survive the end of the program.
    ///
    /// # Errors
    /// If the medium cannot be written; the thread then ends.
    fn flush(&mut self) -> Result<(), LogError>;

    /// Closes the log.
    ///
    /// # Errors
    /// If the medium cannot be written.
    fn finish(self) -> Result<Totals, LogError>;
}

/// A log's file that also survives a power cut, up to its last flush.
struct SyncedLog {
    log: LogFile<BufWriter<File>>,
    file: File,
}

impl LogSink for SyncedLog {
    fn write(&mut self, record: &CycleRecord) -> Result<(), LogError> {
        self.log.write(record)
    }

    fn flush(&mut self) -> Result<(), LogError> {
        self.log.flush()?;
        Ok(self.file.sync_data()?)
    }

    fn finish(self) -> Result<Totals, LogError> {
        let (totals, _) = self.log.finish()?;
        self.file.sync_all()?;
        Ok(totals)
    }
}

impl<W: Write + Seek + Send + 'static> LogSink for LogFile<W> {
    fn write(&mut self, record: &CycleRecord) -> Result<(), LogError> {
        self.write(record)
    }

    fn flush(&mut self) -> Result<(), LogError> {
        self.flush()
    }

    fn finish(self) -> Result<Totals, LogError> {
        Self::finish(self).map(|(totals, _)| totals)
    }
}

/// Result of passing a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Handed {
    /// The thread has the record.
    Over,
    /// The ring was full: the record is lost and counted.
    Dropped,
    /// The thread has failed: this record and all others are lost and counted.
    Broken,
}

/// Statistics of a finished log.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Logging {
    /// Statistics of the file.
    pub written: Totals,
    /// Records that exceeded the ring.
    pub dropped: u64,
}

/// The cycle's end of the log.
pub struct LogWriter {
    ring: Producer<CycleRecord>,
    dropped: u64,
    gap: bool,
    thread: JoinHandle<Result<Totals, LogError>>,
}

impl LogWriter {
    /// Creates the file and starts the thread.
    ///
    /// Call this before the caller takes a real-time priority: a new thread inherits it.
    ///
    /// # Errors
    /// If the file exists or cannot be written, or no thread can be started.
    pub fn create(path: &Path, setup: &Setup) -> Result<Self, LogError> {
        let file = File::create_new(path)?;
        let log = LogFile::new(BufWriter::with_capacity(1 << 20, file.try_clone()?), setup)?;
        Self::start(SyncedLog { log, file }, RING_RECORDS)
    }

    /// Starts the thread on any sink, with a ring of this many records.
    ///
    /// # Errors
    /// If no thread can be started.
    pub fn start(sink: impl LogSink, records: usize) -> Result<Self, LogError> {
        let (mut ring, mut consumer) = RingBuffer::new(records);
        touch(&mut ring, &mut consumer);
        let thread = thread::Builder::new().name("log".to_owned()).spawn(move || drain(sink, consumer))?;
        Ok(Self { ring, dropped: 0, gap: false, thread })
    }

    /// Passes a record with the number of lost ones; neither waits nor allocates.
    pub fn push(&mut self, mut record: CycleRecord) -> Handed {
        record.log_dropped = self.dropped;
        if self.gap {
            record.flags |= cycle_flags::AFTER_GAP;
        }
        if self.ring.is_abandoned() {
            self.dropped += 1;
            return Handed::Broken;
        }
        self.gap = matches!(self.ring.push(record), Err(PushError::Full(_)));
        self.dropped += u64::from(self.gap);
        if self.gap { Handed::Dropped } else { Handed::Over }
    }

    /// Returns the records lost so far.
    pub fn dropped(&self) -> u64 {
        self.dropped
    }

    /// Writes the remaining records, closes the log and waits for the thread.
    ///
    /// # Errors
    /// If the thread has failed.
    pub fn finish(self) -> Result<Logging, LogError> {
        drop(self.ring);
        let written = self.thread.join().map_err(|panic| LogError::Panicked(panic_text(&*panic)))??;
        Ok(Logging { written, dropped: self.dropped })
    }
}

/// Touches all memory of the ring, so that the cycle meets no page fault in it.
fn touch(ring: &mut Producer<CycleRecord>, consumer: &mut Consumer<CycleRecord>) {
    while ring.push(CycleRecord::BLANK).is_ok() {}
    while consumer.pop().is_ok() {}
}

/// Writes until the cycle's end of the ring is closed and the ring is empty.
fn drain(mut sink: impl LogSink, mut ring: Consumer<CycleRecord>) -> Result<Totals, LogError> {
    let mut flushed = Instant::now();
    loop {
        // The order matters: records pushed before the end was dropped are in the ring if it is read second.
        let last = ring.is_abandoned();
        while let Ok(record) = ring.pop() {
            sink.write(&record)?;
            flush_when_due(&mut sink, &mut flushed)?;
        }
        if last {
            return sink.finish();
        }
        flush_when_due(&mut sink, &mut flushed)?;
        thread::sleep(REST);
    }
}

fn flush_when_due(sink: &mut impl LogSink, flushed: &mut Instant) -> Result<(), LogError> {
    if flushed.elapsed() >= FLUSH {
        sink.flush()?;
        *flushed = Instant::now();
    }
    Ok(())
}

fn panic_text(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "a panic without a message".to_owned())
}

#[cfg(test)]
mod tests;
