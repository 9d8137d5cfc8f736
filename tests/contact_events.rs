//! `[contact_events]`: the rows against the metrics of their runs, names, selection, and the file's place in a results folder.

use crate::cli::{Bench, assert_same, text};
use softdock_farm::ResultsFolder;
use softdock_results::contact_events::read_contact_events;
use softdock_results::traces::NOMINAL_RUN;
use softdock_results::{Table, TableReader};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;

const RUN: &str = "run c/smoke.toml --backend cpu --out";
const FILE: &str = "contact_events.parquet";

/// The smoke campaign with contact events, and with one contact point: its force is the contact force of the run.
fn bench(keep: &str) -> Bench {
    let bench = Bench::new();
    bench.edit("[traces]", &format!("[contact_events]\nkeep = [{keep}]\n\n[traces]"));
    let scenario = bench.path("c/scenarios/smoke.toml");
    let written = fs::read_to_string(&scenario).expect("the scenario");
    let shaft =
        "[[part_a.point]]                   # shaft\nposition = [\"-60 mm\", \"0 mm\", \"0 mm\"]\nradius = \"15 mm\"\n";
    let cone = "[[part_b.solid]]\n";
    assert!(written.contains(shaft) && written.contains(cone));
    let named = written.replace(shaft, "").replace(cone, "[[part_b.solid]]\nname = \"drogue\"\n");
    fs::write(&scenario, named).expect("written");
    bench
}

fn made(bench: &Bench, words: &str) -> String {
    let output = bench.softdock(words);
    let printed = text(&output.stderr);
    assert!(matches!(output.status.code(), Some(0 | 1)), "softdock {words}\n{printed}");
    printed
}

/// The events of a folder.
fn events(bench: &Bench, results: &str) -> Table {
    let folder = ResultsFolder::open(&bench.path(results)).expect("a results folder");
    let index = folder.shards().expect("shards");
    read_contact_events(&folder.path, &index).expect("a whole file").expect("a file")
}

/// Words of a column.
fn words<'a>(table: &'a Table, column: &str) -> Vec<&'a str> {
    let values = &table.column(column).expect("a column").values;
    (0..table.rows()).map(|row| values.word(row).expect("a word")).collect()
}

#[test]
fn greatest_event_of_every_run_has_the_peak_force_of_its_row() {
    let bench = bench("\"all\", \"nominal\"");
    made(&bench, &format!("{RUN} r"));
    let table = events(&bench, "r");
    let runs = table.u64s("run").expect("runs");
    let (loops, peaks) = (words(&table, "loop"), table.f64s("peak_force_n").expect("forces"));
    let mut greatest: BTreeMap<(u64, &str), f64> = BTreeMap::new();
    let mut counts: BTreeMap<(u64, &str), u32> = BTreeMap::new();
    let numbers = table.u32s("event").expect("numbers");
    for row in 0..table.rows() {
        let key = (runs[row], loops[row]);
        let peak = greatest.entry(key).or_insert(0.0);
        *peak = peak.max(peaks[row].expect("a force"));
        let count = counts.entry(key).or_insert(0);
        *count += 1;
        assert_eq!(numbers[row], *count, "from 1, in order");
    }
    let folder = ResultsFolder::open(&bench.path("r")).expect("a results folder");
    let mut touched = 0;
    for row in folder.shards().expect("shards").read_runs() {
        let row = row.expect("a row");
        for (side, metrics) in [("space", row.space.metrics), ("hil", row.hil.metrics)] {
            let key = (row.run, side);
            let peak = greatest.get(&key).copied().unwrap_or(0.0);
            assert!((peak - metrics.peak_contact_force).abs() <= 1e-9 * peak, "run {} {side}: {peak}", row.run);
            let count = counts.get(&key).copied().unwrap_or(0);
            assert_eq!(f64::from(count), metrics.contact_count, "run {} {side}", row.run);
            touched += count;
        }
    }
    assert!(touched > 100, "{touched} events");
    let column = |name: &str| words(&table, name).into_iter().collect::<BTreeSet<_>>();
    assert_eq!(column("loop"), BTreeSet::from(["space", "hil"]));
    assert_eq!((column("part_a"), column("part_a_name")), (["part_a.point[1]"].into(), [""].into()));
    assert_eq!((column("part_b"), column("part_b_name")), (["part_b.solid[1]"].into(), ["drogue"].into()));
    assert_eq!(column("pair"), BTreeSet::from(["contact"]));
    assert!(column("kept_as").is_superset(&["all", "nominal"].into()));
    assert!(greatest.contains_key(&(NOMINAL_RUN, "space")), "the nominal case stands last");
    assert!(runs.is_sorted());
    let metadata = TableReader::open(&bench.path(&format!("r/{FILE}"))).expect("a table").metadata();
    assert_eq!(metadata["softdock.kept_runs"], "65");
    assert!(metadata.contains_key("softdock.rows_hash"), "it states its runs");
    let described = |column: &softdock_results::Column| !column.unit.is_empty() && column.description.len() > 10;
    assert!(table.columns.iter().all(described));
}

#[test]
fn only_chosen_runs_have_events() {
    let bench = bench("\"worst:1\", \"random:3\"");
    made(&bench, &format!("{RUN} r"));
    let table = events(&bench, "r");
    let runs: BTreeSet<u64> = table.u64s("run").expect("runs").iter().copied().collect();
    // Three at random, and the worst run of each of two requirements on each loop.
    assert!(!runs.is_empty() && runs.len() <= 7 && !runs.contains(&NOMINAL_RUN), "{runs:?}");
    let reasons = words(&table, "kept_as").into_iter().collect::<BTreeSet<_>>();
    assert!(
        reasons.contains("random") && reasons.iter().any(|reason| reason.starts_with("worst SMOKE-0")),
        "{reasons:?}"
    );
    // Without the table there is no file, and nothing else changes but what states the campaign.
    let plain = Bench::new();
    made(&plain, &format!("{RUN} r"));
    assert!(!plain.path(&format!("r/{FILE}")).exists());
}

#[test]
fn interrupted_and_merged_campaigns_have_the_same_events() {
    let bench = bench("\"all\"");
    made(&bench, &format!("{RUN} whole"));
    let mut child = bench.until_first_shard(&format!("{RUN} stopped"), "stopped");
    child.kill().expect("killed");
    child.wait().expect("its end");
    made(&bench, &format!("{RUN} stopped"));
    assert_same(&bench.path("whole"), &bench.path("stopped"));
    // A folder whose last writer was killed before the events.
    for name in [FILE, "summary.json", "report.html"] {
        fs::remove_file(bench.path(&format!("stopped/{name}"))).expect("removed");
    }
    made(&bench, &format!("{RUN} stopped"));
    assert_same(&bench.path("whole"), &bench.path("stopped"));
    for part in ["1/2", "2/2"] {
        let out = part.replace('/', "of");
        bench.expect(3, &format!("{RUN} {out} --shard {part}"));
        assert!(!bench.path(&format!("{out}/{FILE}")).exists(), "a part has no events");
    }
    made(&bench, "merge merged 1of2 2of2");
    let bytes = |folder: &str| fs::read(bench.path(&format!("{folder}/{FILE}"))).expect("a file");
    assert!(bytes("merged") == bytes("whole"), "the events of merged parts");
}

#[test]
fn verify_reports_changed_and_missing_events() {
    let bench = bench("\"random:8\"");
    made(&bench, &format!("{RUN} r"));
    bench.expect(0, "verify r");
    let file = bench.path(&format!("r/{FILE}"));
    let whole = fs::read(&file).expect("a file");
    let mut changed = whole.clone();
    changed[whole.len() / 2] ^= 1;
    fs::write(&file, &changed).expect("written");
    let printed = bench.expect(1, "verify r");
    assert!(printed.contains(&format!("{FILE}: damaged")), "{printed}");
    fs::remove_file(&file).expect("removed");
    let printed = bench.expect(1, "verify r");
    assert!(printed.contains("a file below the folder is not the one that was judged"), "{printed}");
    made(&bench, &format!("{RUN} r"));
    assert!(fs::read(&file).expect("a file") == whole, "the same command makes them again");
    bench.expect(0, "verify r");
}

#[test]
fn judge_takes_another_choice_of_events_without_new_runs() {
    let bench = bench("\"random:2\"");
    made(&bench, &format!("{RUN} r"));
    let before = events(&bench, "r").rows();
    bench.edit("keep = [\"random:2\"]", "merge_gap = \"5 ms\"\nkeep = [\"all\"]");
    made(&bench, "judge r c/smoke.toml");
    assert!(events(&bench, "r").rows() > before);
    let metadata = TableReader::open(&bench.path(&format!("r/{FILE}"))).expect("a table").metadata();
    assert_eq!(metadata["softdock.merge_gap_s"], "0.005");
    bench.expect(0, "verify r");
}
