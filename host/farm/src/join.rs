//! Join of the shards of several results folders.

use crate::error::{FarmError, Result};
use crate::folder::ResultsFolder;
use crate::observer::Context;
use crate::outcome::Incomplete;
use softdock_results::merge::{MergeError, check_merge, merge as join};
use softdock_results::shards::ShardIndex;
use std::path::{Path, PathBuf};

/// Joins folders of a campaign into another; returns that folder and its shards, or the missing shards.
pub(crate) fn join_parts(
    campaign: &ResultsFolder,
    out: &Path,
    parts: &[PathBuf],
    context: Context,
) -> Result<std::result::Result<(ResultsFolder, ShardIndex), Incomplete>> {
    let (plan, origin) = (campaign.plan(), campaign.origin());
    // A previously merged folder may contain shards that are missing elsewhere.
    let mut sources = parts.to_vec();
    sources.extend(out.is_dir().then(|| out.to_owned()));
    let whole = match check_merge(&sources, plan, &origin) {
        Err(MergeError::Gaps { planned, missing }) => {
            let done = planned as usize - missing.len();
            return Ok(Err(Incomplete::PartsMissing { done, planned, first: missing[0] }));
        }
        whole => whole.map_err(|error| {
            FarmError::refused(error, "the folders must hold parts of one campaign, made with one seed")
        })?,
    };
    drop(whole);
    let folder = campaign.claim_alike(out, context)?;
    let index = join(parts, out, plan, &origin);
    let index = index.map_err(|error| FarmError::refused(error, "run the same command again"))?;
    Ok(Ok((folder, index)))
}
