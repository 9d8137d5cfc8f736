//! `softdock rig init` as a process: from a log to the first answer, open values, existing files.

use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

fn softdock(folder: &Path, words: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_softdock"));
    command.current_dir(folder).args(words).stdin(Stdio::null());
    command.output().expect("softdock starts")
}

/// Writes a log of 3 kg m^2 with friction; `scale` divides its torque.
fn log(folder: &Path, name: &str, header: &str, scale: f64) {
    let mut text = format!("{header}\n");
    let mut noise = 1_u64;
    for row in 0..3000 {
        let t = f64::from(row) * 0.005;
        noise = noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        let noise = 1e-6 * ((noise >> 33) as f64 / f64::from(1 << 30) - 1.0);
        let angle = 0.8 * (2.0 * t).sin() + 0.2 * (5.3 * t).cos();
        let rate = 1.6 * (2.0 * t).cos() - 1.06 * (5.3 * t).sin();
        let acceleration = -3.2 * (2.0 * t).sin() - 5.618 * (5.3 * t).cos();
        let torque = 3.0 * acceleration + 5.0 * rate + 7.0 * (rate / 0.01).tanh();
        let _ = writeln!(text, "{t},{:.9},{:.6}", angle + noise, torque / scale);
    }
    fs::write(folder.join(name), text).expect("a file");
}

fn text(bytes: &[u8]) -> String {
    // Messages are wrapped to the width of a terminal.
    String::from_utf8_lossy(bytes).replace('│', " ").split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn log_with_torque_leads_to_an_answer_without_an_edit() {
    let folder = tempfile::tempdir().expect("a folder");
    log(folder.path(), "log.csv", "t_s,q_rad,tau_nm", 1.0);
    let output = softdock(folder.path(), &["rig", "init", "log.csv"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("no value is open"), "{}", text(&output.stdout));
    let output =
        softdock(folder.path(), &["diagnose", "rig.toml", "log.csv", "--hold-out-from", "9", "--out", "first"]);
    let printed = text(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{printed}{}", text(&output.stderr));
    assert!(printed.contains("Answer, block by block") && printed.contains("Drive"), "{printed}");

    // An existing file is kept.
    fs::write(folder.path().join("rig.toml"), "mine").expect("a file");
    let output = softdock(folder.path(), &["rig", "init", "log.csv"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("rig.toml exists") && text(&output.stderr).contains("--force"));
    assert_eq!(fs::read_to_string(folder.path().join("rig.toml")).expect("the file"), "mine");
}

#[test]
fn open_values_are_listed_and_refused_by_diagnose() {
    let folder = tempfile::tempdir().expect("a folder");
    log(folder.path(), "log.csv", "t_s,q_rad,i_a", 11.0);
    let output = softdock(folder.path(), &["rig", "init", "log.csv", "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let keys: Vec<&str> =
        json["open"].as_array().expect("a list").iter().filter_map(|key| key["key"].as_str()).collect();
    assert_eq!(keys, ["motor_inertia", "motor_inertia", "tau"]);
    let output = softdock(folder.path(), &["diagnose", "rig.toml", "log.csv"]);
    assert_eq!(output.status.code(), Some(2));
    for key in ["drive.motor_inertia", "tolerance.motor_inertia", "log.tau.scale"] {
        assert!(text(&output.stderr).contains(&format!("fill in `{key}`")), "{}", text(&output.stderr));
    }
}

#[test]
fn bad_input_is_refused_with_a_remedy() {
    let folder = tempfile::tempdir().expect("a folder");
    log(folder.path(), "log.csv", "t_s,q_rad,tau_nm", 1.0);
    fs::write(folder.path().join("robot.urdf"), "<robot name=\"r\"><link name=\"a\">").expect("a file");
    let cases: [(&[&str], &str); 6] = [
        (&["none.csv"], "there is no such file"),
        (&["log.csv", "--out", "rig.txt"], "a rig file ends in .toml"),
        (&["log.csv", "--urdf", "robot.urdf"], "this is not a URDF"),
        (&["log.csv", "--kind", "robot"], "add --urdf"),
        (&["log.csv", "--kind", "tos"], "toss"),
        (&["robot.urdf"], "robot.urdf"),
    ];
    for (words, message) in cases {
        let output = softdock(folder.path(), &[&["rig", "init"], words].concat());
        assert_eq!(output.status.code(), Some(2), "{words:?}");
        assert!(text(&output.stderr).contains(message), "{words:?}: {}", text(&output.stderr));
        assert!(!folder.path().join("rig.toml").exists(), "{words:?}");
    }
}
