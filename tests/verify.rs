//! `softdock verify` detects any change in a results folder.

use crate::cli::{Bench, text};
use softdock_test_size::sized;
use std::fs;
use std::path::{Path, PathBuf};

/// All files below a folder, in order.
fn files_below(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() { files.append(&mut files_below(&path)) } else { files.push(path) }
    }
    files.sort();
    files
}

fn whole() -> Bench {
    let bench = Bench::new();
    let output = bench.softdock("run c/smoke.toml --backend cpu --out r");
    assert!(matches!(output.status.code(), Some(0 | 1)), "{}", text(&output.stderr));
    bench
}

#[test]
fn one_changed_bit_anywhere_in_a_results_folder_is_found() {
    let bench = whole();
    let printed = bench.softdock("verify r");
    assert_eq!(printed.status.code(), Some(0), "{}{}", text(&printed.stdout), text(&printed.stderr));
    let size = |file: &PathBuf| fs::metadata(file).expect("a file").len();
    // The folder's lock is empty.
    let files: Vec<PathBuf> = files_below(&bench.path("r")).into_iter().filter(|file| size(file) > 0).collect();
    let sizes: Vec<u64> = files.iter().map(size).collect();
    let all: u64 = sizes.iter().sum();
    let changes: u64 = sized(60, 1000);
    for change in 0..changes {
        // Small files get their share too: every second change is in a file drawn without regard to its size.
        let draw = |what: u32| softdock_kernels::philox::uniform(47, "verify", change, what);
        let (mut at, mut file) = ((draw(0) * all as f64) as u64, 0);
        while change % 2 == 0 && at >= sizes[file] {
            (at, file) = (at - sizes[file], file + 1);
        }
        if change % 2 == 1 {
            file = (draw(1) * files.len() as f64) as usize;
            at = (draw(2) * sizes[file] as f64) as u64;
        }
        let mut bytes = fs::read(&files[file]).expect("a file");
        let bit = (draw(3) * 8.0) as u32;
        bytes[at as usize] ^= 1 << bit;
        fs::write(&files[file], &bytes).expect("written");
        let output = bench.softdock("verify r");
        let name = files[file].display();
        assert!(matches!(output.status.code(), Some(1..=3)), "bit {bit} of byte {at} of {name} is not found");
        let printed = text(&output.stderr);
        assert!(!printed.contains("panicked"), "bit {bit} of byte {at} of {name}: {printed}");
        bytes[at as usize] ^= 1 << bit;
        fs::write(&files[file], &bytes).expect("written");
    }
    assert_eq!(bench.softdock("verify r").status.code(), Some(0), "and nothing else has changed");
}

#[test]
fn damaged_and_stray_shards_are_reported_and_rerun_once() {
    let bench = whole();
    let summary = fs::read(bench.path("r/summary.json")).expect("a summary");
    fs::copy(bench.path("r/runs/shard=00000.parquet"), bench.path("r/runs/shard=00000 (copy).parquet"))
        .expect("copied");
    let shard = bench.path("r/runs/shard=00001.parquet");
    let mut bytes = fs::read(&shard).expect("a shard");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    fs::write(&shard, bytes).expect("written");

    let printed = bench.softdock("status r");
    let words = text(&printed.stdout);
    assert_eq!(printed.status.code(), Some(3), "{words}");
    assert!(words.contains("ignored  runs/shard=00001.parquet: damaged"), "{words}");
    assert!(words.contains("ignored  runs/shard=00000 (copy).parquet"), "{words}");
    let printed = bench.softdock("verify r");
    assert_eq!(printed.status.code(), Some(1), "{}", text(&printed.stdout));

    let printed = bench.softdock("run c/smoke.toml --backend cpu --out r");
    assert!(text(&printed.stderr).contains("1 shards to make"), "{}", text(&printed.stderr));
    // The stray file is still reported and ignored.
    fs::remove_file(bench.path("r/runs/shard=00000 (copy).parquet")).expect("removed");
    assert_eq!(bench.softdock("report r").status.code(), printed.status.code());
    assert!(fs::read(bench.path("r/summary.json")).expect("a summary") == summary, "the same runs, each once");
    assert_eq!(bench.softdock("verify r").status.code(), Some(0));
}

#[test]
fn runs_of_two_builds_are_not_mixed() {
    let bench = whole();
    let manifest = bench.path("r/campaign.json");
    let text_of = fs::read_to_string(&manifest).expect("the manifest");
    let value: serde_json::Value = serde_json::from_str(&text_of).expect("JSON");
    let commit = value["made_by"]["commit"].as_str().expect("a commit").to_owned();
    // The folder states another build, so its shards do not belong to it.
    fs::write(&manifest, text_of.replace(&commit, "000000000000")).expect("written");
    let printed = bench.softdock("run c/smoke.toml --backend cpu --out r");
    assert_eq!(printed.status.code(), Some(2));
    let words = text(&printed.stderr).replace('│', " ").split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains("(commit 000000000000) has made") && words.contains("--fresh"), "{words}");
    let printed = bench.softdock("status r");
    assert_eq!(printed.status.code(), Some(3), "{}", text(&printed.stdout));
    assert!(text(&printed.stdout).contains("commit is `"), "{}", text(&printed.stdout));
}
