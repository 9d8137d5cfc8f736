//! Shipped files, damaged in thousands of ways, through the readers: problems or values, never a panic, abort or hang.

use crate::mutations::{Stream, mutate, sealed_again};
use crate::watchdog::Watchdog;
use crate::workshop::{Workshop, copy, root};
use softdock_campaign::{Campaign, Cases, Rig, Robot, Scenario, Station, manifest};
use softdock_diagnosis::data::grid;
use softdock_identify::log::Recording;
use softdock_identify::published_errors::read_published_errors;
use softdock_realtime::log::mcap::Setup;
use softdock_realtime::log::reader::read_log;
use softdock_realtime::log::record::CycleRecord;
use softdock_realtime::log::table::Logged;
use softdock_realtime::log::writer::LogWriter;
use softdock_realtime::protocol::rsi::context::rsi_ethernet;
use softdock_realtime::protocol::rsi::ethernet_file::{RsiExpectation, read_rsi_ethernet};
use softdock_realtime::protocol::rsi::tags::{Correction, TagMap};
use softdock_realtime::time::Nanos;
use softdock_results::drive_log::{open_drive_log, signal, write_drive_log};
use softdock_results::foreign::{column_names, number_columns};
use softdock_results::shards::{Origin, ShardIndex, ShardPlan, run_files, verify_shard};
use softdock_results::traces::read_trace;
use softdock_results::{Table, TableReader, Values};
use softdock_test_size::sized;
use std::cell::RefCell;
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Threads that read.
const WORKERS: usize = 2;

/// Reads the file at a path, which lies in a worker's own copy of all files; whether it was accepted.
type Read = fn(&Path) -> bool;

/// A file and its reader.
struct Input {
    /// Below the workshop's folder.
    file: &'static str,
    read: Read,
    /// Whether the hash of its bytes is stated again in every second case.
    is_sealed: bool,
}

fn campaign_of(path: &Path, name: &str) -> bool {
    let campaign = Campaign::load(&path.ancestors().nth(1).expect("a folder").join(name));
    campaign.iter().for_each(used);
    campaign.is_ok()
}

/// Draws from a campaign that was accepted.
fn used(campaign: &Campaign) {
    for run in [0, 1, campaign.runs - 1] {
        let _ = campaign.draw(run);
    }
    let _ = campaign.nominal();
}

fn campaign(path: &Path) -> bool {
    let campaign = softdock_campaign::load(path);
    campaign.iter().for_each(used);
    let _ = softdock_campaign::kind(path);
    if let (Ok(damaged), Ok(shipped)) =
        (fs::read_to_string(path), fs::read_to_string(root().join("campaigns/smoke.toml")))
    {
        let _ = softdock_campaign::difference::changed_keys(&shipped, &damaged);
    }
    campaign.is_ok()
}

fn bad_folder(path: &Path) -> bool {
    campaign_of(path, "campaign.toml")
}

fn scenario(path: &Path) -> bool {
    let _ = Scenario::load(path);
    campaign_of(path.parent().expect("a folder"), "smoke.toml")
}

fn facility(path: &Path) -> bool {
    Station::load(path).is_ok()
}

fn robot(path: &Path) -> bool {
    Robot::load(path).is_ok()
}

fn rig(path: &Path) -> bool {
    Rig::load(path).is_ok()
}

/// A table of cases, for the campaign that lies beside it.
fn cases(path: &Path) -> bool {
    let cases = if path.extension().is_some_and(|ending| ending == "csv") {
        Cases::of_csv(path)
    } else {
        let Ok(names) = column_names(path) else { return false };
        let bytes = fs::read(path).expect("a file");
        Cases::of_columns(path, bytes, &names, |names| number_columns(path, names).map_err(|error| error.to_string()))
    };
    let campaign = softdock_campaign::load(&path.with_file_name("c").join("smoke.toml")).expect("not damaged");
    let campaign = cases.and_then(|cases| campaign.with_cases(cases));
    campaign.iter().for_each(used);
    campaign.is_ok()
}

fn shard(path: &Path) -> bool {
    let results = path.ancestors().nth(2).expect("a results folder");
    let plan = ShardPlan { runs: 8, shard_runs: 8 };
    let stated = TableReader::open(path).map(|reader| reader.metadata()).unwrap_or_default();
    let text = |key: &str| stated.get(&format!("softdock.{key}")).cloned().unwrap_or_default();
    let origin = Origin {
        campaign_hash: text("campaign_hash"),
        seed: text("seed").parse().unwrap_or(0),
        version: text("version"),
        commit: text("commit"),
    };
    let index = ShardIndex::scan(results, plan, &origin).expect("a folder that can be read");
    index.complete.values().for_each(|file| drop(verify_shard(file)));
    let _ = index.read_runs().take(100).filter(Result::is_ok).count();
    let _ = index.read_run(3);
    let _ = run_files(results);
    cases(path_beside(path).as_path());
    index.is_complete()
}

/// The damaged shard as a table of cases.
fn path_beside(path: &Path) -> PathBuf {
    let place = path.ancestors().nth(3).expect("the worker's folder").join("of_shard.parquet");
    fs::copy(path, &place).expect("copied");
    place
}

fn trace(path: &Path) -> bool {
    read_trace(path).is_ok()
}

fn drive_table(path: &Path) -> bool {
    let is_log = open_drive_log(path).is_ok_and(|(reader, _)| reader.read().is_ok());
    if let Ok(names) = column_names(path) {
        let _ = number_columns(path, &names.iter().map(String::as_str).collect::<Vec<_>>());
    }
    is_log
}

fn drive_log(path: &Path) -> bool {
    read_log(path).is_ok_and(|log| log.ends_early.is_none() && !log.records.is_empty())
}

fn results_manifest(path: &Path) -> bool {
    manifest::read(path.parent().expect("a folder"), "results/4").is_ok()
}

fn tosses(path: &Path) -> bool {
    let rig = Rig::load(&root().join("campaigns/rigs/cube_toss.toml")).expect("shipped");
    grid::read(path, &rig).is_ok()
}

fn trajectory(path: &Path) -> bool {
    let robot = Robot::load(&root().join("campaigns/models/kr300_r2500.toml")).expect("shipped");
    Recording::read(path, &robot).is_ok()
}

fn marks(path: &Path) -> bool {
    read_published_errors(path, 6).is_ok()
}

fn rsi(path: &Path) -> bool {
    let Ok(text) = fs::read_to_string(path) else { return false };
    let expected =
        RsiExpectation { mode: Correction::Absolute, cycle: Nanos::from_millis(4), rail: false, torque: None };
    read_rsi_ethernet(&text, &expected).is_ok()
}

const fn plain(file: &'static str, read: Read) -> Input {
    Input { file, read, is_sealed: false }
}

const fn sealed(file: &'static str, read: Read) -> Input {
    Input { file, read, is_sealed: true }
}

const INPUTS: [Input; 27] = [
    plain("c/smoke.toml", campaign),
    plain("c/scenarios/smoke.toml", scenario),
    plain("b/campaign.toml", bad_folder),
    plain("b/scenario.toml", bad_folder),
    plain("b/arm.urdf", bad_folder),
    plain("b/delays.csv", bad_folder),
    plain("c/facilities/reference.toml", facility),
    plain("c/models/kr300_r2500.toml", robot),
    plain("c/rigs/cube_toss.toml", rig),
    plain("c/rigs/kr300.toml", rig),
    plain("c/rigs/ur_servo.toml", rig),
    plain("c/rigs/emps.toml", rig),
    plain("c/compensators.toml", campaign),
    plain("c/smoke_joint.toml", campaign),
    plain("c/stability_map.toml", campaign),
    plain("c/facility_sine.toml", campaign),
    plain("cases.csv", cases),
    sealed("cases.parquet", cases),
    sealed("r/runs/shard=00000.parquet", shard),
    sealed("r/traces/nominal.parquet", trace),
    sealed("log.parquet", drive_table),
    plain("log.mcap", drive_log),
    plain("r/campaign.json", results_manifest),
    plain("tosses.csv", tosses),
    plain("trajectory.csv", trajectory),
    plain("marks.csv", marks),
    plain("rsi_ethernet.xml", rsi),
];

/// The first lines of a shipped table.
fn head(from: &str, lines: usize, to: &Path) {
    let text = fs::read_to_string(root().join(from)).expect("shipped");
    fs::write(to, text.lines().take(lines).collect::<Vec<_>>().join("\n") + "\n").expect("written");
}

/// All whole files.
fn made() -> Workshop {
    let workshop = Workshop::new();
    workshop.ended(&[0, 1], "run c/smoke.toml --backend cpu --runs 8 --out r");
    fs::write(workshop.path("cases.csv"), "run,loop_delay,in_contact_stiffness_n_per_m\n3,0.004,1e5\n5,0.02,2e5\n")
        .expect("written");
    fs::copy(workshop.path("r/runs/shard=00000.parquet"), workshop.path("cases.parquet")).expect("copied");
    head("tests/data/cube-tosses/tosses.csv", 200, &workshop.path("tosses.csv"));
    head("tests/data/kuka-kr300-recordings/traj_A.csv", 60, &workshop.path("trajectory.csv"));
    fs::copy(root().join("tests/data/kuka-kr300-recordings/marks.csv"), workshop.path("marks.csv")).expect("copied");
    let rows = 0..300_u64;
    let columns = vec![
        signal("cycle", "1", "cycle", Values::U64(rows.clone().collect())),
        signal("tick", "1", "tick", Values::U64(rows.clone().map(|row| 4 * row).collect())),
        signal("force_n", "N", "a force", Values::F64(rows.map(|row| Some(row as f64)).collect())),
    ];
    write_drive_log(&workshop.path("log.parquet"), [Ok(Table { columns })], &[]).expect("written");
    let mut log = LogWriter::create(&workshop.path("log.mcap"), &Setup::default()).expect("a log");
    for cycle in 1..40 {
        log.push(CycleRecord { cycle, ..CycleRecord::BLANK });
    }
    log.finish().expect("a whole log");
    let text = rsi_ethernet(&TagMap::kroshu(), "192.168.1.10:59152".parse().expect("an address"));
    fs::write(workshop.path("rsi_ethernet.xml"), text).expect("written");
    workshop
}

thread_local! {
    /// Place and message of the last panic of this thread.
    static PANIC: RefCell<String> = const { RefCell::new(String::new()) };
}

#[test]
fn damaged_inputs_give_problems_without_panic_or_hang() {
    let whole = made();
    for input in &INPUTS {
        assert!((input.read)(&whole.path(input.file)), "the whole {} is not accepted", input.file);
    }
    // Panics of the Parquet library are caught and become errors, so they are not printed.
    let usual = std::panic::take_hook();
    let caught = Arc::new(AtomicUsize::new(0));
    let counted = caught.clone();
    std::panic::set_hook(Box::new(move |info| match std::thread::current().name() {
        Some("reader") => {
            counted.fetch_add(1, Ordering::Relaxed);
            PANIC.with(|panic| *panic.borrow_mut() = info.to_string());
        }
        _ => usual(info),
    }));
    let (count, next, faults) = (sized(2_700, 10_000), AtomicUsize::new(0), Mutex::new(Vec::new()));
    let accepted: Vec<AtomicUsize> = INPUTS.iter().map(|_| AtomicUsize::new(0)).collect();
    let watchdog = Watchdog::start();
    std::thread::scope(|scope| {
        for worker in 0..WORKERS {
            let folder = tempfile::tempdir().expect("a folder");
            copy(whole.path("").as_path(), folder.path());
            let (next, faults, accepted, watchdog) = (&next, &faults, &accepted, watchdog.clone());
            let work = move || {
                loop {
                    let case = next.fetch_add(1, Ordering::Relaxed);
                    if case >= count {
                        return;
                    }
                    let input = &INPUTS[case % INPUTS.len()];
                    let path = folder.path().join(input.file);
                    let bytes = fs::read(&path).expect("a whole file");
                    let mut damaged = mutate(&bytes, &mut Stream::new(case as u64));
                    if input.is_sealed && case % 2 == 0 {
                        damaged = sealed_again(damaged);
                    }
                    fs::write(&path, &damaged).expect("written");
                    watchdog.begin(worker, format!("case {case}, {}", input.file));
                    match catch_unwind(AssertUnwindSafe(|| (input.read)(&path))) {
                        Ok(is_accepted) => {
                            accepted[case % INPUTS.len()].fetch_add(usize::from(is_accepted), Ordering::Relaxed);
                        }
                        Err(_) => {
                            let panic = PANIC.with(|panic| panic.borrow().clone());
                            faults.lock().expect("a list").push(format!("case {case}, {}: {panic}", input.file));
                        }
                    }
                    watchdog.end(worker);
                    fs::write(&path, &bytes).expect("put back");
                }
            };
            // The usual stack of a thread: a quarter of the program's.
            std::thread::Builder::new().name("reader".to_owned()).spawn_scoped(scope, work).expect("a thread");
        }
    });
    let _ = std::panic::take_hook();
    for (input, accepted) in INPUTS.iter().zip(&accepted) {
        println!("{}: {} of {} accepted", input.file, accepted.load(Ordering::Relaxed), count / INPUTS.len());
    }
    println!("{} panics of the Parquet library became errors", caught.load(Ordering::Relaxed));
    let faults = faults.into_inner().expect("a list");
    assert!(faults.is_empty(), "{} of {count} cases:\n{}", faults.len(), faults.join("\n"));
}

/// Commands that read one of the inputs.
const COMMANDS: [(&str, &str, bool); 7] = [
    ("c/smoke.toml", "check c/smoke.toml", false),
    ("b/scenario.toml", "check b/campaign.toml", false),
    ("b/arm.urdf", "check b/campaign.toml", false),
    ("cases.parquet", "run c/smoke.toml --backend cpu --out o --cases cases.parquet", true),
    ("r/campaign.json", "status r", true),
    ("r/runs/shard=00000.parquet", "verify r", true),
    ("log.mcap", "replay --log log.mcap", false),
];

#[test]
fn damaged_inputs_give_an_exit_code_and_no_folder() {
    let workshop = made();
    for case in 0..sized(14, 140) {
        let (file, command, may_make) = COMMANDS[case % COMMANDS.len()];
        let path = workshop.path(file);
        let bytes = fs::read(&path).expect("a whole file");
        let damaged = mutate(&bytes, &mut Stream::new(1_000_000 + case as u64));
        fs::write(&path, damaged).expect("written");
        let ended = workshop.run(command, Duration::from_secs(20));
        let context = format!("case {case}, {file}: {command}: {:?}\n{}", ended.code, ended.printed);
        assert!(matches!(ended.code, Some(0..=3)), "{context}");
        let is_made = workshop.path("o").exists();
        assert!(!is_made || may_make && ended.code != Some(2), "{context}");
        let _ = fs::remove_dir_all(workshop.path("o"));
        fs::write(&path, bytes).expect("put back");
    }
}
