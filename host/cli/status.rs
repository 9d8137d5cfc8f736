//! `softdock status`: how far a campaign is.

use crate::args::{StatusArgs, default_results};
use crate::folder::Folder;
use crate::run::tell;
use crate::variants;
use crate::words::{Exit, explain, refuse, warn};
use miette::IntoDiagnostic;
use softdock_analysis::summarise;
use softdock_results::partial::partial_runs;
use std::path::Path;

/// Says what is there and what it shows so far.
pub(crate) fn status(args: &StatusArgs) -> miette::Result<Exit> {
    let folder = folder_of(&args.what, None)?;
    if !folder.campaign.variants.is_empty() {
        return variants::status(&folder, args.json);
    }
    let summary = summarise(&folder.path, &folder.facts()).into_diagnostic()?;
    tell(&summary, args.json);
    match partial_runs(&folder.path).into_diagnostic()? {
        0 => {}
        runs => warn(format!("{runs} finished runs of unfinished shards are kept; `softdock run` goes on from them")),
    }
    Ok(Exit::of(&summary))
}

/// The results folder itself, or that of a campaign file.
pub(crate) fn folder_of(what: &Path, out: Option<&Path>) -> miette::Result<Folder> {
    if what.is_dir() {
        return Folder::open(what);
    }
    let campaign = softdock_campaign::load(what).map_err(explain)?;
    let path = out.map_or_else(|| default_results(&campaign.id), Path::to_owned);
    if path.is_dir() {
        return Folder::open(&path);
    }
    let message = format!("there is no results folder `{}`", path.display());
    Err(refuse(message, format!("run the campaign first: softdock run {}", what.display())))
}
