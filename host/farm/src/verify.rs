//! Verification of a results folder against its stated hashes.

use crate::clear::is_known;
use crate::error::Result;
use crate::finish::Stated;
use crate::folder::ResultsFolder;
use crate::manifest::Build;
use crate::paths::files_below;
use serde_json::json;
use softdock_analysis::{Summary, summary_text};
use std::path::Path;

/// Result of the verification of a folder.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Verification {
    /// Id of the campaign.
    pub campaign: String,
    /// Files that differ from their stated content, with the reason.
    pub differs: Vec<String>,
    /// Files that do not exist yet.
    pub missing: Vec<String>,
    /// Unknown files, which are ignored, and other notes.
    pub notes: Vec<String>,
    /// Hash over everything, if the folder has a summary.
    pub results_hash: Option<String>,
}

impl Verification {
    /// Returns the exit code: 0 unchanged, 1 different, 3 incomplete.
    pub fn exit_code(&self) -> u8 {
        match (self.differs.is_empty(), self.missing.is_empty()) {
            (false, _) => 1,
            (true, false) => 3,
            (true, true) => 0,
        }
    }

    /// Returns the result with one line per finding.
    pub fn text(&self) -> String {
        let word = match self.exit_code() {
            0 => "every file is unchanged; summary and page follow from the runs",
            1 => "DIFFERS from its stated hashes",
            _ => "the existing files are unchanged; incomplete",
        };
        let mut lines = vec![format!("{}  {word}", self.campaign)];
        for (kind, found) in [("differs", &self.differs), ("missing", &self.missing), ("note", &self.notes)] {
            lines.extend(found.iter().map(|line| format!("  {kind}  {line}")));
        }
        lines.extend(self.results_hash.iter().map(|hash| format!("  results_hash  {hash}")));
        lines.join("\n")
    }

    /// Returns the result as JSON.
    pub fn json(&self) -> serde_json::Value {
        json!({
            "campaign": self.campaign, "verified": self.exit_code() == 0, "results_hash": self.results_hash,
            "differs": self.differs, "missing": self.missing, "unknown": self.notes,
        })
    }

    /// Returns the exit code of several folders: a difference outweighs a missing file.
    pub fn worst_exit_code(all: &[Self]) -> u8 {
        let codes = || all.iter().map(Self::exit_code);
        if codes().any(|code| code == 1) { 1 } else { codes().max().unwrap_or(0) }
    }
}

/// Verifies every file of a results folder, or of every variant below it, against its stated hash, and compares summary
/// and page with the runs.
///
/// # Errors
/// If the folder is not a results folder, or cannot be read.
pub fn verify(results: &Path) -> Result<Vec<Verification>> {
    ResultsFolder::open(results)?.with_runs()?.iter().map(verify_folder).collect()
}

fn verify_folder(folder: &ResultsFolder) -> Result<Verification> {
    let mut found = Verification { campaign: folder.campaign.id.clone(), ..Verification::default() };
    let stated = Stated::of(folder, folder.shards()?)?;
    let (index, summary) = (&stated.content.shards, &stated.summary);
    for ignored in &summary.completeness.ignored {
        found.differs.push(format!("{}: {}", ignored.file, ignored.reason));
    }
    if !index.is_complete() {
        found.missing.push(format!("{} of {} shards", index.missing().len(), index.plan.shards()));
    }
    for path in &index.set_aside {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        found.notes.push(format!("runs/{name}: a damaged or foreign file that was at the place of a shard; ignored"));
    }
    // Another build may write the same runs down in other words.
    let is_own = folder.build == Build::own();
    if !is_own {
        let by = &folder.build;
        found.notes.push(format!("{by} has made the runs: summary and page are not compared, their hash is"));
    }
    if let Some(text) = read(folder, "summary.json", &mut found) {
        let kept: Option<Summary> = serde_json::from_str(&text).ok();
        let kept_hash = kept.as_ref().and_then(|kept| kept.results_hash.clone());
        if kept.is_none() {
            found.differs.push("summary.json: not a summary".to_owned());
        } else if kept_hash != summary.results_hash {
            found.differs.push("results_hash: a file below the folder is not the one that was judged".to_owned());
        } else if is_own && text != summary_text(summary) {
            found.differs.push("summary.json: the runs give another one".to_owned());
        }
        found.results_hash = summary.results_hash.clone();
    }
    if let Some(text) = read(folder, "report.html", &mut found)
        && is_own
        && text != stated.page(folder)?
    {
        found.differs.push("report.html: the runs give another one".to_owned());
    }
    let known = is_known(folder);
    let ignored = &summary.completeness.ignored;
    let files = files_below(&folder.path).into_iter().map(|(name, _)| name);
    found.notes.extend(files.filter(|name| !known(name) && !ignored.iter().any(|file| file.file == *name)));
    Ok(found)
}

/// A file of the folder; one that cannot be read is missing or differs.
fn read(folder: &ResultsFolder, name: &str, found: &mut Verification) -> Option<String> {
    match softdock_input::read_text(&folder.path.join(name), softdock_input::MAX_TABLE) {
        Ok(text) => return Some(text),
        Err(softdock_input::InputError::Absent { .. }) => found.missing.push(name.to_owned()),
        Err(error) => found.differs.push(format!("{name}: {}", error.what())),
    }
    None
}
