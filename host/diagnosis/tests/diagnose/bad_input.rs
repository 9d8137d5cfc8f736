//! Recordings and model files that are wrong: a clear finding or a clear error, never a wrong name.

use crate::bench::{Bench, Kind, drive};
use softdock_diagnosis::diagnosis::{DiagnosisOptions, prepare};
use softdock_diagnosis::verdict::answer::DiagnosisVerdict;
use softdock_gauntlet::NoiseColour;
use softdock_kernels::philox;
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

/// A validation motion of a robot in which this joint holds its position.
#[test]
fn held_out_motion_of_a_joint_at_rest_is_refused() {
    let bench = Bench::drive(&[("J1_coulomb", 12.0)], 1).with_held_out(|text| {
        let row = |(number, line): (usize, &str)| {
            let cells: Vec<&str> = line.split(',').collect();
            let motion = |cell: &str| if number == 0 { cell.to_owned() } else { times(cell, 0.01) };
            format!("{},{},{},{}\n", cells[0], motion(cells[1]), motion(cells[2]), cells[3])
        };
        text.lines().enumerate().map(row).collect()
    });
    let message = refused(&bench);
    assert!(message.contains("`q` (range 0.0") && message.contains("hold out a recording"), "{message}");
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

/// A torque in kilopond metres or doubled is no effect of a drive.
#[test]
fn wrong_units_are_reported() {
    for (factor, word) in first(1, [(2.0, "0.5"), (1.0 / 9.80665, "9.81")]) {
        let diagnosis = torque(|cell| times(cell, factor)).diagnose();
        assert!(diagnosis.answer >= DiagnosisVerdict::Named, "{factor}: {:?}", diagnosis.answer);
        let is_reported =
            diagnosis.findings.iter().any(|finding| finding.what.contains("`tau`") && finding.what.contains(word));
        assert!(is_reported, "{factor}: {:?} {:?}", diagnosis.findings, drive(&diagnosis).answer);
    }
}

/// Recordings of which some cells hold anything: of 1,000 recordings one to twenty each at the full size.
#[test]
fn damaged_cells_neither_panic_nor_make_a_name() {
    let kinds = [Kind::Drive { link_encoder: false }, Kind::Sensor, Kind::Contact, Kind::Command];
    for trial in first(kinds.len(), 0..1000_u64) {
        let random = |of: &str, place: u64, below: u64| (philox::uniform(trial, of, place, 0) * below as f64) as usize;
        let bench =
            Bench::of(kinds[trial as usize % kinds.len()], NoiseColour::White, &[], trial).with_recordings(|text| {
                let mut rows: Vec<Vec<String>> =
                    text.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect();
                let (count, columns) = (rows.len() as u64, rows[0].len() as u64);
                for cell in 0..=random("cells", 0, 20) as u64 {
                    let row = 3 + random("row", cell, count - 6);
                    let column = 1 + random("column", cell, columns - 1);
                    let value: f64 = rows[row][column].parse().unwrap_or(0.0);
                    let damaged = [1e6, 0.0, -value, 1000.0 * value, 1e30, -1e12][random("kind", cell, 6)];
                    rows[row][column] = format!("{damaged:e}");
                }
                rows.into_iter().map(|row| row.join(",") + "\n").collect()
            });
        // An error is an answer as well; a name is none, since nothing is hidden.
        if let Ok((diagnosis, _)) = bench.diagnose_with(&DiagnosisOptions::default()) {
            assert!(!matches!(diagnosis.answer, DiagnosisVerdict::Named), "{trial}: {:?}", diagnosis.effects);
        }
    }
}

/// A recording in which the command rests has no say in the weight of the others.
#[test]
fn constant_command_beside_a_motion_hides_no_lag() {
    let folder = tempfile::tempdir().expect("a folder");
    let rig = folder.path().join("rig.toml");
    let text = "schema = \"rig/1\"\nkind = \"command\"\nid = \"servo\"\n[command]\nperiod = \"10 ms\"\nreceived = \"position\"\n\
                [log]\n\"t\" = { column = \"t\", unit = \"s\" }\n\"sent\" = { column = \"u\", unit = \"rad\" }\n\
                \"received\" = { column = \"y\", unit = \"rad\" }\n";
    std::fs::write(&rig, text).expect("writable");
    let lag = 0.05;
    let write = |name: &str, amplitude: f64, rate: f64| {
        let path = folder.path().join(name);
        let (gain, phase) = ((1.0 + (rate * lag).powi(2)).sqrt().recip(), (rate * lag).atan());
        let row = |i: u32| {
            let t = f64::from(i) * 0.01;
            let noise = 1e-3 * (f64::from(i * 7919 % 1009) / 1009.0 - 0.5);
            format!("{t},{},{}\n", amplitude * (rate * t).sin(), amplitude * gain * (rate * t - phase).sin() + noise)
        };
        std::fs::write(&path, "t,u,y\n".to_owned() + &(0..1500).map(row).collect::<String>()).expect("writable");
        path
    };
    let files = [write("rest.csv", 0.0, 1.0), write("slow.csv", 0.3, 3.0), write("fast.csv", 0.2, 7.0)];
    let load = || softdock_campaign::Rig::load(&rig).expect("a legal model");
    let options = DiagnosisOptions::default();
    let prepared = prepare(load(), &[&files[0], &files[1]], &[&files[2]], &options).expect("a motion");
    let diagnosis = prepared.diagnose().expect("a motion").0;
    assert_eq!(diagnosis.answer, DiagnosisVerdict::Named);
    let effect = &diagnosis.effects[0];
    assert!(effect.id == "C2_lag" && (effect.parameters["lag"].value - lag).abs() < 3e-3, "{effect:?}");
    let refused = prepare(load(), &[&files[0]], &[], &options).map(|_| ()).expect_err("no motion").to_string();
    assert!(refused.contains("`sent` is constant"), "{refused}");
}
