//! Recordings in the dialects of common programs: the same samples, with a statement of what was assumed.

use softdock_campaign::Rig;
use softdock_diagnosis::data::grid::{Finding, Piece, read};
use std::path::Path;

/// A joint that is known by its inertia alone.
pub(crate) const MODEL: &str = r#"schema = "rig/1"
kind = "drive"
id = "joint"
title = "A joint"
[drive]
motion = "revolute"
motor_inertia = "5.4 kg m^2"
[tolerance]
motor_inertia = "5 %"
[log]
"t" = { column = "t", unit = "s" }
"q" = { column = "q1", unit = "rad" }
"tau" = { column = "i1", unit = "N m" }
"#;

/// Rows of the recordings.
const ROWS: u32 = 400;

pub(crate) fn plain() -> String {
    let row = |i: u32| {
        let t = f64::from(i) * 0.01;
        format!("{t:.7},{:.7},{:.7}\n", (2.0 * t).sin(), 30.0 * (2.0 * t + 0.4).cos())
    };
    "t,q1,i1\n".to_owned() + &(0..ROWS).map(row).collect::<String>()
}

/// The text with every time stamp replaced.
fn with_stamps(stamp: impl Fn(u32) -> String) -> String {
    let text = plain();
    let mut lines = text.lines();
    let header = lines.next().expect("a header");
    let row = |(i, line): (usize, &str)| format!("{},{}\n", stamp(i as u32), line.split_once(',').expect("cells").1);
    format!("{header}\n") + &lines.enumerate().map(row).collect::<String>()
}

fn recording(folder: &Path, model: &str, text: &str) -> Result<(Vec<Piece>, Vec<Finding>), String> {
    let (rig, file) = (folder.join("rig.toml"), folder.join("recording.csv"));
    std::fs::write(&rig, model).expect("writable");
    std::fs::write(&file, text).expect("writable");
    let rig = Rig::load(&rig).expect("a legal model");
    read(&file, &rig).map_err(|error| format!("{error} | {}", error.remedy()))
}

/// A changed text and words of the statement about it.
type Case = (String, &'static str);

#[test]
fn dialects_give_the_samples_of_the_plain_text() {
    let folder = tempfile::tempdir().expect("a folder");
    let (expected, findings) = recording(folder.path(), MODEL, &plain()).expect("the plain text");
    assert!(findings.is_empty(), "{findings:?}");
    let iso = |i: u32| format!("2024-03-05T10:00:{:02}.{:03}", i / 100, i % 100 * 10);
    let body = plain().split_once('\n').expect("a header").1.to_owned();
    let cases: [Case; 11] = [
        (plain().replace(',', ";"), "separated by `;`"),
        (plain().replace(',', ";").replace('.', ","), "decimal mark is a comma"),
        (plain().replace(',', "\t"), "separated by tab"),
        (plain().replace(',', "  "), "separated by spaces"),
        (body, "no header: its columns are taken for t, q1, i1"),
        ("# drive log, 100 Hz\n".to_owned() + &plain(), "comment lines"),
        (plain().replacen("i1\n", "i1\ns,rad,Nm\n", 1), "units (s, rad, Nm)"),
        (plain().replace('\n', ",\n").replacen("i1,", "i1", 1), "rows end with a separator"),
        (plain() + "4.0000000,0.9893\n", "the last one, is incomplete"),
        (plain().replacen("3.0000000,", "2.9900000,", 1), "repeat the time stamp"),
        (with_stamps(iso), "date and time"),
    ];
    for (text, statement) in cases {
        let (pieces, findings) = recording(folder.path(), MODEL, &text).expect(statement);
        assert!(findings.iter().any(|finding| finding.what.contains(statement)), "{statement}: {findings:?}");
        assert_eq!((pieces.len(), pieces[0].samples()), (1, expected[0].samples()), "{statement}");
        for (signal, values) in &expected[0].signals {
            let scale = values.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
            let off = values.iter().zip(&pieces[0].signals[signal]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            // The sample of a repeated stamp is interpolated, stamps since 1970 are rounded to 0.24 us.
            assert!(off < 1e-4 * scale, "{statement}: {signal} differs by {off}");
        }
    }
    let nanoseconds = MODEL.replacen("unit = \"s\"", "unit = \"ns\"", 1);
    let text = with_stamps(|i| format!("{}", 1_700_000_000_000_000_000 + u64::from(i) * 10_000_000));
    let (pieces, _) = recording(folder.path(), &nanoseconds, &text).expect("stamps in nanoseconds");
    assert_eq!((pieces.len(), pieces[0].samples()), (1, expected[0].samples()));
}

#[test]
fn unreadable_dialects_name_the_cause() {
    let folder = tempfile::tempdir().expect("a folder");
    let refused = |text: &str| recording(folder.path(), MODEL, text).expect_err("refused");
    let message = refused(&plain().replacen("0.0100000,", "0,0100000,", 1));
    assert!(message.contains("4 values where the header names 3 columns") && message.contains("`;`"), "{message}");
    let message = refused(&plain().lines().skip(1).map(|line| format!("{line},1.0\n")).collect::<String>());
    assert!(message.contains("no header") && message.contains("4 columns"), "{message}");
}
