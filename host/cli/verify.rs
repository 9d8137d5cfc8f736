//! `softdock verify`: a results folder compared with what it states of itself.

use crate::args::StatusArgs;
use crate::changes::files_below;
use crate::finish::stated;
use crate::folder::{Build, Folder};
use crate::fresh::is_known;
use crate::page::page_text;
use crate::variants;
use crate::words::{Exit, json, say};
use serde_json::json;
use softdock_analysis::{Summary, summary_text};

/// What a folder holds beside what it states.
#[derive(Default)]
struct Found {
    /// Files that are not what they state to be, with the reason.
    differs: Vec<String>,
    /// Files that softdock does not write there; nothing reads them.
    unknown: Vec<String>,
    /// What is not there yet.
    missing: Vec<String>,
    /// Hash of everything, if the folder has a summary.
    hash: Option<String>,
}

/// Verifies a folder, or every variant below it.
pub(crate) fn verify(args: &StatusArgs) -> miette::Result<Exit> {
    let whole = Folder::open(&args.what)?;
    let folders = match whole.campaign.variants.is_empty() {
        true => vec![whole],
        false => variants::folders(&whole)?,
    };
    let mut exit = Exit::Done;
    let mut answers = Vec::new();
    for folder in &folders {
        let found = found(folder)?;
        let own = match (found.differs.is_empty(), found.missing.is_empty()) {
            (false, _) => Exit::NotVerified,
            (true, false) => Exit::Incomplete,
            (true, true) => Exit::Done,
        };
        // What differs weighs more than what is missing.
        exit = if exit == Exit::NotVerified || own == Exit::NotVerified { Exit::NotVerified } else { exit.max(own) };
        let Found { differs, unknown, missing, hash } = found;
        if args.json {
            answers.push(json!({
                "campaign": folder.campaign.id, "verified": own == Exit::Done, "results_hash": hash,
                "differs": differs, "missing": missing, "unknown": unknown,
            }));
            continue;
        }
        let word = match own {
            Exit::Done => "every file is as it was written, and gives the summary and the page that are there",
            Exit::NotVerified => "DIFFERS from what it states",
            _ => "what is there is as it was written; not complete",
        };
        say(format!("{}  {word}", folder.campaign.id));
        for (kind, lines) in [("differs", &differs), ("missing", &missing), ("note", &unknown)] {
            lines.iter().for_each(|line| say(format!("  {kind}  {line}")));
        }
        hash.iter().for_each(|hash| say(format!("  results_hash  {hash}")));
    }
    if args.json {
        say(json(&json!(answers)));
    }
    Ok(exit)
}

fn found(folder: &Folder) -> miette::Result<Found> {
    let mut found = Found::default();
    let index = folder.shards()?;
    let summary = stated(folder)?;
    for ignored in &summary.completeness.ignored {
        found.differs.push(format!("{}: {}", ignored.file, ignored.reason));
    }
    if !index.is_complete() {
        found.missing.push(format!("{} of {} shards", index.missing().len(), index.plan.shards()));
    }
    for path in &index.set_aside {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        found.unknown.push(format!("runs/{name}: a damaged or foreign file that was at the place of a shard; ignored"));
    }
    // Another build may write the same runs down in other words.
    let is_own = folder.build == Build::own();
    if !is_own {
        let by = &folder.build;
        found.unknown.push(format!("{by} has made the runs: summary and page are not compared, their hash is"));
    }
    let read = |name: &str| softdock_input::read_text(&folder.path.join(name), softdock_input::MAX_TABLE);
    match read("summary.json") {
        Err(softdock_input::InputError::Absent { .. }) => found.missing.push("summary.json".to_owned()),
        Err(error) => found.differs.push(format!("summary.json: {}", error.what())),
        Ok(text) => {
            let kept: Option<Summary> = serde_json::from_str(&text).ok();
            let kept_hash = kept.as_ref().and_then(|kept| kept.results_hash.clone());
            if kept.is_none() {
                found.differs.push("summary.json: it is no summary".to_owned());
            } else if kept_hash != summary.results_hash {
                found.differs.push("results_hash: a file below the folder is not the one that was judged".to_owned());
            } else if is_own && text != summary_text(&summary) {
                found.differs.push("summary.json: the runs give another one".to_owned());
            }
            found.hash = summary.results_hash.clone();
        }
    }
    match read("report.html") {
        Err(softdock_input::InputError::Absent { .. }) => found.missing.push("report.html".to_owned()),
        Err(error) => found.differs.push(format!("report.html: {}", error.what())),
        Ok(text) if is_own && text != page_text(folder, &summary)? => {
            found.differs.push("report.html: the runs give another one".to_owned());
        }
        Ok(_) => {}
    }
    let known = is_known(folder);
    let ignored = &summary.completeness.ignored;
    let files = files_below(&folder.path).into_iter().map(|(name, _)| name);
    found.unknown.extend(files.filter(|name| !known(name) && !ignored.iter().any(|file| file.file == *name)));
    Ok(found)
}
