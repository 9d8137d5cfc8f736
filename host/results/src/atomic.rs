//! Files that appear whole or not at all.

use std::fs::{self, File, Permissions};
use std::io::Write;
use std::path::Path;

use crate::{Error, Result};

/// Writes a file by a unique temporary name in the same folder, fsync and atomic rename; makes the folder if needed.
///
/// Two writers of one file never mix; a killed one leaves only `NAME.*.tmp`, which no reader looks at.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<()> {
    atomically(path, |file| file.write_all(bytes).map_err(Error::io(path)))
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
