//! `softdock merge`: several workers' folders into one, without gaps and clashes.

use crate::args::MergeArgs;
use crate::finish::finish;
use crate::folder::Folder;
use crate::run::tell;
use crate::words::{Exit, refuse, warn};
use softdock_results::merge::{MergeError, check_merge, merge as join};

/// Joins and judges.
pub(crate) fn merge(args: &MergeArgs) -> miette::Result<Exit> {
    let first = Folder::open(&args.parts[0])?;
    for part in &args.parts[1..] {
        first.same_campaign(&Folder::open(part)?)?;
    }
    let (plan, hash, seed) = (first.plan(), &first.campaign.hash, first.campaign.seed);
    // A folder that was merged before may hold what is missing elsewhere.
    let mut sources = args.parts.clone();
    sources.extend(args.out.is_dir().then(|| args.out.clone()));
    match check_merge(&sources, plan, hash, seed) {
        Err(error @ MergeError::Gaps { .. }) => {
            warn(format!("{error}; run the missing parts first"));
            return Ok(Exit::Incomplete);
        }
        Err(error) => return Err(refuse(error, "the folders must hold parts of one campaign, made with one seed")),
        Ok(_) => {}
    }
    let whole = first.claim_alike(&args.out)?;
    join(&args.parts, &args.out, plan, hash, seed).map_err(|error| refuse(error, "run the same command again"))?;
    let summary = finish(&whole)?;
    tell(&summary, false);
    Ok(Exit::of(&summary))
}
