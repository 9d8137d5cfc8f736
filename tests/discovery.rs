//! A way in from an empty folder: `init`, lists, `--set`, hints, `--json`, completions, manual pages; safe output.

use crate::cli::{assert_same, text};
use serde_json::Value;
use softdock_test_size::first;
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// Runs the program in a folder.
fn softdock(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_softdock"));
    command.current_dir(folder).args(arguments).stdin(Stdio::null());
    command.output().expect("softdock starts")
}

/// Runs the program, which must end with this exit code; returns its answer and its messages.
fn expect(folder: &Path, code: i32, arguments: &[&str]) -> (String, String) {
    let output = softdock(folder, arguments);
    let (printed, errors) = (text(&output.stdout), text(&output.stderr));
    assert_eq!(output.status.code(), Some(code), "softdock {arguments:?}\n{printed}\n{errors}");
    (printed, errors)
}

fn json(folder: &Path, arguments: &[&str]) -> Value {
    let (printed, errors) = expect(folder, 0, arguments);
    serde_json::from_str(&printed).unwrap_or_else(|error| panic!("{arguments:?}: {error}\n{printed}\n{errors}"))
}

/// The tasks that `init` knows, with the ids of their campaigns.
fn tasks() -> Vec<(String, String)> {
    let list = json(Path::new("."), &["init", "--json"]);
    let word = |row: &Value, key: &str| row[key].as_str().expect("a text").to_owned();
    list.as_array().expect("a list").iter().map(|row| (word(row, "task"), word(row, "id"))).collect()
}

#[test]
fn every_task_is_written_into_an_empty_folder_and_checked() {
    for (task, id) in tasks() {
        let folder = tempfile::tempdir().expect("a folder");
        let (printed, _) = expect(folder.path(), 0, &["init", &task]);
        assert!(printed.ends_with(&format!("next  softdock run {id}.toml\n")), "{task}: {printed}");
        expect(folder.path(), 0, &["check", &format!("{id}.toml"), "--runs", "20", "--step", "1", "--backend", "cpu"]);
        // The id does the same, and equal files may exist.
        expect(folder.path(), 0, &["init", &id]);
    }
}

#[test]
fn a_written_task_ends_in_a_verdict_or_a_report() {
    // The last ones have no requirement; the first in the list of the short size runs both kinds.
    let order = ["first", "wedge", "insert", "dock", "mesh", "jam", "ring", "impact", "capture", "track", "berth"];
    for task in first(3, order) {
        let folder = tempfile::tempdir().expect("a folder");
        let id = json(folder.path(), &["init", task, "new", "--json"])["id"].as_str().expect("an id").to_owned();
        let file = format!("new/{id}.toml");
        let run = ["run", &file, "--runs", "20", "--backend", "cpu", "--out", "results"];
        let output = softdock(folder.path(), &run);
        assert!(output.status.code().is_some_and(|code| code <= 1), "{task}: {}", text(&output.stderr));
        assert!(folder.path().join("results/report.html").is_file(), "{task}");
    }
}

#[test]
fn init_replaces_no_file_unasked() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("smoke.toml"), "mine").expect("a file");
    let (_, errors) = expect(folder.path(), 2, &["init", "first"]);
    assert!(errors.contains("smoke.toml") && errors.contains("--force"), "{errors}");
    assert!(!folder.path().join("scenarios").exists(), "nothing is written");
    assert_eq!(fs::read_to_string(folder.path().join("smoke.toml")).expect("the file"), "mine");
    expect(folder.path(), 0, &["init", "first", "--force"]);
    let (_, errors) = expect(folder.path(), 2, &["init", "dok"]);
    assert!(errors.contains("did you mean `dock`?"), "{errors}");
}

#[test]
fn lists_have_units_and_meanings_and_can_be_searched() {
    let here = Path::new(".");
    for (command, word, name) in [
        ("params", "friction", "contact_friction"),
        ("params", "latency", "loop_delay"),
        ("metrics", "force", "peak_contact_force"),
        ("effects", "transport", "C1_transport_delay"),
        ("signals", "latch", "space_latch_force_n"),
        ("examples", "peg", "insert"),
    ] {
        let (printed, _) = expect(here, 0, &[command, word]);
        let lines: Vec<&str> = printed.lines().collect();
        assert!(lines[1..].iter().any(|line| line.contains(name)), "{command} {word}: {printed}");
        let (whole, part) = (json(here, &[command, "--json"]), json(here, &[command, word, "--json"]));
        let count = |list: &Value| list.as_array().expect("a list").len();
        assert!(count(&part) < count(&whole) && count(&part) > 0, "{command}");
        assert!(whole.as_array().expect("a list").iter().all(|row| row["meaning"].is_string()), "{command}");
        expect(here, 2, &[command, "qqqq"]);
    }
    let delay = &json(here, &["params", "loop_delay", "--json"])[0];
    assert_eq!((delay["unit"].as_str(), delay["range"][0].as_f64()), (Some("s"), Some(0.0)));
}

#[test]
fn a_set_value_is_repeated_by_the_copy_in_the_results() {
    let folder = tempfile::tempdir().expect("a folder");
    expect(folder.path(), 0, &["init", "first"]);
    let run = |more: &[&str]| {
        let mut arguments = vec!["run", "smoke.toml", "--backend", "cpu"];
        arguments.extend(more);
        softdock(folder.path(), &arguments)
    };
    let set =
        ["--set", "runs=16", "--set", "scenario.contact.friction=0.3", "--set", "requirement[SMOKE-020].at_most=390 N"];
    let of = |out: &'static str| [&set[..], &["--out", out]].concat();
    assert!(run(&of("set")).status.code().is_some_and(|code| code <= 1));
    let copy = fs::read_to_string(folder.path().join("set/campaign/smoke.toml")).expect("the copy");
    assert!(copy.contains("runs = 16") && copy.contains("# --set \"runs=16\""), "{copy}");
    // The same command resumes, and the copy gives the same results.
    assert!(run(&of("set")).status.code().is_some_and(|code| code <= 1));
    let again = ["run", "set/campaign/smoke.toml", "--backend", "cpu", "--out", "again"];
    assert!(softdock(folder.path(), &again).status.code().is_some_and(|code| code <= 1));
    assert_same(&folder.path().join("set/runs"), &folder.path().join("again/runs"));
    expect(folder.path(), 0, &["verify", "set"]);
    let errors = text(&run(&["--out", "set"]).stderr);
    assert!(errors.contains("runs: 16 -> 64"), "{errors}");
    let errors = text(&run(&["--set", "scenario.contact.frictoin=0.3"]).stderr);
    assert!(errors.contains("--set:1") && errors.contains("did you mean `friction`?"), "{errors}");
}

#[test]
fn an_unknown_word_is_understood_by_its_meaning() {
    let folder = tempfile::tempdir().expect("a folder");
    expect(folder.path(), 0, &["init", "first"]);
    for (key, value, hint) in [
        ("dispersion[2].target", "friction", "`contact_friction`"),
        ("dispersion[4].target", "latency", "`loop_delay`"),
        ("requirement[2].metric", "force", "`peak_contact_force`"),
    ] {
        let (_, errors) = expect(folder.path(), 2, &["check", "smoke.toml", "--set", &format!("{key}={value}")]);
        assert!(errors.contains("did you mean") && errors.contains(hint), "{errors}");
    }
    for (word, command) in [("simulate", "run"), ("template", "init"), ("diff", "compare")] {
        let (_, errors) = expect(folder.path(), 2, &[word]);
        assert!(errors.contains(&format!("'{command}'")), "{word}: {errors}");
    }
}

#[test]
fn completions_and_manual_pages_name_every_command() {
    let folder = tempfile::tempdir().expect("a folder");
    for shell in ["bash", "zsh", "fish", "powershell"] {
        let (script, _) = expect(folder.path(), 0, &["completions", shell]);
        assert!(["init", "params", "diagnose"].iter().all(|word| script.contains(word)), "{shell}");
    }
    expect(folder.path(), 0, &["man", "pages/man1"]);
    for page in ["softdock.1", "softdock-run.1", "softdock-identify-robot.1"] {
        assert!(folder.path().join("pages/man1").join(page).is_file(), "{page}");
    }
}

#[test]
fn every_answer_is_json_on_request() {
    let folder = tempfile::tempdir().expect("a folder");
    expect(folder.path(), 0, &["init", "first"]);
    expect(folder.path(), 0, &["run", "smoke.toml", "--backend", "cpu", "--out", "r", "--threads", "1"]);
    for arguments in [
        &["report", "r"][..],
        &["replay", "r", "3", "--out", "made/here/run3.parquet"],
        &["merge", "merged", "r"],
        &["devices"],
        &["diagnose", "--signals"],
        &["kernel", "scenarios/smoke.toml"],
        &["submit", "smoke.toml", "--slurm", "--dry-run", "--out", "array"],
        &["man", "pages"],
    ] {
        json(folder.path(), &[arguments, &["--json"]].concat());
    }
    assert!(folder.path().join("made/here/run3.parquet").is_file());
    expect(folder.path(), 0, &["check", "smoke.toml", "--runs", "10", "--scene", "drawn/start.svg"]);
    assert!(folder.path().join("drawn/start.svg").is_file());
    let (_, errors) = expect(folder.path(), 2, &["devices", "--threads", "0"]);
    assert!(errors.contains("--threads"), "{errors}");
}

#[test]
fn no_escape_sequence_of_a_user_reaches_the_terminal() {
    let folder = tempfile::tempdir().expect("a folder");
    expect(folder.path(), 0, &["init", "first"]);
    let file = folder.path().join("smoke.toml");
    let campaign = fs::read_to_string(&file).expect("the campaign");
    let title = campaign.replace("title = \"Smoke test", "title = \"\\u001b]0;owned\\u0007\\u001b[2J\\u009b31m");
    fs::write(&file, &title).expect("a campaign");
    fs::write(folder.path().join("a\u{1b}[31mb.toml"), "schema = \"campaign/2\"\nid = \"\u{1b}[2J\"\n")
        .expect("a file");
    let cases: [&[&str]; 7] = [
        &["check", "smoke.toml", "--runs", "10"],
        &["check", "smoke.toml", "--runs", "10", "--json"],
        &["run", "smoke.toml", "--runs", "20", "--backend", "cpu", "--out", "r\u{1b}[5m"],
        &["status", "r\u{1b}[5m"],
        &["check", "a\u{1b}[31mb.toml"],
        &["check", "smoke.toml", "--set", "\u{1b}[31mruns=3"],
        &["\u{1b}[31mrun"],
    ];
    for arguments in cases {
        let output = softdock(folder.path(), arguments);
        for printed in [text(&output.stdout), text(&output.stderr)] {
            let is_control = |c: char| c.is_control() && !matches!(c, '\n' | '\t');
            assert!(!printed.contains(is_control), "{arguments:?}: {printed:?}");
        }
    }
}

#[test]
fn verdicts_have_colours_where_they_are_asked_for() {
    let folder = tempfile::tempdir().expect("a folder");
    expect(folder.path(), 0, &["init", "first"]);
    expect(folder.path(), 0, &["run", "smoke.toml", "--backend", "cpu", "--out", "r"]);
    let with = |name: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_softdock"));
        command.current_dir(folder.path()).args(["status", "r"]).env_remove("NO_COLOR").env_remove("CLICOLOR_FORCE");
        text(&command.env(name, "1").output().expect("softdock starts").stdout)
    };
    let (plain, forced) = (with("UNUSED"), with("CLICOLOR_FORCE"));
    assert!(!plain.contains('\u{1b}') && !with("NO_COLOR").contains('\u{1b}'), "no terminal");
    assert!(forced.contains("\u{1b}[1m\u{1b}[32mVERIFIED\u{1b}[0m"), "{forced:?}");
}
