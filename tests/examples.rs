//! The examples run as documented in their first lines.

use std::path::Path;
use std::process::Command;

/// Output of an example, which `cargo test` has built beside the tests.
fn output(name: &str, words: &[&Path]) -> String {
    let tests = std::env::current_exe().expect("the path of the tests");
    let program = tests.parent().expect("deps").with_file_name("examples").join(name);
    assert!(program.is_file(), "{}: build it with `cargo build --release --examples`", program.display());
    let mut command = Command::new(program);
    let output = command.current_dir(env!("CARGO_MANIFEST_DIR")).args(words).output().expect("it starts");
    let text = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{name}: {text}");
    text
}

#[test]
fn examples_run_as_documented() {
    let (folder, campaign) = (tempfile::tempdir().expect("a folder"), Path::new("campaigns/smoke.toml"));
    let results = folder.path().join("smoke");
    let text = output("run_campaign", &[campaign, &results]);
    assert!(text.contains("VERIFIED") && text.contains("Verified"), "{text}");
    let text = output("read_results", &[&results]);
    assert!(text.contains("2 of 2 shards") && text.contains("64 runs, at most "), "{text}");
    let text = output("observe_progress", &[campaign, &folder.path().join("observed")]);
    assert!(text.contains(r#"{"event":"verdict","exit_code":0}"#) && text.contains(r#""percent":100"#), "{text}");
    let text = output("resume_and_merge", &[campaign, &folder.path().join("parts")]);
    assert!(text.contains("the same command resumes"), "{text}");
    assert!(text.contains("resumed and merged results are equal: true"), "{text}");
}
