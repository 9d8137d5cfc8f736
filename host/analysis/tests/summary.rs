//! The summary against counts made by hand: invalid runs, incomplete campaigns, outer draws, parity.

mod synthetic;

use softdock_analysis::exact::{allowed_failures, clopper_pearson, upper_bound};
use softdock_analysis::{CampaignFacts, InvalidRuns, RunningSummary, Summary, Verdict, summarise_folder, verdict_text};
use softdock_campaign::requirement::{AgreementRequirement, Rate, Requirement, Subject};
use softdock_results::runs::{Agreement, Outcome, RunRow, Status};
use softdock_results::shards::{shard_path, write_shard};
use synthetic::{facts, plan, provenance, requirements, row, schema, write_campaign, write_shards};

const RUNS: u64 = 4_000;

/// A folder that grows, that is damaged, and whose runs change: each time the summary is that of a whole reading.
#[test]
fn running_summary_is_that_of_the_whole_folder() {
    let results = tempfile::tempdir().unwrap();
    let requirements = requirements();
    let facts = facts(&requirements, RUNS);
    let mut running = RunningSummary::default();
    let mut check = |what: &str, runs: u64| {
        let summary = running.renew(results.path(), &facts).unwrap();
        assert_eq!(summary.completeness.runs_done, runs, "{what}");
        assert!(summary == summarise_folder(results.path(), &facts).unwrap(), "{what}");
    };
    check("an empty folder", 0);
    write_shards(results.path(), RUNS, [0, 3].into_iter());
    check("two shards", 1000);
    write_shards(results.path(), RUNS, [1].into_iter());
    check("one more", 1500);
    check("nothing new", 1500);
    std::fs::write(shard_path(results.path(), 3), "damaged").unwrap();
    check("a damaged shard", 1000);
    let mut rows: Vec<RunRow> = plan(RUNS).range(3).map(row).collect();
    rows[0].status = Status::Invalid;
    write_shard(results.path(), 3, &schema(), rows, &provenance()).unwrap();
    check("other runs in its place", 1500);
    std::fs::remove_file(shard_path(results.path(), 0)).unwrap();
    check("a shard less", 1000);
    write_shards(results.path(), RUNS, 0..plan(RUNS).shards());
    check("all of them", RUNS);
}

fn whole(runs: u64) -> (tempfile::TempDir, Vec<Requirement>) {
    let results = tempfile::tempdir().unwrap();
    write_shards(results.path(), runs, 0..plan(runs).shards());
    (results, requirements())
}

#[test]
fn counts_are_those_of_the_rows_and_invalid_runs_are_failures() {
    let (results, requirements) = whole(RUNS);
    let summary = summarise_folder(results.path(), &facts(&requirements, RUNS)).unwrap();
    let rows: Vec<RunRow> = (0..RUNS).map(row).collect();
    let count = |which: &dyn Fn(&&RunRow) -> bool| rows.iter().filter(which).count() as u64;
    let invalid = count(&|row| row.status == Status::Invalid);
    assert!(invalid >= 3);
    assert_eq!(summary.accounting.invalid, invalid);
    assert_eq!(summary.accounting.runs(), RUNS);
    for (at, requirement) in summary.requirements.iter().enumerate() {
        let space = count(&|row| row.space.requirements[at].pass != Some(true));
        let facility = count(&|row| row.hil.requirements[at].pass != Some(true));
        let loops = &requirement.loops;
        assert_eq!((loops.space.failures, loops.space.runs, loops.space.invalid), (space, RUNS, invalid));
        assert_eq!(loops.facility.failures, facility);
        assert_eq!(loops.space.allowed, allowed_failures(RUNS, requirement.probability, 0.9));
        assert_eq!(loops.space.failure_rate_bound, Some(upper_bound(space, RUNS, 0.9)));
        assert_eq!(loops.space.verdict == Verdict::Verified, loops.space.failures <= loops.space.allowed.unwrap());
    }
    let both = count(&|row| row.space.requirements.iter().all(|outcome| outcome.pass == Some(true)));
    assert_eq!((summary.joint.space.count, summary.joint.space.cases), (both, RUNS));
    let false_pass = count(&|row| row.agreement == Agreement::FalsePass);
    let true_fail = count(&|row| row.agreement == Agreement::TrueFail);
    assert!(false_pass > 0 && true_fail > 0);
    let rate = &summary.agreement.false_pass_rate;
    let failing = false_pass + true_fail + count(&|row| row.agreement == Agreement::AbortedFail);
    assert_eq!((rate.count, rate.cases), (false_pass, failing));
    assert_eq!(rate.interval, clopper_pearson(false_pass, failing, 0.95));
    let aborted = count(&|row| row.hil.outcome == Outcome::Aborted);
    assert!(aborted > 0);
    assert_eq!((summary.agreement.abort_rate.count, summary.agreement.abort_rate.cases), (aborted, RUNS - invalid));
    for (side, causes) in [(0, &summary.causes.space), (1, &summary.causes.facility)] {
        let outcome = |row: &RunRow| [row.space.outcome, row.hil.outcome][side];
        let not_passed = count(&|row| outcome(row) != Outcome::Pass);
        assert_eq!(
            causes.iter().map(|cause| cause.runs).sum::<u64>(),
            not_passed,
            "every loop that did not pass has a cause"
        );
        assert!(causes.windows(2).all(|pair| pair[0].runs >= pair[1].runs), "most frequent first");
    }
    let stopped = summary.causes.facility.iter().find(|cause| cause.cause == "injected_energy").expect("a rule");
    assert_eq!((stopped.outcome.as_str(), stopped.runs, stopped.examples.len()), ("aborted", aborted, 10));
    assert!(stopped.values.expect("values")[0] > stopped.limit.expect("a limit"));
    for (at, requirement) in summary.requirements.iter().enumerate() {
        let own = &requirement.loops.facility;
        assert_eq!(own.causes.iter().map(|cause| cause.runs).sum::<u64>(), own.failures, "every failure has a cause");
        let alone =
            count(&|row| row.space.requirements[at].pass == Some(false) && row.hil.requirements[at].pass == Some(true));
        assert_eq!(requirement.agreement.as_ref().unwrap().false_pass.count, alone);
    }
    assert_eq!(summary.agreement.invalid.count, invalid);
    let non_finite = summary.accounting.flags.iter().find(|flag| flag.flag == "space_non_finite").unwrap();
    assert_eq!((non_finite.runs, non_finite.invalid_runs, non_finite.invalidates), (invalid, invalid, true));
}

#[test]
fn the_worst_run_and_the_tolerance_limit_are_order_statistics() {
    let (results, requirements) = whole(RUNS);
    let summary = summarise_folder(results.path(), &facts(&requirements, RUNS)).unwrap();
    let margins = |at: usize| -> Vec<(f64, u64)> {
        let keyed =
            (0..RUNS).map(row).map(|row| (row.space.requirements[at].margin.unwrap_or(f64::NEG_INFINITY), row.run));
        let mut margins: Vec<_> = keyed.collect();
        margins.sort_by(|one, two| one.0.total_cmp(&two.0));
        margins
    };
    let sorted = margins(0);
    let space = &summary.requirements[0].loops.space;
    let finite = sorted.iter().find(|(margin, _)| margin.is_finite()).unwrap();
    assert_eq!(space.worst.map(|worst| (worst.margin, worst.run)), Some(*finite));
    let limit = space.tolerance_limit.unwrap();
    assert_eq!((limit.margin, limit.run), sorted[space.allowed.unwrap() as usize]);
    assert_eq!(limit.margin >= 0.0, space.verdict == Verdict::Verified);
}

#[test]
fn report_only_excludes_invalid_runs_from_the_verdict_not_from_the_report() {
    let (results, requirements) = whole(RUNS);
    let mut facts = facts(&requirements, RUNS);
    let strict = summarise_folder(results.path(), &facts).unwrap();
    facts.invalid = InvalidRuns::ReportOnly;
    let lenient = summarise_folder(results.path(), &facts).unwrap();
    let invalid = strict.accounting.invalid;
    let [strict_space, lenient_space] = [&strict, &lenient].map(|summary| &summary.requirements[0].loops.space);
    assert_eq!(lenient_space.runs, strict_space.runs - invalid);
    assert_eq!(lenient_space.failures, strict_space.failures - invalid);
    assert_eq!(lenient.accounting, strict.accounting);
    assert!(verdict_text(&lenient).contains("invalid (report-only)"));
}

#[test]
fn incomplete_campaign_may_fail_early_and_never_pass_early() {
    let (results, mut requirements) = (tempfile::tempdir().unwrap(), requirements());
    let empty = summarise_folder(results.path(), &facts(&requirements, RUNS)).unwrap();
    assert_eq!((empty.exit_code, empty.verdict), (3, Verdict::Undecided));
    write_shards(results.path(), RUNS, 0..7);
    requirements[0].limits.at_most = Some(1.0e9);
    requirements[0].probability = 0.5;
    let summary = summarise_folder(results.path(), &facts(&requirements, RUNS)).unwrap();
    assert_eq!((summary.exit_code, summary.completeness.shards_missing.clone()), (3, vec![7]));
    assert_eq!(summary.requirements[0].loops.space.verdict, Verdict::Undecided);
    requirements[0].probability = 0.999_9;
    requirements[1].probability = 0.999;
    let summary = summarise_folder(results.path(), &facts(&requirements, RUNS)).unwrap();
    assert_eq!(summary.requirements[0].loops.space.allowed, None);
    assert_eq!(summary.requirements[1].loops.space.verdict, Verdict::NotVerified);
    assert_eq!((summary.exit_code, summary.verdict), (3, Verdict::NotVerified));
}

#[test]
fn a_requirement_is_judged_on_its_subject() {
    let (results, mut requirements) = whole(RUNS);
    requirements.truncate(1);
    requirements[0].probability = 0.01;
    let on_space = summarise_folder(results.path(), &facts(&requirements, RUNS)).unwrap();
    assert_eq!((on_space.exit_code, on_space.verdict), (0, Verdict::Verified));
    assert!(on_space.requirements[0].agreement.is_some());
    // Between the rates of the two loops: verified in space, not on the facility.
    let [space, facility] = [&on_space.requirements[0].loops.space, &on_space.requirements[0].loops.facility]
        .map(|judged| judged.failure_rate_bound.unwrap());
    assert!(space + 0.005 < facility, "{space} {facility}");
    requirements[0].probability = 1.0 - 0.5 * (space + facility);
    let on_space = summarise_folder(results.path(), &facts(&requirements, RUNS)).unwrap();
    assert_eq!((on_space.exit_code, on_space.requirements[0].verdict), (0, Verdict::Verified));
    requirements[0].subject = Subject::Facility;
    let on_facility = summarise_folder(results.path(), &facts(&requirements, RUNS)).unwrap();
    assert_eq!((on_facility.exit_code, on_facility.requirements[0].verdict), (1, Verdict::NotVerified));
    assert_eq!(on_facility.requirements[0].agreement, None, "a demand on the test itself is no question to the test");
    let text = verdict_text(&on_facility).split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(text.contains("DCK-010 facility NOT VERIFIED"), "{text}");
}

#[test]
fn the_agreement_is_judged_by_an_exact_bound_of_its_rates() {
    let (results, requirements) = whole(RUNS);
    let all = summarise_folder(results.path(), &facts(&requirements, RUNS)).unwrap().agreement;
    let rates =
        [(Rate::FalsePass, all.false_pass_rate), (Rate::FalseFail, all.false_fail_rate), (Rate::Abort, all.abort_rate)];
    let invalid = all.invalid.count;
    assert!(invalid > 0);
    for (rate, share) in rates {
        let judged = |policy: InvalidRuns, at_most: f64| {
            let (id, text) = ("AGR-1".to_owned(), "t".to_owned());
            let own = [AgreementRequirement { id, text, rate, at_most, confidence: 0.9 }];
            let facts =
                CampaignFacts { requirements: &[], agreement: &own, invalid: policy, ..facts(&requirements, RUNS) };
            summarise_folder(results.path(), &facts).unwrap()
        };
        for (policy, added) in [(InvalidRuns::CountAsFailures, invalid), (InvalidRuns::ReportOnly, 0)] {
            let (count, cases) = (share.count + added, share.cases + added);
            let bound = upper_bound(count, cases, 0.9);
            let accepted = judged(policy, bound + 1e-6);
            let own = &accepted.agreement_requirements[0];
            assert_eq!((own.share.count, own.share.cases, own.bound), (count, cases, Some(bound)), "{rate:?}");
            assert_eq!((accepted.exit_code, accepted.verdict), (0, Verdict::Verified), "{rate:?}");
            assert!(own.allowed >= Some(count));
            let refused = judged(policy, bound - 1e-6);
            assert_eq!((refused.exit_code, refused.verdict), (1, Verdict::NotVerified), "{rate:?}");
            assert!(verdict_text(&refused).contains("AGR-1  agreement  NOT VERIFIED"), "{}", verdict_text(&refused));
        }
    }
}

#[test]
fn a_rate_without_cases_is_not_verified() {
    let results = tempfile::tempdir().unwrap();
    let requirements = requirements();
    // No run fails in space: nothing is shown of the rate of false passes.
    let docked = |run: u64| RunRow { run, agreement: Agreement::TruePass, ..row(1) };
    write_shard(results.path(), 0, &schema(), (0..500).map(docked).collect(), &provenance()).unwrap();
    let (id, text) = ("AGR-1".to_owned(), "t".to_owned());
    let own = [AgreementRequirement { id, text, rate: Rate::FalsePass, at_most: 0.5, confidence: 0.9 }];
    let facts = CampaignFacts { requirements: &[], agreement: &own, ..facts(&requirements, 500) };
    let summary = summarise_folder(results.path(), &facts).unwrap();
    let rate = &summary.agreement_requirements[0];
    assert_eq!((rate.share.cases, rate.bound, rate.allowed), (0, Some(1.0), None));
    assert_eq!((summary.exit_code, summary.verdict), (1, Verdict::NotVerified));
}

#[test]
fn without_a_requirement_there_is_no_verdict() {
    let (results, requirements) = whole(RUNS);
    let facts = CampaignFacts { requirements: &[], ..facts(&requirements, RUNS) };
    let summary = summarise_folder(results.path(), &facts).unwrap();
    assert_eq!((summary.exit_code, summary.verdict), (1, Verdict::Undecided));
    assert!(verdict_text(&summary).contains("no verdict: the campaign has no requirement"));
}

#[test]
fn the_exit_code_is_the_verdict_of_all_requirements() {
    let (results, mut requirements) = whole(RUNS);
    requirements.iter_mut().for_each(|requirement| requirement.probability = 0.01);
    let summary = summarise_folder(results.path(), &facts(&requirements, RUNS)).unwrap();
    assert_eq!((summary.exit_code, summary.verdict), (0, Verdict::Verified));
    requirements[1].probability = 0.999;
    let summary = summarise_folder(results.path(), &facts(&requirements, RUNS)).unwrap();
    assert_eq!((summary.exit_code, summary.verdict), (1, Verdict::NotVerified));
    let mut exploring = facts(&requirements, RUNS);
    exploring.independent_runs = false;
    let summary = summarise_folder(results.path(), &exploring).unwrap();
    assert_eq!((summary.exit_code, summary.verdict), (1, Verdict::Undecided));
    let text = verdict_text(&summary);
    assert!(text.contains("exploring only, no verdict: the runs are not independent"), "{text}");
    assert!(!text.contains("p <= ") && !text.contains("allowed"), "no binomial claim: {text}");
    let space = &summary.requirements[0].loops.space;
    assert_eq!(
        (space.allowed, space.failure_rate_bound, space.wilson, space.tolerance_limit),
        (None, None, None, None)
    );
    exploring.requirements = &[];
    let summary = summarise_folder(results.path(), &exploring).unwrap();
    assert_eq!((summary.exit_code, summary.verdict), (1, Verdict::Undecided), "nor without requirements");
}

#[test]
fn a_campaign_of_invalid_runs_alone_is_not_verified() {
    let (results, requirements) = (tempfile::tempdir().unwrap(), requirements());
    let invalid = |run: u64| RunRow { run, ..row(996) };
    write_shard(results.path(), 0, &schema(), (0..500).map(invalid).collect(), &provenance()).unwrap();
    let summary = summarise_folder(results.path(), &facts(&requirements, 500)).unwrap();
    assert_eq!((summary.exit_code, summary.verdict), (1, Verdict::NotVerified));
    assert_eq!(summary.requirements[0].loops.facility.failures, 500);
    assert_eq!(summary.requirements[0].loops.space.worst, None);
}

#[test]
fn every_outer_draw_must_be_verified() {
    let (results, mut requirements) = (tempfile::tempdir().unwrap(), requirements());
    requirements.truncate(1);
    let outer = |run: u64| RunRow { outer: (run / 250) as u32, ..row(run) };
    for shard in 0..2 {
        let rows = plan(1_000).range(shard).map(outer);
        let bad = |mut row: RunRow| {
            row.space.requirements[0].pass = Some(row.outer != 2 || row.run.is_multiple_of(2));
            row
        };
        write_shard(results.path(), shard, &schema(), rows.map(bad).collect(), &provenance()).unwrap();
    }
    let summary = summarise_folder(results.path(), &facts(&requirements, 1_000)).unwrap();
    let space = &summary.requirements[0].loops.space;
    let outer = space.outer.as_ref().unwrap();
    assert_eq!((outer.draws, outer.verified, outer.worst_draw), (4, 3, 2));
    assert_eq!((outer.worst_runs, space.verdict), (250, Verdict::NotVerified));
    assert_eq!(space.tolerance_limit, None);
}

#[test]
fn a_damaged_shard_is_missing_and_named() {
    let (results, requirements) = whole(1_000);
    std::fs::write(shard_path(results.path(), 1), b"damaged").unwrap();
    let summary = summarise_folder(results.path(), &facts(&requirements, 1_000)).unwrap();
    let done = &summary.completeness;
    assert_eq!((summary.exit_code, done.runs_done, done.shards_missing.clone()), (3, 500, vec![1]));
    assert_eq!(done.ignored.len(), 1);
    assert_eq!(done.ignored[0].file, "runs/shard=00001.parquet");
    assert!(verdict_text(&summary).contains("ignored  runs/shard=00001.parquet"), "{}", verdict_text(&summary));
}

#[test]
fn parity_measures_differences_and_flips() {
    let (results, requirements) = (tempfile::tempdir().unwrap(), requirements());
    write_campaign(results.path(), RUNS);
    let summary = summarise_folder(results.path(), &facts(&requirements, RUNS)).unwrap();
    let parity = summary.parity.as_ref().unwrap();
    assert_eq!((parity.runs, parity.flipped.count, parity.diverged), (100, 2, 1));
    assert_eq!((parity.flips[0].run, parity.flips[0].column.as_str()), (280, "hil_pass_dck_010"));
    assert_eq!(parity.flips[0].within_three_rms, Some(false));
    let fates: Vec<(u64, bool)> = parity.flips.iter().map(|flip| (flip.run, flip.diverged)).collect();
    assert_eq!(fates, [(280, false), (287, true)]);
    let force = parity.metrics.iter().find(|metric| metric.column == "space_peak_contact_force_n").unwrap();
    assert!(force.rms_difference > 0.0 && force.max_difference <= 0.01 && force.unit == "N");
    let halved = summary.half_step.as_ref().unwrap();
    assert_eq!((halved.runs, halved.flipped.count), (50, 0));
    let force = halved.metrics.iter().find(|metric| metric.column == "space_peak_contact_force_n").unwrap();
    assert!((force.rms_difference - 0.3).abs() < 1e-9 && (force.max_difference - 0.3).abs() < 1e-9);
    let text = verdict_text(&summary);
    assert!(text.contains("  1 of them: the facility's loop diverged in one of the two alone"), "{text}");
    assert!(text.contains("step size  50 runs repeated at half the substep: 0 with another verdict"), "{text}");
    let json = serde_json::to_value(&summary).unwrap();
    for key in ["schema", "campaign_hash", "seed", "verdict", "exit_code", "completeness", "requirements", "agreement"]
    {
        assert!(!json[key].is_null(), "{key}");
    }
    assert_eq!(json["requirements"][0]["loops"]["space"]["allowed"], 375);
    let back: Summary = serde_json::from_value(json).unwrap();
    assert_eq!(back, summary);
}

#[test]
fn terminal_text_is_aligned_and_every_share_has_an_interval() {
    let (results, requirements) = (tempfile::tempdir().unwrap(), requirements());
    write_campaign(results.path(), RUNS);
    let text = verdict_text(&summarise_folder(results.path(), &facts(&requirements, RUNS)).unwrap());
    println!("{text}");
    assert!(text.lines().all(|line| line.len() <= 140), "{text}");
    for line in text.lines().filter(|line| line.contains('%')) {
        assert!(line.contains("confidence") || line.contains("p <= "), "{line}");
    }
}
