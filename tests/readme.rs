//! The commands of README.md, of the tutorials and of the how-to pages run in order, in a folder with the shipped files, as a new user runs them.
//!
//! Blocks marked `console` are run. A line `$ COMMAND` is a command for bash, in which `cargo run --release --` is the
//! program; a comment `# exit code N` at its end states its exit code, 0 if there is none. The lines below a command must
//! occur in its output, in this order, with any number of spaces; `...` stands for lines that are not compared.

use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Commands that the test does not run, by their beginnings, and why.
const NOT_RUN: [(&str, &str); 7] = [
    ("git clone", "needs a network"),
    ("cargo build", "the tests have built the program"),
    ("cargo install", "needs a network"),
    ("bash tests/run.sh", "is the check that this test is a part of"),
    ("softdock map", "takes 20 s of two cores; tests/oracles checks the map"),
    ("softdock diagnose campaigns/rigs/kr300.toml", "takes 20 s; a tutorial runs a shorter diagnosis"),
    ("cargo run --release --example", "tests/examples.rs runs the examples"),
];

/// One command of a page, with the lines that its output must have.
#[derive(Debug)]
struct Step {
    line: usize,
    command: String,
    exit_code: i32,
    expected: Vec<String>,
}

fn steps(text: &str) -> Vec<Step> {
    let mut steps: Vec<Step> = Vec::new();
    let mut inside = false;
    for (index, line) in text.lines().enumerate() {
        if line.starts_with("```") {
            inside = !inside && line.starts_with("```console");
        } else if let Some(command) = line.strip_prefix("$ ").filter(|_| inside) {
            let exit_code = command.rsplit_once("# exit code ").and_then(|(_, code)| code.trim().parse().ok());
            let (command, exit_code) = (command.to_owned(), exit_code.unwrap_or(0));
            steps.push(Step { line: index + 1, command, exit_code, expected: Vec::new() });
        } else if let Some(more) = line.strip_prefix("> ").filter(|_| inside) {
            let step = steps.last_mut().expect("a command before its continuation");
            step.command.push('\n');
            step.command.push_str(more);
        } else if inside && !line.trim().is_empty() && line.trim() != "..." && !line.starts_with('#') {
            steps.last_mut().expect("a command before its output").expected.push(squeezed(line));
        }
    }
    steps
}

fn squeezed(line: &str) -> String {
    line.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Returns a folder with the files of a clone that a new user needs: campaigns and recordings.
fn clone() -> tempfile::TempDir {
    let (root, folder) = (Path::new(env!("CARGO_MANIFEST_DIR")), tempfile::tempdir().expect("a folder"));
    copy(&root.join("campaigns"), &folder.path().join("campaigns"));
    symlink(root.join("tests"), folder.path().join("tests")).expect("a link");
    folder
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("a folder");
    for entry in fs::read_dir(from).expect("a folder").flatten() {
        let target = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy(&entry.path(), &target);
        } else {
            fs::copy(entry.path(), target).expect("a copy");
        }
    }
}

/// Runs the commands of a page in order.
fn run_page(page: &Path) {
    let text = fs::read_to_string(page).expect("a page");
    let folder = clone();
    let program = Path::new(env!("CARGO_BIN_EXE_softdock")).parent().expect("a folder");
    let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap_or_default());
    let steps = steps(&text);
    assert!(!steps.is_empty(), "{} has no command", page.display());
    for step in &steps {
        if NOT_RUN.iter().any(|(begin, _)| step.command.starts_with(begin)) {
            continue;
        }
        let place = format!("{}:{}: {}", page.display(), step.line, step.command);
        // In f64 on the CPU, whatever the machine has: single precision may change a count.
        let command = step.command.replace("cargo run --release -- ", "softdock ");
        let command = command.replace("softdock run ", "softdock run --backend cpu ");
        let mut bash = Command::new("bash");
        bash.args(["-c", &command]).current_dir(folder.path()).env("PATH", &path).stdin(Stdio::null());
        let output = bash.output().expect("bash starts");
        let printed = String::from_utf8_lossy(&output.stdout);
        let errors = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(step.exit_code), "{place}\n{printed}\n{errors}");
        let lines: Vec<String> = printed.lines().chain(errors.lines()).map(squeezed).collect();
        let mut rest = lines.iter();
        for expected in &step.expected {
            assert!(
                rest.any(|line| line == expected),
                "{place}\nhas no line `{expected}`, or not there:\n{printed}\n{errors}"
            );
        }
    }
}

#[test]
fn commands_of_the_readme_run_in_order() {
    run_page(&Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md"));
}

/// The pages of a folder of docs.
fn pages(folder: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs").join(folder);
    let mut pages: Vec<PathBuf> = fs::read_dir(folder).expect("a folder of docs").flatten().map(|e| e.path()).collect();
    pages.retain(|page| page.extension().is_some_and(|extension| extension == "md"));
    pages.sort();
    assert!(pages.len() >= 5, "{pages:?}");
    pages
}

#[test]
fn commands_of_the_tutorials_run_in_order() {
    pages("tutorials").iter().for_each(|page| run_page(page));
}

#[test]
fn commands_of_the_how_to_pages_run_in_order() {
    let runs = |page: &PathBuf| fs::read_to_string(page).expect("a page").contains("```console");
    pages("how-to").iter().filter(|page| runs(page)).for_each(|page| run_page(page));
}
