//! Locks of a results folder: several processes may make its runs, a shard has one writer, and other changes are
//! exclusive.
//!
//! The locks are advisory locks of the operating system. They need no clock, and they are released when a process ends.

use crate::error::{FarmError, Result, writing};
use crate::observer::Cancel;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// File in a results folder by which the folder is locked.
pub(crate) const FOLDER_LOCK: &str = ".lock";

/// Folder with a lock for each shard that is being made.
pub(crate) const SHARD_LOCKS: &str = "locks";

/// Time between two attempts to take a lock.
const RETRY: Duration = Duration::from_millis(100);

/// Lock of a results folder, released on drop.
#[derive(Debug)]
pub(crate) struct FolderLock {
    file: File,
}

impl FolderLock {
    /// Locks the folder exclusively; `None` if another process works in it.
    pub(crate) fn try_alone(folder: &Path) -> Result<Option<Self>> {
        let path = folder.join(FOLDER_LOCK);
        let file = open(&path).map_err(writing(&path))?;
        match file.try_lock() {
            Ok(()) => Ok(Some(Self { file })),
            Err(TryLockError::WouldBlock) => Ok(None),
            Err(TryLockError::Error(error)) => Err(writing(&path)(error)),
        }
    }

    /// Locks the folder together with other processes that make runs; waits while one has it exclusively.
    pub(crate) fn together(folder: &Path, cancel: &Cancel) -> Result<Self> {
        let path = folder.join(FOLDER_LOCK);
        let file = open(&path).map_err(writing(&path))?;
        loop {
            match file.try_lock_shared() {
                Ok(()) => return Ok(Self { file }),
                Err(TryLockError::WouldBlock) if cancel.is_cancelled() => return Err(FarmError::Cancelled),
                Err(TryLockError::WouldBlock) => std::thread::sleep(RETRY),
                Err(TryLockError::Error(error)) => return Err(writing(&path)(error)),
            }
        }
    }

    /// Converts an exclusive lock into a shared one; the folder is unlocked for a moment.
    pub(crate) fn share(self, folder: &Path, cancel: &Cancel) -> Result<Self> {
        self.file.unlock().map_err(writing(&folder.join(FOLDER_LOCK)))?;
        Self::together(folder, cancel)
    }
}

/// Lock of a shard, released and removed on drop.
#[derive(Debug)]
pub(crate) struct ShardLock {
    path: PathBuf,
    _file: File,
}

impl ShardLock {
    /// Locks a shard; `None` if another process is making it.
    pub(crate) fn try_take(folder: &Path, shard: u32) -> Result<Option<Self>> {
        let locks = folder.join(SHARD_LOCKS);
        let path = locks.join(format!("shard={shard:05}"));
        loop {
            match fs::create_dir(&locks) {
                Err(error) if error.kind() != ErrorKind::AlreadyExists => return Err(writing(&locks)(error)),
                _ => {}
            }
            let file = match open(&path) {
                // Another process has removed the empty folder meanwhile.
                Err(error) if error.kind() == ErrorKind::NotFound => continue,
                file => file.map_err(writing(&path))?,
            };
            match file.try_lock() {
                // A lock of a file that its last owner has removed is invalid.
                Ok(()) if is_still(&path, &file) => return Ok(Some(Self { path, _file: file })),
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => return Ok(None),
                Err(TryLockError::Error(error)) => return Err(writing(&path)(error)),
            }
        }
    }
}

impl Drop for ShardLock {
    fn drop(&mut self) {
        // While the lock is still held; another process finds that its file is gone and takes a new one.
        let _ = fs::remove_file(&self.path);
        if let Some(folder) = self.path.parent() {
            let _ = fs::remove_dir(folder);
        }
    }
}

fn open(path: &Path) -> std::io::Result<File> {
    let mut options = OpenOptions::new();
    options.read(true).write(true).create(true).truncate(false);
    match options.open(path) {
        // The file of another user can be locked as well.
        Err(error) if error.kind() == ErrorKind::PermissionDenied => File::open(path).map_err(|_| error),
        file => file,
    }
}

/// Whether a path still names an open file.
#[cfg(unix)]
fn is_still(path: &Path, file: &File) -> bool {
    use std::os::unix::fs::MetadataExt;
    let same = |one: &fs::Metadata, two: &fs::Metadata| (one.dev(), one.ino()) == (two.dev(), two.ino());
    matches!((fs::metadata(path), file.metadata()), (Ok(one), Ok(two)) if same(&one, &two))
}

/// Whether a path still names an open file: a locked file cannot be removed there.
#[cfg(not(unix))]
fn is_still(path: &Path, _: &File) -> bool {
    path.is_file()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shard_has_one_owner_and_its_lock_file_is_removed() {
        let folder = tempfile::tempdir().expect("a folder");
        let first = ShardLock::try_take(folder.path(), 3).expect("a lock").expect("it is free");
        assert!(ShardLock::try_take(folder.path(), 3).expect("no error").is_none());
        let other = ShardLock::try_take(folder.path(), 4).expect("a lock").expect("it is free");
        drop(first);
        drop(ShardLock::try_take(folder.path(), 3).expect("a lock").expect("given back"));
        drop(other);
        assert!(!folder.path().join(SHARD_LOCKS).exists());
    }

    #[test]
    fn shard_is_never_owned_by_two_threads() {
        let folder = tempfile::tempdir().expect("a folder");
        let owners = std::sync::atomic::AtomicU32::new(0);
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    for _ in 0..500 {
                        if let Some(lock) = ShardLock::try_take(folder.path(), 0).expect("no error") {
                            assert_eq!(owners.fetch_add(1, std::sync::atomic::Ordering::SeqCst), 0);
                            owners.fetch_sub(1, std::sync::atomic::Ordering::SeqCst);
                            drop(lock);
                        }
                    }
                });
            }
        });
    }

    #[test]
    fn folder_lock_is_shared_by_writers_of_runs_and_exclusive_otherwise() {
        let (folder, cancel) = (tempfile::tempdir().expect("a folder"), Cancel::default());
        let alone = FolderLock::try_alone(folder.path()).expect("a lock").expect("it is free");
        assert!(FolderLock::try_alone(folder.path()).expect("no error").is_none());
        let one = alone.share(folder.path(), &cancel).expect("a lock");
        let two = FolderLock::together(folder.path(), &cancel).expect("a lock");
        assert!(FolderLock::try_alone(folder.path()).expect("no error").is_none());
        drop((one, two));
        assert!(FolderLock::try_alone(folder.path()).expect("no error").is_some());
    }
}
