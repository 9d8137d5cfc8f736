//! Recordings as test rigs give them: one axis, several rates in one table, Parquet of other programs.

use crate::dialects::{MODEL, plain};
use softdock_campaign::Rig;
use softdock_diagnosis::data::grid::{Finding, Piece, read};
use softdock_diagnosis::diagnosis::{Diagnosis, DiagnosisOptions, prepare};
use softdock_kernels::philox;
use std::path::Path;

/// Answer for a model and two recordings.
fn diagnosed(model: &str, learn: &str, test: &str) -> Diagnosis {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        let file = folder.path().join(name);
        std::fs::write(&file, text).expect("writable");
        file
    };
    let rig = Rig::load(&write("rig.toml", model)).expect("a legal model");
    let (learn, test) = (write("learn.csv", learn), write("test.csv", test));
    let prepared = prepare(rig, &[&learn], &[&test], &DiagnosisOptions::default()).expect("good recordings");
    prepared.diagnose().expect("an answer").0
}

/// Noise of a row, from -1 to 1.
fn noise(of: &str, motion: u64, row: u32) -> f64 {
    2.0 * philox::uniform(motion, of, u64::from(row), 0) - 1.0
}

/// Impacts on a plate of 200 kN/m and 150 N s/m, of which the normal alone was recorded.
fn impacts(motion: u64) -> String {
    let row = |i: u32| {
        let (t, omega) = (f64::from(i) * 1e-4, 40.0 + 7.0 * motion as f64);
        let (sin, cos) = (omega * t).sin_cos();
        let (depth, rate) = (2e-4 * sin - 1e-4, 2e-4 * omega * cos);
        let force = if depth > 0.0 { (2e5 * depth + 150.0 * rate).max(0.0) } else { 0.0 };
        format!("{t:.7},{:.9},{:.6}\n", -depth + 1e-8 * noise("z", motion, i), force + 0.3 * noise("f", motion, i))
    };
    "t,z,fz\n".to_owned() + &(0..6000).map(row).collect::<String>()
}

#[test]
fn contact_is_diagnosed_from_its_normal_alone() {
    let model = "schema = \"rig/1\"\nkind = \"contact\"\nid = \"pendulum\"\ntitle = \"A pendulum\"\n\
                 [contact]\nstiffness = \"1e5 N/m\"\n[tolerance]\nstiffness = \"10 %\"\n[log]\n\
                 \"t\" = { column = \"t\", unit = \"s\" }\n\"position.z\" = { column = \"z\", unit = \"m\" }\n\
                 \"force.z\" = { column = \"fz\", unit = \"N\" }\n";
    let diagnosis = diagnosed(model, &impacts(1), &impacts(2));
    let sizes = |id: &str, name: &str| {
        let effect = diagnosis.effects.iter().find(|effect| effect.id == id);
        effect.unwrap_or_else(|| panic!("{:?}", diagnosis.effects)).parameters[name].value
    };
    assert!((sizes("K1_stiffness", "stiffness") / 2e5 - 1.0).abs() < 0.02, "{:?}", diagnosis.effects);
    assert!((sizes("K3_damping", "damping") / 150.0 - 1.0).abs() < 0.1, "{:?}", diagnosis.effects);
}

/// Reads a recording by the model of a joint.
fn joint(file: &Path) -> (Vec<Piece>, Vec<Finding>) {
    let model = file.with_file_name("rig.toml");
    std::fs::write(&model, MODEL).expect("writable");
    read(file, &Rig::load(&model).expect("a legal model")).unwrap_or_else(|error| panic!("{error}"))
}

/// Angles at 200 Hz and torques at 100 Hz, each in rows of its own.
#[test]
fn signals_at_two_rates_share_a_table() {
    let folder = tempfile::tempdir().expect("a folder");
    let angle = |t: f64| (2.0 * t).sin();
    let torque = |t: f64| 30.0 * (2.0 * t + 0.4).cos();
    let row = |i: u32| {
        let t = f64::from(i) * 0.005;
        let late = t + 0.003;
        let second = if i.is_multiple_of(2) { format!("{late:.7},,{:.9}\n", torque(late)) } else { String::new() };
        format!("{t:.7},{:.9},\n{second}", angle(t))
    };
    let file = folder.path().join("rates.csv");
    std::fs::write(&file, "t,q1,i1\n".to_owned() + &(0..800).map(row).collect::<String>()).expect("writable");
    let (pieces, findings) = joint(&file);
    let says = findings.iter().any(|finding| finding.what.contains("200.0000 Hz") && finding.what.contains("100.0000"));
    assert!(pieces.len() == 1 && says, "{findings:?}");
    let piece = &pieces[0];
    assert!((piece.step - 0.01).abs() < 1e-9 && piece.samples() > 395, "{} {}", piece.step, piece.samples());
    let times = (0..piece.samples()).map(|i| piece.start + i as f64 * piece.step);
    for (i, t) in times.enumerate() {
        let off = [piece.signals["q"][i] - angle(t), (piece.signals["tau"][i] - torque(t)) / 30.0];
        assert!(off.iter().all(|off| off.abs() < 1e-4), "{t}: {off:?}");
    }
}

/// The plain text of the dialects, written by pyarrow 26 with snappy.
#[test]
fn parquet_of_pyarrow_is_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let [csv, parquet] = ["recording.csv", "recording.parquet"].map(|name| folder.path().join(name));
    std::fs::write(&csv, plain()).expect("writable");
    std::fs::write(&parquet, include_bytes!("pyarrow_snappy.parquet")).expect("writable");
    let (expected, found) = (joint(&csv).0, joint(&parquet).0);
    assert_eq!((found.len(), found[0].samples()), (1, expected[0].samples()));
    for (signal, values) in &expected[0].signals {
        let off = values.iter().zip(&found[0].signals[signal]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-6, "{signal} differs by {off}");
    }
}
