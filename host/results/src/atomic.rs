//! Atomic writes, and removal of the temporary files of killed writers.

use std::fs::{self, File, OpenOptions, Permissions};
use std::io::Write;
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::{Result, ResultsError};

/// Characters that make a temporary name unique.
const UNIQUE: usize = 6;

/// Writes a file by a unique temporary name in the same folder, fsync and atomic rename; makes the folder if needed.
///
/// Two writers of one file never mix; a killed one leaves only `NAME.*.tmp`, which no reader looks at and
/// [`remove_abandoned`] clears away.
///
/// # Errors
/// [`ResultsError::Write`] if the file cannot be written; what was there before stays.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<()> {
    atomically(path, |file| file.write_all(bytes).map_err(ResultsError::write(path)))
}

/// A text file of a results folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ResultFile {
    /// Name in the folder.
    pub name: String,
    /// Text.
    pub text: String,
}

impl ResultFile {
    /// A file of this name and text.
    pub fn new(name: impl Into<String>, text: impl Into<String>) -> Self {
        Self { name: name.into(), text: text.into() }
    }
}

/// Writes files into a folder, each by [`write_file`]; makes the folder if needed. Gives their paths, in the same order.
///
/// # Errors
/// If the folder or a file cannot be written.
pub fn write_files(folder: &Path, files: &[ResultFile]) -> Result<Vec<PathBuf>> {
    fs::create_dir_all(folder).map_err(ResultsError::write(folder))?;
    let write = |file: &ResultFile| {
        let path = folder.join(&file.name);
        write_file(&path, file.text.as_bytes()).map(|()| path)
    };
    files.iter().map(write).collect()
}

/// Removes the temporary files below a results folder whose writers are dead; returns how many.
///
/// A writer locks its temporary file as long as it lives: a file that can be locked has lost its writer, whatever its
/// time stamps. Links below the folder are not followed, and nothing but regular files with a temporary name is removed.
///
/// # Errors
/// If a folder cannot be read.
pub fn remove_abandoned(results: &Path) -> Result<usize> {
    let (mut open, mut removed) = (Vec::new(), 0);
    // The folder itself may be a link that the user has named.
    if results.is_dir() {
        open.push(results.to_owned());
    }
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(&folder).map_err(ResultsError::io(&folder))? {
            let entry = entry.map_err(ResultsError::io(&folder))?;
            // Another worker may have removed it meanwhile.
            let Ok(kind) = entry.file_type() else { continue };
            if kind.is_dir() {
                open.push(entry.path());
            } else if kind.is_file() && is_temporary(&entry.path()) {
                removed += usize::from(remove_if_abandoned(&entry.path()));
            }
        }
    }
    Ok(removed)
}

/// Removes a temporary file unless its writer lives; `true` if this call has removed it.
fn remove_if_abandoned(path: &Path) -> bool {
    let mut options = OpenOptions::new();
    options.read(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(&mut options, libc::O_NOFOLLOW | libc::O_NONBLOCK);
    let Ok(file) = options.open(path) else { return false };
    // The lock is held until the file is gone, so that a writer that is just about to lock it sees that.
    file.try_lock().is_ok() && is_at(&file, path) && fs::remove_file(path).is_ok()
}

/// Whether an open file is still the one at a path, and no link to one.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    match (file.metadata(), fs::symlink_metadata(path)) {
        (Ok(open), Ok(there)) => there.is_file() && (open.dev(), open.ino()) == (there.dev(), there.ino()),
        _ => false,
    }
}

/// Elsewhere an open file keeps its name.
#[cfg(not(unix))]
fn is_at(_file: &File, path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok_and(|there| there.is_file())
}

/// Whether a file's name is one that a writer gives it before it is whole.
pub fn is_temporary(path: &Path) -> bool {
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let unique = name.strip_suffix(".tmp").and_then(|name| name.rsplit_once('.')).map(|(_, unique)| unique.to_owned());
    unique.is_some_and(|unique| unique.len() == UNIQUE && unique.chars().all(|c| c.is_ascii_alphanumeric()))
}

/// As [`write_file`], for a writer that streams.
pub(crate) fn atomically(path: &Path, fill: impl FnOnce(&mut File) -> Result<()>) -> Result<()> {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    fs::create_dir_all(folder).map_err(ResultsError::write(folder))?;
    let name = path.file_name().ok_or_else(|| ResultsError::contract(path, "not a file name"))?.to_string_lossy();
    let mut temporary = locked_temporary(path, folder, &name)?;
    fill(temporary.as_file_mut())?;
    temporary.as_file().sync_all().map_err(ResultsError::write(path))?;
    temporary.persist(path).map_err(|failed| ResultsError::Write { path: path.to_owned(), source: failed.error })?;
    sync_folder(folder)
}

/// A new temporary file that [`remove_abandoned`] does not remove as long as it is open.
fn locked_temporary(path: &Path, folder: &Path, name: &str) -> Result<NamedTempFile> {
    loop {
        let temporary = tempfile::Builder::new()
            .prefix(&format!("{name}."))
            .suffix(".tmp")
            .rand_bytes(UNIQUE)
            .permissions(shared_permissions(folder)?)
            .tempfile_in(folder)
            .map_err(ResultsError::write(path))?;
        // A file system without locks is no reason not to write: nothing is removed there.
        let is_locked = temporary.as_file().lock().is_ok();
        // Before the lock was there, somebody may have taken the file for abandoned.
        if !is_locked || is_at(temporary.as_file(), temporary.path()) {
            return Ok(temporary);
        }
    }
}

/// Results are read by colleagues: the user's umask decides, not the private mode of temporary files.
#[cfg(unix)]
fn shared_permissions(_folder: &Path) -> Result<Permissions> {
    use std::os::unix::fs::PermissionsExt;
    Ok(Permissions::from_mode(0o666))
}

/// Other systems inherit the folder's access list; only the read-only bit could be set here.
#[cfg(not(unix))]
fn shared_permissions(folder: &Path) -> Result<Permissions> {
    Ok(fs::metadata(folder).map_err(ResultsError::write(folder))?.permissions())
}

/// The rename itself must survive a power cut: on Unix the folder is synced too.
fn sync_folder(folder: &Path) -> Result<()> {
    if cfg!(unix) {
        File::open(folder).and_then(|folder| folder.sync_all()).map_err(ResultsError::write(folder))?;
    }
    Ok(())
}
