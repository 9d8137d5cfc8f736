//! `softdock compare`: two results folders side by side.

use crate::args::CompareArgs;
use crate::farm::called;
use crate::words::{Exit, json, say};
use serde_json::json;
use softdock_analysis::compare_results_text;
use softdock_farm::changes::{FileChange, listed};

/// Compares failures, rates, runs, metrics and keys.
pub(crate) fn compare(args: &CompareArgs) -> miette::Result<Exit> {
    let compared = called(softdock_farm::compare_folders(&args.first, &args.second))?;
    if args.json {
        let mut value = serde_json::to_value(&compared.results).expect("a comparison is plain JSON");
        value["changes"] = json!(compared.changes.iter().map(FileChange::json).collect::<Vec<_>>());
        value["cases_differ"] = json!(compared.cases_differ);
        say(json(&value));
    } else {
        let mut lines = listed(&compared.changes);
        lines.extend(compared.cases_differ.then(|| "the tables of given cases differ".to_owned()));
        if lines.is_empty() {
            lines.push("none".to_owned());
        }
        say(format!("{}\nkeys that differ\n  {}", compare_results_text(&compared.results), lines.join("\n  ")));
    }
    Ok(if compared.is_complete() { Exit::Done } else { Exit::Incomplete })
}
