//! Recordings that are read as they are, and spoiled ones with their errors.

use crate::kr300;
use softdock_campaign::Robot;
use softdock_identify::log::Recording;
use softdock_identify::{IdentificationOptions, identify};
use softdock_results::{Column, ColumnKind, Table, Values, write_table};
use std::path::PathBuf;

const JOINTS: usize = 6;

/// Names of the columns that the shipped map asks for.
fn names(robot: &Robot) -> Vec<String> {
    robot.log.iter().map(|channel| channel.column.name.clone()).collect()
}

/// A CSV with a slow motion of every joint at 100 Hz.
fn text(robot: &Robot, rows: usize, amplitude: f64) -> String {
    let names = names(robot);
    let mut text = names.join(",") + "\n";
    for row in 0..rows {
        let value = |(column, name): (usize, &String)| match name.as_str() {
            "t_s" => format!("{}", row as f64 * 0.01),
            _ => format!("{:.6}", amplitude * (0.05 * (row as f64) * (1.0 + 0.1 * column as f64)).sin()),
        };
        text += &(names.iter().enumerate().map(value).collect::<Vec<_>>().join(",") + "\n");
    }
    text
}

fn written(folder: &tempfile::TempDir, name: &str, text: &str) -> PathBuf {
    let path = folder.path().join(name);
    std::fs::write(&path, text).expect("a file");
    path
}

#[test]
fn csv_and_parquet_give_the_same_recording() {
    let (robot, folder) = (kr300(), tempfile::tempdir().expect("a folder"));
    let text = text(&robot, 200, 20.0);
    let csv = Recording::read(&written(&folder, "log.csv", &text), &robot).expect("a recording");
    assert_eq!((csv.rows(), csv.angle.len(), csv.link_angle.len()), (200, JOINTS, 3));
    assert!((csv.step - 0.01).abs() < 1e-12);
    // The map's offset and unit, and the gear ratio of a motor-side torque.
    let column = |name: &str| {
        let at = names(&robot).iter().position(|column| column == name).expect(name);
        text.lines()
            .skip(1)
            .map(|line| line.split(',').nth(at).expect("a cell").parse().expect("a number"))
            .collect::<Vec<f64>>()
    };
    assert!((csv.angle[1][7] - (column("mot_pos_deg_2")[7] - 90.0).to_radians()).abs() < 1e-12);
    assert!((csv.torque[0][7] - column("tau_abs_nm_1")[7] * 256.857_142_857_142_83).abs() < 1e-9);

    let columns = names(&robot).into_iter().map(|name| Column {
        values: Values::F64(column(&name).into_iter().map(Some).collect()),
        unit: "1".to_owned(),
        description: "a column".to_owned(),
        source: String::new(),
        kind: ColumnKind::Signal,
        name,
    });
    let path = folder.path().join("log.parquet");
    write_table(&path, &Table { columns: columns.collect() }, &[]).expect("a table");
    let parquet = Recording::read(&path, &robot).expect("a recording");
    assert_eq!((parquet.angle, parquet.torque, parquet.link_angle), (csv.angle, csv.torque, csv.link_angle));
}

#[test]
fn parquet_of_the_wrong_kind_is_refused() {
    let (robot, folder) = (kr300(), tempfile::tempdir().expect("a folder"));
    let column = |name: String| {
        let number = Values::F64((0..100).map(|row| Some(0.01 * f64::from(row))).collect());
        let values = match name.as_str() {
            "mot_pos_deg_4" => Values::words(&["left", "right"], vec![0; 100]),
            "mot_pos_deg_5" => Values::F64((0..100).map(|row| (row != 6).then_some(1.0)).collect()),
            _ => number,
        };
        Column {
            name,
            unit: "1".to_owned(),
            description: String::new(),
            source: String::new(),
            kind: ColumnKind::Signal,
            values,
        }
    };
    let path = folder.path().join("log.parquet");
    let refused = |names: Vec<String>| {
        let table = Table { columns: names.into_iter().map(column).collect() };
        write_table(&path, &table, &[]).expect("a table");
        let text = Recording::read(&path, &robot).expect_err("refused").to_string();
        text.trim_start_matches(&format!("{}: ", path.display())).to_owned()
    };
    let message = refused(names(&robot));
    assert!(message.starts_with("column `mot_pos_deg_4` holds Dictionary"), "{message}");
    let rename = |name: String| if name == "mot_pos_deg_4" { "joint_4".to_owned() } else { name };
    let message = refused(names(&robot).into_iter().map(rename).collect());
    let expected = "there is no column `mot_pos_deg_4`, which [log] of kr300_r2500.toml names for `r1.q.4`";
    assert_eq!(message, expected);
    let mut lenient = robot.clone();
    lenient.log.retain(|channel| channel.column.name != "mot_pos_deg_4");
    let error = Recording::read(&path, &lenient).expect_err("a hole");
    assert!(error.to_string().ends_with("row 7 of column `mot_pos_deg_5` is not a finite number"), "{error}");
}

#[test]
fn unequal_steps_are_resampled_and_reported() {
    let (robot, folder) = (kr300(), tempfile::tempdir().expect("a folder"));
    let good = text(&robot, 200, 20.0);
    let even = Recording::read(&written(&folder, "even.csv", &good), &robot).expect("equal steps");
    let missing = good.lines().nth(19).expect("a line").to_owned() + "\n";
    let jittered = Recording::read(&written(&folder, "missing.csv", &good.replacen(&missing, "", 1)), &robot);
    let jittered = jittered.expect("a missing row is interpolated");
    assert!((jittered.step / even.step - 1.0).abs() < 1e-6 && even.notes.is_empty());
    assert!(
        jittered.notes.len() == 1 && jittered.notes[0].contains("resampled to equal steps"),
        "{:?}",
        jittered.notes
    );
    let far = even.angle[0].iter().zip(&jittered.angle[0]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let range = even.angle[0].iter().fold(0.0_f64, |most, own| most.max(own.abs()));
    assert!(even.rows() == jittered.rows() && far < 0.01 * range, "{far} of {range}");
}

#[test]
fn damaged_recordings_report_the_fault() {
    let (robot, folder) = (kr300(), tempfile::tempdir().expect("a folder"));
    let good = text(&robot, 200, 20.0);
    let line = |number: usize| good.lines().nth(number - 1).expect("a line").to_owned();
    let first_cell_of = |number: usize, cell: &str| {
        let rest = line(number);
        let rest = rest.split_once(',').expect("cells").1.to_owned();
        good.replacen(&line(number), &format!("{cell},{rest}"), 1)
    };
    let cases = [
        (String::new(), ": the file is empty", "CSV file with a header"),
        (
            good.replace("tau_abs_nm_3", "torque_3"),
            ":1: there is no column `tau_abs_nm_3`, which [log] of kr300_r2500.toml names for `r1.tau_motor.3`",
            "name one of its columns there: t_s, mot_pos_deg_1",
        ),
        (first_cell_of(8, "NaN"), ":8: `NaN` in column `t_s` is not a finite number", "every row is complete"),
        (
            good.replacen(&line(9), "1,2,3", 1),
            ":9: 3 values where the header names 16 columns",
            "complete or remove the row",
        ),
        (
            (60..80).fold(good.clone(), |text, number| text.replacen(&(line(number) + "\n"), "", 1)),
            ": cut at 1 gaps into 2 pieces: a low-pass needs one stretch without gaps",
            "cut the recording at its gaps",
        ),
        (
            good.lines().take(20).collect::<Vec<_>>().join("\n"),
            ": 19 rows are too few for the low-pass",
            "at least 50 rows",
        ),
    ];
    for (text, message, remedy) in cases {
        let path = written(&folder, "bad.csv", &text);
        let error = Recording::read(&path, &robot).expect_err(message);
        assert_eq!(error.to_string(), format!("{}{message}", path.display()));
        assert!(error.remedy().contains(remedy), "{message}: {}", error.remedy());
    }
    let missing = Recording::read(&folder.path().join("none.csv"), &robot).expect_err("no file");
    assert!(missing.to_string().contains("none.csv: there is no such file"), "{missing}");
}

#[test]
fn insufficient_recordings_are_rejected() {
    let (mut robot, folder) = (kr300(), tempfile::tempdir().expect("a folder"));
    let still = written(&folder, "still.csv", &text(&robot, 200, 0.1));
    let error = identify(&robot, &[&still], &[], &IdentificationOptions::default()).expect_err("a robot at rest");
    assert_eq!(error.to_string(), "joint A1 moves by only 0.2000 deg");
    let moving = written(&folder, "moving.csv", &text(&robot, 200, 20.0));
    let mut options = IdentificationOptions::default();
    options.preparation.period = Some(0.333);
    let error = identify(&robot, &[&moving], &[], &options).expect_err("no whole period");
    assert_eq!(error.to_string(), "moving.csv: a period of 0.333 s is not a whole number of steps of 0.010000 s");
    options.preparation.period = Some(5.0);
    let error = identify(&robot, &[&moving], &[], &options).expect_err("too short");
    assert_eq!(error.to_string(), "moving.csv: 2.000 s are shorter than one period of 5 s");
    robot.log.retain(|channel| channel.name != "r1.q.4");
    let error = identify(&robot, &[&moving], &[], &IdentificationOptions::default()).expect_err("no angle");
    assert!(error.to_string().ends_with("the signal `r1.q.4` is not mapped to any column"), "{error}");
}
