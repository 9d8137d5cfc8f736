//! Recordings and model files that are wrong: a clear finding or a clear error, never a wrong name.

use crate::bench::{Bench, drive};
use softdock_diagnosis::diagnosis::DiagnosisOptions;
use softdock_diagnosis::verdict::answer::DiagnosisVerdict;
use softdock_test_size::first;

fn refused(bench: &Bench) -> String {
    match bench.diagnose_with(&DiagnosisOptions::default()) {
        Ok((diagnosis, _)) => panic!("answered {:?}", diagnosis.answer),
        Err(error) => format!("{error} | {}", error.remedy()),
    }
}

/// Recordings whose fourth column is made of itself.
fn torque(change: impl Fn(&str) -> String) -> Bench {
    Bench::drive(&[], 1).with_recordings(|text| {
        let row = |(number, line): (usize, &str)| {
            let cells: Vec<&str> = line.split(',').collect();
            let torque = if number == 0 { cells[3].to_owned() } else { change(cells[3]) };
            format!("{},{},{},{torque}\n", cells[0], cells[1], cells[2])
        };
        text.lines().enumerate().map(row).collect()
    })
}

fn times(cell: &str, factor: f64) -> String {
    format!("{}", cell.parse::<f64>().expect("a number") * factor)
}

#[test]
fn a_constant_channel_is_refused() {
    let said = refused(&torque(|_| "12.5".to_owned()));
    assert!(said.contains("`tau` is constant") && said.contains("12.5") && said.contains("[log]"), "{said}");
}

#[test]
fn ten_samples_are_too_few() {
    let said = refused(
        &Bench::drive(&[], 1)
            .with_recordings(|text| text.lines().take(11).fold(String::new(), |all, line| all + line + "\n")),
    );
    assert!(said.contains("10 rows are too few") && said.contains("record"), "{said}");
}

#[test]
fn missing_column_is_reported_with_the_existing_ones() {
    let said = refused(&Bench::drive(&[], 1).with_model("\"tau_nm\"", "\"torque_nm\""));
    assert!(said.contains("`torque_nm`") && said.contains("tau_nm"), "{said}");
}

#[test]
fn rows_without_a_number_are_gaps_and_are_reported() {
    let bench = Bench::drive(&[], 1).with_recordings(|text| {
        let row = |(number, line): (usize, &str)| match number % 500 {
            499 => format!("{},nan\n", line.rsplit_once(',').expect("cells").0),
            _ => format!("{line}\n"),
        };
        text.lines().enumerate().map(row).collect()
    });
    let diagnosis = bench.diagnose();
    assert!(
        diagnosis.findings.iter().any(|finding| finding.what.contains("have missing numbers")),
        "{:?}",
        diagnosis.findings
    );
    assert_eq!(diagnosis.answer, DiagnosisVerdict::NoEffect);
}

/// A torque in kilopond metres, in turns, doubled or with its sign reversed is no effect of a drive.
#[test]
fn wrong_units_and_signs_are_reported() {
    for (factor, word) in first(1, [(-1.0, "sign"), (2.0, "0.5"), (1.0 / 9.80665, "9.81")]) {
        let diagnosis = torque(|cell| times(cell, factor)).diagnose();
        assert!(diagnosis.answer >= DiagnosisVerdict::Named, "{factor}: {:?}", diagnosis.answer);
        let is_reported =
            diagnosis.findings.iter().any(|finding| finding.what.contains("`tau`") && finding.what.contains(word));
        assert!(is_reported, "{factor}: {:?} {:?}", diagnosis.findings, drive(&diagnosis).answer);
    }
}
