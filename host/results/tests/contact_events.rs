//! Contact events: what is written part by part comes back, and an error or other runs leave no file that counts.

mod sample;

use sample::{PLAN, fill, origin, provenance};
use softdock_kernels::outcome::ContactEvent;
use softdock_kernels::plant::PointSource;
use softdock_kernels::vector::vec3;
use softdock_results::contact_events::*;
use softdock_results::shards::ShardIndex;
use softdock_results::{ResultsError, TableReader};
use std::path::Path;

const FACTS: ContactEventFacts = ContactEventFacts { kept_runs: 3, merge_gap: 1e-3 };

/// A number of an event.
type Number = fn(&ContactEvent) -> f64;

/// An event whose numbers all differ.
fn row(run: u64, number: u32) -> ContactEventRow {
    let start = run as f64 + 0.1 * f64::from(number);
    let event = ContactEvent {
        members: [PointSource::Point(0), PointSource::Solid(1)],
        pair: Some(0),
        start,
        duration: start + 0.01,
        peak_time: start + 0.02,
        place: vec3(start + 0.03, start + 0.04, start + 0.05),
        normal: vec3(-1.0, 0.0, 0.0),
        peak_force: start + 0.06,
        peak_normal_force: start + 0.07,
        impulse: vec3(start + 0.08, start + 0.09, start + 0.10),
        slip: start + 0.11,
        work: -start - 0.12,
        depth: start + 0.13,
        closing_speed: start + 0.14,
        is_open: run == 2,
    };
    let members = [["part_a.point[1]", "tip"], ["part_b.solid[2]", ""]].map(|names| names.map(str::to_owned));
    let (kept_as, pair) = (format!("random {run}"), "contact.pair[1]".to_owned());
    ContactEventRow { run, kept_as, side: (number % 2) as usize, number, members, pair, event }
}

fn scan(results: &Path) -> ShardIndex {
    ShardIndex::scan(results, PLAN, &origin()).expect("a folder that can be read")
}

fn write(results: &Path, parts: Vec<Result<Vec<ContactEventRow>, ResultsError>>) -> Result<(), ResultsError> {
    write_contact_events(results, FACTS, parts.into_iter(), &provenance(), &scan(results))
}

#[test]
fn events_that_are_written_part_by_part_come_back() {
    let results = tempfile::tempdir().expect("a temporary folder");
    fill(results.path(), &[0, 1, 2]);
    assert!(read_contact_events(results.path(), &scan(results.path())).expect("no file").is_none());
    let rows = [row(0, 1), row(0, 2), row(1, 1), row(2, 1)];
    write(results.path(), vec![Ok(rows[..3].to_vec()), Ok(Vec::new()), Ok(rows[3..].to_vec())]).expect("written");
    let table = read_contact_events(results.path(), &scan(results.path())).expect("a whole file").expect("a file");
    assert_eq!(table.u64s("run"), Some(&[0, 0, 1, 2][..]));
    assert_eq!(table.u32s("event"), Some(&[1, 2, 1, 1][..]));
    let word = |column: &str, row| table.column(column).and_then(|column| column.values.word(row)).map(str::to_owned);
    assert_eq!([word("loop", 1), word("loop", 3)], ["space", "hil"].map(|word| Some(word.to_owned())));
    assert_eq!([word("kept_as", 0), word("kept_as", 3)], ["random 0", "random 2"].map(|word| Some(word.to_owned())));
    assert_eq!(word("part_a_name", 2).as_deref(), Some("tip"));
    assert_eq!(word("part_b_name", 2).as_deref(), Some(""));
    assert_eq!(table.bools("open"), Some(&[Some(false), Some(false), Some(false), Some(true)][..]));
    let numbers: [(&str, Number); 9] = [
        ("start_s", |event| event.start),
        ("duration_s", |event| event.duration),
        ("place_y_m", |event| event.place.y),
        ("normal_x", |event| event.normal.x),
        ("peak_force_n", |event| event.peak_force),
        ("impulse_z_n_s", |event| event.impulse.z),
        ("slip_m", |event| event.slip),
        ("work_j", |event| event.work),
        ("closing_speed_m_per_s", |event| event.closing_speed),
    ];
    for (name, of) in numbers {
        let written: Vec<_> = rows.iter().map(|row| Some(of(&row.event))).collect();
        assert_eq!(table.f64s(name), Some(&written[..]), "{name}");
    }
    let metadata = TableReader::open(&contact_events_path(results.path())).expect("a table").metadata();
    assert_eq!([&metadata["softdock.kept_runs"], &metadata["softdock.merge_gap_s"]], ["3", "0.001"]);
}

#[test]
fn an_error_among_the_parts_leaves_no_file() {
    let results = tempfile::tempdir().expect("a temporary folder");
    fill(results.path(), &[0, 1, 2]);
    let source = std::io::Error::other("this run cannot be made");
    let error = ResultsError::Write { path: "x".into(), source };
    let message = write(results.path(), vec![Ok(vec![row(0, 1)]), Err(error)]).expect_err("an error").to_string();
    assert!(message.contains("this run cannot be made"), "{message}");
    let files: Vec<_> = results.path().read_dir().expect("a folder").flatten().map(|entry| entry.file_name()).collect();
    assert_eq!(files, ["runs"], "nothing but the shards");
}

#[test]
fn events_of_other_runs_are_refused() {
    let results = tempfile::tempdir().expect("a temporary folder");
    fill(results.path(), &[0, 1]);
    write(results.path(), vec![Ok(vec![row(0, 1)])]).expect("written");
    check_contact_events(results.path(), &scan(results.path())).expect("its runs are there");
    fill(results.path(), &[2]);
    let message = check_contact_events(results.path(), &scan(results.path())).expect_err("more runs").to_string();
    assert!(message.contains("other runs than those that are there"), "{message}");
}
