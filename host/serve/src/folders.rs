//! Results folders below a folder, each with what its own files state.

use serde::Serialize;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Deepest place of a results folder below the served one.
const DEPTH: usize = 5;

/// Most results folders that are listed.
const MOST: usize = 2_000;

/// Pages of a folder, the main one first.
pub(crate) const PAGES: [&str; 7] =
    ["report.html", "compare.html", "diagnosis.html", "identify.html", "motion.html", "score.html", "map.html"];

/// Age of the newest file of runs below which a folder counts as growing \[s\].
const GROWING: u64 = 20;

/// A results folder.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FoundFolder {
    /// Place below the served folder, with `/` between folders; empty for the served folder itself.
    pub name: String,
    /// Id of the campaign; empty for other results.
    pub campaign: String,
    /// Title.
    pub title: String,
    /// `verified`, `not_verified`, `undecided`, or `none` without a summary.
    pub verdict: String,
    /// Finished runs of whole shards; none without a summary.
    pub runs_done: Option<u64>,
    /// Runs of the campaign.
    pub runs_planned: Option<u64>,
    /// Whether runs were written a moment ago and some are missing.
    pub is_growing: bool,
    /// Last change of its files, seconds since 1970.
    pub changed_unix_s: u64,
    /// Its pages.
    pub pages: Vec<String>,
    /// Its path.
    #[serde(skip)]
    pub path: PathBuf,
}

/// Where a results folder is.
struct Place {
    name: String,
    path: PathBuf,
    pages: Vec<String>,
}

/// The results folders below a folder, the one that was changed last first.
pub fn found_folders(root: &Path) -> Vec<FoundFolder> {
    let mut found: Vec<FoundFolder> = places(root).into_iter().map(folder).collect();
    found.sort_by(|one, two| two.changed_unix_s.cmp(&one.changed_unix_s).then(one.name.cmp(&two.name)));
    found
}

/// The results folder of a name below a folder; only its own files are read.
pub(crate) fn found_folder(root: &Path, name: &str) -> Option<FoundFolder> {
    places(root).into_iter().find(|place| place.name == name).map(folder)
}

fn places(root: &Path) -> Vec<Place> {
    let mut found = Vec::new();
    search(root, "", 0, &mut found);
    found
}

fn search(path: &Path, name: &str, depth: usize, found: &mut Vec<Place>) {
    if found.len() >= MOST {
        return;
    }
    let is_campaign = path.join("campaign.json").is_file();
    let pages: Vec<String> =
        PAGES.iter().filter(|page| path.join(page).is_file()).map(|page| (*page).to_owned()).collect();
    if is_campaign || !pages.is_empty() {
        found.push(Place { name: name.to_owned(), path: path.to_owned(), pages });
    }
    if depth == DEPTH {
        return;
    }
    let mut inside: Vec<PathBuf> =
        std::fs::read_dir(path).into_iter().flatten().flatten().map(|entry| entry.path()).collect();
    inside.sort();
    for entry in inside {
        // A link may lead outside, or in a circle.
        let is_folder = entry.symlink_metadata().is_ok_and(|meta| meta.is_dir());
        let Some(own) = entry.file_name().and_then(|own| own.to_str()) else { continue };
        let is_content = is_campaign && ["runs", "partial", "traces", "replays", "campaign"].contains(&own);
        if is_folder && !is_content && !own.starts_with('.') {
            let name = if name.is_empty() { own.to_owned() } else { format!("{name}/{own}") };
            search(&entry, &name, depth + 1, found);
        }
    }
}

/// What the files of a folder state; nothing is computed, so that the list is immediate for any number of runs.
fn folder(Place { name, path, pages }: Place) -> FoundFolder {
    let read = |file: &str| -> Option<Value> {
        let text = softdock_input::read_text(&path.join(file), softdock_input::MAX_TEXT).ok()?;
        serde_json::from_str(&text).ok()
    };
    let manifest = read("campaign.json").unwrap_or_default();
    let summary = read("summary.json").or_else(|| read("compare.json")).unwrap_or_default();
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    let first = |values: [&Value; 2]| values.into_iter().map(text).find(|text| !text.is_empty()).unwrap_or_default();
    let runs_done = summary["completeness"]["runs_done"].as_u64();
    let runs_planned = manifest["runs"].as_u64();
    let newest = ["runs", "partial"].iter().filter_map(|place| newest(&path.join(place))).max();
    let changed = ["summary.json", "compare.json", "campaign.json"].iter().chain(&PAGES);
    let changed = changed.filter_map(|file| changed_at(&path.join(file))).chain(newest).max().unwrap_or_default();
    let is_whole = runs_done.is_some() && runs_done >= runs_planned;
    FoundFolder {
        name,
        campaign: first([&manifest["id"], &summary["campaign"]]),
        title: text(&summary["title"]),
        verdict: first([&summary["verdict"], &Value::String("none".to_owned())]),
        runs_done,
        runs_planned,
        is_growing: !is_whole && newest.is_some_and(|newest| now() < newest + GROWING),
        changed_unix_s: changed,
        pages,
        path,
    }
}

/// Seconds since 1970.
pub(crate) fn now() -> u64 {
    seconds(SystemTime::now())
}

fn seconds(time: SystemTime) -> u64 {
    time.duration_since(SystemTime::UNIX_EPOCH).map_or(0, |since| since.as_secs())
}

fn changed_at(file: &Path) -> Option<u64> {
    file.metadata().ok()?.modified().ok().map(seconds)
}

/// Last change of the files of a folder.
fn newest(folder: &Path) -> Option<u64> {
    std::fs::read_dir(folder).ok()?.flatten().filter_map(|entry| changed_at(&entry.path())).max()
}
