//! A folder with the shipped campaigns, and the program run in it.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// The repository.
pub(crate) fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// A temporary folder with copies of `campaigns` (as `c`) and `tests/data/bad` (as `b`).
pub(crate) struct Workshop {
    folder: tempfile::TempDir,
}

/// How a command ended.
pub(crate) struct Ended {
    /// Exit code; `None` if a signal ended it, or if it took too long.
    pub(crate) code: Option<i32>,
    /// Its messages on stderr, without line breaks and frames.
    pub(crate) printed: String,
    /// Its answer.
    pub(crate) answer: String,
}

impl Workshop {
    pub(crate) fn new() -> Self {
        let workshop = Self { folder: tempfile::tempdir().expect("a temporary folder") };
        copy(&root().join("campaigns"), &workshop.path("c"));
        copy(&root().join("tests/data/bad"), &workshop.path("b"));
        workshop
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Replaces a part of a file.
    pub(crate) fn edit(&self, file: &str, old: &str, new: &str) {
        let text = fs::read_to_string(self.path(file)).expect("a text");
        assert!(text.contains(old), "`{old}` in {file}");
        fs::write(self.path(file), text.replacen(old, new, 1)).expect("written");
    }

    /// Starts a command whose output is kept in files, so that no pipe fills.
    pub(crate) fn start(&self, words: &str) -> Child {
        let file = |name: &str| fs::File::create(self.path(name)).expect("a file");
        Command::new(env!("CARGO_BIN_EXE_softdock"))
            .current_dir(self.folder.path())
            .args(words.split(' '))
            .stdin(Stdio::null())
            .stdout(file("answer.txt"))
            .stderr(file("said.txt"))
            .spawn()
            .expect("softdock starts")
    }

    /// Runs a command, for at most `limit`.
    pub(crate) fn run(&self, words: &str, limit: Duration) -> Ended {
        let (mut child, begin) = (self.start(words), Instant::now());
        let code = loop {
            match child.try_wait().expect("a process") {
                Some(status) => break status.code(),
                None if begin.elapsed() > limit => {
                    child.kill().expect("killed");
                    child.wait().expect("its end");
                    break None;
                }
                None => std::thread::sleep(Duration::from_millis(2)),
            }
        };
        let text = |name: &str| String::from_utf8_lossy(&fs::read(self.path(name)).expect("its output")).into_owned();
        let printed = text("said.txt");
        let lines = printed.lines().map(|line| line.trim_start_matches(['│', ' ', '×', '╰', '─', '▶']));
        Ended { code, printed: lines.collect::<Vec<_>>().join(" "), answer: text("answer.txt") }
    }

    /// Runs a command that must end with one of these codes.
    pub(crate) fn ended(&self, codes: &[i32], words: &str) -> Ended {
        let ended = self.run(words, Duration::from_secs(120));
        let is_expected = ended.code.is_some_and(|code| codes.contains(&code));
        assert!(is_expected, "softdock {words}: {:?}\n{}\n{}", ended.code, ended.answer, ended.printed);
        ended
    }

    /// Runs a command that must reject its input with these parts of a message, quickly, and make nothing.
    pub(crate) fn rejected(&self, words: &str, parts: &[&str]) {
        let before = names(self.folder.path());
        let begin = Instant::now();
        let ended = self.run(words, crate::watchdog::LIMIT);
        assert_eq!(ended.code, Some(2), "softdock {words} after {:?}\n{}", begin.elapsed(), shortened(&ended.printed));
        for part in parts {
            assert!(ended.printed.contains(part), "softdock {words}: `{part}` in\n{}", shortened(&ended.printed));
        }
        assert!(ended.printed.len() < 400_000, "softdock {words}: {} bytes of message", ended.printed.len());
        assert_eq!(names(self.folder.path()), before, "softdock {words} made something");
    }
}

fn shortened(text: &str) -> String {
    text.chars().take(3_000).collect()
}

/// Every name below a folder but those of the outputs; links are not followed.
pub(crate) fn names(folder: &Path) -> Vec<PathBuf> {
    let (mut open, mut names) = (vec![folder.to_owned()], Vec::new());
    while let Some(next) = open.pop() {
        for entry in fs::read_dir(next).expect("a folder") {
            let entry = entry.expect("an entry");
            if entry.file_type().expect("a kind").is_dir() {
                open.push(entry.path());
            }
            names.push(entry.path());
        }
    }
    names.retain(|path| !["answer.txt", "said.txt"].iter().any(|name| path.ends_with(name)));
    names.sort();
    names
}

/// Every file of a results folder with its bytes.
pub(crate) fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let paths = names(folder).into_iter().filter(|path| path.is_file());
    let named = |path: PathBuf| (path.strip_prefix(folder).expect("below it").to_owned(), path);
    paths.map(named).map(|(name, path)| (name, fs::read(path).expect("a file"))).collect()
}

/// Asserts that two folders hold the same files with the same bytes.
pub(crate) fn assert_same(one: &Path, two: &Path, context: &str) {
    let (one, two) = (files(one), files(two));
    assert_eq!(one.keys().collect::<Vec<_>>(), two.keys().collect::<Vec<_>>(), "{context}");
    let different: Vec<_> = one.iter().filter(|(name, bytes)| two[*name] != **bytes).map(|(name, _)| name).collect();
    assert!(different.is_empty(), "{context}: {different:?}");
}

/// Copies a folder with all that is below it.
pub(crate) fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("a folder");
    for entry in fs::read_dir(from).expect("a folder") {
        let path = entry.expect("an entry").path();
        let place = to.join(path.file_name().expect("a name"));
        if path.is_dir() {
            copy(&path, &place);
        } else {
            fs::copy(&path, place).expect("copied");
        }
    }
}
