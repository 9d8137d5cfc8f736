//! Several workers' folders joined into one, without gaps and clashes, and judged.

use crate::error::{FarmError, Result};
use crate::finish::finish;
use crate::folder::ResultsFolder;
use crate::observer::Context;
use crate::outcome::{Ended, Incomplete, Shown};
use crate::variants;
use softdock_results::merge::{MergeError, check_merge, merge as join};
use std::path::{Path, PathBuf};

/// Joins the results folders of the parts of one campaign into `out`, and judges it.
///
/// # Errors
/// If the folders do not hold parts of one campaign, shards are missing, or a file cannot be read or written; then `out`
/// stays as it is.
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
    let folder = match join_parts(&first, out, parts, context)? {
        Ok(folder) => folder,
        Err(missing) => {
            return Ok(Ended { results: out.to_owned(), shown: Shown::Nothing, incomplete: Some(missing) });
        }
    };
    let summary = finish(&folder, context)?;
    Ok(Ended::new(&folder, Shown::Campaign(Box::new(summary))))
}

/// Joins folders of one campaign into another; gives that folder, or what is missing.
pub(crate) fn join_parts(
    campaign: &ResultsFolder,
    out: &Path,
    parts: &[PathBuf],
    context: Context,
) -> Result<std::result::Result<ResultsFolder, Incomplete>> {
    let (plan, origin) = (campaign.plan(), campaign.origin());
    // A folder that was merged before may hold what is missing elsewhere.
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
    join(parts, out, plan, &origin).map_err(|error| FarmError::refused(error, "run the same command again"))?;
    Ok(Ok(folder))
}
