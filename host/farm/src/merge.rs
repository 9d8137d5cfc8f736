//! Merge of several workers' folders into one, without gaps and conflicts, and its judgement.

use crate::error::{FarmError, Result};
use crate::finish::finish;
use crate::folder::ResultsFolder;
use crate::join::join_parts;
use crate::observer::Context;
use crate::outcome::{Ended, Shown};
use crate::variants;
use std::path::{Path, PathBuf};

/// Merges the results folders of the parts of a campaign into `out`, and judges it.
///
/// # Errors
/// If the folders are not parts of one campaign, shards are missing, or a file cannot be read or written; then `out` is
/// not changed.
pub fn merge(parts: &[PathBuf], out: &Path, context: Context) -> Result<Ended> {
    let Some((first, others)) = parts.split_first() else {
        return Err(FarmError::refused("no folder is named", "name the results folders of the parts"));
    };
    let first = ResultsFolder::open(first)?;
    for part in others {
        first.same_campaign(&ResultsFolder::open(part)?)?;
    }
    if !first.campaign.variants.is_empty() {
        return variants::merge(&first.claim_alike(out, context)?, parts, context);
    }
    let (folder, index) = match join_parts(&first, out, parts, context)? {
        Ok(joined) => joined,
        Err(missing) => {
            return Ok(Ended { results: out.to_owned(), shown: Shown::Nothing, incomplete: Some(missing) });
        }
    };
    let summary = finish(&folder, index, context)?;
    Ok(Ended::new(&folder, Shown::Campaign(Box::new(summary))))
}
