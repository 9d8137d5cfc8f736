//! `softdock report`: summary and page written again from the shards.

use crate::args::ReportArgs;
use crate::finish::judge;
use crate::status::folder_of;
use crate::variants;
use crate::words::{Exit, say};

/// Writes summary and page.
pub(crate) fn report(args: &ReportArgs) -> miette::Result<Exit> {
    let folder = folder_of(&args.what, args.out.as_deref())?;
    if !folder.campaign.variants.is_empty() {
        return variants::report(&folder);
    }
    let summary = judge(&folder)?;
    say(format!("{}\n{}", folder.path.join("summary.json").display(), folder.path.join("report.html").display()));
    Ok(Exit::of(&summary))
}
