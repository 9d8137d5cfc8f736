//! Written records are read bit for bit, for any values and any end of the file.

use super::*;
use crate::log::mcap::{LogFile, Setup};
use crate::log::sample::{self, STARTED, assert_same};
use crate::log::scene::LoggedScene;
use crate::time::Nanos;
use proptest::prelude::*;
use softdock_campaign::Campaign;
use softdock_kernels::plant::Plant;
use std::io::Cursor;
use std::time::Instant;

/// The shipped facility.
fn scene() -> LoggedScene {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../campaigns/probe_drogue.toml");
    let scenario = Campaign::load(&file).expect("the shipped campaign").scenario;
    let station = scenario.station.as_ref().expect("it names its facility");
    LoggedScene::new(&Plant::new(scenario.model.clone()), station, &default_names()).expect("in reach")
}

fn setup() -> Setup {
    Setup {
        started: Nanos(STARTED),
        scene: Some(scene()),
        attachments: vec![Attachment {
            name: "campaign.toml".to_owned(),
            media_type: "application/toml".to_owned(),
            data: b"schema = 1\n".to_vec(),
        }],
        provenance: BTreeMap::from([("version".to_owned(), "0.1.0".to_owned())]),
        ..Setup::default()
    }
}

/// A log's bytes, and the ends of its chunks.
fn written(records: &[CycleRecord], per_chunk: usize) -> (Vec<u8>, Vec<usize>) {
    let mut log = LogFile::new(Cursor::new(Vec::new()), &setup()).expect("a log");
    let mut chunks = Vec::new();
    for chunk in records.chunks(per_chunk) {
        chunk.iter().for_each(|record| log.write(record).expect("a record"));
        log.flush().expect("a flush");
        chunks.push(chunk.len());
    }
    let (totals, medium) = log.finish().expect("an end");
    assert_eq!(totals.records, records.len() as u64);
    (medium.into_inner(), chunks)
}

fn read(bytes: &[u8]) -> Result<Log, LogError> {
    let mut reader = LogReader::new(bytes);
    let records = reader.by_ref().collect::<Result<_, _>>()?;
    Ok(Log { prologue: reader.prologue, records, ends_early: reader.ends_early })
}

#[test]
fn twenty_thousand_records_round_trip_bit_for_bit() {
    let records: Vec<CycleRecord> = (0..20_000).map(sample::cycle).collect();
    let begin = Instant::now();
    let (bytes, _) = written(&records, 1000);
    let wrote = begin.elapsed();
    let begin = Instant::now();
    let log = read(&bytes).expect("a log");
    let (per_record, took) = (wrote.as_secs_f64() * 1e6 / 20_000.0, begin.elapsed().as_secs_f64() * 1e6 / 20_000.0);
    println!("write {per_record:.1} us and {} bytes a record, read {took:.1} us", bytes.len() / 20_000);
    assert_same(&log.records, &records);
    assert_eq!(log.ends_early, None);
    let Setup { scene, attachments, provenance, .. } = setup();
    let robot_description = scene.map(|scene| scene.urdf);
    assert_eq!(log.prologue, Prologue { robot_description, attachments, provenance });
}

#[test]
fn arbitrary_bits_round_trip() {
    let records: Vec<CycleRecord> = (0..2_000).map(sample::any).collect();
    let (bytes, _) = written(&records, 300);
    assert_same(&read(&bytes).expect("a log").records, &records);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn arbitrary_records_round_trip(seeds in prop::collection::vec(any::<u64>(), 0..12), per_chunk in 1_usize..5) {
        let records: Vec<CycleRecord> = seeds.into_iter().map(sample::any).collect();
        let (bytes, _) = written(&records, per_chunk);
        assert_same(&read(&bytes).expect("a log").records, &records);
    }
}

/// Ends of the chunks in a file.
fn chunk_ends(bytes: &[u8]) -> Vec<usize> {
    const MAGIC: usize = 8;
    const CHUNK: u8 = 6;
    let (mut at, mut ends) = (MAGIC, Vec::new());
    while at + 9 < bytes.len() - MAGIC {
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().expect("eight bytes")) as usize;
        if bytes[at] == CHUNK {
            ends.push(at + 9 + length);
        }
        at += 9 + length;
    }
    ends
}

#[test]
fn truncated_file_gives_all_complete_chunks() {
    let records: Vec<CycleRecord> = (0..60).map(sample::cycle).collect();
    let (bytes, chunks) = written(&records, 5);
    // The first chunk has only the definitions and the description.
    let ends = chunk_ends(&bytes).split_off(1);
    assert_eq!(ends.len(), chunks.len());
    let around = ends.iter().flat_map(|end| [end - 1, *end, end + 1]);
    let every = (0..bytes.len()).step_by(101);
    let mut cuts = 0;
    for cut in every.chain(around).chain(bytes.len() - 20..bytes.len()) {
        let log = read(&bytes[..cut]).expect("the complete chunks");
        let whole = ends.iter().filter(|end| **end <= cut).count();
        assert_same(&log.records, &records[..5 * whole]);
        assert!(log.ends_early.is_some(), "cut at {cut} of {}", bytes.len());
        cuts += 1;
    }
    assert!(cuts > 300, "{cuts} cuts of {} bytes", bytes.len());
}

#[test]
fn damaged_file_gives_correct_records_or_an_error() {
    let records: Vec<CycleRecord> = (0..40).map(sample::cycle).collect();
    let (bytes, _) = written(&records, 5);
    for place in (8..bytes.len()).step_by(61) {
        let mut damaged = bytes.clone();
        damaged[place] ^= 1 << (place % 8);
        if let Ok(log) = read(&damaged) {
            for record in log.records {
                assert_same(&[record], &[records[record.cycle as usize]]);
            }
        }
    }
}

#[test]
fn other_files_are_refused() {
    assert!(matches!(read(b"cycle,time\n0,0.0\n1,0.001\n2,0.002\n"), Err(LogError::Mcap(_))));
    let empty = read(b"").expect("an empty file");
    assert!(empty.records.is_empty() && empty.ends_early.is_some());
}

/// Writes the file for `tests/peers/read_mcap.py`: `SOFTDOCK_MCAP=out.mcap cargo test -p softdock-realtime
/// write_a_log_for_others -- --ignored`.
#[test]
#[ignore = "writes a file for other programs to read"]
fn write_a_log_for_others() {
    let path = std::env::var("SOFTDOCK_MCAP").expect("SOFTDOCK_MCAP: the file to write");
    let records: Vec<CycleRecord> = (0..2_000).map(sample::cycle).chain([sample::stopping(2_000)]).collect();
    std::fs::write(path, written(&records, 1000).0).expect("a file");
}
