//! `softdock compare`: two results folders side by side.

use crate::args::CompareArgs;
use crate::changes::{changed_files, files_below, listed};
use crate::folder::Folder;
use crate::variants::refuse_whole;
use crate::words::{Exit, json, refuse, say};
use serde_json::json;
use softdock_analysis::{ResultsInput, compare_results, compare_results_text};
use std::path::Path;

/// Compares failures, rates, runs, metrics and keys.
pub(crate) fn compare(args: &CompareArgs) -> miette::Result<Exit> {
    let [first, second] = [open(&args.first)?, open(&args.second)?];
    let names = [&args.first, &args.second].map(|path| path.display().to_string());
    let [one, two] = [(&first, &names[0]), (&second, &names[1])].map(|(folder, name)| ResultsInput {
        name,
        results: &folder.path,
        facts: folder.facts(),
        outer_draws: folder.campaign.outer_draws.unwrap_or(1),
        numbered_as_drawn: folder.campaign.cases().is_none_or(softdock_campaign::Cases::is_numbered),
    });
    let remedy = "repair the folder: the command that made its runs makes what is missing or damaged again";
    let compared = compare_results(&one, &two).map_err(|error| refuse(error, remedy))?;
    let files = [&first, &second].map(|folder| files_below(&folder.path.join("campaign")));
    let changes = changed_files((&first.file, &files[0]), (&second.file, &files[1]));
    let cases = [&first, &second].map(|folder| folder.campaign.cases().map(softdock_campaign::Cases::hash));
    if args.json {
        let mut value = serde_json::to_value(&compared).expect("a comparison is plain JSON");
        value["changes"] = json!(changes.iter().map(crate::changes::FileChange::json).collect::<Vec<_>>());
        value["cases_differ"] = json!(cases[0] != cases[1]);
        say(json(&value));
    } else {
        let mut lines = listed(&changes);
        if cases[0] != cases[1] {
            lines.push("the tables of given cases differ".to_owned());
        }
        if lines.is_empty() {
            lines.push("none".to_owned());
        }
        say(format!("{}\nkeys that differ\n  {}", compare_results_text(&compared), lines.join("\n  ")));
    }
    Ok(if compared.first.complete && compared.second.complete { Exit::Done } else { Exit::Incomplete })
}

fn open(path: &Path) -> miette::Result<Folder> {
    let folder = Folder::open(path)?;
    refuse_whole(&folder)?;
    Ok(folder)
}
