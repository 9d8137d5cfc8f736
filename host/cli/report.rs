//! `softdock report`: summary and page written again from the shards.

use crate::args::ReportArgs;
use crate::farm::called;
use crate::status::results_of;
use crate::words::{Exit, say};
use softdock_farm::Shown;

/// Writes summary and page.
pub(crate) fn report(args: &ReportArgs) -> miette::Result<Exit> {
    let ended = called(softdock_farm::report(&results_of(&args.what, args.out.as_deref())?))?;
    let files = match ended.shown {
        Shown::Variants(_) => ["compare.json", "compare.html"],
        _ => ["summary.json", "report.html"],
    };
    files.iter().for_each(|file| say(ended.results.join(file).display()));
    Ok(Exit::of_code(ended.shown.exit_code()))
}
