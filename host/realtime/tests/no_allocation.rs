//! Passing records to log, evidence and view allocates nothing.

use assert_no_alloc::{AllocDisabler, assert_no_alloc};
use softdock_realtime::drive::feed::feed;
use softdock_realtime::log::codes::StopCause;
use softdock_realtime::log::evidence::EvidenceBuffer;
use softdock_realtime::log::mcap::Setup;
use softdock_realtime::log::record::CycleRecord;
use softdock_realtime::log::table::Logged;
use softdock_realtime::log::writer::{Handed, LogWriter};
use softdock_realtime::time::Nanos;

/// Aborts the test at a forbidden allocation.
#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;

#[test]
fn passing_a_record_allocates_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut log = LogWriter::create(&folder.path().join("drive.mcap"), &Setup::default()).expect("a log");
    let mut evidence = EvidenceBuffer::new(Nanos::from_millis(2_000), Nanos::from_millis(1));
    let (mut feed, samples) = feed();
    let mut over = 0;
    for cycle in 0..20_000 {
        assert_no_alloc(|| {
            let mut record = CycleRecord { cycle, ..CycleRecord::BLANK };
            record.robot_1.set_command(None);
            record.robot_1.take(None, Nanos(0));
            if cycle > 19_000 {
                record.cause = StopCause::Operator;
            }
            // Full rings are covered too: at this pace they overflow.
            over += u64::from(log.push(record) == Handed::Over);
            evidence.push(&record);
            feed.push(&record);
        });
    }
    assert_eq!(evidence.stop().map(|(cause, cycle, _)| (cause, cycle)), Some((StopCause::Operator, 19_001)));
    assert_eq!(over + log.dropped(), 20_000);
    drop(samples);
    let logging = log.finish().expect("a log");
    assert_eq!((logging.written.records, logging.written.records + logging.dropped), (over, 20_000));
}
