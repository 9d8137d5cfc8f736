//! A results folder of a million runs: what the server answers, and when.

use crate::serve::get;
use serde_json::Value;
use softdock_results::shards::shard_path;
use softdock_results::{TableReader, Values, content_hash, write_table};
use std::io::{BufRead, BufReader};
use std::net::SocketAddr;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

const RUNS: u64 = 1_000_000;
const SHARD_RUNS: u64 = 500;

fn softdock(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_softdock"));
    command.args(arguments).current_dir(env!("CARGO_MANIFEST_DIR"));
    command
}

/// Makes the first shard of a campaign of a million runs.
fn begin(results: &str) {
    let runs = RUNS.to_string();
    let size = format!("execution.shard_runs={SHARD_RUNS}");
    let part = format!("1/{}", RUNS / SHARD_RUNS);
    let mut arguments = vec!["run", "campaigns/smoke.toml", "--runs", &runs, "--out", results, "--backend", "cpu"];
    arguments.extend(["--set", &size, "--set", "execution.parity=\"0 %\"", "--shard", &part]);
    let made = softdock(&arguments).output().expect("softdock");
    // A part of a campaign is incomplete.
    assert_eq!(made.status.code(), Some(3), "{}", String::from_utf8_lossy(&made.stderr));
}

/// Writes shards with the rows of the first one under other run numbers.
fn fill(results: &Path, shards: std::ops::Range<u64>) {
    let reader = TableReader::open(&shard_path(results, 0)).expect("a shard");
    let mut metadata = reader.metadata();
    let mut table = reader.read().expect("rows");
    for shard in shards {
        let first = shard * SHARD_RUNS;
        let number = table.columns.iter_mut().find(|column| column.name == "run").expect("run numbers");
        number.values = Values::U64((first..first + SHARD_RUNS).collect());
        metadata.insert("softdock.shard".to_owned(), shard.to_string());
        metadata.insert("softdock.first_run".to_owned(), first.to_string());
        metadata.insert("softdock.content_hash".to_owned(), content_hash(&table));
        let stated: Vec<(String, String)> = metadata.clone().into_iter().collect();
        write_table(&shard_path(results, shard as u32), &table, &stated).expect("a shard");
    }
}

/// Largest resident memory of a process so far \[MB\].
fn peak_mb(process: &Child) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{}/status", process.id())).unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmHWM")).unwrap_or_default();
    line.split_ascii_whitespace().nth(1).and_then(|kilobytes| kilobytes.parse::<u64>().ok()).unwrap_or(0) / 1024
}

/// The server's address, as it prints it.
fn address(server: &mut Child) -> SocketAddr {
    let output = BufReader::new(server.stdout.take().expect("its output"));
    let mut lines = output.lines().map(|line| line.expect("a line"));
    let line = lines.find(|line| line.starts_with("pages")).expect("the address");
    line.split(' ')
        .find_map(|word| word.strip_prefix("http://"))
        .expect("an address")
        .trim_end_matches('/')
        .parse()
        .expect("an address")
}

/// An answer's body and time.
fn timed(address: SocketAddr, path: &str) -> (String, Duration) {
    let begun = Instant::now();
    let (status, head, body) = get(address, path);
    assert_eq!(status, 200, "{path}: {head}");
    (body, begun.elapsed())
}

/// Asks for the state of the folder until it has been read; every answer comes within a second.
fn live(address: SocketAddr, what: &str) -> Value {
    let begun = Instant::now();
    let mut slowest = Duration::ZERO;
    loop {
        let (body, took) = timed(address, "/api/live/.");
        slowest = slowest.max(took);
        let state: Value = serde_json::from_str(&body).expect("JSON");
        if state["pending"].is_null() {
            println!("{what}: read after {:.1?}, slowest answer {slowest:.3?}", begun.elapsed());
            assert!(slowest < Duration::from_secs(1), "{what}");
            return state["answer"].clone();
        }
        assert!(begun.elapsed() < Duration::from_secs(600), "{what}");
        std::thread::sleep(Duration::from_millis(200));
    }
}

/// Writes a gigabyte and takes minutes. `SOFTDOCK_KEEP_RESULTS` names a folder that keeps the results.
#[test]
#[ignore = "slow: a million runs"]
fn server_answers_within_a_second_with_a_million_runs() {
    let scratch = tempfile::tempdir().expect("a folder");
    let kept = std::env::var_os("SOFTDOCK_KEEP_RESULTS").map(std::path::PathBuf::from);
    let results = kept.unwrap_or_else(|| scratch.path().to_owned()).join("million");
    let shown = results.to_str().expect("a plain path");
    begin(shown);
    let shards = RUNS / SHARD_RUNS;
    fill(&results, 1..shards - 1);

    let mut server =
        softdock(&["serve", shown, "--address", "127.0.0.1:0"]).stdout(Stdio::piped()).spawn().expect("softdock serve");
    let address = address(&mut server);
    let state = live(address, "a growing folder, first look");
    assert_eq!(state["summary"]["completeness"]["runs_done"], RUNS - SHARD_RUNS);
    fill(&results, shards - 1..shards);
    // The answer is renewed in the background; only the new shard is read.
    let begun = Instant::now();
    while live(address, "one more shard")["summary"]["completeness"]["runs_done"] != RUNS {
        assert!(begun.elapsed() < Duration::from_secs(600), "the new shard is not seen");
        std::thread::sleep(Duration::from_secs(1));
    }
    println!("the new shard was seen {:.1?} after it was written", begun.elapsed());

    let begun = Instant::now();
    let mut report = softdock(&["report", shown]).stdout(Stdio::null()).spawn().expect("softdock report");
    let mut peak = 0;
    let ended = loop {
        peak = peak.max(peak_mb(&report));
        match report.try_wait().expect("softdock report") {
            Some(ended) => break ended,
            None => std::thread::sleep(Duration::from_millis(50)),
        }
    };
    assert!(ended.code().is_some_and(|code| code < 2), "{ended}");
    println!("softdock report: {:.1?}, peak memory {peak} MB", begun.elapsed());
    assert!(peak < 1024, "{peak} MB");

    let mut second =
        softdock(&["serve", shown, "--address", "127.0.0.1:0"]).stdout(Stdio::piped()).spawn().expect("softdock serve");
    let fresh = self::address(&mut second);
    let state = live(fresh, "a complete folder, first look");
    assert_eq!(state["summary"]["completeness"]["runs_done"], RUNS);
    for path in ["/", "/api/folders", "/page/./report.html"] {
        let (body, took) = timed(fresh, path);
        println!("{path}: {} bytes in {took:.3?}", body.len());
        assert!(took < Duration::from_secs(1), "{path}");
    }
    println!(
        "peak memory of the servers: {} MB after the growing folder, {} MB after the complete one",
        peak_mb(&server),
        peak_mb(&second)
    );
    for process in [&mut server, &mut second] {
        process.kill().expect("a running server");
        process.wait().expect("its end");
    }
}
