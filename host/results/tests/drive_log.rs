//! A drive's log as a table: what is written comes back, part by part, with units and meanings.

use softdock_results::drive_log::{open_drive_log, signal, write_drive_log};
use softdock_results::{ColumnKind, ResultsError, Table, Values, write_table};
use std::path::Path;

const PHASES: [&str; 3] = ["approach", "contact", "stopped"];

/// Rows `from` to `to` of a log with a column of every type.
fn part(from: u64, to: u64) -> Table {
    let rows = || from..to;
    let force = |row: u64| [Some(0.1 * row as f64), Some(-0.0), Some(f64::MAX), None][row as usize % 4];
    Table {
        columns: vec![
            signal("cycle", "1", "cycle", Values::U64(rows().collect())),
            signal(
                "time_ns",
                "ns",
                "start of the cycle",
                Values::I64(rows().map(|row| row as i64 * 1_000_000 - 7).collect()),
            ),
            signal("phase", "1", "phase", Values::words(&PHASES, rows().map(|row| (row / 4000) as u32 % 3).collect())),
            signal("ft_flags", "bits", "status of the sensor", Values::U32(rows().map(|row| row as u32 & 3).collect())),
            signal("ft_raw_force_x_n", "N", "force, the sensor's axes", Values::F64(rows().map(force).collect())),
        ],
    }
}

fn written(path: &Path) -> u64 {
    let parts = (0..5).map(|n| Ok(part(n * 2_500, (n + 1) * 2_500)));
    write_drive_log(path, parts, &[("softdock.version".to_owned(), "0.1.0".to_owned())]).expect("a log")
}

#[test]
fn parts_come_back_as_one_table() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("drive.parquet");
    assert_eq!(written(&path), 12_500);
    let (reader, metadata) = open_drive_log(&path).expect("a log");
    assert_eq!(metadata, [("softdock.version".to_owned(), "0.1.0".to_owned())]);
    assert_eq!(reader.rows(), 12_500);
    let (back, whole) = (reader.read().expect("rows"), part(0, 12_500));
    for (back, column) in back.columns.iter().zip(&whole.columns) {
        assert_eq!((&back.name, &back.unit, &back.description), (&column.name, &column.unit, &column.description));
        if !matches!(column.values, Values::Words { .. }) {
            assert_eq!(back.values, column.values, "{}", column.name);
        }
        let words = (0..12_500).all(|row| back.values.word(row) == column.values.word(row));
        assert!(words, "{}", column.name);
    }
    assert_eq!(back.columns[1].kind, ColumnKind::Key);
    assert_eq!(back.columns[4].kind, ColumnKind::Signal);
    let force = back.f64s("ft_raw_force_x_n").expect("the force");
    assert_eq!(force[1].map(f64::to_bits), Some((-0.0_f64).to_bits()));
}

#[test]
fn a_log_appears_whole_or_not_at_all() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("drive.parquet");
    let broken = || ResultsError::Contract { path: path.clone(), what: "the recording ends".to_owned() };
    let parts = [Ok(part(0, 10)), Err(broken())];
    assert!(write_drive_log(&path, parts, &[]).unwrap_err().to_string().contains("the recording ends"));
    let other = Table { columns: part(10, 20).columns.split_off(1) };
    let parts = [Ok(part(0, 10)), Ok(other)];
    assert!(write_drive_log(&path, parts, &[]).unwrap_err().to_string().contains("different columns"));
    assert!(write_drive_log(&path, [], &[]).unwrap_err().to_string().contains("no columns"));
    assert_eq!(std::fs::read_dir(folder.path()).expect("the folder").count(), 0);
}

#[test]
fn other_tables_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("other.parquet");
    write_table(&path, &part(0, 3), &[("softdock.schema".to_owned(), "runs/1".to_owned())]).expect("a table");
    let refused = open_drive_log(&path).map(|_| ()).unwrap_err().to_string();
    assert!(refused.contains("`runs/1`"), "{refused}");
}
