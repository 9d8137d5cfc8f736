//! A replayed log reproduces its decisions bit for bit; a changed input shows.

use crate::fixture::{Rig, Setting};
use softdock_realtime::drive::replay::{Replayed, Unplayed, replay};
use softdock_realtime::log::codes::StopCause;
use softdock_realtime::log::mcap::Setup;
use softdock_realtime::log::reader::read_log;
use softdock_realtime::log::record::CycleRecord;
use softdock_realtime::log::writer::{Handed, LogWriter};
use softdock_realtime::signals::Capabilities;
use softdock_realtime::time::Nanos;
use softdock_realtime::wire::relay::{Direction, Endpoint, Fault, Relay, RelayRule};

/// Writes records to an MCAP file and reads them back.
fn logged(records: &[CycleRecord]) -> Vec<CycleRecord> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("drive.mcap");
    let mut log = LogWriter::create(&path, &Setup::default()).expect("a log");
    for record in records {
        // The ring is full when a whole session arrives at once: the thread gets time.
        while log.push(*record) != Handed::Over {
            std::thread::sleep(std::time::Duration::from_millis(20));
        }
    }
    log.finish().expect("a whole log");
    read_log(&path).expect("what was written").records
}

fn capabilities(rig: &Rig) -> [Capabilities; 2] {
    rig.session.core().capabilities()
}

fn played(setting: &Setting, rig: &Rig, records: &[CycleRecord]) -> Replayed {
    replay(setting.task(), capabilities(rig), records.iter().copied()).expect("the task that was driven")
}

#[track_caller]
fn assert_equal(replayed: &Replayed, records: &[CycleRecord]) {
    assert_eq!(replayed.first.as_ref().map(ToString::to_string), None);
    assert_eq!((replayed.cycles, replayed.equal), (records.len() as u64, records.len() as u64));
}

#[test]
fn docking_over_rsi_replays_bit_for_bit() {
    let setting = Setting::docking();
    let mut rig = Rig::new(&setting, Relay::default());
    assert_eq!(rig.finish().cause, StopCause::Completed);
    let mut records = logged(&rig.records);
    assert_eq!(records.len(), rig.records.len());
    assert_equal(&played(&setting, &rig, &records), &records);

    // One input, one unit in the last place, during the run.
    let at = records.iter().position(|record| record.tick > 1000).expect("a run");
    let axis = &mut records[at].robot_1.position[0];
    *axis = axis.next_up();
    let replayed = played(&setting, &rig, &records);
    let first = replayed.first.expect("a difference");
    assert_eq!(first.cycle, records[at].cycle, "{first}");
    assert!(!first.column.is_empty(), "{first}");
    println!("{first}");
    assert_ne!(first.logged, first.replayed);
    assert!(replayed.equal >= at as u64, "{} equal", replayed.equal);
}

#[test]
fn empty_log_is_an_error_and_records_after_the_end_differ() {
    let setting = Setting::docking();
    let mut rig = Rig::new(&setting, Relay::default());
    rig.run_for(0.2);
    let mut records = rig.records.clone();
    let nothing = replay(setting.task(), capabilities(&rig), std::iter::empty());
    assert_eq!(nothing, Err(Unplayed::NoCycle));
    assert!(nothing.expect_err("nothing").to_string().contains("holds no cycle"));
    assert_equal(&played(&setting, &rig, &records), &records);
    // A repeated cycle is the session's own end; no cycle may follow.
    let middle = records.len() / 2;
    records.insert(middle, records[middle - 1]);
    let replayed = played(&setting, &rig, &records);
    assert_eq!(replayed.cycles, middle as u64);
    assert_eq!(replayed.first.expect("a difference").column, "cycle");
}

#[test]
fn dry_run_replays_bit_for_bit() {
    let setting = Setting { armed: false, ..Setting::docking() };
    let mut rig = Rig::new(&setting, Relay::default());
    rig.run_for(1.0);
    rig.session.cycle(Some(StopCause::Operator));
    rig.records.push(*rig.session.record());
    assert_eq!(rig.finish().cause, StopCause::Operator);
    let records = logged(&rig.records);
    assert_equal(&played(&setting, &rig, &records), &records);
}

#[test]
fn lost_packets_and_a_silent_sensor_replay_bit_for_bit() {
    let mut setting = Setting::docking();
    (setting.station.links.window_cycles, setting.station.links.catch_up) = (1000, 10.0);
    let (from, until) = (Nanos::from_millis(2_000), Nanos::from_millis(600_000));
    let lossy = |endpoint, direction, every| RelayRule { endpoint, direction, from, until, every, fault: Fault::Lose };
    let relay =
        Relay::new([lossy(Endpoint::Robot1, Direction::Report, 37), lossy(Endpoint::Robot2, Direction::Answer, 23)]);
    let mut rig = Rig::new(&setting, relay);
    rig.run_for(1.0);
    let now = rig.session.record().time;
    rig.network.borrow_mut().relay.add(RelayRule { from: now, ..lossy(Endpoint::Sensor, Direction::Report, 1) });
    let cause = rig.finish().cause;
    assert!(matches!(cause, StopCause::SensorStale | StopCause::LinkFault), "{cause:?}");
    assert!(rig.records.iter().any(|record| record.broken == 4), "a failed link");
    let records = logged(&rig.records);
    assert_equal(&played(&setting, &rig, &records), &records);
}

#[test]
fn lost_records_are_reported() {
    let setting = Setting::docking();
    let mut rig = Rig::new(&setting, Relay::default());
    (0..300).for_each(|_| {
        rig.cycle();
    });
    let mut records = rig.records.clone();
    records.remove(200);
    let first = played(&setting, &rig, &records).first.expect("a difference");
    assert_eq!((first.cycle, first.column.as_str()), (records[200].cycle, "cycle"));
}

#[test]
fn end_without_decisions_is_not_replayed() {
    let setting = Setting::docking();
    let mut rig = Rig::new(&setting, Relay::default());
    rig.run_for(0.2);
    let records = rig.records.clone();
    rig.session.end_at_once(StopCause::Operator);
    rig.records.push(*rig.session.record());
    assert_equal(&played(&setting, &rig, &rig.records), &records);
}
