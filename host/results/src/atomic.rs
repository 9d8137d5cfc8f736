//! Files that appear whole or not at all, and what killed writers leave of them.

use std::fs::{self, File, Permissions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use crate::{Error, Result};

/// A temporary file that nobody has written to for this long has lost its writer: a shard takes seconds.
const ABANDONED: Duration = Duration::from_secs(3600);

/// Characters that make a temporary name unique.
const UNIQUE: usize = 6;

/// Writes a file by a unique temporary name in the same folder, fsync and atomic rename; makes the folder if needed.
///
/// Two writers of one file never mix; a killed one leaves only `NAME.*.tmp`, which no reader looks at and
/// [`remove_abandoned`] clears away.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<()> {
    atomically(path, |file| file.write_all(bytes).map_err(Error::io(path)))
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
    fs::create_dir_all(folder).map_err(Error::io(folder))?;
    let write = |file: &ResultFile| {
        let path = folder.join(&file.name);
        write_file(&path, file.text.as_bytes()).map(|()| path)
    };
    files.iter().map(write).collect()
}

/// Removes what killed writers left below a results folder more than an hour ago; returns how many files.
pub fn remove_abandoned(results: &Path) -> Result<usize> {
    let (mut open, mut removed) = (vec![results.to_owned()], 0);
    while let Some(folder) = open.pop() {
        if !folder.is_dir() {
            continue;
        }
        for entry in fs::read_dir(&folder).map_err(Error::io(&folder))? {
            let path = entry.map_err(Error::io(&folder))?.path();
            if path.is_dir() {
                open.push(path);
            } else if is_temporary(&path) && is_abandoned(&path) {
                // Another worker may have been faster.
                removed += usize::from(fs::remove_file(&path).is_ok());
            }
        }
    }
    Ok(removed)
}

/// Whether a file's name is one that a writer gives it before it is whole.
pub fn is_temporary(path: &Path) -> bool {
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let unique = name.strip_suffix(".tmp").and_then(|name| name.rsplit_once('.')).map(|(_, unique)| unique.to_owned());
    unique.is_some_and(|unique| unique.len() == UNIQUE && unique.chars().all(|c| c.is_ascii_alphanumeric()))
}

fn is_abandoned(path: &Path) -> bool {
    let written = fs::metadata(path).and_then(|data| data.modified());
    written.is_ok_and(|written| SystemTime::now().duration_since(written).is_ok_and(|age| age > ABANDONED))
}

/// As [`write_file`], for a writer that streams.
pub(crate) fn atomically(path: &Path, fill: impl FnOnce(&mut File) -> Result<()>) -> Result<()> {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    fs::create_dir_all(folder).map_err(Error::io(folder))?;
    let name = path.file_name().ok_or_else(|| Error::contract(path, "not a file name"))?.to_string_lossy();
    let mut temporary = tempfile::Builder::new()
        .prefix(&format!("{name}."))
        .suffix(".tmp")
        .rand_bytes(UNIQUE)
        .permissions(shared_permissions(folder)?)
        .tempfile_in(folder)
        .map_err(Error::io(path))?;
    fill(temporary.as_file_mut())?;
    temporary.as_file().sync_all().map_err(Error::io(path))?;
    temporary.persist(path).map_err(|failed| Error::Io { path: path.to_owned(), source: failed.error })?;
    sync_folder(folder)
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
    Ok(fs::metadata(folder).map_err(Error::io(folder))?.permissions())
}

/// The rename itself must survive a power cut: on Unix the folder is synced too.
fn sync_folder(folder: &Path) -> Result<()> {
    if cfg!(unix) {
        File::open(folder).and_then(|folder| folder.sync_all()).map_err(Error::io(folder))?;
    }
    Ok(())
}
