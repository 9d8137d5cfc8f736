//! Results in an object store: a local S3 server, two pushes at once, a pull that is judged like the original.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

fn softdock(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_softdock"));
    command.args(arguments).current_dir(folder);
    command.stdin(Stdio::null()).output().expect("the program starts")
}

fn text(output: &Output) -> String {
    format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr))
}

/// `tests/store.sh` starts the server and sets its address and credentials.
#[test]
#[ignore = "needs an S3 server and the feature s3: tests/run.sh --full starts one"]
fn pushed_results_come_back_equal_and_nothing_is_overwritten() {
    let folder = tempfile::tempdir().expect("a folder");
    let campaign = Path::new(env!("CARGO_MANIFEST_DIR")).join("campaigns/smoke.toml");
    let campaign = campaign.to_str().expect("UTF-8");
    let run = |out: &str, more: &[&str]| {
        let made = softdock(folder.path(), &[&["run", campaign, "--backend", "cpu", "--out", out], more].concat());
        // Verified or not: the runs are complete.
        assert!(matches!(made.status.code(), Some(0 | 1)), "{}", text(&made));
    };
    run("first", &[]);
    run("other", &["--seed", "2"]);
    let url = format!("s3://runs/smoke-{}", std::process::id());

    // Two writers at once: each object is written by one of them.
    let pushes: Vec<_> = (0..2)
        .map(|_| {
            let mut command = Command::new(env!("CARGO_BIN_EXE_softdock"));
            command.args(["store", "push", "first", &url]).current_dir(folder.path());
            command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the program starts")
        })
        .collect();
    let done: Vec<Output> = pushes.into_iter().map(|push| push.wait_with_output().expect("it ends")).collect();
    let counts: Vec<(usize, usize)> = done
        .iter()
        .map(|output| {
            assert!(output.status.success(), "{}", text(output));
            let text = text(output);
            let mut numbers = text.split_whitespace().filter_map(|word| word.parse().ok());
            (numbers.next().expect("files written"), numbers.next().expect("files that existed"))
        })
        .collect();
    let files = counts[0].0 + counts[0].1;
    assert_eq!(counts[1].0 + counts[1].1, files);
    assert_eq!(counts[0].0 + counts[1].0, files, "each object was written once: {counts:?}");

    let pulled = softdock(folder.path(), &["store", "pull", &url, "second"]);
    assert!(pulled.status.success(), "{}", text(&pulled));
    let finished = softdock(folder.path(), &["finish", "second"]);
    assert!(finished.status.success(), "{}", text(&finished));
    for name in ["runs/shard=00000.parquet", "runs/shard=00001.parquet", "summary.json"] {
        let [first, second] = ["first", "second"].map(|out| fs::read(folder.path().join(out).join(name)).expect(name));
        assert!(first == second, "{name} differs");
    }

    // Another campaign at the same place changes nothing.
    let refused = softdock(folder.path(), &["store", "push", "other", &url]);
    assert_eq!(refused.status.code(), Some(2), "{}", text(&refused));
    assert!(text(&refused).contains("exists with other bytes"), "{}", text(&refused));
    let again = softdock(folder.path(), &["store", "pull", &url, "second"]);
    assert!(text(&again).starts_with("0 files written"), "{}", text(&again));

    let absent = softdock(folder.path(), &["store", "pull", "s3://runs/absent", "third"]);
    assert_eq!(absent.status.code(), Some(2));
    assert!(text(&absent).contains("holds no results"), "{}", text(&absent));
}
