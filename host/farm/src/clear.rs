//! `run --fresh`: deletes the files of softdock in a results folder, and no others.

use crate::error::{FarmError, Result, writing};
use crate::folder::{ResultsFolder, busy};
use crate::lock::{FOLDER_LOCK, FolderLock, SHARD_LOCKS};
use crate::observer::{Context, Note};
use crate::paths::{files_below, named_files, normal};
use crate::slurm::{SLURM_FILES, SLURM_FOLDER};
use softdock_results::contact_events::CONTACT_EVENTS_FILE;
use std::path::{Path, PathBuf};

/// Files at the top of a results folder; the last one goes last, so that what is left is still known as one.
const FILES: [&str; 10] = [
    "summary.json",
    "report.html",
    "compare.json",
    "compare.html",
    "parity.parquet",
    "half_step.parquet",
    CONTACT_EVENTS_FILE,
    "cases.csv",
    "cases.parquet",
    "campaign.json",
];

/// Folders whose file names are those of softdock.
const FOLDERS: [&str; 4] = ["runs", "partial", "traces", "replays"];

/// Clears a results folder; a missing or empty one is not changed.
///
/// # Errors
/// If the folder holds a file that softdock does not write there, or one of `inputs`, which the next run reads; nothing
/// is deleted then.
pub(crate) fn clear(results: &Path, inputs: &[PathBuf], context: Context) -> Result<()> {
    let is_lock = |entry: std::io::Result<std::fs::DirEntry>| entry.is_ok_and(|entry| entry.file_name() == FOLDER_LOCK);
    if !results.exists() || results.read_dir().is_ok_and(|mut entries| entries.all(is_lock)) {
        return Ok(());
    }
    let inside = normal(results);
    if let Some(input) = inputs.iter().find(|input| normal(input).starts_with(&inside)) {
        let message = format!("`{}` lies in the folder that --fresh would empty", input.display());
        return Err(FarmError::refused(message, "copy the campaign's files elsewhere and run them from there"));
    }
    if !results.join("campaign.json").is_file() {
        let message = format!("`{}` is no results folder: it has no campaign.json", results.display());
        return Err(FarmError::refused(message, "name a folder that `softdock run` has written, or empty it by hand"));
    }
    let folder = ResultsFolder::open(results).map_err(|error| {
        let message = format!("`{}` cannot be read, so that nothing in it is deleted: {error}", results.display());
        FarmError::refused(message, "delete the folder by hand")
    })?;
    let variants = folder.campaign.variants.iter().map(|variant| results.join(&variant.name));
    let folders = std::iter::once(results.to_owned()).chain(variants.filter(|variant| variant.is_dir()));
    let alone = |folder: PathBuf| FolderLock::try_alone(&folder)?.ok_or_else(|| busy(&folder));
    let _locks: Vec<FolderLock> = folders.map(alone).collect::<Result<_>>()?;
    let is_known = is_known(&folder);
    let mut files = files_below(results);
    if let Some((name, path)) = files.iter().find(|(name, _)| !is_known(name)) {
        let message = format!("`{}` is not written by softdock: `{name}`", path.display());
        return Err(FarmError::refused(
            message,
            "move it out of the results folder, or write --out DIR; nothing was deleted",
        ));
    }
    let root = results.canonicalize().unwrap_or_else(|_| results.to_owned());
    let is_inside = |path: &Path| path.canonicalize().is_ok_and(|path| path.starts_with(&root));
    if let Some((_, path)) = files.iter().find(|(_, path)| !is_inside(path)) {
        let message = format!("`{}` leads out of the folder that --fresh would empty", path.display());
        return Err(FarmError::refused(message, "remove the link by hand; nothing was deleted"));
    }
    // The lock is still needed.
    files.retain(|(name, _)| name != FOLDER_LOCK);
    files.sort_by_key(|(name, _)| name == "campaign.json");
    let shards = files.iter().filter(|(name, _)| name.contains("runs/") && name.ends_with(".parquet")).count();
    for (_, path) in &files {
        std::fs::remove_file(path).map_err(writing(path))?;
    }
    remove_empty(results);
    context.note(Note::Deleted { folder: results.to_owned(), files: files.len(), shards });
    Ok(())
}

/// Whether a name below a results folder is one that softdock writes there.
pub(crate) fn is_known(folder: &ResultsFolder) -> impl Fn(&str) -> bool + use<> {
    let mut known: Vec<String> =
        named_files(&folder.campaign).into_iter().map(|file| format!("campaign/{}", file.name)).collect();
    for variant in &folder.campaign.variants {
        let own = known.iter().filter(|name| name.starts_with("campaign/")).cloned().collect::<Vec<_>>();
        known.extend(own.into_iter().map(|name| format!("{}/{name}", variant.name)));
    }
    let variants: Vec<String> = folder.campaign.variants.iter().map(|variant| variant.name.clone()).collect();
    move |name: &str| {
        let inner = variants.iter().find_map(|variant| name.strip_prefix(variant.as_str())?.strip_prefix('/'));
        known.iter().any(|known| known == without_temporary(name)) || is_own(inner.unwrap_or(name))
    }
}

/// The name of the file that a killed writer was about to write: `NAME.x1Y2z3.tmp`.
fn without_temporary(name: &str) -> &str {
    let written = name.strip_suffix(".tmp").and_then(|name| name.rsplit_once('.'));
    match written {
        Some((file, unique)) if unique.len() == 6 && unique.chars().all(|c| c.is_ascii_alphanumeric()) => file,
        _ => name,
    }
}

/// Whether softdock writes a file of this name in a results folder.
fn is_own(name: &str) -> bool {
    let name = without_temporary(name);
    let numbered = |file: &str, key: &str| {
        let number = file.strip_prefix(key).and_then(|rest| rest.strip_suffix(".parquet"));
        number.is_some_and(|number| !number.is_empty() && number.chars().all(|c| c.is_ascii_digit()))
    };
    match name.split_once('/') {
        Some((SHARD_LOCKS, file)) => file.starts_with("shard="),
        None if name == FOLDER_LOCK => true,
        Some((SLURM_FOLDER, file)) => SLURM_FILES.contains(&file) || file.ends_with(".log"),
        None => FILES.contains(&name),
        Some(("runs", file)) if softdock_results::shards::is_set_aside(file) => true,
        Some((folder @ ("runs" | "partial"), file)) if FOLDERS.contains(&folder) => numbered(file, "shard="),
        Some((folder, file)) => FOLDERS.contains(&folder) && (numbered(file, "run=") || file == "nominal.parquet"),
    }
}

/// Removes the folders below that hold nothing any more; the results folder itself stays.
fn remove_empty(folder: &Path) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            remove_empty(&path);
            // Fails if a file has been created meanwhile, as intended.
            let _ = std::fs::remove_dir(&path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_names_of_softdock_files_are_recognised() {
        let own = [
            "campaign.json",
            "runs/shard=00012.parquet",
            "runs/shard=00012.parquet.a1B2c3.tmp",
            "runs/shard=00012.parquet.damaged-1",
            "partial/shard=00000.parquet",
            "traces/nominal.parquet",
            "traces/run=000000017.parquet",
            "replays/run=000000017.parquet",
            "half_step.parquet",
            "contact_events.parquet",
        ];
        let foreign =
            ["notes.txt", "runs/mine.parquet", "runs/shard=1.csv", "traces/sub/run=1.parquet", "shard=1.parquet", ""];
        for name in own {
            assert!(is_own(name), "{name}");
        }
        for name in foreign {
            assert!(!is_own(name), "{name}");
        }
    }
}
