//! `softdock merge`: several workers' folders into one, without gaps and clashes.

use crate::args::MergeArgs;
use crate::finish::finish;
use crate::folder::Folder;
use crate::run::tell;
use crate::variants;
use crate::words::{Exit, refuse, warn};
use softdock_results::merge::{MergeError, check_merge, merge as join};
use std::path::{Path, PathBuf};

/// Joins and judges.
pub(crate) fn merge(args: &MergeArgs) -> miette::Result<Exit> {
    let first = Folder::open(&args.parts[0])?;
    for part in &args.parts[1..] {
        first.same_campaign(&Folder::open(part)?)?;
    }
    if !first.campaign.variants.is_empty() {
        return variants::merge(&first.claim_alike(&args.out)?, &args.parts);
    }
    if !join_parts(&first, &args.out, &args.parts)? {
        return Ok(Exit::Incomplete);
    }
    let summary = finish(&first.claim_alike(&args.out)?)?;
    tell(&summary, false);
    Ok(Exit::of(&summary))
}

/// Joins folders of one campaign into another; false, and a word about it, if shards are missing.
pub(crate) fn join_parts(campaign: &Folder, out: &Path, parts: &[PathBuf]) -> miette::Result<bool> {
    let (plan, origin) = (campaign.plan(), campaign.origin());
    // A folder that was merged before may hold what is missing elsewhere.
    let mut sources = parts.to_vec();
    sources.extend(out.is_dir().then(|| out.to_owned()));
    match check_merge(&sources, plan, &origin) {
        Err(error @ MergeError::Gaps { .. }) => {
            warn(format!("{error}; run the missing parts first"));
            return Ok(false);
        }
        Err(error) => return Err(refuse(error, "the folders must hold parts of one campaign, made with one seed")),
        Ok(_) => {}
    }
    campaign.claim_alike(out)?;
    join(parts, out, plan, &origin).map_err(|error| refuse(error, "run the same command again"))?;
    Ok(true)
}
