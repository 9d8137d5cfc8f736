//! A results folder: which campaign it belongs to, with that campaign's files beside the results.
//!
//! `campaign.json` says which; `campaign/` holds the files, so that the folder can be judged, replayed and moved
//! to another machine on its own.

use crate::words::{explain, json, refuse};
use miette::IntoDiagnostic;
use serde_json::{Value, json};
use softdock_analysis::{CampaignFacts, InvalidRuns};
use softdock_campaign::Campaign;
use softdock_campaign::campaign::{Invalid, Method};
use softdock_results::shards::{ShardIndex, ShardPlan};
use softdock_results::{TableReader, remove_abandoned, write_file};
use std::path::{Component, Path, PathBuf};

/// Version of `campaign.json`.
const SCHEMA: &str = "results/1";

/// Version of softdock, as the files state it.
pub(crate) const VERSION: &str = env!("CARGO_PKG_VERSION");

/// A results folder and its campaign.
pub(crate) struct Folder {
    /// Where the results lie.
    pub(crate) path: PathBuf,
    /// The campaign, with the folder's seed and number of runs.
    pub(crate) campaign: Campaign,
    /// The campaign's file below `campaign/`.
    pub(crate) file: String,
    /// Likewise the scenario in the place of the campaign's own.
    pub(crate) model: Option<String>,
}

impl Folder {
    /// Takes a folder for a campaign: an empty one gets the campaign's files, one of another campaign is refused.
    ///
    /// What killed writers left in it is cleared away.
    pub(crate) fn claim(path: &Path, campaign: Campaign) -> miette::Result<Self> {
        let files: Vec<PathBuf> = campaign.files().iter().map(|file| normal(file)).collect();
        let root = common_root(&files);
        let within = |file: &Path| slashed(file.strip_prefix(&root).unwrap_or(file));
        let model = campaign.model.as_ref().map(|model| within(&normal(model)));
        let folder = Self { path: path.to_owned(), file: within(&files[0]), model, campaign };
        match read_manifest(path)? {
            Some(found) if found == folder.manifest() => drop(remove_abandoned(path).into_diagnostic()?),
            Some(found) => return Err(folder.other(path, &found)),
            None => {
                folder.refuse_strangers()?;
                for file in &files {
                    let bytes = std::fs::read(file).into_diagnostic()?;
                    write_file(&path.join("campaign").join(within(file)), &bytes).into_diagnostic()?;
                }
                let manifest = json(&folder.manifest()) + "\n";
                write_file(&path.join("campaign.json"), manifest.as_bytes()).into_diagnostic()?;
            }
        }
        Ok(folder)
    }

    /// Opens a folder by the campaign files that it holds.
    pub(crate) fn open(path: &Path) -> miette::Result<Self> {
        let remedy = "name a folder that `softdock run` has written";
        let nothing = || refuse(format!("`{}` is no results folder", path.display()), remedy);
        let manifest = read_manifest(path)?.ok_or_else(nothing)?;
        let file = manifest["campaign"].as_str().ok_or_else(nothing)?.to_owned();
        let model = manifest["model"].as_str().map(str::to_owned);
        let inside = |file: &String| path.join("campaign").join(file);
        let whole = Campaign::load_with(&inside(&file), model.as_ref().map(inside).as_deref()).map_err(explain)?;
        let variant = whole.variants.iter().find(|variant| manifest["id"] == variant.campaign.id.as_str());
        let campaign = variant.map_or_else(|| whole.clone(), |variant| variant.campaign.clone());
        let number = |key: &str| manifest[key].as_u64().ok_or_else(nothing);
        let campaign = campaign.with_sample(number("runs")?, number("seed")?);
        let folder = Self { path: path.to_owned(), campaign, file, model };
        if folder.manifest() == manifest {
            return Ok(folder);
        }
        let message = format!("the campaign files in `{}` were changed after the runs", path.display());
        Err(refuse(message, "put the files back, or run the changed campaign into a folder of its own"))
    }

    /// Takes `path` for the same campaign as this folder.
    pub(crate) fn claim_alike(&self, path: &Path) -> miette::Result<Self> {
        let mut folder = Self::claim(path, self.campaign.clone())?;
        folder.file.clone_from(&self.file);
        folder.model.clone_from(&self.model);
        Ok(folder)
    }

    /// Refuses a folder of another campaign.
    pub(crate) fn same_campaign(&self, other: &Self) -> miette::Result<()> {
        let found = other.manifest();
        if found == self.manifest() { Ok(()) } else { Err(self.other(&other.path, &found)) }
    }

    /// Runs and how they are cut.
    pub(crate) fn plan(&self) -> ShardPlan {
        ShardPlan { runs: self.campaign.runs, shard_runs: self.campaign.execution.shard_runs }
    }

    /// Which shards exist.
    pub(crate) fn shards(&self) -> miette::Result<ShardIndex> {
        ShardIndex::scan(&self.path, self.plan(), &self.campaign.hash, self.campaign.seed).into_diagnostic()
    }

    /// The campaign as the analysis looks at it.
    pub(crate) fn facts(&self) -> CampaignFacts<'_> {
        let c = &self.campaign;
        CampaignFacts {
            id: &c.id,
            title: &c.title,
            text: &c.text,
            hash: &c.hash,
            seed: c.seed,
            version: VERSION,
            plan: self.plan(),
            invalid: match c.execution.invalid {
                Invalid::CountAsFailure => InvalidRuns::CountAsFailures,
                Invalid::ReportOnly => InvalidRuns::ReportOnly,
            },
            independent_runs: c.method == Method::Random,
            requirements: &c.requirements,
        }
    }

    fn manifest(&self) -> Value {
        let c = &self.campaign;
        let (id, file, hash) = (&c.id, &self.file, &c.hash);
        let mut all =
            json!({ "schema": SCHEMA, "id": id, "campaign": file, "hash": hash, "seed": c.seed, "runs": c.runs });
        if let Some(model) = &self.model {
            all["model"] = json!(model);
        }
        all
    }

    /// What to say of a folder that belongs to another campaign.
    fn other(&self, path: &Path, found: &Value) -> miette::Report {
        let (own, mut differences) = (self.manifest(), Vec::new());
        for key in ["id", "campaign", "hash", "seed", "runs"].iter().filter(|key| own[**key] != found[**key]) {
            differences.push(format!("{key} {} there, {} here", found[*key], own[*key]));
        }
        let message = format!("`{}` holds the results of another campaign: {}", path.display(), differences.join("; "));
        refuse(message, "add `--out DIR` with a folder of its own, or move the old results away")
    }

    /// Shards without `campaign.json` may still be somebody's work.
    fn refuse_strangers(&self) -> miette::Result<()> {
        let readable = |(path, _): &&(PathBuf, String)| TableReader::open(path).is_ok();
        match self.shards()?.foreign.iter().find(readable) {
            None => Ok(()),
            Some((path, reason)) => {
                let message = format!("`{}` is not of this campaign: {reason}", path.display());
                Err(refuse(message, "add `--out DIR` with a folder of its own, or move the old results away"))
            }
        }
    }
}

fn read_manifest(folder: &Path) -> miette::Result<Option<Value>> {
    let path = folder.join("campaign.json");
    if !path.is_file() {
        return Ok(None);
    }
    let text = std::fs::read_to_string(&path).into_diagnostic()?;
    let parsed = serde_json::from_str(&text);
    parsed.map(Some).map_err(|error| refuse(format!("{}: {error}", path.display()), "move the damaged folder away"))
}

/// The path from the root, without `.` and `..`.
fn normal(path: &Path) -> PathBuf {
    let mut out = PathBuf::new();
    for part in std::path::absolute(path).unwrap_or(path.to_owned()).components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir => drop(out.pop()),
            part => out.push(part),
        }
    }
    out
}

/// The deepest folder that holds all files.
fn common_root(files: &[PathBuf]) -> PathBuf {
    let mut folders = files.iter().filter_map(|file| file.parent());
    let first = folders.next().unwrap_or(Path::new("")).to_owned();
    folders.fold(first, |root, folder| {
        let shared = root.components().zip(folder.components()).take_while(|(one, two)| one == two);
        shared.map(|(one, _)| one).collect()
    })
}

/// A relative path as it is written on every system.
fn slashed(path: &Path) -> String {
    path.components().map(|part| part.as_os_str().to_string_lossy()).collect::<Vec<_>>().join("/")
}
