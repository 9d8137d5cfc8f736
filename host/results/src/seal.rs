//! The hash of a Parquet file's own bytes, in its own footer: one changed bit anywhere in the file shows.
//!
//! The footer states the key [`FILE_HASH`]. The hash is that of all bytes of the file with zeros in the place of its own
//! 64 digits.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::Path;

use bytes::Bytes;

use crate::{Result, ResultsError};

/// Key of the hash among the file's metadata.
pub const FILE_HASH: &str = "softdock.file_hash";

/// Hexadecimal digits of the hash.
const DIGITS: usize = 64;

/// Bytes that may stand between the key and its value: field headers and lengths of the footer's encoding.
const BETWEEN: usize = 8;

/// What stands in the place of the hash while it is computed.
pub(crate) fn blank() -> String {
    "0".repeat(DIGITS)
}

/// Writes the hash into a finished file that states [`blank`] in its place.
pub(crate) fn seal(path: &Path, file: &mut File) -> Result<()> {
    let mut bytes = Vec::new();
    file.seek(SeekFrom::Start(0)).map_err(ResultsError::write(path))?;
    file.read_to_end(&mut bytes).map_err(ResultsError::write(path))?;
    let place = place(&bytes).ok_or_else(|| ResultsError::contract(path, "the file has no place for its hash"))?;
    let hash = blake3::hash(&bytes).to_hex();
    file.seek(SeekFrom::Start(place as u64)).map_err(ResultsError::write(path))?;
    file.write_all(hash.as_bytes()).map_err(ResultsError::write(path))
}

/// The bytes of a file that are as its writer left them.
///
/// # Errors
/// If the file is not a regular one, cannot be read, states no hash, or has another one.
pub(crate) fn read_sealed(path: &Path) -> Result<Bytes> {
    let bytes = read_regular(path)?;
    let Some(place) = place(&bytes) else {
        // What is no Parquet file at all says so better.
        let what = "it states no hash of its bytes: another program or an older version has written it";
        return if bytes.starts_with(b"PAR1") { Err(ResultsError::contract(path, what)) } else { Ok(bytes) };
    };
    let mut hasher = blake3::Hasher::new();
    hasher.update(&bytes[..place]).update(blank().as_bytes()).update(&bytes[place + DIGITS..]);
    if hasher.finalize().to_hex().as_bytes() != &bytes[place..place + DIGITS] {
        return Err(ResultsError::contract(path, "damaged: its bytes do not have the hash that it states"));
    }
    Ok(bytes)
}

/// All bytes of a regular file; a pipe or a device would never end.
pub(crate) fn read_regular(path: &Path) -> Result<Bytes> {
    Ok(Bytes::from(softdock_input::read(path, softdock_input::MAX_BINARY)?))
}

/// Hash of files below a folder, in the order of their names: every name and every byte.
///
/// # Errors
/// If a file is not a regular one, or cannot be read.
pub fn hash_files(folder: &Path, names: &[String]) -> Result<String> {
    let mut names: Vec<&String> = names.iter().collect();
    names.sort();
    let mut hasher = blake3::Hasher::new();
    for name in names {
        let bytes = read_regular(&folder.join(name))?;
        hasher.update(name.as_bytes()).update(&[0]).update(&(bytes.len() as u64).to_le_bytes()).update(&bytes);
    }
    Ok(hasher.finalize().to_hex().to_string())
}

/// Where the hash stands: behind the last mention of its key.
fn place(bytes: &[u8]) -> Option<usize> {
    let key = FILE_HASH.as_bytes();
    let at = bytes.windows(key.len()).rposition(|window| window == key)? + key.len();
    let is_digits = |start: &usize| {
        bytes.get(*start..start + DIGITS).is_some_and(|digits| digits.iter().all(u8::is_ascii_hexdigit))
    };
    (at..at + BETWEEN).find(is_digits)
}
