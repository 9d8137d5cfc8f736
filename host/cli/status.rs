//! `softdock status`: how far a campaign is.

use crate::args::StatusArgs;
use crate::farm::called;
use crate::words::{Exit, explain, json, refuse, say, warn};
use softdock_farm::default_results;
use std::path::{Path, PathBuf};

/// Reports what exists and what it shows so far.
pub(crate) fn status(args: &StatusArgs) -> miette::Result<Exit> {
    let status = called(softdock_farm::status(&results_of(&args.what, None)?))?;
    match args.json {
        true => say(json(&status.shown.json())),
        false => say(status.shown.text()),
    }
    if status.partial_runs > 0 {
        let runs = status.partial_runs;
        warn(format!("{runs} finished runs of unfinished shards are kept; `softdock run` goes on from them"));
    }
    Ok(Exit::of_code(status.shown.exit_code()))
}

/// The results folder itself, or that of a campaign file.
pub(crate) fn results_of(what: &Path, out: Option<&Path>) -> miette::Result<PathBuf> {
    if what.is_dir() {
        return Ok(what.to_owned());
    }
    let campaign = softdock_campaign::load(what).map_err(explain)?;
    let path = out.map_or_else(|| default_results(&campaign.id), Path::to_owned);
    if path.is_dir() {
        return Ok(path);
    }
    let message = format!("there is no results folder `{}`", path.display());
    Err(refuse(message, format!("run the campaign first: softdock run {}", what.display())))
}
