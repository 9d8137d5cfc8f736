//! CI size of the gauntlet: no false name, and detectable effects are named.

use softdock_analysis::PageOrigin;
use softdock_bench::outcome::AnswerGrade;
use softdock_bench::page::page;
use softdock_bench::plan::{Extent, MachineKind, WantedCases, plan};
use softdock_bench::record::{Ledger, done, scales};
use softdock_bench::score::{score, scored};
use softdock_bench::seal::Asks;
use softdock_bench::summary_text::text;
use softdock_bench::trial::TrialRunner;
use softdock_test_size::is_full;
use std::collections::BTreeSet;

/// Cases that are allowed to be ambiguous: a delay and a lag are hardly separable in these motions with a clock known
/// to 0.2 ms.
const UNNAMED: [&str; 1] = ["drive.effect.C1_transport_delay.x4.0"];

#[test]
fn ci_plan_has_no_false_name_and_names_detectable_effects() {
    let folder = tempfile::tempdir().expect("a folder");
    let ledger = Ledger::open(folder.path(), 1, 1).expect("writable");
    let mut cases =
        plan(&WantedCases { extent: Extent::Ci, machine: MachineKind::Exact, plants: Vec::new(), draws: None })
            .expect("the drive");
    if !is_full() {
        let subjects = ["drive.null", "drive.effect.J3_stribeck", "drive.outside.quadratic_drag"];
        cases.retain(|case| case.draw == 0 && subjects.contains(&case.subject().as_str()));
        assert_eq!(cases.len(), subjects.len(), "{subjects:?}");
    }
    let mut runner = TrialRunner::new(&ledger).expect("an empty ledger");
    for case in &cases {
        runner.run(case).unwrap_or_else(|error| panic!("{}: {error}", case.id()));
    }
    assert_eq!(done(folder.path()).expect("records").len(), cases.len());
    let all = scored(folder.path()).expect("sealed truths");
    let score = score(&all);
    let summary = text(&score);
    assert!(
        all.iter().all(|case| !matches!(case.outcome, None | Some(AnswerGrade::Wrong | AnswerGrade::Refused))),
        "{summary}"
    );
    let named = |asks: Asks| all.iter().filter(move |case| case.truth.asks == asks);
    assert!(named(Asks::Null).all(|case| case.outcome == Some(AnswerGrade::Right)), "{summary}");
    assert!(named(Asks::Outside).all(|case| case.outcome == Some(AnswerGrade::Right)), "{summary}");
    let unnamed = named(Asks::Effect).filter(|case| case.outcome != Some(AnswerGrade::Right));
    let unnamed: Vec<&str> = unnamed.map(|case| case.truth.case.as_str()).collect();
    assert!(unnamed.iter().all(|case| UNNAMED.contains(case)), "{unnamed:?}\n{summary}");
    let limits = scales(folder.path()).expect("whole lines");
    let of: BTreeSet<(&str, u64)> = limits.iter().map(|line| (line.effect.as_str(), line.seed)).collect();
    assert!(!limits.is_empty() && of.len() == limits.len(), "each detection limit is computed once");
    let page = page(&score, &PageOrigin::default()).expect("a page");
    assert!(
        page.contains("drive, 4 s*") && page.contains("<svg") && !page.replace("http-equiv", "").contains("http"),
        "a page that opens offline"
    );
}

#[test]
fn case_without_a_seal_is_not_scored() {
    let folder = tempfile::tempdir().expect("a folder");
    let line = "{\"case\": \"drive.null.0\", \"sealed\": \"00\", \"answer\": null, \"gain\": null, \"baselines\": [], \
                \"cost\": {\"diagnosis\": 1.0, \"rest\": 1.0}}\n";
    std::fs::write(folder.path().join("answers-1-1.jsonl"), line).expect("writable");
    let message = scored(folder.path()).expect_err("no seal").to_string();
    assert!(message.contains("drive.null.0 was not sealed"), "{message}");
}
