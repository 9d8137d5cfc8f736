//! Regular files within a size limit, and their text.

use crate::{InputError, Result};
use std::fs::{self, File, FileType, OpenOptions};
use std::io::Read;
use std::path::Path;

/// Bytes reserved before the first read: a stated size must not allocate at once.
const RESERVED: u64 = 1 << 20;

/// Opens a regular file of at most `limit` bytes; follows a symbolic link.
///
/// # Errors
/// If the file does not exist, is a directory, pipe, socket or device, is larger, or the system reports an error.
pub fn open(path: &Path, limit: u64) -> Result<File> {
    // Checked before opening: opening a device may have effects.
    let data = fs::metadata(path).map_err(|source| of_system(path, source))?;
    check_kind(path, data.file_type())?;
    check_size(path, data.len(), limit)?;
    let mut options = OpenOptions::new();
    options.read(true);
    // A pipe that has replaced the file in the meantime does not block.
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(&mut options, libc::O_NONBLOCK | libc::O_NOCTTY);
    let file = options.open(path).map_err(|source| of_system(path, source))?;
    let data = file.metadata().map_err(|source| of_system(path, source))?;
    check_kind(path, data.file_type())?;
    check_size(path, data.len(), limit)?;
    Ok(file)
}

/// Reads a regular file of at most `limit` bytes.
///
/// # Errors
/// As [`open`]; also if the file grows beyond the limit while it is read.
pub fn read(path: &Path, limit: u64) -> Result<Vec<u8>> {
    let file = open(path, limit)?;
    let stated = file.metadata().map_or(0, |data| data.len());
    let mut bytes = Vec::with_capacity(stated.min(RESERVED) as usize);
    file.take(limit.saturating_add(1)).read_to_end(&mut bytes).map_err(|source| of_system(path, source))?;
    check_size(path, bytes.len() as u64, limit)?;
    Ok(bytes)
}

/// Reads a regular text file of at most `limit` bytes.
///
/// # Errors
/// As [`read`]; also if a byte is not UTF-8, with its line and column.
pub fn read_text(path: &Path, limit: u64) -> Result<String> {
    decode_text(path, read(path, limit)?)
}

/// Decodes bytes as text; `path` is used in the error.
///
/// # Errors
/// If a byte is not UTF-8, with its line and column.
pub fn decode_text(path: &Path, bytes: Vec<u8>) -> Result<String> {
    String::from_utf8(bytes).map_err(|error| {
        let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line_start = valid.iter().rposition(|byte| *byte == b'\n').map_or(0, |at| at + 1);
        InputError::NotText {
            path: path.to_owned(),
            line: 1 + valid.iter().filter(|byte| **byte == b'\n').count(),
            column: 1 + String::from_utf8_lossy(&valid[line_start..]).chars().count(),
            byte: error.as_bytes()[valid.len()],
        }
    })
}

/// Checks that a path is absent or a regular file, for readers that treat an absent file as an empty one.
///
/// Returns whether the file exists.
///
/// # Errors
/// If it is a directory, pipe, socket or device, or if the system refuses.
pub fn check_regular(path: &Path) -> Result<bool> {
    match fs::metadata(path) {
        Ok(data) => check_kind(path, data.file_type()).map(|()| true),
        Err(error) if is_absent(&error) => {
            // A dangling link counts as existing.
            match fs::symlink_metadata(path) {
                Ok(_) => Err(InputError::NotRegular { path: path.to_owned(), kind: "link to nothing" }),
                Err(_) => Ok(false),
            }
        }
        Err(source) => Err(of_system(path, source)),
    }
}

fn is_absent(error: &std::io::Error) -> bool {
    matches!(error.kind(), std::io::ErrorKind::NotFound | std::io::ErrorKind::NotADirectory)
}

fn of_system(path: &Path, source: std::io::Error) -> InputError {
    match is_absent(&source) {
        true => InputError::Absent { path: path.to_owned() },
        false => InputError::Io { path: path.to_owned(), source },
    }
}

fn check_kind(path: &Path, kind: FileType) -> Result<()> {
    if kind.is_file() {
        return Ok(());
    }
    Err(InputError::NotRegular { path: path.to_owned(), kind: kind_of(kind) })
}

fn kind_of(kind: FileType) -> &'static str {
    if kind.is_dir() {
        return "directory";
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        if kind.is_fifo() {
            return "named pipe";
        }
        if kind.is_socket() {
            return "socket";
        }
        if kind.is_char_device() || kind.is_block_device() {
            return "device";
        }
    }
    "special file"
}

fn check_size(path: &Path, bytes: u64, limit: u64) -> Result<()> {
    if bytes <= limit {
        return Ok(());
    }
    Err(InputError::TooLarge { path: path.to_owned(), bytes, limit })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_file_is_refused_before_it_is_read() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("large.toml");
        // Sparse: it needs no disk space.
        File::create(&path).and_then(|file| file.set_len(1 << 30)).expect("a file");
        let error = read(&path, 1 << 20).expect_err("too large");
        assert!(error.to_string().ends_with("large.toml: has 1.0 GiB, the limit is 1.0 MiB"), "{error}");
        File::create(&path).and_then(|file| file.set_len(1 << 20)).expect("a file");
        assert_eq!(read(&path, 1 << 20).expect("at the limit").len(), 1 << 20);
    }

    #[test]
    fn invalid_byte_is_reported_with_line_and_column() {
        let error = decode_text(Path::new("a.csv"), b"a,b\n\xC3\xA4x\xFF".to_vec()).expect_err("not UTF-8");
        assert_eq!(error.to_string(), "a.csv:2:3: byte 0xFF is not UTF-8 text");
    }

    #[cfg(unix)]
    #[test]
    fn pipes_devices_sockets_and_directories_are_refused_at_once() {
        use std::os::unix::net::UnixListener;
        let folder = tempfile::tempdir().expect("a folder");
        let (pipe, socket) = (folder.path().join("pipe"), folder.path().join("socket"));
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        assert!(made.expect("mkfifo").success());
        let _listener = UnixListener::bind(&socket).expect("a socket");
        let cases = [
            (pipe.as_path(), "named pipe"),
            (&socket, "socket"),
            (Path::new("/dev/zero"), "device"),
            (folder.path(), "directory"),
        ];
        for (path, kind) in cases {
            let error = read(path, 1 << 20).expect_err(kind);
            assert!(error.to_string().ends_with(&format!("is no regular file but a {kind}")), "{error}");
            assert!(check_regular(path).is_err(), "{kind}");
        }
        // A file of the system whose stated size is 0 is read as far as the limit.
        assert!(matches!(read(Path::new("/proc/self/maps"), 16), Err(InputError::TooLarge { .. })));
        let dangling = folder.path().join("dangling");
        std::os::unix::fs::symlink(folder.path().join("nothing"), &dangling).expect("a link");
        assert!(matches!(read(&dangling, 16), Err(InputError::Absent { .. })));
        assert!(check_regular(&dangling).is_err() && !check_regular(&folder.path().join("nothing")).expect("none"));
    }
}
