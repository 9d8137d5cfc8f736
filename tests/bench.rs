//! `softdock bench diagnosis` as a process: scores of finished cases, and rejections.

use softdock_bench::plan::{Extent, MachineKind, WantedCases, plan};
use softdock_bench::record::{CaseRecord, Cost, Ledger, RecordedAnswer, RecordedVerdict, SealLine};
use softdock_bench::seal::{SealedTruth, seal};
use softdock_bench::sizing::Hiding;
use std::path::Path;
use std::process::{Command, Output, Stdio};

fn softdock(folder: &Path, words: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_softdock"));
    command.current_dir(folder).args(["bench", "diagnosis"]).args(words.split(' ')).stdin(Stdio::null());
    command.output().expect("softdock starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Writes a results folder in which the first case, a null, has the right answer.
fn begun(folder: &Path) {
    let wanted = WantedCases { extent: Extent::Ci, machine: MachineKind::Exact, plants: Vec::new(), draws: None };
    let case = plan(&wanted).expect("the drive")[0];
    let sealed = seal(folder, &SealedTruth::of(&case, &Hiding::default(), None)).expect("writable");
    let ledger = Ledger::open(folder, 1, 1).expect("writable");
    ledger.seal(&SealLine { case: case.id(), sealed: sealed.clone() }).expect("writable");
    let answer = RecordedAnswer {
        verdict: RecordedVerdict::NoEffect,
        effects: Vec::new(),
        possible: Vec::new(),
        blocks: Vec::new(),
        partner_missing: false,
        experiment: None,
        gain: None,
        gain_elsewhere: None,
        refusal: None,
    };
    let cost = Cost { diagnosis: 4.0, rest: 2.0 };
    let record = CaseRecord { answer: Some(answer), cost, ..CaseRecord::of(case.id(), sealed) };
    ledger.finish(&record).expect("writable");
}

#[test]
fn finished_cases_are_scored_and_missing_ones_reported() {
    let folder = tempfile::tempdir().expect("a folder");
    begun(&folder.path().join("score"));
    let output = softdock(folder.path(), "--out score --score");
    let (printed, beside) = (text(&output.stdout), text(&output.stderr));
    assert_eq!(output.status.code(), Some(3), "{beside}");
    assert!(
        printed.starts_with("Cases diagnosed: 1")
            && printed.contains("false alarms where nothing is hidden: at most 1 %: 0 of 1"),
        "{printed}"
    );
    assert!(beside.contains("cases are missing; the same command resumes"), "{beside}");
    let page = std::fs::read_to_string(folder.path().join("score/score.html")).expect("a page");
    assert!(
        page.contains("criteria are met") && !page.replace("http-equiv", "").contains("http"),
        "the page opens offline"
    );
}

#[test]
fn only_selected_missing_cases_are_run() {
    let folder = tempfile::tempdir().expect("a folder");
    begun(&folder.path().join("score"));
    let output = softdock(folder.path(), "--out score --only drive.null.0");
    let (printed, beside) = (text(&output.stdout), text(&output.stderr));
    assert_eq!(output.status.code(), Some(3), "{beside}");
    assert!(printed.starts_with("Cases diagnosed: 1") && !beside.contains("s left"), "{beside}");
}

#[test]
fn changed_truth_and_unknown_names_are_rejected() {
    let folder = tempfile::tempdir().expect("a folder");
    begun(&folder.path().join("score"));
    let sealed = folder.path().join("score/sealed/drive.null.0.json");
    let truth = std::fs::read_to_string(&sealed).expect("a truth");
    std::fs::write(&sealed, truth.replace("null", "pair")).expect("writable");
    for (words, expected) in [
        ("--out score --score", "not the truth that was sealed"),
        ("--plants wheel", "no plant `wheel`; there are drive, robot, sensor, contact"),
        ("--out score --only wheel", "no case of this size and these plants has `wheel` in its name"),
        ("--out score --only effect --multiples 3", "has `effect` in its name and such a multiple"),
        ("--out nowhere --score", "nowhere"),
    ] {
        let output = softdock(folder.path(), words);
        assert_eq!(output.status.code(), Some(2), "{words}: {}", text(&output.stderr));
        // The message is broken into lines as wide as the terminal.
        let beside = text(&output.stderr).replace(['\n', '│'], " ").split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(beside.contains(expected), "{words}: {beside}");
    }
}

#[test]
fn lay_out_writes_a_case_and_rejects_an_unknown_one() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = softdock(folder.path(), "--lay-out drive.null.0 --out case");
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("softdock diagnose case/model.toml"), "{}", text(&output.stdout));
    let is_there = |path: &str| folder.path().join("case").join(path).exists();
    assert!(["model.toml", "training", "holdout", "sealed/drive.null.0.json"].iter().all(|path| is_there(path)));
    let output = softdock(folder.path(), "--lay-out drive.nothing --out case");
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("drive.null.0"), "{}", text(&output.stderr));
}
