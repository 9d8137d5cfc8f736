//! What the disk does to results: full, forbidden, links and pipes below the folder, killed and living writers.

mod sample;

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, SystemTime};

use sample::{PLAN, fill, origin, provenance, row, schema};
use softdock_results::partial::write_partial;
use softdock_results::shards::{ShardIndex, is_set_aside, shard_path, verify_shard, write_shard};
use softdock_results::traces::{Trace, write_trace_to};
use softdock_results::{ResultsError, TableReader, remove_abandoned, write_file};

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

fn scan(results: &Path) -> ShardIndex {
    ShardIndex::scan(results, PLAN, &origin()).expect("a folder that can be read")
}

/// Names below a folder, sorted.
fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder");
    let mut names: Vec<String> =
        entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// A test of this file in a process of its own, with a folder.
fn child(test: &str, folder: &Path) -> Child {
    Command::new(std::env::current_exe().expect("this program"))
        .args(["--exact", test, "--ignored"])
        .env("SOFTDOCK_TEST_FOLDER", folder)
        .stdout(Stdio::null())
        .spawn()
        .expect("a process")
}

fn folder_of_parent() -> PathBuf {
    PathBuf::from(std::env::var("SOFTDOCK_TEST_FOLDER").expect("the parent sets it"))
}

#[test]
fn a_folder_that_cannot_be_made_is_a_failed_write_and_a_missing_file_is_not() {
    let results = folder();
    let blocked = results.path().join("file");
    fs::write(&blocked, "in the way").expect("written");
    let error = write_file(&blocked.join("runs/summary.json"), b"x").expect_err("a file in the way");
    assert!(error.is_write_failure() && error.to_string().contains("cannot be written"), "{error}");
    assert!(!error.remedy().is_empty());
    let error = write_shard(&blocked, 0, &schema(), vec![row(0)], &provenance()).expect_err("a file in the way");
    assert!(error.is_write_failure(), "{error}");
    let error = TableReader::open(&results.path().join("nothing.parquet")).err().expect("nothing there");
    assert!(!error.is_write_failure() && matches!(error, ResultsError::Input(_)), "{error}");
    let twice = write_shard(results.path(), 1, &schema(), vec![row(3), row(3)], &provenance()).expect_err("twice");
    assert!(!twice.is_write_failure(), "{twice}");
}

/// Child half of the next test: every kind of file beyond the size that this process may write.
#[cfg(unix)]
#[test]
#[ignore = "started by a_full_disk_is_a_failed_write_and_leaves_no_file"]
fn write_beyond_the_limit() {
    let results = folder_of_parent();
    let limit = libc::rlimit { rlim_cur: 512, rlim_max: 512 };
    // SAFETY: plain calls of the C library on values that live here.
    unsafe {
        libc::signal(libc::SIGXFSZ, libc::SIG_IGN);
        assert_eq!(libc::setrlimit(libc::RLIMIT_FSIZE, &limit), 0);
    }
    let rows = || (0..10).map(row).collect::<Vec<_>>();
    let trace = Trace { run: 1, kept_as: "random".to_owned(), time: vec![0.0; 2_000], signals: Vec::new() };
    let answers = [
        write_shard(&results, 0, &schema(), rows(), &provenance()).map(drop),
        write_partial(&results, 0, &schema(), rows(), &provenance()),
        write_trace_to(&results.join("trace.parquet"), &trace, &provenance()),
        write_file(&results.join("summary.json"), &[b'x'; 4096]),
    ];
    for answer in answers {
        let error = answer.expect_err("no space");
        assert!(error.is_write_failure() && error.remedy().contains("free space"), "{error:?}: {}", error.remedy());
    }
}

#[cfg(unix)]
#[test]
fn a_full_disk_is_a_failed_write_and_leaves_no_file() {
    let results = folder();
    fs::write(results.path().join("summary.json"), "the old one").expect("written");
    assert!(child("write_beyond_the_limit", results.path()).wait().expect("its end").success());
    assert_eq!(fs::read_to_string(results.path().join("summary.json")).expect("kept"), "the old one");
    for folder in ["runs", "partial"] {
        assert!(names(&results.path().join(folder)).is_empty(), "{folder}");
    }
}

/// Child half of the next tests: writes one file for ever.
#[test]
#[ignore = "started by the tests of abandoned files"]
fn write_for_ever() {
    let path = folder_of_parent().join("runs/shard=00000.parquet");
    let bytes = vec![b'x'; 4 << 20];
    loop {
        write_file(&path, &bytes).expect("written");
    }
}

/// The temporary files of a folder.
fn temporary(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
    paths.filter(|path| path.extension().is_some_and(|ending| ending == "tmp")).collect()
}

#[test]
fn a_killed_writers_file_is_removed_at_once_and_a_locked_one_never() {
    let results = folder();
    let runs = results.path().join("runs");
    let mut found = 0;
    for round in 0..10 {
        let mut writer = child("write_for_ever", results.path());
        let begin = std::time::Instant::now();
        let mut rounds = 0;
        while rounds < 20 + round || temporary(&runs).is_empty() {
            assert!(begin.elapsed() < Duration::from_secs(20), "the writer has not begun");
            // Clocks prove nothing: the file looks as if it were from 1970.
            for path in temporary(&runs) {
                let _ =
                    File::options().write(true).open(path).and_then(|file| file.set_modified(SystemTime::UNIX_EPOCH));
            }
            // A file that its writer has not locked yet may go: the writer then makes another. It ends if it loses any
            // other file.
            remove_abandoned(results.path()).expect("a folder");
            assert!(writer.try_wait().expect("a process").is_none(), "the writer lost its file");
            rounds += 1;
        }
        writer.kill().expect("killed");
        writer.wait().expect("its end");
        let left = temporary(&runs);
        assert_eq!(remove_abandoned(results.path()).expect("a folder"), left.len());
        assert!(temporary(&runs).is_empty());
        found += left.len();
    }
    assert!(found > 0, "no round was killed while it wrote");
}

#[cfg(unix)]
#[test]
fn links_out_of_the_folder_and_files_of_others_stay_untouched() {
    let (results, outside) = (folder(), folder());
    let runs = results.path().join("runs");
    fs::create_dir(&runs).expect("made");
    let name = "shard=00003.parquet.aB3xY9.tmp";
    let precious = outside.path().join(name);
    fs::write(&precious, "mine").expect("written");
    std::os::unix::fs::symlink(outside.path(), results.path().join("traces")).expect("a linked folder");
    std::os::unix::fs::symlink(&precious, runs.join(name)).expect("a linked file");
    let pipe = runs.join("shard=00004.parquet.aB3xY9.tmp");
    assert!(Command::new("mkfifo").arg(&pipe).status().expect("mkfifo").success());
    fs::write(runs.join("notes.tmp"), "mine").expect("written");
    fs::write(runs.join("shard=00001.parquet"), "mine").expect("written");
    assert_eq!(remove_abandoned(results.path()).expect("a folder"), 0);
    assert_eq!(fs::read_to_string(&precious).expect("untouched"), "mine");
    assert_eq!(names(&runs).len(), 4);
    let abandoned = [runs.join("shard=00005.parquet.Zz01qq.tmp"), results.path().join("summary.json.Zz01qq.tmp")];
    abandoned.iter().for_each(|path| fs::write(path, "half").expect("written"));
    // The folder itself may be named by a link.
    let linked = outside.path().join("results");
    std::os::unix::fs::symlink(results.path(), &linked).expect("a link");
    assert_eq!(remove_abandoned(&linked).expect("a folder"), 2);
    assert_eq!(remove_abandoned(&results.path().join("absent")).expect("nothing"), 0);
}

#[test]
fn a_damaged_shard_is_set_aside_and_a_whole_one_replaced() {
    let results = folder();
    fill(results.path(), &[0, 1, 2]);
    let (path, runs) = (shard_path(results.path(), 1), results.path().join("runs"));
    let whole = fs::read(&path).expect("a shard");
    fill(results.path(), &[1]);
    assert_eq!(names(&runs).len(), 3, "a whole shard is no damage");
    // Damaged, cut, of another shard, and no file at all.
    let mut flipped = whole.clone();
    flipped[whole.len() / 2] ^= 1;
    let other = fs::read(shard_path(results.path(), 0)).expect("a shard");
    for (number, bytes) in [flipped, whole[..whole.len() / 2].to_vec(), other].into_iter().enumerate() {
        fs::write(&path, &bytes).expect("written");
        assert_eq!(scan(results.path()).missing(), [1]);
        fill(results.path(), &[1]);
        assert_eq!(fs::read(&path).expect("a shard"), whole);
        let aside = runs.join(format!("shard=00001.parquet.damaged-{}", number + 1));
        assert_eq!(fs::read(&aside).expect("kept"), bytes);
        let index = scan(results.path());
        assert!(index.is_complete() && index.foreign.is_empty());
        assert_eq!((index.set_aside.len(), index.set_aside.last()), (number + 1, Some(&aside)));
    }
    fs::remove_file(&path).expect("removed");
    fs::create_dir(&path).expect("a folder in its place");
    fill(results.path(), &[1]);
    assert!(runs.join("shard=00001.parquet.damaged-4").is_dir());
    verify_shard(&scan(results.path()).complete[&1]).expect("whole");
}

#[test]
fn only_names_of_set_aside_shards_are_known_as_such() {
    assert!(is_set_aside("shard=00012.parquet.damaged-1") && is_set_aside("shard=100000.parquet.damaged-12"));
    let others = [
        "shard=00012.parquet",
        "shard=00012.parquet.damaged-",
        "shard=x.parquet.damaged-1",
        "notes.damaged-1",
        "",
        "a",
    ];
    assert!(!others.iter().any(|name| is_set_aside(name)));
}

#[cfg(unix)]
#[test]
fn a_pipe_in_the_place_of_a_shard_is_foreign_and_does_not_block() {
    let results = folder();
    fill(results.path(), &[0]);
    let pipe = shard_path(results.path(), 1);
    assert!(Command::new("mkfifo").arg(&pipe).status().expect("mkfifo").success());
    let index = scan(results.path());
    assert!(index.foreign[0].1.contains("is no regular file but a named pipe"), "{:?}", index.foreign);
    fill(results.path(), &[1]);
    assert_eq!(scan(results.path()).set_aside.len(), 1);
}
