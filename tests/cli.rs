//! `softdock` as a process: exit codes, equal bytes, resume, parts, replay, JSON.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

/// Temporary folder with the smoke campaign, in shards of eight runs.
pub(crate) struct Bench {
    pub(crate) folder: tempfile::TempDir,
}

impl Bench {
    pub(crate) fn new() -> Self {
        let bench = Self { folder: tempfile::tempdir().expect("a temporary folder") };
        let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("campaigns");
        fs::create_dir_all(bench.path("c/scenarios")).expect("a folder");
        fs::copy(shipped.join("scenarios/smoke.toml"), bench.path("c/scenarios/smoke.toml")).expect("the scenario");
        let text = fs::read_to_string(shipped.join("smoke.toml")).expect("the smoke campaign");
        assert!(text.contains("shard_runs = 32"));
        fs::write(bench.path("c/smoke.toml"), text.replace("shard_runs = 32", "shard_runs = 8")).expect("a campaign");
        bench
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Rewrites a part of the campaign file.
    pub(crate) fn edit(&self, old: &str, new: &str) {
        let text = fs::read_to_string(self.path("c/smoke.toml")).expect("the campaign");
        assert!(text.contains(old), "`{old}`");
        fs::write(self.path("c/smoke.toml"), text.replace(old, new)).expect("the campaign");
    }

    pub(crate) fn command(&self, words: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_softdock"));
        command.current_dir(self.folder.path()).args(words.split(' ')).stdin(Stdio::null());
        command
    }

    /// Runs a command to its end.
    pub(crate) fn softdock(&self, words: &str) -> Output {
        self.command(words).output().expect("softdock starts")
    }

    /// Runs a command that must end with this exit code and returns its output.
    pub(crate) fn expect(&self, code: i32, words: &str) -> String {
        let output = self.softdock(words);
        let printed = text(&output.stdout);
        assert_eq!(output.status.code(), Some(code), "softdock {words}\n{printed}\n{}", text(&output.stderr));
        printed
    }

    /// Runs in the background; waits until the first shard is written.
    pub(crate) fn until_first_shard(&self, words: &str, results: &str) -> Child {
        let child = self.command(words).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("softdock starts");
        let begin = Instant::now();
        while !self.path(results).join("runs/shard=00000.parquet").is_file() {
            assert!(begin.elapsed() < Duration::from_secs(120), "no shard after two minutes");
            std::thread::sleep(Duration::from_millis(2));
        }
        child
    }
}

pub(crate) fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Returns every file of a results folder with its bytes; temporary files of a killed writer are excluded.
pub(crate) fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut all = BTreeMap::new();
    let mut open = vec![folder.to_owned()];
    while let Some(next) = open.pop() {
        for entry in fs::read_dir(next).expect("a folder") {
            let path = entry.expect("an entry").path();
            match path.extension() {
                _ if path.is_dir() => open.push(path),
                Some(extension) if extension == "tmp" => {}
                _ => {
                    let bytes = fs::read(&path).expect("a file");
                    all.insert(path.strip_prefix(folder).expect("below it").to_owned(), bytes);
                }
            }
        }
    }
    all
}

/// Asserts that two folders hold the same files with the same bytes.
pub(crate) fn assert_same(one: &Path, two: &Path) {
    let (one, two) = (files(one), files(two));
    assert_eq!(one.keys().collect::<Vec<_>>(), two.keys().collect::<Vec<_>>());
    let different: Vec<_> = one.iter().filter(|(name, bytes)| two[*name] != **bytes).map(|(name, _)| name).collect();
    assert!(different.is_empty(), "{different:?}");
}

#[test]
fn exit_code_states_the_outcome() {
    let bench = Bench::new();
    bench.expect(0, "run c/smoke.toml --backend cpu --out verified");
    bench.expect(0, "status verified");
    bench.expect(3, "run c/smoke.toml --backend cpu --out part --shard 2/3");
    bench.expect(3, "status part");
    bench.expect(2, "run c/smoke.toml --backend cpu --out verified --seed 2");
    bench.expect(2, "run c/smoke.toml --backend cpu --runs 2");
    bench.expect(2, "replay verified 64");
    bench.expect(2, "status c");
    bench.expect(2, "run");
    bench.edit("at_most = \"400 N\"", "at_most = \"1 N\"");
    bench.expect(1, "run c/smoke.toml --backend cpu --out failed --runs 16");
    bench.expect(2, "run c/smoke.toml --backend cpu --out verified");
}

#[test]
fn bad_file_is_located_and_no_output_is_written() {
    let bench = Bench::new();
    bench.edit("runs = 64", "runs = 0");
    let before = files(bench.folder.path());
    let output = bench.softdock("run c/smoke.toml --backend cpu");
    assert_eq!(output.status.code(), Some(2));
    let printed = text(&output.stderr);
    for part in ["smoke.toml:8", "runs", "out of range", "help"] {
        assert!(printed.contains(part), "`{part}` in\n{printed}");
    }
    assert_eq!(files(bench.folder.path()), before);
}

/// A driver list that does not exist: the Vulkan loader finds no adapter.
fn without_adapter(command: &mut Command) -> Output {
    let none = "/nonexistent/icd.json";
    command.env("VK_ICD_FILENAMES", none).env("VK_DRIVER_FILES", none).output().expect("softdock starts")
}

#[test]
fn without_adapter_gpu_is_rejected_and_auto_uses_the_cpu() {
    let bench = Bench::new();
    let output = without_adapter(&mut bench.command("run c/smoke.toml --backend gpu --out none"));
    let printed = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{printed}");
    for part in ["no GPU adapter found", "`--backend cpu`", "install a Vulkan driver", "softdock devices"] {
        assert!(printed.split_whitespace().collect::<Vec<_>>().join(" ").contains(part), "`{part}` in\n{printed}");
    }
    assert!(!bench.path("none").exists(), "nothing is written");
    let output = without_adapter(&mut bench.command("run c/smoke.toml --backend auto --out auto"));
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("made on cpu f64"), "{}", text(&output.stdout));
}

#[test]
fn step_size_is_checked_on_a_share_of_the_runs() {
    let bench = Bench::new();
    bench.edit("parity = \"25 %\"", "half_step = \"12.5 %\"");
    let printed = bench.expect(0, "run c/smoke.toml --backend cpu --out r");
    assert!(printed.contains("step size  8 runs repeated at half the substep: "), "{printed}");
    assert!(bench.path("r/half_step.parquet").is_file());
    let summary = fs::read_to_string(bench.path("r/summary.json")).expect("the summary");
    let summary: serde_json::Value = serde_json::from_str(&summary).expect("JSON");
    let metrics = summary["half_step"]["metrics"].as_array().expect("metrics");
    let force = metrics.iter().find(|metric| metric["column"] == "space_peak_contact_force_n").expect("the force");
    let rms = force["rms_difference"].as_f64().expect("a number");
    // Forces of 100 N; halving a step of second order moves them by far less, but not by nothing.
    assert!(rms > 0.0 && rms < 20.0, "{rms}");
    let page = fs::read_to_string(bench.path("r/report.html")).expect("the page");
    assert!(page.contains("8 runs were repeated at half the substep"));
    assert!(!page.contains("Test motion"), "there is none in this campaign");
    bench.edit("half_step = \"12.5 %\"", "half_step = \"0 %\"");
    let printed = bench.expect(0, "run c/smoke.toml --backend cpu --out none");
    assert!(!printed.contains("step size") && !bench.path("none/half_step.parquet").exists(), "{printed}");
}

#[test]
fn exploratory_samples_give_no_verdict() {
    let bench = Bench::new();
    for (method, most) in [("sobol", "65537"), ("lhs", "1000000001")] {
        bench.edit(
            "[[requirement]]\nid = \"SMOKE-010\"",
            &format!("[sampling]\nmethod = \"{method}\"\n[[requirement]]\nid = \"SMOKE-010\""),
        );
        assert!(bench.expect(0, "check c/smoke.toml").contains("exploring only, no verdict"));
        let printed = bench.expect(1, &format!("run c/smoke.toml --backend cpu --out {method} --runs 16"));
        assert!(printed.contains("exploring only, no verdict") && !printed.contains("p <= "), "{printed}");
        assert!(!printed.contains(" VERIFIED"), "{printed}");
        bench.expect(1, &format!("status {method}"));
        bench.expect(2, &format!("run c/smoke.toml --backend cpu --out {method} --runs {most}"));
        bench.edit(&format!("[sampling]\nmethod = \"{method}\"\n"), "");
    }
}

#[test]
fn the_same_campaign_gives_the_same_bytes() {
    let bench = Bench::new();
    bench.expect(0, "run c/smoke.toml --backend cpu --out one");
    let mut alone = bench.command("run c/smoke.toml --backend cpu --out two");
    assert!(alone.env("RAYON_NUM_THREADS", "1").output().expect("softdock starts").status.success());
    assert_same(&bench.path("one"), &bench.path("two"));
    // Again, over the existing results.
    bench.expect(0, "run c/smoke.toml --backend cpu --out two");
    bench.expect(0, "report two");
    assert_same(&bench.path("one"), &bench.path("two"));
}

#[test]
fn killed_campaign_resumes_to_identical_files() {
    let bench = Bench::new();
    let words = "run c/smoke.toml --backend cpu --runs 256 --out";
    let code = bench.softdock(&format!("{words} whole")).status.code();
    let mut child = bench.until_first_shard(&format!("{words} killed"), "killed");
    child.kill().expect("kill -9");
    child.wait().expect("its end");
    assert!(files(&bench.path("killed/runs")).len() < 32, "killed too late to prove anything");
    // A damaged shard is made again too.
    fs::write(bench.path("killed/runs/shard=00000.parquet"), "PAR1 not quite").expect("damage");
    bench.expect(3, "status killed");
    assert_eq!(bench.softdock(&format!("{words} killed")).status.code(), code);
    // The damaged file is kept, counts for nothing, and is known to be no shard.
    let aside = bench.path("killed/runs/shard=00000.parquet.damaged-1");
    assert_eq!(fs::read(&aside).expect("kept"), b"PAR1 not quite");
    assert!(bench.expect(0, "verify killed").contains("shard=00000.parquet.damaged-1: a damaged or foreign file"));
    fs::remove_file(aside).expect("removed");
    assert_same(&bench.path("whole"), &bench.path("killed"));
}

#[cfg(unix)]
#[test]
fn ctrl_c_ends_with_finished_shards() {
    let bench = Bench::new();
    let child = bench.until_first_shard("run c/smoke.toml --backend cpu --runs 256 --out stopped", "stopped");
    let interrupt = Command::new("sh").args(["-c", &format!("kill -INT {}", child.id())]).status();
    assert!(interrupt.expect("a shell").success());
    let output = child.wait_with_output().expect("its end");
    assert_eq!(output.status.code(), Some(3), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("the same command resumes"), "{}", text(&output.stderr));
}

#[test]
fn merged_parts_equal_the_whole_campaign() {
    let bench = Bench::new();
    bench.expect(0, "run c/smoke.toml --backend cpu --out whole");
    bench.expect(3, "run c/smoke.toml --backend cpu --out one --shard 1/3");
    bench.expect(3, "run c/smoke.toml --backend cpu --out two --shard 2/3");
    bench.expect(3, "merge merged one two");
    assert!(!bench.path("merged").exists(), "nothing is written while a part is missing");
    bench.expect(3, "run c/smoke.toml --backend cpu --out three --shard 3/3");
    bench.expect(0, "merge merged one two three");
    assert_same(&bench.path("whole"), &bench.path("merged"));
    // Parts that share a folder need no merge.
    for part in ["1/2", "2/2"] {
        bench.softdock(&format!("run c/smoke.toml --backend cpu --out shared --shard {part}"));
    }
    assert_same(&bench.path("whole"), &bench.path("shared"));
    bench.softdock("run c/smoke.toml --backend cpu --out other --seed 9");
    bench.expect(2, "merge mixed one other");
}

#[test]
fn replay_is_bit_identical_to_the_row() {
    let bench = Bench::new();
    bench.expect(0, "run c/smoke.toml --backend cpu --out first");
    // The folder needs nothing but itself.
    fs::remove_dir_all(bench.path("c")).expect("the campaign is gone");
    fs::rename(bench.path("first"), bench.path("moved")).expect("the folder moves");
    for run in [0, 17, 63] {
        let printed = bench.expect(0, &format!("replay moved {run} --out {run}.parquet"));
        assert!(printed.contains("equal, bit for bit"), "{printed}");
        assert!(fs::read(bench.path(&format!("{run}.parquet"))).expect("the trace").starts_with(b"PAR1"));
    }
}

/// Two facilities on the smoke campaign's draws, the second without delay.
const VARIANTS: &str = "[[dispersion]]
variable = \"knowledge\"
dist = { kind = \"uniform\", min = 0.9, max = 1.1 }

[[variant]]
name = \"none\"

[[variant]]
name = \"damped\"
title = \"virtual damping\"
set = { \"facility.compensator\" = { kind = \"virtual_damping\", delay = \"3 ms\", stiffness = \"1e4 N/m\" } }
[[variant.derived]]
target = \"compensator_delay\"
expr = \"loop_delay * knowledge\"

[compare]
along = \"loop_delay\"
edges = [\"3 ms\", \"10 ms\", \"40 ms\"]
metrics = [\"injected_energy\"]

[[compare.map]]
x = \"loop_delay\"
y = \"contact_stiffness\"
cells = [2, 2]

[traces]";

#[test]
fn variants_use_the_same_draws() {
    let bench = Bench::new();
    bench.edit("[traces]", VARIANTS);
    assert!(bench.expect(0, "check c/smoke.toml").contains("damped  virtual damping"));
    bench.expect(3, "run c/smoke.toml --backend cpu --out part1 --shard 1/2");
    bench.expect(3, "run c/smoke.toml --backend cpu --out part2 --shard 2/2");
    let printed = bench.expect(0, "run c/smoke.toml --backend cpu --out whole");
    assert!(printed.contains("2 variants on the same draws") && printed.contains("comparison"), "{printed}");
    bench.expect(0, "merge merged part1 part2");
    assert_same(&bench.path("whole"), &bench.path("merged"));
    bench.expect(0, "report whole");
    assert_same(&bench.path("whole"), &bench.path("merged"));
    let compared = fs::read_to_string(bench.path("whole/compare.json")).expect("the comparison");
    let compared: serde_json::Value = serde_json::from_str(&compared).expect("JSON");
    let [none, damped] = [0, 1].map(|variant| &compared["variants"][variant]);
    assert_eq!(none["space_pass"], damped["space_pass"], "space is the same");
    assert!(none["wrong"]["factor"].is_null() && damped["wrong"]["pairs"].is_object());
    let rows = damped["maps"][0]["cells"].as_array().expect("rows of cells").iter();
    let cells = rows.flat_map(|row| row.as_array().expect("a row of cells"));
    let runs: u64 = cells.filter_map(|cell| cell["wrong"]["cases"].as_u64()).sum();
    assert_eq!(runs, 64, "every run lies in a cell");
    // One variant alone is a campaign as any other, and the same rows.
    bench.expect(0, "run c/smoke.toml --backend cpu --out alone --variant damped");
    let rows = |folder: &str| fs::read(bench.path(folder).join("runs/shard=00000.parquet")).expect("a shard");
    assert_eq!(rows("alone/damped"), rows("whole/damped"));
    assert_ne!(rows("whole/none"), rows("whole/damped"));
    assert!(bench.expect(0, "replay whole/damped 17").contains("equal, bit for bit"));
    bench.expect(2, "replay whole 17");
    bench.expect(2, "run c/smoke.toml --variant dampd");
}

#[test]
fn json_flag_prints_json() {
    let bench = Bench::new();
    let answer = |code: i32, words: &str| -> serde_json::Value {
        serde_json::from_str(&bench.expect(code, words)).unwrap_or_else(|error| panic!("softdock {words}: {error}"))
    };
    assert_eq!(answer(0, "run c/smoke.toml --backend cpu --out r --json")["exit_code"], 0);
    assert_eq!(answer(0, "status r --json")["completeness"]["runs_done"], 64);
    assert_eq!(answer(0, "check c/smoke.toml --json")["requirements"][1]["id"], "SMOKE-020");
    assert_eq!(answer(0, "plan --probability 99% --confidence 0.9 --json")["needed"][0]["runs"], 230);
    for kind in ["campaign", "scenario"] {
        assert!(answer(0, &format!("schema {kind}"))["properties"].is_object());
    }
}

#[test]
fn every_help_page_has_an_example() {
    let bench = Bench::new();
    for command in ["check", "plan", "run", "status", "merge", "compare", "report", "replay", "schema"] {
        let printed = bench.expect(0, &format!("{command} --help"));
        assert!(printed.contains("Example") && printed.contains(&format!("softdock {command} ")), "{printed}");
    }
    let printed = bench.expect(0, "check c/smoke.toml --runs 100");
    assert!(printed.contains("loop_delay") && printed.contains("SMOKE-010"), "{printed}");
    assert!(bench.expect(0, "devices").contains("cpu f64"));
}
