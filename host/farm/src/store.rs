//! Results folders in S3-compatible object stores: the campaign and its runs, never what is computed from them.
//!
//! Every object is written once (put-if-absent). Two workers that push the same shard write equal bytes, since runs do
//! not depend on who makes them; unequal bytes are an error and change nothing.

use crate::error::{FarmError, Result, writing};
use crate::folder::ResultsFolder;
use crate::observer::Context;
use crate::paths::files_below;
use object_store::aws::{AmazonS3, AmazonS3Builder};
use object_store::path::Path as ObjectPath;
use object_store::{ObjectStore, ObjectStoreExt, PutMode, PutOptions, PutPayload};
use softdock_results::write_file;
use std::path::{Path, PathBuf};

/// Largest object that is read \[bytes\].
const MAX_OBJECT: u64 = 1 << 30;

/// What a push or a pull has done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Transfer {
    /// Files that were written.
    pub written: usize,
    /// Files that existed with equal bytes.
    pub existing: usize,
}

/// Writes the campaign and the whole shards of a results folder to `s3://BUCKET/PREFIX`.
///
/// Address and credentials come from the environment: `AWS_ENDPOINT_URL`, `AWS_REGION`, `AWS_ACCESS_KEY_ID`,
/// `AWS_SECRET_ACCESS_KEY`; `AWS_ALLOW_HTTP=true` allows a store without TLS.
///
/// # Errors
/// If the folder is no results folder or has damaged shards, the store does not answer, or an object exists with other
/// bytes.
pub fn push(results: &Path, url: &str, context: Context) -> Result<Transfer> {
    if let Some((path, reason)) = foreign_shard(results)? {
        let message = format!("`{}` cannot be pushed: {reason}", path.display());
        return Err(FarmError::refused(message, "run the campaign again in this folder: it makes the shard again"));
    }
    let store = Store::open(url)?;
    let mut done = Transfer::default();
    for (name, path) in files_below(results).into_iter().filter(|(name, _)| is_shared(name)) {
        if context.cancel.is_cancelled() {
            return Err(FarmError::Cancelled);
        }
        let bytes = softdock_input::read(&path, MAX_OBJECT)?;
        match store.put_if_absent(&name, bytes)? {
            true => done.written += 1,
            false => done.existing += 1,
        }
    }
    Ok(done)
}

/// Reads the campaign and the shards of `s3://BUCKET/PREFIX` into a results folder; `finish_folder` judges it.
///
/// # Errors
/// If the store does not answer or has no campaign, a file exists with other bytes, or a shard is damaged.
pub fn pull(url: &str, results: &Path, context: Context) -> Result<Transfer> {
    let store = Store::open(url)?;
    let names: Vec<String> = store.names()?.into_iter().filter(|name| is_shared(name)).collect();
    if !names.iter().any(|name| name == "campaign.json") {
        let message = format!("`{url}` holds no results: there is no object `campaign.json`");
        return Err(FarmError::refused(message, "check bucket and prefix; `softdock store push DIR URL` writes one"));
    }
    let mut done = Transfer::default();
    // The manifest last: a folder whose pull was interrupted is no results folder yet.
    let (manifests, others): (Vec<String>, Vec<String>) =
        names.into_iter().partition(|name| name.ends_with("campaign.json"));
    for name in others.into_iter().chain(manifests.into_iter().rev()) {
        if context.cancel.is_cancelled() {
            return Err(FarmError::Cancelled);
        }
        let (path, bytes) = (results.join(&name), store.get(&name)?);
        if path.exists() {
            if softdock_input::read(&path, MAX_OBJECT)? != bytes {
                let message = format!("`{}` differs from the object `{name}`", path.display());
                return Err(FarmError::refused(message, "pull into a folder of its own"));
            }
            done.existing += 1;
            continue;
        }
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(writing(folder))?;
        }
        write_file(&path, &bytes)?;
        done.written += 1;
    }
    if let Some((path, reason)) = foreign_shard(results)? {
        let message = format!("`{}` is damaged or foreign: {reason}", path.display());
        return Err(FarmError::refused(message, "push the shard again from where it was made, to another prefix"));
    }
    Ok(done)
}

/// The first damaged or foreign file among the shards of a results folder, with the reason.
fn foreign_shard(results: &Path) -> Result<Option<(PathBuf, String)>> {
    for folder in ResultsFolder::open(results)?.with_runs()?.into_iter().filter(|folder| folder.path.is_dir()) {
        if let Some(foreign) = folder.shards()?.foreign.into_iter().next() {
            return Ok(Some(foreign));
        }
    }
    Ok(None)
}

/// Whether a name below a results folder is one of the campaign or of a whole shard, in the folder or in one of its
/// variants.
fn is_shared(name: &str) -> bool {
    let parts: Vec<&str> = name.split('/').collect();
    let is_plain = |part: &&str| !part.is_empty() && !part.starts_with('.') && !part.contains(['\\', ':']);
    if !parts.iter().all(is_plain) {
        return false;
    }
    let is_own = |parts: &[&str]| match parts {
        ["campaign.json" | "cases.csv" | "cases.parquet"] => true,
        ["campaign", _, ..] => true,
        ["runs", file] => file.starts_with("shard=") && file.ends_with(".parquet"),
        _ => false,
    };
    is_own(&parts) || is_own(&parts[1..])
}

/// A prefix of a bucket.
struct Store {
    store: AmazonS3,
    prefix: ObjectPath,
    url: String,
    runtime: tokio::runtime::Runtime,
}

impl Store {
    fn open(url: &str) -> Result<Self> {
        let refuse = |why: &dyn std::fmt::Display| {
            FarmError::refused(
                format!("`{url}` is no object store: {why}"),
                "write s3://BUCKET/PREFIX, and set AWS_ENDPOINT_URL, AWS_REGION, AWS_ACCESS_KEY_ID and \
                 AWS_SECRET_ACCESS_KEY",
            )
        };
        let (bucket, prefix) = url
            .strip_prefix("s3://")
            .and_then(|rest| rest.split_once('/'))
            .filter(|(bucket, prefix)| !bucket.is_empty() && !prefix.is_empty())
            .ok_or_else(|| refuse(&"bucket or prefix is missing"))?;
        let store = AmazonS3Builder::from_env().with_bucket_name(bucket).build().map_err(|error| refuse(&error))?;
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(|e| refuse(&e))?;
        Ok(Self { store, prefix: ObjectPath::from(prefix), url: url.to_owned(), runtime })
    }

    fn path(&self, name: &str) -> ObjectPath {
        ObjectPath::from(format!("{}/{name}", self.prefix))
    }

    fn failed(&self, name: &str, error: &object_store::Error) -> FarmError {
        FarmError::refused(
            format!("object `{name}` of {}: {error}", self.url),
            "check the address, the credentials and the network; the same command goes on",
        )
    }

    /// Writes an object that does not exist; `false` if it exists with equal bytes.
    fn put_if_absent(&self, name: &str, bytes: Vec<u8>) -> Result<bool> {
        let options = PutOptions { mode: PutMode::Create, ..PutOptions::default() };
        let payload = PutPayload::from(bytes.clone());
        match self.runtime.block_on(self.store.put_opts(&self.path(name), payload, options)) {
            Ok(_) => Ok(true),
            Err(object_store::Error::AlreadyExists { .. }) => match self.get(name)? == bytes {
                true => Ok(false),
                false => Err(FarmError::refused(
                    format!("object `{name}` of {} exists with other bytes", self.url),
                    "push to another prefix: the objects there are of another campaign, seed, build or state",
                )),
            },
            Err(error) => Err(self.failed(name, &error)),
        }
    }

    fn get(&self, name: &str) -> Result<Vec<u8>> {
        let read = async {
            let object = self.store.get(&self.path(name)).await?;
            if object.meta.size > MAX_OBJECT {
                return Ok(None);
            }
            object.bytes().await.map(Some)
        };
        let bytes = self.runtime.block_on(read).map_err(|error| self.failed(name, &error))?;
        bytes.map(|bytes| bytes.to_vec()).ok_or_else(|| {
            FarmError::refused(
                format!("object `{name}` of {} is larger than {MAX_OBJECT} bytes", self.url),
                "remove it: no file of a results folder is as large",
            )
        })
    }

    /// Names of all objects below the prefix.
    fn names(&self) -> Result<Vec<String>> {
        let (mut open, mut names) = (vec![self.prefix.clone()], Vec::new());
        while let Some(folder) = open.pop() {
            let listed = self.runtime.block_on(self.store.list_with_delimiter(Some(&folder)));
            let listed = listed.map_err(|error| self.failed(folder.as_ref(), &error))?;
            open.extend(listed.common_prefixes);
            let below = |path: &ObjectPath| path.as_ref().strip_prefix(self.prefix.as_ref()).map(str::to_owned);
            names.extend(listed.objects.iter().filter_map(|object| below(&object.location)));
        }
        let mut names: Vec<String> = names.iter().map(|name| name.trim_start_matches('/').to_owned()).collect();
        names.sort();
        Ok(names)
    }
}

#[cfg(test)]
mod tests {
    use super::is_shared;

    #[test]
    fn campaign_and_whole_shards_are_shared_and_nothing_else() {
        let shared = ["campaign.json", "campaign/smoke.toml", "campaign/scenarios/a.toml", "runs/shard=00001.parquet"];
        let variants = ["none/campaign.json", "none/runs/shard=00000.parquet", "smith/campaign/x.toml"];
        for name in shared.iter().chain(&variants) {
            assert!(is_shared(name), "{name}");
        }
        let others = [
            "summary.json",
            "report.html",
            ".lock",
            "runs/shard=00001.parquet.damaged-1",
            "partial/shard=00001.parquet",
            "campaign/../../etc/passwd",
            "campaign/.hidden",
            "runs/a/shard=00001.parquet",
            "",
        ];
        for name in others {
            assert!(!is_shared(name), "{name}");
        }
    }
}
