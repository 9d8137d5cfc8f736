//! Unfinished shards: the runs of a shard that had ended when its writer was stopped.
//!
//! They lie in `partial/`, apart from `runs/`, and state a schema of their own, so that no reader takes one for a whole
//! shard. A writer that goes on reads them, makes the other runs, writes the whole shard and removes the partial one.

use std::fs;
use std::path::{Path, PathBuf};

use crate::read::TableReader;
use crate::runs::{RunRow, RunsSchema};
use crate::shards::{Provenance, ShardFile, parquet_files};
use crate::write::{content_hash, write_table};
use crate::{Result, ResultsError};

/// Version of an unfinished shard; its columns are those of the runs table.
pub const PARTIAL_SCHEMA: &str = "partial/1";

/// Path of an unfinished shard below a results folder.
pub fn partial_path(results: &Path, shard: u32) -> PathBuf {
    results.join("partial").join(format!("shard={shard:05}.parquet"))
}

/// The runs that an unfinished shard holds.
#[derive(Clone, Debug, PartialEq)]
pub enum PartialShard {
    /// There is none.
    Absent,
    /// Runs that the same campaign, version and device made, in order of their numbers.
    Usable(Vec<RunRow>),
    /// Runs that do not go together with those of this writer, and why.
    Unusable(String),
}

/// Writes the finished runs of an unfinished shard, sorted by run, in the place of what was kept of it before.
///
/// # Errors
/// If the file cannot be written.
pub fn write_partial(
    results: &Path,
    shard: u32,
    schema: &RunsSchema,
    mut rows: Vec<RunRow>,
    provenance: &Provenance,
) -> Result<()> {
    rows.sort_by_key(|row| row.run);
    rows.dedup_by_key(|row| row.run);
    let table = schema.table(&rows);
    let mut metadata = provenance.metadata(PARTIAL_SCHEMA);
    metadata.push(("softdock.shard".to_owned(), shard.to_string()));
    metadata.push(("softdock.content_hash".to_owned(), content_hash(&table)));
    write_table(&partial_path(results, shard), &table, &metadata)
}

/// Reads an unfinished shard; only runs that are `wanted` are given back.
///
/// A shard states one version, backend and device: rows of another one are unusable. All CPUs give equal rows.
pub fn read_partial(
    results: &Path,
    shard: u32,
    wanted: impl Fn(u64) -> bool,
    schema: &RunsSchema,
    own: &Provenance,
) -> PartialShard {
    let path = partial_path(results, shard);
    if !path.is_file() {
        return PartialShard::Absent;
    }
    let read = || -> std::result::Result<Vec<RunRow>, String> {
        let reader = TableReader::open(&path).map_err(|error| error.to_string())?;
        let metadata = reader.metadata();
        let text = |key: &str| metadata.get(&format!("softdock.{key}")).cloned().unwrap_or_default();
        let shard = shard.to_string();
        let device = if own.backend == "cpu" { text("device") } else { own.device.clone() };
        let expected = [("schema", PARTIAL_SCHEMA), ("shard", &shard), ("backend", &own.backend), ("device", &device)];
        if let Some((key, value)) = expected.into_iter().find(|(key, value)| text(key) != *value) {
            return Err(format!("{key} is `{}`, expected `{value}`", text(key)));
        }
        own.origin.differs(&metadata).map_or(Ok(()), Err)?;
        let table = reader.read().map_err(|error| error.to_string())?;
        if content_hash(&table) != text("content_hash") {
            return Err("the rows do not have the hash that the file states".to_owned());
        }
        if RunsSchema::of_table(&table) != *schema {
            return Err("the columns are those of other requirements".to_owned());
        }
        Ok(schema.rows(&table)?)
    };
    match read() {
        Ok(rows) => PartialShard::Usable(rows.into_iter().filter(|row| wanted(row.run)).collect()),
        Err(reason) => PartialShard::Unusable(reason),
    }
}

/// Turns a whole shard into an unfinished one with the same rows: for a campaign that gets more runs.
///
/// The whole shard stays where it is, so that nothing is lost if the writer is killed here.
///
/// # Errors
/// If a file cannot be read or written.
pub fn reopen_shard(results: &Path, shard: u32, file: &ShardFile) -> Result<()> {
    let reader = TableReader::open(&file.path)?;
    let mut metadata: Vec<(String, String)> = reader.metadata().into_iter().collect();
    for (key, value) in &mut metadata {
        if key == "softdock.schema" {
            PARTIAL_SCHEMA.clone_into(value);
        }
    }
    write_table(&partial_path(results, shard), &reader.read()?, &metadata)
}

/// Removes an unfinished shard, and the folder with the last of them; one that is not there is no error.
///
/// # Errors
/// If the file cannot be removed.
pub fn remove_partial(results: &Path, shard: u32) -> Result<()> {
    let path = partial_path(results, shard);
    match fs::remove_file(&path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(ResultsError::write(&path)(error)),
        _ => {}
    }
    // Fails while other files lie in it, and that is right.
    let _ = fs::remove_dir(results.join("partial"));
    Ok(())
}

/// Number of runs in the unfinished shards of a results folder; damaged files count for none.
///
/// # Errors
/// If the folder cannot be read.
pub fn partial_runs(results: &Path) -> Result<u64> {
    let files = parquet_files(&results.join("partial"))?;
    Ok(files.iter().filter_map(|path| TableReader::open(path).ok()).map(|reader| reader.rows()).sum())
}
