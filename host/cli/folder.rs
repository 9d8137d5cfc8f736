//! A results folder: which campaign it belongs to, with that campaign's files beside the results.
//!
//! `campaign.json` states which; `campaign/` holds the files, so that the folder can be judged, replayed and moved
//! to another machine on its own. A table of given cases lies beside them as `cases.csv` or `cases.parquet`.

use crate::changes::{FileChange, JudgedFiles, changed_files, files_below, listed};
use crate::words::{explain, json, refuse, warn};
use miette::IntoDiagnostic;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use softdock_analysis::{CampaignFacts, Extension, InvalidRuns, Judge, Judgement};
use softdock_campaign::Campaign;
use softdock_campaign::campaign::{Invalid, Method};
use softdock_results::partial::reopen_shard;
use softdock_results::shards::{Origin, ShardIndex, ShardPlan, rewrite_runs, run_files};
use softdock_results::{TableReader, remove_abandoned, write_file};
use std::path::{Component, Path, PathBuf};

/// Version of `campaign.json`.
const SCHEMA: &str = "results/4";

/// Files that follow from all runs together.
const DERIVED: [&str; 6] =
    ["summary.json", "report.html", "parity.parquet", "half_step.parquet", "compare.json", "compare.html"];

/// The build that has made the runs of a folder.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Build {
    /// Version of softdock.
    pub(crate) version: String,
    /// The commit that it was built from.
    pub(crate) commit: String,
}

impl Build {
    /// This program.
    pub(crate) fn own() -> Self {
        Self { version: env!("CARGO_PKG_VERSION").to_owned(), commit: env!("SOFTDOCK_COMMIT").to_owned() }
    }
}

impl std::fmt::Display for Build {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "softdock {} (commit {})", self.version, self.commit)
    }
}

/// Runs that are to be judged by another state of their campaign.
#[derive(Clone, Debug)]
pub(crate) struct Rejudged {
    /// Hash of the campaign by which they are judged now.
    pub(crate) before: String,
    /// What differs; `None` if nothing does, or if the record has it already.
    pub(crate) changes: Option<Vec<String>>,
}

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
    /// What has made the runs.
    pub(crate) build: Build,
    /// When the campaign got more runs, in order of time.
    pub(crate) extensions: Vec<Extension>,
    /// When the runs were judged anew, in order of time.
    pub(crate) judgements: Vec<Judgement>,
}

impl Folder {
    /// Takes a folder for a campaign: an empty one gets the campaign's files, one of another campaign is refused.
    ///
    /// A folder of the same campaign with fewer runs is extended. What killed writers left in it is cleared away.
    pub(crate) fn claim(path: &Path, campaign: Campaign) -> miette::Result<Self> {
        Self::claim_recorded(path, campaign, Vec::new(), Vec::new())
    }

    fn claim_recorded(
        path: &Path,
        campaign: Campaign,
        extensions: Vec<Extension>,
        judgements: Vec<Judgement>,
    ) -> miette::Result<Self> {
        let files = named_files(&campaign);
        let name_of =
            |path: &Path| files.iter().find(|(_, other)| *other == normal(path)).map(|(name, _)| name.clone());
        let (file, model) = (files[0].0.clone(), campaign.model.as_deref().and_then(name_of));
        let build = Build::own();
        let mut folder = Self { path: path.to_owned(), file, model, campaign, build, extensions, judgements };
        let found = read_manifest(path)?;
        refuse_half_judged(path, found.as_ref())?;
        if let Some(found) = &found {
            (folder.extensions, folder.judgements) = (extensions_of(found), judgements_of(found));
            folder.build = build_of(found);
        }
        let is_alike = |found: &Value| with_runs(found, 0) == with_runs(&folder.manifest(), 0);
        if found.as_ref().is_some_and(is_alike) {
            folder.refuse_other_build()?;
        }
        match found {
            Some(found) if found == folder.manifest() => drop(remove_abandoned(path).into_diagnostic()?),
            Some(found) if with_runs(&found, 0) == with_runs(&folder.manifest(), 0) => {
                folder.extend(found["runs"].as_u64().unwrap_or(0))?;
            }
            Some(found) => return Err(folder.other(path, &found)),
            None => {
                folder.refuse_strangers()?;
                folder.write_files()?;
                if let Some(cases) = folder.campaign.cases() {
                    write_file(&path.join(cases.file_name()), cases.bytes()).into_diagnostic()?;
                }
                folder.write_manifest()?;
            }
        }
        Ok(folder)
    }

    /// Refuses to make or judge runs beside those that another build has made.
    fn refuse_other_build(&self) -> miette::Result<()> {
        let own = Build::own();
        if self.build == own {
            return Ok(());
        }
        let message = format!(
            "`{}` holds runs that {} has made, and this is {own}: runs of two builds do not go together",
            self.path.display(),
            self.build
        );
        let remedy = "write --fresh to make all runs again here, --out DIR for a folder of its own, or use that build; \
                      `softdock status`, `report` and `verify` read them as they are";
        Err(refuse(message, remedy))
    }

    /// Keeps the campaign's files below `campaign/`.
    fn write_files(&self) -> miette::Result<()> {
        for (name, file) in named_files(&self.campaign) {
            let bytes = softdock_input::read(&file, softdock_input::MAX_BINARY).into_diagnostic()?;
            write_file(&self.path.join("campaign").join(name), &bytes).into_diagnostic()?;
        }
        Ok(())
    }

    fn write_manifest(&self) -> miette::Result<()> {
        write_manifest(&self.path, &self.manifest())
    }

    /// Opens a folder to judge its runs by `campaign`, of whose files `changes` are reported.
    ///
    /// # Errors
    /// If the folder cannot be read, or its runs would not be those of the campaign: with the keys that differ.
    pub(crate) fn open_to_judge(path: &Path, campaign: Campaign) -> miette::Result<(Self, Option<Rejudged>)> {
        let remedy = "name a folder that `softdock run` has written";
        let nothing = || refuse(format!("`{}` is no results folder", path.display()), remedy);
        let manifest = read_manifest(path)?.ok_or_else(nothing)?;
        let number = |key: &str| manifest[key].as_u64().ok_or_else(nothing);
        let campaign = campaign.with_sample(number("runs")?, number("seed")?);
        let campaign = match manifest["cases"].as_str() {
            Some(cases) => campaign.with_cases(crate::cases::read(&path.join(cases))?).map_err(explain)?,
            None => campaign,
        };
        let files = named_files(&campaign);
        let model = campaign.model.as_deref().map(normal);
        let name = |path: &Path| files.iter().find(|(_, other)| other == path).map(|(name, _)| name.clone());
        let folder = Self {
            path: path.to_owned(),
            file: files[0].0.clone(),
            model: model.as_deref().and_then(name),
            build: build_of(&manifest),
            extensions: extensions_of(&manifest),
            judgements: judgements_of(&manifest),
            campaign,
        };
        folder.refuse_other_build()?;
        let own = |key: &str| manifest[key].as_str().unwrap_or_default().to_owned();
        let (before, after) = (own("hash"), folder.campaign.hash.clone());
        if let Some(interrupted) = manifest["judging"].as_str() {
            if before == after {
                return Ok((folder, Some(Rejudged { before: interrupted.to_owned(), changes: None })));
            }
            let message =
                format!("the judgement of `{}` by another state of the campaign was interrupted", path.display());
            return Err(refuse(message, "complete it first: name the campaign file of that state"));
        }
        if before == after {
            return Ok((folder, None));
        }
        let changes = folder.changes_from(&manifest);
        let is_whole_there = own("id") == folder.campaign.id;
        let making = folder.making_runs(&changes);
        if !is_whole_there || !making.is_empty() || changes.is_empty() {
            let mut lines = listed(&making);
            if !is_whole_there {
                lines.insert(0, format!("id: \"{}\" -> \"{}\"", own("id"), folder.campaign.id));
            }
            if lines.is_empty() {
                lines.push("no key and no file: another version of softdock has made the results".to_owned());
            }
            let message = format!(
                "the runs of `{}` cannot be judged by this campaign; what changes the runs themselves:\n  {}",
                path.display(),
                lines.join("\n  ")
            );
            let remedy = "put these values back, or make the runs with `softdock run` in a folder of its own: criteria of \
                          [task], [[metric]] and [[requirement]] are judged again";
            return Err(refuse(message, remedy));
        }
        Ok((folder, Some(Rejudged { before, changes: Some(listed(&changes)) })))
    }

    /// Judges the folder's runs by its campaign: rewrites every file of runs, the campaign's files and the record.
    ///
    /// If this is interrupted, the folder says so, and the same command completes it: no run is lost.
    pub(crate) fn rejudge(&mut self, rejudged: Rejudged) -> miette::Result<()> {
        remove_abandoned(&self.path).into_diagnostic()?;
        let (before, after) = (rejudged.before, self.campaign.hash.clone());
        let files = run_files(&self.path).into_diagnostic()?;
        if let Some((path, hash)) = files.iter().find(|(_, hash)| *hash != before && *hash != after) {
            let message = format!("`{}` belongs to another campaign (hash `{hash}`)", path.display());
            return Err(refuse(message, "move the file away; `softdock run` makes its runs again"));
        }
        if let Some(changes) = rejudged.changes {
            self.judgements.push(Judgement { hash_before: before.clone(), hash_after: after.clone(), changes });
        }
        let mut manifest = self.manifest();
        manifest["judging"] = json!(before);
        write_manifest(&self.path, &manifest)?;
        let inside = normal(&self.path.join("campaign"));
        let is_own = named_files(&self.campaign).iter().any(|(_, file)| file.starts_with(&inside));
        if !is_own {
            remove_folder(&inside)?;
            self.write_files()?;
        }
        let judge = Judge::of(&self.campaign);
        let schema = judge.schema();
        let texts = [("campaign_hash", after.as_str())];
        for (path, _) in files.iter().filter(|(_, hash)| *hash == before) {
            rewrite_runs(path, &schema, &texts, |row| judge.judge(row)).into_diagnostic()?;
        }
        self.remove_derived()?;
        self.write_manifest()
    }

    /// Removes what follows from all runs together: summary, page, time histories, repeated runs.
    fn remove_derived(&self) -> miette::Result<()> {
        for name in DERIVED {
            remove(&self.path.join(name))?;
        }
        remove_folder(&self.path.join("traces"))
    }

    /// What differs between the files that a folder keeps and those of this campaign.
    fn changes_from(&self, found: &Value) -> Vec<FileChange> {
        let there = files_below(&self.path.join("campaign"));
        let file = found["campaign"].as_str().unwrap_or(&self.file);
        changed_files((file, &there), (&self.file, &named_files(&self.campaign)))
    }

    /// The changes that other runs would follow from.
    fn making_runs(&self, changes: &[FileChange]) -> Vec<FileChange> {
        let scenario = normal(self.campaign.scenario.file());
        let files = named_files(&self.campaign);
        let scenario = files.iter().find(|(_, file)| *file == scenario).map_or("", |(name, _)| name.as_str());
        let judged = JudgedFiles { campaign: &self.file, scenario };
        changes.iter().filter(|change| !change.leaves_runs(judged)).cloned().collect()
    }

    /// Gives the folder's campaign more runs: whole shards stay, the last one is completed if it was not full.
    ///
    /// What follows from all runs together (summary, page, time histories, repeated runs) is removed, to be made anew.
    fn extend(&mut self, before: u64) -> miette::Result<()> {
        let (after, shown) = (self.campaign.runs, self.path.display());
        if after < before {
            let message = format!("`{shown}` holds a campaign of {before} runs, and {after} are asked for");
            let remedy = format!("write --runs {before} or more, or --out DIR for a folder of {after} runs of its own");
            return Err(refuse(message, remedy));
        }
        if let Some(reason) = self.campaign.draws_depend_on_runs() {
            let message = format!("`{shown}` cannot go from {before} to {after} runs: {reason}");
            let remedy = "write --out DIR to make all runs anew in a folder of its own, or --fresh to start over here";
            return Err(refuse(message, remedy));
        }
        let old = Self { campaign: self.campaign.clone().with_sample(before, self.campaign.seed), ..self.alike() };
        let (index, last) = (old.shards()?, before / old.plan().shard_runs.max(1));
        let last = index.complete.get(&(last as u32)).map(|file| (last as u32, file));
        if let Some((shard, file)) = last {
            reopen_shard(&self.path, shard, file).into_diagnostic()?;
        }
        self.remove_derived()?;
        self.extensions.push(Extension { runs_before: before, runs_after: after });
        self.write_manifest()?;
        if let Some((_, file)) = last {
            remove(&file.path)?;
        }
        warn(format!(
            "{}  extended from {before} to {after} runs (recorded in campaign.json). If the verdict seen so far led to \
             this, it is optional stopping: the stated confidence does not hold",
            self.campaign.id
        ));
        Ok(())
    }

    /// The same folder, without its runs.
    fn alike(&self) -> Self {
        Self {
            path: self.path.clone(),
            campaign: self.campaign.clone(),
            file: self.file.clone(),
            model: self.model.clone(),
            build: self.build.clone(),
            extensions: self.extensions.clone(),
            judgements: self.judgements.clone(),
        }
    }

    /// Opens a folder by the campaign files that it holds.
    pub(crate) fn open(path: &Path) -> miette::Result<Self> {
        let remedy = "name a folder that `softdock run` has written";
        let nothing = || refuse(format!("`{}` is no results folder", path.display()), remedy);
        let manifest = read_manifest(path)?.ok_or_else(nothing)?;
        refuse_half_judged(path, Some(&manifest))?;
        let file = manifest["campaign"].as_str().ok_or_else(nothing)?.to_owned();
        let model = manifest["model"].as_str().map(str::to_owned);
        let inside = |file: &String| path.join("campaign").join(file);
        let whole = Campaign::load_with(&inside(&file), model.as_ref().map(inside).as_deref()).map_err(explain)?;
        let variant = whole.variants.iter().find(|variant| manifest["id"] == variant.campaign.id.as_str());
        let campaign = variant.map_or_else(|| whole.clone(), |variant| variant.campaign.clone());
        let number = |key: &str| manifest[key].as_u64().ok_or_else(nothing);
        let campaign = campaign.with_sample(number("runs")?, number("seed")?);
        let campaign = match manifest["cases"].as_str() {
            Some(cases) => campaign.with_cases(crate::cases::read(&path.join(cases))?).map_err(explain)?,
            None => campaign,
        };
        let (extensions, judgements) = (extensions_of(&manifest), judgements_of(&manifest));
        let build = build_of(&manifest);
        let folder = Self { path: path.to_owned(), campaign, file, model, build, extensions, judgements };
        if folder.manifest() == manifest {
            return Ok(folder);
        }
        let message = format!("the campaign files in `{}` were changed after the runs", path.display());
        Err(refuse(message, "put the files back, or run the changed campaign into a folder of its own"))
    }

    /// Takes `path` for the same campaign as this folder.
    pub(crate) fn claim_alike(&self, path: &Path) -> miette::Result<Self> {
        let mut folder =
            Self::claim_recorded(path, self.campaign.clone(), self.extensions.clone(), self.judgements.clone())?;
        folder.file.clone_from(&self.file);
        folder.model.clone_from(&self.model);
        Ok(folder)
    }

    /// Refuses a folder of another campaign.
    pub(crate) fn same_campaign(&self, other: &Self) -> miette::Result<()> {
        let found = without_records(other.manifest());
        if found == without_records(self.manifest()) { Ok(()) } else { Err(self.other(&other.path, &found)) }
    }

    /// Runs and how they are cut.
    pub(crate) fn plan(&self) -> ShardPlan {
        ShardPlan { runs: self.campaign.runs, shard_runs: self.campaign.execution.shard_runs }
    }

    /// Numbers of the runs of a shard, ascending.
    pub(crate) fn run_numbers(&self, shard: u32) -> Vec<u64> {
        self.plan().range(shard).map(|place| self.campaign.run_at(place)).collect()
    }

    /// Which shards exist.
    pub(crate) fn shards(&self) -> miette::Result<ShardIndex> {
        ShardIndex::scan(&self.path, self.plan(), &self.origin()).into_diagnostic()
    }

    /// What the campaign's rows have in common.
    pub(crate) fn origin(&self) -> Origin {
        self.facts().origin()
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
            version: &self.build.version,
            commit: &self.build.commit,
            plan: self.plan(),
            invalid: match c.execution.invalid {
                Invalid::CountAsFailure => InvalidRuns::CountAsFailures,
                Invalid::ReportOnly => InvalidRuns::ReportOnly,
            },
            independent_runs: c.method == Method::Random && c.cases().is_none(),
            given_cases: c.cases().is_some(),
            extensions: &self.extensions,
            judgements: &self.judgements,
            requirements: &c.requirements,
            agreement: &c.agreement,
        }
    }

    fn manifest(&self) -> Value {
        let c = &self.campaign;
        let (id, file, hash) = (&c.id, &self.file, &c.hash);
        let mut all =
            json!({ "schema": SCHEMA, "id": id, "campaign": file, "hash": hash, "seed": c.seed, "runs": c.runs });
        all["made_by"] = json!(self.build);
        if let Some(model) = &self.model {
            all["model"] = json!(model);
        }
        if let Some(cases) = c.cases() {
            all["cases"] = json!(cases.file_name());
            all["cases_hash"] = json!(cases.hash());
        }
        if !self.extensions.is_empty() {
            all["extensions"] = json!(self.extensions);
        }
        if !self.judgements.is_empty() {
            all["judgements"] = json!(self.judgements);
        }
        all
    }

    /// Names every key in which the campaign of a folder differs from this one.
    fn other(&self, path: &Path, found: &Value) -> miette::Report {
        let own = self.manifest();
        let differs = |key: &&str| own[*key] != found[*key];
        let state = if differs(&"id") { "another campaign" } else { "another state of this campaign" };
        let value = |value: &Value| if value.is_null() { "(none)".to_owned() } else { value.to_string() };
        let keys = ["id", "seed", "runs", "model", "cases"].into_iter().filter(differs);
        let mut lines: Vec<String> =
            keys.map(|key| format!("{key}: {} -> {}", value(&found[key]), value(&own[key]))).collect();
        if !differs(&"cases") && differs(&"cases_hash") {
            lines.push(format!("{}: the tables of cases differ", found["cases"].as_str().unwrap_or("cases")));
        }
        let there = Self { path: path.to_owned(), ..self.alike() };
        let changes = there.changes_from(found);
        let is_judgement = lines.is_empty() && !changes.is_empty() && self.making_runs(&changes).is_empty();
        lines.extend(listed(&changes));
        if lines.is_empty() {
            lines.push("no key and no file: another version of softdock has made the results".to_owned());
        }
        let message =
            format!("`{}` holds the results of {state}; what differs:\n  {}", path.display(), lines.join("\n  "));
        let more_runs = lines.iter().any(|line| line.starts_with(&format!("{}: runs: ", self.file)));
        let extend = if more_runs { "; --runs N gives an unchanged campaign more runs" } else { "" };
        if is_judgement {
            let file = self.campaign.files()[0].display();
            let remedy = format!(
                "no run depends on these: `softdock judge {} {file}` judges the runs by them; or write --out DIR for a \
                 folder of its own",
                path.display()
            );
            return refuse(message, remedy);
        }
        let remedy = format!(
            "put the old values back (`{}` keeps the files), write --out DIR for a folder of its own, or --fresh to \
             start over{extend}",
            path.join("campaign").display()
        );
        refuse(message, remedy)
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

/// A state of `campaign.json` with another number of runs.
fn with_runs(manifest: &Value, runs: u64) -> Value {
    let mut manifest = manifest.clone();
    manifest["runs"] = json!(runs);
    manifest
}

/// `campaign.json` without the records of extensions and judgements.
fn without_records(mut manifest: Value) -> Value {
    if let Some(keys) = manifest.as_object_mut() {
        keys.remove("extensions");
        keys.remove("judgements");
    }
    manifest
}

fn write_manifest(folder: &Path, manifest: &Value) -> miette::Result<()> {
    write_file(&folder.join("campaign.json"), (json(manifest) + "\n").as_bytes()).into_diagnostic()
}

/// Refuses a folder of which some runs are judged by another campaign than the others.
fn refuse_half_judged(path: &Path, manifest: Option<&Value>) -> miette::Result<()> {
    if manifest.is_none_or(|manifest| manifest["judging"].is_null()) {
        return Ok(());
    }
    let message = format!("the judgement of the runs in `{}` was interrupted", path.display());
    Err(refuse(message, format!("complete it with the campaign file: softdock judge {} CAMPAIGN", path.display())))
}

/// Id of the campaign whose runs a folder holds.
pub(crate) fn id_of(path: &Path) -> miette::Result<String> {
    let manifest = read_manifest(path)?;
    let id = manifest.as_ref().and_then(|manifest| manifest["id"].as_str()).map(str::to_owned);
    let nothing =
        || refuse(format!("`{}` is no results folder", path.display()), "name one that `softdock run` has written");
    id.ok_or_else(nothing)
}

/// The build that has made the runs of a folder; this one where there is no folder yet.
pub(crate) fn build_of_folder(path: &Path) -> miette::Result<Build> {
    Ok(read_manifest(path)?.map_or_else(Build::own, |manifest| build_of(&manifest)))
}

/// Extensions and judgements that a results folder records; none where there is no folder.
pub(crate) fn records(path: &Path) -> miette::Result<(Vec<Extension>, Vec<Judgement>)> {
    let manifest = read_manifest(path)?.unwrap_or_default();
    Ok((extensions_of(&manifest), judgements_of(&manifest)))
}

/// The build that a manifest states; one without is of no build that is known.
fn build_of(manifest: &Value) -> Build {
    let unknown = || Build { version: "unknown".to_owned(), commit: "unknown".to_owned() };
    serde_json::from_value(manifest["made_by"].clone()).unwrap_or_else(|_| unknown())
}

fn judgements_of(manifest: &Value) -> Vec<Judgement> {
    serde_json::from_value(manifest["judgements"].clone()).unwrap_or_default()
}

fn extensions_of(manifest: &Value) -> Vec<Extension> {
    serde_json::from_value(manifest["extensions"].clone()).unwrap_or_default()
}

/// Removes a folder with all that is in it; one that is not there is no error.
fn remove_folder(path: &Path) -> miette::Result<()> {
    if path.is_dir() { std::fs::remove_dir_all(path).into_diagnostic() } else { Ok(()) }
}

/// Removes a file; one that is not there is no error.
fn remove(path: &Path) -> miette::Result<()> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(refuse(format!("{}: {error}", path.display()), "check the permissions of the folder"))
        }
        _ => Ok(()),
    }
}

/// The files of a campaign, its own first: name below `campaign/`, and path.
pub(crate) fn named_files(campaign: &Campaign) -> Vec<(String, PathBuf)> {
    let files: Vec<PathBuf> = campaign.files().iter().map(|file| normal(file)).collect();
    let root = common_root(&files);
    files.into_iter().map(|file| (slashed(file.strip_prefix(&root).unwrap_or(&file)), file)).collect()
}

fn read_manifest(folder: &Path) -> miette::Result<Option<Value>> {
    let Some(parsed) = softdock_campaign::manifest::read(folder, SCHEMA).map_err(explain)? else { return Ok(None) };
    if parsed["schema"] == SCHEMA {
        return Ok(Some(parsed));
    }
    let message = format!(
        "`{}` holds results of the format {}, and this version of softdock reads \"{SCHEMA}\"",
        folder.display(),
        parsed["schema"]
    );
    let remedy =
        "run the campaign again with another `--out DIR`, or delete the folder; the version that wrote it reads it";
    Err(refuse(message, remedy))
}

/// The path from the root, without `.` and `..`.
pub(crate) fn normal(path: &Path) -> PathBuf {
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
