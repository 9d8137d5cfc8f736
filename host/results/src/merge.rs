//! Several workers' results folders into one, refusing gaps and clashes.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use crate::shards::{Origin, ShardFile, ShardIndex, ShardPlan, shard_path, verify_shard};
use crate::{Result, ResultsError, write_file};

/// Why folders cannot be merged.
#[derive(Debug, thiserror::Error)]
pub enum MergeError {
    /// A file does not belong to the campaign.
    #[error("{}: {reason}", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
        /// Why it does not belong.
        reason: String,
    },
    /// Two folders hold different rows for one shard.
    #[error("shard {shard} differs: {} and {}", first.display(), second.display())]
    Clash {
        /// The shard.
        shard: u32,
        /// One file.
        first: PathBuf,
        /// The other.
        second: PathBuf,
    },
    /// Shards that no folder holds.
    #[error("{} of {planned} shards are missing: {}", missing.len(), list(missing))]
    Gaps {
        /// Number of shards of the campaign.
        planned: u32,
        /// Their numbers.
        missing: Vec<u32>,
    },
    /// A file could not be read or written.
    #[error(transparent)]
    File(#[from] ResultsError),
}

/// The first few of a list of shards.
fn list(shards: &[u32]) -> String {
    const SHOWN: usize = 12;
    let mut words: Vec<String> = shards.iter().take(SHOWN).map(u32::to_string).collect();
    if shards.len() > SHOWN {
        words.push("...".to_owned());
    }
    words.join(", ")
}

/// Checks that the folders hold every shard once, or several times with equal rows; every row is read.
pub fn check_merge(
    folders: &[PathBuf],
    plan: ShardPlan,
    origin: &Origin,
) -> std::result::Result<BTreeMap<u32, ShardFile>, MergeError> {
    let mut whole: BTreeMap<u32, ShardFile> = BTreeMap::new();
    for folder in folders {
        let index = ShardIndex::scan(folder, plan, origin)?;
        if let Some((path, reason)) = index.foreign.into_iter().next() {
            return Err(MergeError::Foreign { path, reason });
        }
        for (shard, file) in index.complete {
            verify_shard(&file)?;
            match whole.get(&shard) {
                Some(known) if known.content_hash != file.content_hash => {
                    return Err(MergeError::Clash { shard, first: known.path.clone(), second: file.path });
                }
                Some(_) => {}
                None => drop(whole.insert(shard, file)),
            }
        }
    }
    let missing: Vec<u32> = (0..plan.shards()).filter(|shard| !whole.contains_key(shard)).collect();
    if !missing.is_empty() {
        return Err(MergeError::Gaps { planned: plan.shards(), missing });
    }
    Ok(whole)
}

/// Merges folders into `out`: shards are linked, or copied where the file system cannot link. What is made from all runs
/// together is made anew from the whole. Folders that [`check_merge`] refuses do not change `out`.
pub fn merge(
    folders: &[PathBuf],
    out: &Path,
    plan: ShardPlan,
    origin: &Origin,
) -> std::result::Result<ShardIndex, MergeError> {
    let mut sources = folders.to_vec();
    if out.is_dir() && !sources.iter().any(|folder| folder == out) {
        sources.push(out.to_owned());
    }
    for (shard, file) in check_merge(&sources, plan, origin)? {
        place(&file.path, &shard_path(out, shard))?;
    }
    Ok(ShardIndex::scan(out, plan, origin)?)
}

/// Puts a file in its place if nothing is there yet.
fn place(from: &Path, to: &Path) -> Result<()> {
    if to.exists() {
        return Ok(());
    }
    let folder = to.parent().unwrap_or(Path::new("."));
    fs::create_dir_all(folder).map_err(ResultsError::write(folder))?;
    if fs::hard_link(from, to).is_ok() || to.exists() {
        return Ok(());
    }
    write_file(to, &softdock_input::read(from, softdock_input::MAX_BINARY)?)
}
