//! One process per robot: a lock that the kernel releases when the process ends.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read, Write};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

/// Ownership of a robot, released on drop.
#[derive(Debug)]
pub struct Lock {
    /// The lock; released when the file closes.
    _file: File,
}

/// Error of owning a robot.
#[derive(Debug, thiserror::Error)]
pub enum NotOwner {
    /// Another process owns the robot.
    #[error(
        "{robot} is driven by another process ({owner}): stop that process first ({path} is its lock, released when it ends)"
    )]
    Taken {
        /// Name of the robot.
        robot: String,
        /// Process number and command line of the owner, as stated in the lock file.
        owner: String,
        /// The lock's file.
        path: PathBuf,
    },
    /// The lock file cannot be opened or locked.
    #[error("the lock {path} cannot be taken: {why}")]
    File {
        /// The lock's file.
        path: PathBuf,
        /// Reason.
        why: io::Error,
    },
}

/// Makes this process the only owner of a robot among those that use the same folder.
///
/// The lock is the kernel's (`flock`), not the file's existence: the lock of a killed process is released.
///
/// # Errors
/// If another process owns the robot, or the folder cannot be written.
pub fn single_owner(folder: &Path, robot: &str) -> Result<Lock, NotOwner> {
    let path = folder.join(format!("{}.lock", plain(robot)));
    take(folder, &path).map_err(|why| match why {
        TryLockError::WouldBlock => NotOwner::Taken { robot: robot.to_owned(), owner: owner_in(&path), path },
        TryLockError::Error(why) => NotOwner::File { path, why },
    })
}

fn take(folder: &Path, path: &Path) -> Result<Lock, TryLockError> {
    let open = || -> io::Result<File> {
        fs::create_dir_all(folder)?;
        // Not truncated: the file may hold the owner's name. Not through a link: every user may write the folder, and
        // the target of a link is not ours to write.
        let mut options = OpenOptions::new();
        options.read(true).write(true).create(true).truncate(false).custom_flags(libc::O_NOFOLLOW | libc::O_NONBLOCK);
        let file = options.open(path)?;
        let found = file.metadata()?;
        if !found.is_file() || found.nlink() != 1 {
            return Err(io::Error::other("it is a link or no plain file"));
        }
        Ok(file)
    };
    let mut file = open().map_err(TryLockError::Error)?;
    file.try_lock()?;
    let command: Vec<String> = std::env::args().collect();
    let name = format!("process {}: {}\n", std::process::id(), command.join(" "));
    let written = file.set_len(0).and_then(|()| file.write_all(name.as_bytes()));
    written.map_err(TryLockError::Error)?;
    Ok(Lock { _file: file })
}

/// Reads the owner's own statement.
fn owner_in(path: &Path) -> String {
    let mut text = String::new();
    let read = File::open(path).and_then(|file| file.take(4096).read_to_string(&mut text));
    match (read, text.trim()) {
        (Ok(_), name) if !name.is_empty() => name.to_owned(),
        _ => "an unnamed process".to_owned(),
    }
}

/// Converts a name for use in a path.
fn plain(name: &str) -> String {
    name.chars().map(|letter| if letter.is_alphanumeric() || letter == '-' { letter } else { '_' }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::{Command, Stdio};
    use std::time::{Duration, Instant};

    const ROBOT: &str = "KR 300 R2500 ultra, no. 1";

    #[test]
    fn robot_has_one_owner() {
        let folder = tempfile::tempdir().expect("a folder");
        let lock = single_owner(folder.path(), ROBOT).expect("a free robot");
        let refused = single_owner(folder.path(), ROBOT).expect_err("an owned robot").to_string();
        assert!(refused.contains(&format!("process {}", std::process::id())), "{refused}");
        single_owner(folder.path(), "KR 300 R2500 ultra, no. 2").expect("another robot");
        drop(lock);
        single_owner(folder.path(), ROBOT).expect("free again");
    }

    #[test]
    fn lock_refuses_a_symbolic_link() {
        let folder = tempfile::tempdir().expect("a folder");
        let precious = folder.path().join("precious");
        fs::write(&precious, "mine").expect("a file");
        let lock = folder.path().join(format!("{}.lock", plain(ROBOT)));
        std::os::unix::fs::symlink(&precious, &lock).expect("a link");
        assert!(matches!(single_owner(folder.path(), ROBOT), Err(NotOwner::File { .. })));
        fs::remove_file(&lock).expect("removed");
        fs::hard_link(&precious, &lock).expect("a link");
        let refused = single_owner(folder.path(), ROBOT).expect_err("a link").to_string();
        assert!(refused.contains("it is a link"), "{refused}");
        assert_eq!(fs::read_to_string(&precious).expect("a file"), "mine");
    }

    #[test]
    fn lock_ends_with_a_killed_process() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut child = Command::new(std::env::current_exe().expect("this test"))
            .args(["process::owner::tests::own_until_killed", "--exact", "--ignored"])
            .env("SOFTDOCK_LOCK_FOLDER", folder.path())
            .stdout(Stdio::null())
            .spawn()
            .expect("a process");
        let begin = Instant::now();
        let refused = loop {
            match single_owner(folder.path(), ROBOT) {
                Err(refused) if refused.to_string().contains(&child.id().to_string()) => break refused,
                _ => std::thread::sleep(Duration::from_millis(5)),
            }
            assert!(begin.elapsed() < Duration::from_secs(20), "the other process did not own the robot");
        };
        assert!(refused.to_string().contains("own_until_killed"), "{refused}");
        child.kill().expect("a kill");
        child.wait().expect("an end");
        single_owner(folder.path(), ROBOT).expect("free again");
    }

    #[test]
    #[ignore = "run by lock_ends_with_a_killed_process"]
    fn own_until_killed() {
        let folder = std::env::var("SOFTDOCK_LOCK_FOLDER").expect("SOFTDOCK_LOCK_FOLDER: the folder of the locks");
        let lock = loop {
            match single_owner(Path::new(&folder), ROBOT) {
                Ok(lock) => break lock,
                Err(_) => std::thread::sleep(Duration::from_millis(1)),
            }
        };
        std::thread::sleep(Duration::from_secs(60));
        drop(lock);
    }
}
