//! Campaigns as array jobs of a Slurm cluster on loopback: failed node, lost shards, two writers.

use crate::cli::{Bench, files, text};
use softdock_test_size::sized;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant, SystemTime};

/// A cluster that ends with the test.
struct Cluster {
    folder: PathBuf,
}

impl Cluster {
    fn start(folder: PathBuf) -> Self {
        let cluster = Self { folder };
        cluster.script(&["start"]);
        cluster
    }

    fn script(&self, words: &[&str]) {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/slurm/cluster.sh");
        let mut command = Command::new("bash");
        command.arg(script).arg(words[0]).arg(&self.folder).args(&words[1..]);
        // The daemons keep inherited handles, so this process must not wait for them.
        let status = command.stdin(std::process::Stdio::null()).status().expect("bash starts");
        assert!(status.success(), "cluster.sh {words:?}");
    }

    fn command(&self, mut command: Command) -> String {
        let output = command.env("SLURM_CONF", self.folder.join("slurm.conf")).output().expect("it starts");
        let printed = format!("{}{}", text(&output.stdout), text(&output.stderr));
        assert!(output.status.success(), "{command:?}\n{printed}\n{}", self.logs());
        printed
    }

    fn slurm(&self, program: &str, words: &[&str]) -> String {
        let mut command = Command::new(program);
        command.args(words);
        self.command(command)
    }

    /// Waits until no job is in the queue.
    fn until_idle(&self, bench: &Bench, results: &str) {
        let begin = Instant::now();
        while !self.slurm("squeue", &["--noheader"]).trim().is_empty() {
            if begin.elapsed() > Duration::from_secs(240) {
                let logs = files(&bench.path(results).join("slurm"));
                let logs: Vec<_> = logs.iter().map(|(name, bytes)| (name, text(bytes))).collect();
                panic!("{}\n{logs:?}\n{}", self.slurm("squeue", &[]), self.logs());
            }
            std::thread::sleep(Duration::from_millis(200));
        }
    }

    fn logs(&self) -> String {
        let log = |name: &str| fs::read_to_string(self.folder.join(name)).unwrap_or_default();
        let tail = |text: String| text.lines().rev().take(30).map(str::to_owned).collect::<Vec<_>>();
        format!("{:?}", ["slurmctld.log", "slurmd.node1.log", "slurmd.node2.log"].map(|name| tail(log(name))))
    }
}

impl Drop for Cluster {
    fn drop(&mut self) {
        self.script(&["stop"]);
    }
}

/// The files of a results folder, those of its jobs left out.
fn results(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    files(folder).into_iter().filter(|(name, _)| !name.starts_with("slurm")).collect()
}

fn assert_equal(bench: &Bench, one: &str, two: &str) {
    let [one, two] = [one, two].map(|name| results(&bench.path(name)));
    let names = |files: &[(PathBuf, Vec<u8>)]| files.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&one), names(&two));
    for ((name, one), (_, two)) in one.iter().zip(&two) {
        assert!(one == two, "{} differs", name.display());
    }
}

fn shards(bench: &Bench, results: &str) -> Vec<(PathBuf, SystemTime)> {
    let entries = fs::read_dir(bench.path(results).join("runs")).into_iter().flatten().flatten();
    let is_shard = |path: &PathBuf| path.extension().is_some_and(|extension| extension == "parquet");
    let changed = |path: PathBuf| fs::metadata(&path).and_then(|file| file.modified()).ok().map(|at| (path, at));
    let mut shards: Vec<_> = entries.map(|entry| entry.path()).filter(is_shard).filter_map(changed).collect();
    shards.sort();
    shards
}

#[test]
#[ignore = "needs root and Slurm: tests/run.sh installs it"]
fn an_array_job_survives_a_dead_node_and_gives_the_files_of_one_process() {
    let bench = Bench::new();
    // A task lasts long enough that the node dies with one, beside other tests too.
    let runs = sized(12_000, 64_000);
    bench.edit("runs = 64", &format!("runs = {runs}"));
    bench.edit("shard_runs = 8", &format!("shard_runs = {}", runs / 16));
    bench.softdock("run c/smoke.toml --backend cpu --out alone");
    let cluster = Cluster::start(bench.path("cluster"));

    // One of two nodes dies with everything that runs there.
    let printed = cluster.command(bench.command("submit c/smoke.toml --slurm --backend cpu --out shared"));
    assert!(printed.contains("16 tasks make the runs"), "{printed}");
    let begin = Instant::now();
    let wait = |is_there: &dyn Fn() -> bool| {
        while !is_there() {
            assert!(begin.elapsed() < Duration::from_secs(120), "{}", cluster.logs());
            std::thread::sleep(Duration::from_millis(20));
        }
    };
    let running = || {
        let jobs = cluster.slurm("squeue", &["--noheader", "--nodelist=node2", "--states=running", "--format=%A"]);
        jobs.split_whitespace().map(str::to_owned).collect::<Vec<_>>()
    };
    wait(&|| !running().is_empty());
    let first = running();
    wait(&|| shards(&bench, "shared").len() >= 3);
    // A task that has just begun: one of the first could end before the kill.
    wait(&|| running().iter().any(|job| !first.contains(job)));
    cluster.script(&["kill", "2"]);
    let mut status = bench.command("status shared");
    let status = status.env("SLURM_CONF", bench.path("cluster/slurm.conf")).output().expect("it starts");
    let status = text(&status.stderr);
    assert!(status.contains("slurm jobs ") && status.contains("(16 tasks)") && status.contains(" pending"), "{status}");
    let begin = Instant::now();
    while !cluster.slurm("sinfo", &["--noheader", "--Node", "--states=down", "--format=%N"]).contains("node2") {
        assert!(begin.elapsed() < Duration::from_secs(90), "{}", cluster.logs());
        std::thread::sleep(Duration::from_millis(200));
    }
    cluster.script(&["node", "2"]);
    cluster.until_idle(&bench, "shared");
    let log = fs::read_to_string(bench.path("cluster/slurmctld.log")).expect("a log");
    assert!(log.contains("requeue"), "the node has died without work: {log}");
    assert_equal(&bench, "alone", "shared");

    // Two lost shards are made again, and nothing else.
    let before = shards(&bench, "shared");
    for lost in [3, 11] {
        fs::remove_file(&before[lost].0).expect("removed");
    }
    cluster.command(bench.command("submit c/smoke.toml --slurm --backend cpu --out shared"));
    cluster.until_idle(&bench, "shared");
    assert_equal(&bench, "alone", "shared");
    let changed: Vec<usize> = before
        .iter()
        .zip(shards(&bench, "shared"))
        .enumerate()
        .filter(|(_, (one, two))| **one != *two)
        .map(|(k, _)| k)
        .collect();
    assert_eq!(changed, [3, 11]);

    // The same array twice at once: two writers for each shard.
    let printed =
        cluster.command(bench.command("submit c/smoke.toml --slurm --backend cpu --out twice --tasks 4 --dry-run"));
    let scripts: Vec<&str> = printed.lines().collect();
    let arrays = [0, 1].map(|_| cluster.slurm("sbatch", &["--parsable", scripts[0]]).trim().to_owned());
    let after = format!("--dependency=afterany:{}", arrays.join(":"));
    cluster.slurm("sbatch", &["--parsable", &after, scripts[1]]);
    cluster.until_idle(&bench, "twice");
    assert_equal(&bench, "alone", "twice");
}

#[test]
fn scripts_for_slurm_state_the_campaign_and_its_parts() {
    let bench = Bench::new();
    let printed = bench.expect(
        0,
        "submit c/smoke.toml --slurm --out out --dry-run --tasks 4 --backend cpu --sbatch=--time=00:10:00 --runs 640",
    );
    let scripts: Vec<String> = printed.lines().map(|path| fs::read_to_string(path).expect("a script")).collect();
    let place = bench.path("out");
    let worker = format!("worker {} --part array/4 --backend cpu &", place.display());
    for line in ["#SBATCH --array=0-3", "#SBATCH --requeue", "#SBATCH --time=00:10:00", &worker] {
        assert!(scripts[0].contains(line), "{line}\n{}", scripts[0]);
    }
    assert!(scripts[1].contains(&format!("finish {}", place.display())), "{}", scripts[1]);
    // The parts as tasks of an array, by hand; an invalid task is rejected.
    for index in ["0", "1", "2", "3"] {
        let mut command = bench.command("worker out --part array/4 --backend cpu");
        let output = command.env("SLURM_ARRAY_TASK_ID", index).output().expect("it starts");
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    }
    bench.expect(0, "finish out");
    bench.expect(0, "verify out");
    let mut command = bench.command("worker out --part array/4");
    let output = command.env("SLURM_ARRAY_TASK_ID", "4").output().expect("it starts");
    assert_eq!(output.status.code(), Some(2), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("0 to 3"), "{}", text(&output.stderr));
}
