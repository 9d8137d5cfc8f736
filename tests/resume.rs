//! Interrupted, extended, restarted, given and repeated work, and comparison of two results.

use crate::cli::{Bench, assert_same, files, text};
use serde_json::Value;
use softdock_results::shards::{Origin, ShardIndex, ShardPlan, shard_path};
use softdock_results::{TableReader, runs::RunRow};
use std::fs;
use std::path::Path;

const RUN: &str = "run c/smoke.toml --backend cpu --out";

/// The smoke campaign without outer loop: its draws do not depend on the number of runs.
fn without_outer_loop() -> Bench {
    let bench = Bench::new();
    bench.edit("class = \"epistemic\"                # fixed but unknown: one value per outer draw\n", "");
    bench.edit("[outer]                            # only with epistemic dispersions\n", "");
    bench.edit("draws = 4                          # 4 x 16 runs\n", "");
    bench
}

/// All runs of a folder that holds every shard of its campaign.
fn rows(results: &Path) -> Vec<RunRow> {
    let manifest = json(&results.join("campaign.json"));
    let first = TableReader::open(&shard_path(results, 0)).expect("a shard");
    let plan = ShardPlan { runs: manifest["runs"].as_u64().expect("a number"), shard_runs: first.rows() };
    let text = |value: &Value| value.as_str().expect("a word").to_owned();
    let made_by = &manifest["made_by"];
    let origin = Origin {
        campaign_hash: text(&manifest["hash"]),
        seed: manifest["seed"].as_u64().expect("a seed"),
        version: text(&made_by["version"]),
        commit: text(&made_by["commit"]),
    };
    let index = ShardIndex::scan(results, plan, &origin).expect("a folder");
    assert!(index.is_complete() && index.foreign.is_empty(), "{:?}", index.foreign);
    index.read_runs().map(|row| row.expect("a row")).collect()
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(path).expect("a file")).expect("JSON")
}

/// Hash of the rows of a shard, as the file states it.
fn content_hash(bench: &Bench, shard: &str) -> String {
    let reader = TableReader::open(&bench.path(shard)).expect("a shard");
    reader.metadata()["softdock.content_hash"].clone()
}

/// Runs a campaign to its end, whatever its verdict, and returns its messages.
fn made(bench: &Bench, words: &str) -> String {
    let output = bench.softdock(words);
    let printed = text(&output.stderr);
    assert!(matches!(output.status.code(), Some(0 | 1)), "softdock {words}\n{printed}");
    printed
}

/// Runs a command that must be rejected and returns the message without line breaks.
fn refused(bench: &Bench, words: &str) -> String {
    let output = bench.softdock(words);
    let printed = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "softdock {words}\n{}\n{printed}", text(&output.stdout));
    printed.lines().map(|line| line.trim_start_matches(['│', ' ', '×', '╰', '─', '▶'])).collect::<Vec<_>>().join(" ")
}

fn assert_contains(printed: &str, parts: &[&str]) {
    for part in parts {
        assert!(printed.contains(part), "`{part}` in\n{printed}");
    }
}

#[cfg(unix)]
#[test]
fn ctrl_c_keeps_finished_runs_and_the_same_command_continues_to_the_same_files() {
    use std::process::{Command, Stdio};
    use std::time::Duration;
    let bench = Bench::new();
    bench.edit("shard_runs = 8", "shard_runs = 1000000");
    bench.edit("parity = \"25 %\"", "half_step = 0");
    let words = |out: &str| format!("run c/smoke.toml --backend cpu --runs 1200 --out {out}");
    let code = bench.softdock(&words("whole")).status.code();
    let mut command = bench.command(&words("stopped"));
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("softdock starts");
    while !bench.path("stopped/campaign.json").is_file() {
        std::thread::sleep(Duration::from_millis(2));
    }
    std::thread::sleep(Duration::from_millis(100));
    let interrupt = Command::new("sh").args(["-c", &format!("kill -INT {}", child.id())]).status();
    assert!(interrupt.expect("a shell").success());
    let output = child.wait_with_output().expect("its end");
    let printed = text(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{printed}");
    assert_contains(&printed, &["stopped with 0 of 1 shards and ", " runs of others; the same command resumes"]);
    let kept = TableReader::open(&bench.path("stopped/partial/shard=00000.parquet")).expect("kept").rows();
    assert!(kept > 0 && kept < 1200, "{kept} runs");
    assert!(!bench.path("stopped/runs").exists(), "no whole shard");
    let status = bench.softdock("status stopped");
    assert_contains(&text(&status.stderr), &[&format!("{kept} finished runs of unfinished shards are kept")]);
    let output = bench.softdock(&words("stopped"));
    assert_eq!(output.status.code(), code);
    assert_contains(
        &text(&output.stderr),
        &[&format!("0 and {kept} runs of others there"), &format!("of {} runs", 1200 - kept)],
    );
    assert!(!bench.path("stopped/partial").exists(), "the shard is whole");
    assert_same(&bench.path("whole"), &bench.path("stopped"));
}

#[test]
fn more_runs_extend_a_campaign_and_keep_its_runs() {
    let bench = without_outer_loop();
    made(&bench, &format!("{RUN} whole --runs 32"));
    // Two full shards and one of four runs.
    made(&bench, &format!("{RUN} grown --runs 20"));
    let first = fs::read(bench.path("grown/runs/shard=00000.parquet")).expect("a shard");
    let output = bench.softdock(&format!("{RUN} grown --runs 32"));
    let printed = text(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{printed}");
    assert_contains(
        &printed,
        &["extended from 20 to 32 runs", "it is optional stopping", "2 and 4 runs of others there", "of 12 runs"],
    );
    assert_eq!(fs::read(bench.path("grown/runs/shard=00000.parquet")).expect("a shard"), first);
    for shard in 0..4 {
        let of = |folder: &str| content_hash(&bench, &format!("{folder}/runs/shard=0000{shard}.parquet"));
        assert_eq!(of("grown"), of("whole"), "shard {shard}");
    }
    assert!(!bench.path("grown/partial").exists());
    let names = |folder: &str| files(&bench.path(folder)).into_keys().collect::<Vec<_>>();
    assert_eq!(names("grown"), names("whole"), "time histories of the smaller campaign are gone");
    let (mut grown, whole) = (json(&bench.path("grown/summary.json")), json(&bench.path("whole/summary.json")));
    let extension = serde_json::json!([{ "runs_before": 20, "runs_after": 32 }]);
    assert_eq!(json(&bench.path("grown/campaign.json"))["extensions"], extension);
    assert_eq!(grown["extensions"], extension);
    // campaign.json records the extension, and is one of the files behind the hash.
    for key in ["extensions", "results_hash"] {
        grown[key] = whole[key].clone();
    }
    assert_eq!(grown, whole);
    assert_contains(&bench.expect(0, "status grown"), &["32 of 32 runs", "the stated confidence does not hold"]);
    let printed = refused(&bench, &format!("{RUN} grown --runs 20"));
    assert_contains(&printed, &["holds a campaign of 32 runs, and 20 are asked for", "--runs 32 or more"]);
}

#[test]
fn draws_that_depend_on_the_run_count_are_not_extended() {
    let bench = Bench::new();
    made(&bench, &format!("{RUN} outer --runs 16"));
    let printed = refused(&bench, &format!("{RUN} outer --runs 32"));
    assert_contains(&printed, &["4 outer draws share out the runs by their number", "--out DIR", "--fresh"]);
    assert_eq!(json(&bench.path("outer/campaign.json"))["runs"], 16);
    let bench = without_outer_loop();
    bench.edit(
        "[[requirement]]\nid = \"SMOKE-010\"",
        "[sampling]\nmethod = \"lhs\"\n[[requirement]]\nid = \"SMOKE-010\"",
    );
    bench.expect(1, &format!("{RUN} lhs --runs 16"));
    assert_contains(&refused(&bench, &format!("{RUN} lhs --runs 32")), &["Latin hypercube", "the number of runs"]);
}

#[test]
fn campaign_with_variants_is_extended_and_restarted() {
    let bench = without_outer_loop();
    let variants = "[[variant]]\nname = \"none\"\n[[variant]]\nname = \"fast\"\n\
                    set = { \"facility.loop_delay\" = \"9 ms\" }\n[[variant.derived]]\ntarget = \"command_hold\"\nexpr = \"0\"\n\n[traces]";
    bench.edit("[traces]", variants);
    made(&bench, &format!("{RUN} whole --runs 16"));
    made(&bench, &format!("{RUN} grown --runs 12"));
    let printed = made(&bench, &format!("{RUN} grown --runs 16"));
    assert_contains(&printed, &["smoke/fast  extended from 12 to 16 runs", "1 and 4 runs of others there"]);
    let names = |folder: &str| files(&bench.path(folder)).into_keys().collect::<Vec<_>>();
    assert_eq!(names("grown"), names("whole"));
    for variant in ["none", "fast"] {
        let of = |folder: &str| content_hash(&bench, &format!("{folder}/{variant}/runs/shard=00001.parquet"));
        assert_eq!(of("grown"), of("whole"), "{variant}");
    }
    refused(&bench, &format!("{RUN} g --cases whole/none/runs/shard=00000.parquet"));
    fs::write(bench.path("grown/fast/notes.txt"), "mine").expect("written");
    assert_contains(&refused(&bench, &format!("{RUN} grown --runs 16 --fresh")), &["`fast/notes.txt`"]);
    fs::remove_file(bench.path("grown/fast/notes.txt")).expect("removed");
    made(&bench, &format!("{RUN} grown --runs 16 --fresh"));
    assert_same(&bench.path("grown"), &bench.path("whole"));
    // All variants are judged together.
    bench.edit("at_most = \"400 N\"", "at_most = \"60 N\"");
    assert_contains(
        &refused(&bench, "judge grown/fast c/smoke.toml"),
        &["one variant of a comparison", "softdock judge"],
    );
    made(&bench, "judge grown c/smoke.toml");
    made(&bench, &format!("{RUN} anew --runs 16"));
    for variant in ["none", "fast"] {
        assert_eq!(rows(&bench.path("grown").join(variant)), rows(&bench.path("anew").join(variant)), "{variant}");
    }
    let summary = |folder: &str| json(&bench.path(folder).join("fast/summary.json"))["requirements"].clone();
    assert_eq!(summary("grown"), summary("anew"));
    let answer = bench.softdock("judge grown --json");
    let compared: serde_json::Value = serde_json::from_slice(&answer.stdout).expect("JSON and nothing else");
    assert_eq!(compared["variants"].as_array().map(Vec::len), Some(2), "{compared}");
    made(&bench, &format!("{RUN} grown --runs 16"));
}

#[test]
fn changed_campaign_is_rejected_with_its_keys() {
    let bench = Bench::new();
    made(&bench, &format!("{RUN} r --runs 16"));
    bench.edit("at_most = \"400 N\"", "at_most = \"300 N\"");
    let scenario = fs::read_to_string(bench.path("c/scenarios/smoke.toml")).expect("the scenario");
    fs::write(bench.path("c/scenarios/smoke.toml"), format!("# a word\n{scenario}")).expect("written");
    let printed = refused(&bench, &format!("{RUN} r --runs 16 --seed 2"));
    let parts = [
        "seed: 1 -> 2",
        "smoke.toml: requirement[2 SMOKE-020].at_most: \"400 N\" -> \"300 N\"",
        "scenarios/smoke.toml: only comments or layout differ",
        "put the old values back",
        "--fresh",
    ];
    assert_contains(&printed, &parts);
    assert!(!printed.contains(&json(&bench.path("r/campaign.json"))["hash"].to_string()), "no hash in\n{printed}");
}

/// Metadata and rows of every file of runs.
fn judged_runs(folder: &Path) -> Vec<(String, Vec<RunRow>)> {
    vec![(content_hash_of(&folder.join("runs/shard=00000.parquet")), rows(folder))]
}

fn content_hash_of(path: &Path) -> String {
    TableReader::open(path).expect("a shard").metadata()["softdock.content_hash"].clone()
}

#[test]
fn judge_equals_a_run_of_the_changed_campaign() {
    let bench = Bench::new();
    made(&bench, &format!("{RUN} r --runs 32"));
    fs::create_dir_all(bench.path("old")).expect("made");
    let shard = "runs/shard=00001.parquet";
    fs::copy(bench.path("r").join(shard), bench.path("old/shard.parquet")).expect("kept");
    let hash = json(&bench.path("r/campaign.json"))["hash"].clone();
    // A limit, a subject, a custom metric, a criterion of the task, and its description.
    bench.edit("at_most = \"400 N\"", "at_most = \"60 N\"\nat_least = \"1 N\"");
    bench.edit(
        "[[requirement]]\nid = \"SMOKE-010\"",
        "[[metric]]\nname = \"speed_change\"\nunit = \"m/s\"\nexpr = \"impulse / target_mass\"\n\n[[requirement]]\n\
         id = \"SPEED\"\ntext = \"t\"\nsubject = \"facility\"\nmetric = \"speed_change\"\nat_most = \"100 mm/s\"\n\
         probability = \"50 %\"\nconfidence = 0.9\n\n[[requirement]]\nid = \"AGR\"\ntext = \"t\"\n\
         subject = \"agreement\"\nmetric = \"abort_rate\"\nat_most = \"90 %\"\nconfidence = 0.9\n\n\
         [[requirement]]\nid = \"SMOKE-010\"",
    );
    let scenario = bench.path("c/scenarios/smoke.toml");
    let task = fs::read_to_string(&scenario).expect("the scenario");
    assert!(task.contains("max_contact_force = "), "{task}");
    let lines = task
        .lines()
        .map(|line| if line.starts_with("max_contact_force") { "max_contact_force = \"80 N\"" } else { line });
    fs::write(&scenario, lines.collect::<Vec<_>>().join("\n") + "\n").expect("written");
    assert_contains(
        &refused(&bench, &format!("{RUN} r --runs 32")),
        &["no run depends on these", "softdock judge r c/smoke.toml"],
    );
    let output = bench.softdock("judge r c/smoke.toml");
    let (printed, answer) = (text(&output.stderr), text(&output.stdout));
    assert!(matches!(output.status.code(), Some(0 | 1)), "{printed}");
    assert_contains(&printed, &["judged again by a campaign that differs in", "no run was made"]);
    assert_contains(
        &answer,
        &["judged again after the runs were made", "smoke.toml: requirement", "task.max_contact_force"],
    );
    made(&bench, &format!("{RUN} anew --runs 32"));
    assert_eq!(judged_runs(&bench.path("r")), judged_runs(&bench.path("anew")));
    let (mut one, two) = (json(&bench.path("r/summary.json")), json(&bench.path("anew/summary.json")));
    assert_eq!(one["judgements"][0]["hash_before"], hash);
    one["judgements"] = serde_json::json!([]);
    one["results_hash"] = two["results_hash"].clone();
    assert_eq!(one, two);
    assert_same(&bench.path("r/traces"), &bench.path("anew/traces"));
    let page = fs::read_to_string(bench.path("r/report.html")).expect("the page");
    assert!(page.contains("Judged again after the runs were made") && page.contains("task.max_contact_force"));
    // The same command resumes, and the folder stands alone.
    made(&bench, &format!("{RUN} r --runs 32"));
    bench.expect(two["exit_code"].as_i64().expect("a code") as i32, "judge r");
    assert_eq!(judged_runs(&bench.path("r")), judged_runs(&bench.path("anew")));

    // A judgement that was interrupted: one shard is still judged by the old campaign.
    let whole = fs::read_to_string(bench.path("r/campaign.json")).expect("the record");
    let mut manifest = json(&bench.path("r/campaign.json"));
    manifest["judging"] = hash;
    fs::write(bench.path("r/campaign.json"), manifest.to_string()).expect("written");
    fs::copy(bench.path("old/shard.parquet"), bench.path("r").join(shard)).expect("put back");
    for words in ["report r", "status r", &format!("{RUN} r --runs 32"), "judge r"] {
        assert_contains(&refused(&bench, words), &["was interrupted", "softdock judge r CAMPAIGN"]);
    }
    made(&bench, "judge r c/smoke.toml");
    assert_eq!(fs::read_to_string(bench.path("r/campaign.json")).expect("the record"), whole);
    assert_eq!(judged_runs(&bench.path("r")), judged_runs(&bench.path("anew")));
}

#[test]
fn judge_rejects_a_change_of_the_runs() {
    let bench = Bench::new();
    made(&bench, &format!("{RUN} r --runs 16"));
    let before = files(&bench.path("r"));
    bench.edit("at_most = \"400 N\"", "at_most = \"60 N\"");
    let campaign = fs::read_to_string(bench.path("c/smoke.toml")).expect("the campaign");
    let scenario = fs::read_to_string(bench.path("c/scenarios/smoke.toml")).expect("the scenario");
    let cases = [
        ("c/smoke.toml", &campaign, "seed = 1\n", "seed = 2\n", "smoke.toml: seed: 1 -> 2"),
        ("c/scenarios/smoke.toml", &scenario, "max_depth = ", "max_depth = \"9 mm\" # ", "task.max_depth"),
        ("c/scenarios/smoke.toml", &scenario, "time_limit = ", "time_limit = \"14 s\" # ", "timing.time_limit"),
    ];
    for (file, text, old, new, key) in cases {
        assert!(text.contains(old), "{old}");
        fs::write(bench.path(file), text.replacen(old, new, 1)).expect("written");
        assert_contains(&refused(&bench, "judge r c/smoke.toml"), &["what changes the runs themselves", key]);
        assert_eq!(files(&bench.path("r")), before, "{key}");
        fs::write(bench.path(file), text).expect("put back");
    }
}

#[test]
fn fresh_deletes_only_files_of_softdock() {
    let bench = Bench::new();
    made(&bench, &format!("{RUN} r --runs 16"));
    bench.edit("at_most = \"400 N\"", "at_most = \"399 N\"");
    fs::write(bench.path("r/notes.txt"), "mine").expect("written");
    let before = files(&bench.path("r"));
    let printed = refused(&bench, &format!("{RUN} r --runs 16 --fresh"));
    assert_contains(&printed, &["is not written by softdock: `notes.txt`", "nothing was deleted"]);
    assert_eq!(files(&bench.path("r")), before);
    fs::remove_file(bench.path("r/notes.txt")).expect("removed");
    // The campaign that is to run lies in the folder itself.
    let printed = refused(&bench, "run r/campaign/smoke.toml --backend cpu --out r --runs 16 --fresh");
    assert_contains(&printed, &["lies in the folder that --fresh would empty"]);
    let printed = made(&bench, &format!("{RUN} r --runs 16 --fresh"));
    assert_contains(&printed, &["deleted ", "files of `r`, 2 shards among them"]);
    made(&bench, &format!("{RUN} new --runs 16 --fresh"));
    assert_same(&bench.path("r"), &bench.path("new"));
    fs::create_dir(bench.path("other")).expect("made");
    fs::write(bench.path("other/notes.txt"), "mine").expect("written");
    assert_contains(&refused(&bench, &format!("{RUN} other --fresh")), &["is no results folder"]);
    assert!(bench.path("other/notes.txt").is_file());
}

#[test]
fn given_cases_are_run_without_a_verdict() {
    let bench = Bench::new();
    let table = "loop_delay,in_contact_stiffness_n_per_m\n0.004,1e5\n0.02,2e5\n0.03,3e5\n";
    fs::write(bench.path("corners.csv"), table).expect("written");
    let printed = bench.expect(1, &format!("{RUN} g --cases corners.csv"));
    assert_contains(&printed, &["UNDECIDED", "given cases, no verdict", "3 of 3 runs"]);
    assert!(!printed.contains("p <= ") && !printed.contains("exploring"), "{printed}");
    let made = rows(&bench.path("g"));
    let delay = softdock_results::runs::input_fields().iter().position(|field| field.name == "loop_delay");
    assert_eq!(made.iter().map(|row| row.inputs[delay.expect("a field")]).collect::<Vec<_>>(), [0.004, 0.02, 0.03]);
    assert_eq!(fs::read_to_string(bench.path("g/cases.csv")).expect("kept"), table);
    assert!(json(&bench.path("g/campaign.json"))["cases_hash"].is_string());
    let page = fs::read_to_string(bench.path("g/report.html")).expect("the page");
    assert!(page.contains("Given cases, no verdict"));
    // The folder needs nothing but itself, and the same command resumes.
    bench.expect(1, &format!("{RUN} g --cases corners.csv"));
    bench.expect(1, "report g");
    assert!(bench.expect(0, "replay g 2 --out trace.parquet").contains("equal, bit for bit"));
    let cases = [
        ("loop_delay\n0.004\n4\n", vec!["corners.csv:3", "loop_delay", "4 s is out of range", "at most 0.128 s"]),
        ("loop_dely\n0.004\n", vec!["corners.csv:1", "loop_dely", "did you mean `loop_delay`?"]),
        ("loop_delay\nnan\n", vec!["corners.csv:2", "not a finite number", "at most 0.128 s"]),
        ("loop_delay\n", vec!["no rows", "add at least one row"]),
        ("loop_delay\n0.005\n", vec!["cases.csv: the tables of cases differ"]),
    ];
    for (table, parts) in cases {
        fs::write(bench.path("corners.csv"), table).expect("written");
        assert_contains(&refused(&bench, &format!("{RUN} g --cases corners.csv")), &parts);
    }
    refused(&bench, &format!("{RUN} g --cases corners.csv --runs 4"));
    refused(&bench, &format!("{RUN} g --cases nothing.parquet"));
}

#[test]
fn rows_of_a_campaign_are_cases_that_give_the_same_rows() {
    let bench = Bench::new();
    made(&bench, &format!("{RUN} r --runs 16"));
    bench.expect(1, &format!("{RUN} again --cases r/runs/shard=00001.parquet"));
    let (first, again) = (rows(&bench.path("r")), rows(&bench.path("again")));
    assert_eq!(again.len(), 8);
    for (one, two) in first[8..].iter().zip(&again) {
        assert_eq!((one.run, &one.inputs, &one.space, &one.hil), (two.run, &two.inputs, &two.space, &two.hil));
    }
}

#[test]
fn failed_runs_are_repeated_with_their_inputs_and_numbers() {
    let bench = Bench::new();
    bench.edit("at_most = \"400 N\"", "at_most = \"150 N\"");
    made(&bench, &format!("{RUN} r --runs 32"));
    let output = bench.softdock("run --only-failed r --backend cpu");
    let printed = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{printed}");
    assert_contains(&printed, &["of 32 runs are repeated: ", " failed in space, ", " on the facility, 0 invalid"]);
    let (first, again) = (rows(&bench.path("r")), rows(&bench.path("r_failed")));
    assert!(!again.is_empty() && again.len() < first.len(), "{} of {}", again.len(), first.len());
    assert!(again.iter().zip(0..).any(|(row, place)| row.run != place), "numbers with gaps");
    for row in &again {
        let one = &first[row.run as usize];
        assert_eq!((&one.inputs, &one.space, &one.hil, one.status), (&row.inputs, &row.space, &row.hil, row.status));
    }
    assert_contains(&text(&output.stdout), &["given cases, no verdict"]);
    // The same command resumes, and the folder stands alone.
    bench.expect(1, "run --only-failed r --backend cpu");
    let run = again[again.len() - 1].run;
    assert!(bench.expect(0, &format!("replay r_failed {run} --out t.parquet")).contains("equal, bit for bit"));
    bench.expect(1, "status r_failed");
    refused(&bench, "run --only-failed r --out r");
    refused(&bench, "run --only-failed r c/smoke.toml");
    bench.softdock(&format!("{RUN} part --runs 32 --shard 1/2"));
    assert_contains(&refused(&bench, "run --only-failed part"), &["2 of 4 shards", "finish the campaign first"]);
    let printed = bench.expect(0, "compare r r_failed");
    assert_contains(&printed, &[&format!("{} pairs of runs", again.len()), "runs that changed from A to B\n  none"]);
}

#[test]
fn two_results_are_compared_in_pairs_or_as_samples() {
    let bench = Bench::new();
    made(&bench, &format!("{RUN} a --runs 32"));
    bench.edit("at_most = \"400 N\"", "at_most = \"60 N\"");
    made(&bench, &format!("{RUN} b --runs 32"));
    let printed = bench.expect(0, "compare a b");
    let key = "smoke.toml: requirement[2 SMOKE-020].at_most: \"400 N\" -> \"60 N\"";
    assert_contains(
        &printed,
        &["32 pairs of runs with the same number", "SMOKE-020 (other limit)", "McNemar p = ", key],
    );
    let compared: Value = serde_json::from_str(&bench.expect(0, "compare a b --json")).expect("JSON");
    let failures = &compared["requirements"][1]["loops"]["space"];
    let count = |key: &str| failures[key]["count"].as_u64().expect("a count");
    let failed = |folder: &str| {
        json(&bench.path(folder).join("summary.json"))["requirements"][1]["loops"]["space"]["failures"].clone()
    };
    assert_eq!((failed("a"), failed("b")), (count("first").into(), count("second").into()));
    let more = count("second") - count("first");
    assert!(more > 0, "{failures}");
    assert_eq!(failures["pairs"]["second_only"], more);
    assert_eq!(failures["newly_failed"].as_array().expect("runs").len() as u64, more.min(20));
    let difference = failures["difference"].as_f64().expect("a number");
    assert!((difference - more as f64 / 32.0).abs() < 1e-12);
    let end = |key: &str| failures["interval"][key].as_f64().expect("a number");
    assert!(end("lo") < difference && difference < end("hi") && end("lo") > 0.0, "{failures}");
    assert_eq!(compared["pairs_of_other_inputs"], 0);
    assert!(compared["metrics"].as_array().expect("metrics").iter().all(|metric| metric["difference"] == 0.0));
    assert_eq!(compared["changes"][0]["key"], "requirement[2 SMOKE-020].at_most");
    // Another seed: other draws, no pairs.
    made(&bench, &format!("{RUN} c2 --runs 32 --seed 5"));
    let printed = bench.expect(0, "compare b c2");
    assert_contains(&printed, &["two independent samples", "keys that differ\n  none"]);
    assert!(!printed.contains("McNemar"), "{printed}");
    bench.softdock(&format!("{RUN} part --runs 32 --shard 1/2"));
    assert_contains(&bench.expect(3, "compare b part"), &["incomplete", "16 pairs"]);
    refused(&bench, "compare a c");
    // Cases that are numbered from 0 are no draws of another campaign.
    fs::write(bench.path("corners.csv"), "loop_delay\n0.004\n0.02\n").expect("written");
    made(&bench, &format!("{RUN} corners --cases corners.csv"));
    let printed = bench.expect(0, "compare b corners");
    assert_contains(
        &printed,
        &["two independent samples", "no independent sample", "the tables of given cases differ"],
    );
}

#[test]
fn results_of_an_older_format_are_rejected() {
    let bench = Bench::new();
    made(&bench, &format!("{RUN} r --runs 16"));
    let manifest = bench.path("r/campaign.json");
    let older = fs::read_to_string(&manifest).expect("the manifest").replace("results/4", "results/1");
    fs::write(&manifest, older).expect("written");
    let before = files(&bench.path("r"));
    let again = format!("{RUN} r --runs 16");
    for words in [again.clone(), format!("{again} --fresh"), "report r".to_owned(), "replay r 3".to_owned()] {
        let printed = refused(&bench, &words);
        assert_contains(&printed, &["holds results of", "\"results/1\"", "reads \"results/4\""]);
    }
    assert_eq!(files(&bench.path("r")), before);
}
