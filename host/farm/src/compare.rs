//! Comparison of two results folders: failures, rates, runs, metrics, and different keys of their campaigns.

use crate::changes::{FileChange, changed_files, listed};
use crate::error::{FarmError, Result};
use crate::folder::ResultsFolder;
use crate::paths::named_below;
use serde_json::{Value, json};
use softdock_analysis::{ResultsComparison, ResultsInput, compare_results, compare_results_text};
use softdock_campaign::Cases;
use std::path::Path;

/// Comparison of two results folders.
#[derive(Clone, Debug)]
pub struct FolderComparison {
    /// Their results.
    pub results: ResultsComparison,
    /// Keys and files of their campaigns that differ.
    pub changes: Vec<FileChange>,
    /// Whether their tables of given cases differ.
    pub cases_differ: bool,
}

impl FolderComparison {
    /// Whether both folders hold every run of their campaign.
    pub fn is_complete(&self) -> bool {
        self.results.first.complete && self.results.second.complete
    }

    /// Returns the comparison for a terminal.
    pub fn text(&self) -> String {
        let mut lines = listed(&self.changes);
        lines.extend(self.cases_differ.then(|| "the tables of given cases differ".to_owned()));
        if lines.is_empty() {
            lines.push("none".to_owned());
        }
        format!("{}\nkeys that differ\n  {}", compare_results_text(&self.results), lines.join("\n  "))
    }

    /// Returns the comparison as JSON.
    pub fn json(&self) -> Value {
        let mut value = serde_json::to_value(&self.results).expect("a comparison is plain JSON");
        value["changes"] = json!(self.changes.iter().map(FileChange::json).collect::<Vec<_>>());
        value["cases_differ"] = json!(self.cases_differ);
        value
    }
}

/// Compares two results folders. Runs with the same number are pairs if both folders have the same seed; otherwise the
/// folders are two independent samples.
///
/// # Errors
/// If a folder cannot be read, or holds variants.
pub fn compare_folders(first: &Path, second: &Path) -> Result<FolderComparison> {
    let [one, two] = [open(first)?, open(second)?];
    let names = [first, second].map(|path| path.display().to_string());
    let remedy = "repair the folder: the command that made its runs makes what is missing or damaged again";
    let results = compare_results(&input_of(&one, &names[0]), &input_of(&two, &names[1]))
        .map_err(|error| FarmError::refused(error, remedy))?;
    let files = [&one, &two].map(|folder| named_below(&folder.path.join("campaign")));
    let cases = [&one, &two].map(|folder| folder.campaign.cases().map(Cases::hash));
    Ok(FolderComparison {
        results,
        changes: changed_files((&one.file, &files[0]), (&two.file, &files[1])),
        cases_differ: cases[0] != cases[1],
    })
}

fn input_of<'a>(folder: &'a ResultsFolder, name: &'a str) -> ResultsInput<'a> {
    ResultsInput {
        name,
        results: &folder.path,
        facts: folder.facts(),
        outer_draws: folder.campaign.outer_draws.unwrap_or(1),
        numbered_as_drawn: folder.campaign.cases().is_none_or(Cases::is_numbered),
    }
}

fn open(path: &Path) -> Result<ResultsFolder> {
    let folder = ResultsFolder::open(path)?;
    folder.refuse_variants()?;
    Ok(folder)
}
