//! Several processes in one results folder: they share the work, or one is rejected; nothing is overwritten.

use crate::cli::{Bench, assert_same, text};
use std::process::{Child, Stdio};

fn start(bench: &Bench, words: &str) -> Child {
    let mut command = bench.command(words);
    command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("softdock starts")
}

#[test]
fn processes_of_one_campaign_share_its_shards_and_give_the_files_of_one_process() {
    let bench = Bench::new();
    bench.softdock("run c/smoke.toml --backend cpu --out alone");
    let both = [0, 1].map(|_| start(&bench, "run c/smoke.toml --backend cpu --out shared"));
    for child in both {
        let output = child.wait_with_output().expect("an end");
        assert!(matches!(output.status.code(), Some(0 | 1)), "{}", text(&output.stderr));
    }
    assert_same(&bench.path("alone"), &bench.path("shared"));
    assert!(!bench.path("shared/locks").exists() && !bench.path("shared/partial").exists());
}

#[test]
fn second_campaign_in_a_new_folder_is_rejected() {
    let bench = Bench::new();
    for round in 0..5 {
        let words = |seed: u64| format!("run c/smoke.toml --backend cpu --seed {seed} --out new{round}");
        let codes = [1, 2].map(|seed| start(&bench, &words(seed))).map(|child| {
            let output = child.wait_with_output().expect("an end");
            (output.status.code().expect("an exit code"), text(&output.stderr))
        });
        let refused: Vec<&String> = codes.iter().filter(|(code, _)| *code == 2).map(|(_, printed)| printed).collect();
        assert_eq!(refused.len(), 1, "{codes:?}");
        assert!(refused[0].contains("seed: "), "{}", refused[0]);
        bench.expect(0, &format!("verify new{round}"));
    }
}

#[test]
fn folder_with_active_writers_is_neither_judged_nor_cleared() {
    let bench = Bench::new();
    bench.edit("runs = 64", "runs = 4000");
    let mut running = bench.until_first_shard("run c/smoke.toml --backend cpu --out out", "out");
    for words in ["judge out", "run c/smoke.toml --backend cpu --out out --fresh"] {
        let output = bench.softdock(words);
        assert_eq!(output.status.code(), Some(2), "{words}");
        assert!(text(&output.stderr).contains("another softdock process works in `out`"), "{}", text(&output.stderr));
    }
    // A killed process releases its locks and blocks no successor.
    running.kill().expect("killed");
    running.wait().expect("ended");
    let output = bench.softdock("run c/smoke.toml --backend cpu --out out --shard 1/500");
    assert_eq!(output.status.code(), Some(3), "{}", text(&output.stderr));
    assert!(!bench.path("out/locks").exists());
}
