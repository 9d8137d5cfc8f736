//! Results folder of a campaign, with the campaign's files beside the results.
//!
//! `campaign.json` identifies the campaign. `campaign/` contains its files, so that the folder can be judged, replayed
//! and moved to another machine on its own. A table of given cases is beside them as `cases.csv` or `cases.parquet`.

use crate::changes::{FileChange, JudgedFiles, changed_files, listed};
use crate::error::{FarmError, Result, writing};
use crate::lock::{FolderLock, SHARD_LOCKS};
use crate::manifest::{Build, MANIFEST_SCHEMA, Manifest};
use crate::observer::{Context, Note};
use crate::paths::{named_below, named_files, normal};
use softdock_analysis::{CampaignFacts, Extension, InvalidRuns, Judge, Judgement};
use softdock_campaign::Campaign;
use softdock_campaign::campaign::{Invalid, Method};
use softdock_results::contact_events::CONTACT_EVENTS_FILE;
use softdock_results::partial::reopen_shard;
use softdock_results::shards::{Origin, ShardIndex, ShardPlan, rewrite_runs, run_files};
use softdock_results::{TableReader, remove_abandoned, write_file};
use std::path::{Path, PathBuf};

/// Files derived from all runs.
const DERIVED: [&str; 7] = [
    "summary.json",
    "report.html",
    "parity.parquet",
    "half_step.parquet",
    CONTACT_EVENTS_FILE,
    "compare.json",
    "compare.html",
];

/// Judgement of runs by another version of their campaign.
#[derive(Clone, Debug)]
pub(crate) struct Rejudgement {
    /// Hash of the campaign by which they are judged now.
    pub(crate) before: String,
    /// Changes; `None` if there are none, or if they are recorded already.
    pub(crate) changes: Option<Vec<String>>,
}

/// A results folder and its campaign.
pub struct ResultsFolder {
    /// Path of the folder.
    pub path: PathBuf,
    /// The campaign, with the folder's seed and number of runs.
    pub campaign: Campaign,
    /// The campaign's file below `campaign/`.
    pub file: String,
    /// Scenario below `campaign/` that replaces the campaign's own.
    pub model: Option<String>,
    /// Build that made the runs.
    pub build: Build,
    /// Extensions of the campaign, in chronological order.
    pub extensions: Vec<Extension>,
    /// Repeated judgements, in chronological order.
    pub judgements: Vec<Judgement>,
    /// Held while this process writes in the folder.
    lock: Option<FolderLock>,
}

impl ResultsFolder {
    /// Claims a folder for a campaign: writes the campaign's files into an empty folder, and rejects a folder of
    /// another campaign.
    ///
    /// A folder of the same campaign with fewer runs is extended. Temporary files of killed writers are removed. Until
    /// the value is dropped, other processes may only make runs of the same campaign there.
    ///
    /// # Errors
    /// If the folder holds results of another campaign, state or build, or another process has it for itself.
    pub fn claim(path: &Path, campaign: Campaign, context: Context) -> Result<Self> {
        Self::claim_recorded(path, campaign, (Vec::new(), Vec::new()), context)
    }

    fn claim_recorded(
        path: &Path,
        campaign: Campaign,
        (extensions, judgements): (Vec<Extension>, Vec<Judgement>),
        context: Context,
    ) -> Result<Self> {
        let mut folder = Self::of_campaign(path, campaign);
        (folder.extensions, folder.judgements) = (extensions, judgements);
        // A rejected call writes nothing, not even a lock.
        folder.compare(Manifest::read(path)?.as_ref())?;
        std::fs::create_dir_all(path).map_err(writing(path))?;
        loop {
            if let Some(lock) = FolderLock::try_alone(path)? {
                folder.take(context)?;
                folder.lock = Some(lock.share(path, context.cancel)?);
            } else {
                // Whoever has it makes runs, of this campaign if the manifests are equal.
                folder.lock = Some(FolderLock::together(path, context.cancel)?);
            }
            match (folder.compare(Manifest::read(path)?.as_ref())?, &folder.lock) {
                (Held::Same, _) => return Ok(folder),
                // The other process ended before it wrote the manifest.
                (Held::Nothing, _) => {}
                (Held::FewerRuns(_), _) => return Err(busy(path)),
            }
            folder.lock = None;
        }
    }

    /// A folder of a campaign that nothing is known of.
    fn of_campaign(path: &Path, campaign: Campaign) -> Self {
        let files = named_files(&campaign);
        let name_of = |path: &Path| files.iter().find(|file| file.path == normal(path)).map(|file| file.name.clone());
        let model = campaign.model.as_deref().and_then(name_of);
        Self {
            path: path.to_owned(),
            file: files[0].name.clone(),
            model,
            campaign,
            build: Build::own(),
            extensions: Vec::new(),
            judgements: Vec::new(),
            lock: None,
        }
    }

    /// Compares the manifest of the folder with the campaign, and adopts its records.
    fn compare(&mut self, found: Option<&Manifest>) -> Result<Held> {
        let Some(found) = found else {
            self.refuse_strangers()?;
            return Ok(Held::Nothing);
        };
        found.refuse_half_judged(&self.path)?;
        (self.extensions, self.judgements) = (found.extensions.clone(), found.judgements.clone());
        self.build = found.made_by.clone();
        let own = self.manifest();
        if found.with_runs(0) != own.with_runs(0) {
            return Err(self.other(&self.path, found));
        }
        self.refuse_other_build()?;
        match found.runs == own.runs {
            true => Ok(Held::Same),
            false => {
                self.refuse_extension(found.runs)?;
                Ok(Held::FewerRuns(found.runs))
            }
        }
    }

    /// Makes the folder one of the campaign, while this process has it alone.
    fn take(&mut self, context: Context) -> Result<()> {
        let records = (self.extensions.clone(), self.judgements.clone());
        // No process makes a shard now: existing locks are those of killed processes.
        remove_folder(&self.path.join(SHARD_LOCKS))?;
        match self.compare(Manifest::read(&self.path)?.as_ref())? {
            Held::Same => drop(remove_abandoned(&self.path)?),
            Held::FewerRuns(before) => self.extend(before, context)?,
            Held::Nothing => {
                (self.extensions, self.judgements) = records;
                self.write_files()?;
                if let Some(cases) = self.campaign.cases() {
                    write_file(&self.path.join(cases.file_name()), cases.bytes())?;
                }
                self.manifest().write(&self.path)?;
            }
        }
        Ok(())
    }

    /// Rejects making or judging runs beside those of another build.
    fn refuse_other_build(&self) -> Result<()> {
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
        Err(FarmError::refused(message, remedy))
    }

    /// Keeps the campaign's files below `campaign/`.
    fn write_files(&self) -> Result<()> {
        for file in named_files(&self.campaign) {
            write_file(&self.path.join("campaign").join(&file.name), &file.bytes()?)?;
        }
        Ok(())
    }

    /// Opens a folder for this process alone to judge its runs by `campaign`.
    ///
    /// # Errors
    /// If the folder cannot be read, another process works in it, or its runs would not be those of the campaign: with
    /// the keys that differ.
    pub(crate) fn open_to_judge(path: &Path, campaign: Campaign) -> Result<(Self, Option<Rejudgement>)> {
        Manifest::require(path)?;
        let lock = FolderLock::try_alone(path)?.ok_or_else(|| busy(path))?;
        let manifest = Manifest::require(path)?;
        let campaign = campaign.with_sample(manifest.runs, manifest.seed);
        let campaign = match manifest.cases_file(path) {
            Some(cases) => campaign.with_cases(crate::cases::read_cases(&cases)?)?,
            None => campaign,
        };
        let folder = Self {
            build: manifest.made_by.clone(),
            extensions: manifest.extensions.clone(),
            judgements: manifest.judgements.clone(),
            lock: Some(lock),
            ..Self::of_campaign(path, campaign)
        };
        folder.refuse_other_build()?;
        let (before, after) = (manifest.hash.clone(), folder.campaign.hash.clone());
        if let Some(interrupted) = &manifest.judging {
            if before == after {
                return Ok((folder, Some(Rejudgement { before: interrupted.clone(), changes: None })));
            }
            let message =
                format!("the judgement of `{}` by another state of the campaign was interrupted", path.display());
            return Err(FarmError::refused(message, "complete it first: name the campaign file of that state"));
        }
        if before == after {
            return Ok((folder, None));
        }
        let changes = folder.changes_from(&manifest);
        let is_same_id = manifest.id == folder.campaign.id;
        let making = folder.changes_of_runs(&changes);
        if !is_same_id || !making.is_empty() || changes.is_empty() {
            let mut lines = listed(&making);
            if !is_same_id {
                lines.insert(0, format!("id: \"{}\" -> \"{}\"", manifest.id, folder.campaign.id));
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
            return Err(FarmError::refused(message, remedy));
        }
        Ok((folder, Some(Rejudgement { before, changes: Some(listed(&changes)) })))
    }

    /// Judges the folder's runs by its campaign: rewrites every file of runs, the campaign's files and the record.
    ///
    /// After an interruption, the folder records it and the same command completes it: no run is lost.
    pub(crate) fn rejudge(&mut self, rejudged: Rejudgement) -> Result<()> {
        remove_abandoned(&self.path)?;
        let (before, after) = (rejudged.before, self.campaign.hash.clone());
        let files = run_files(&self.path)?;
        if let Some((path, hash)) = files.iter().find(|(_, hash)| *hash != before && *hash != after) {
            let message = format!("`{}` belongs to another campaign (hash `{hash}`)", path.display());
            return Err(FarmError::refused(message, "move the file away; `softdock run` makes its runs again"));
        }
        if let Some(changes) = rejudged.changes {
            self.judgements.push(Judgement { hash_before: before.clone(), hash_after: after.clone(), changes });
        }
        Manifest { judging: Some(before.clone()), ..self.manifest() }.write(&self.path)?;
        let inside = normal(&self.path.join("campaign"));
        let is_own = named_files(&self.campaign).iter().any(|file| file.path.starts_with(&inside));
        if !is_own {
            remove_folder(&inside)?;
            self.write_files()?;
        }
        let judge = Judge::of(&self.campaign);
        let schema = judge.schema();
        let texts = [("campaign_hash", after.as_str())];
        for (path, _) in files.iter().filter(|(_, hash)| *hash == before) {
            rewrite_runs(path, &schema, &texts, |row| judge.judge(row))?;
        }
        self.remove_derived()?;
        self.manifest().write(&self.path)
    }

    /// Removes derived files: summary, page, time histories, contact events, repeated runs.
    fn remove_derived(&self) -> Result<()> {
        for name in DERIVED {
            remove(&self.path.join(name))?;
        }
        remove_folder(&self.path.join("traces"))
    }

    /// Returns the changes between the folder's files and those of this campaign.
    fn changes_from(&self, found: &Manifest) -> Vec<FileChange> {
        let there = named_below(&self.path.join("campaign"));
        changed_files((&found.campaign, &there), (&self.file, &named_files(&self.campaign)))
    }

    /// Returns the changes that affect the runs.
    fn changes_of_runs(&self, changes: &[FileChange]) -> Vec<FileChange> {
        let scenario = normal(self.campaign.scenario.file());
        let files = named_files(&self.campaign);
        let scenario = files.iter().find(|file| file.path == scenario).map_or("", |file| file.name.as_str());
        let judged = JudgedFiles { campaign: &self.file, scenario };
        changes.iter().filter(|change| !change.leaves_runs(judged)).cloned().collect()
    }

    /// Rejects another number of runs if the existing runs would become invalid.
    fn refuse_extension(&self, before: u64) -> Result<()> {
        let (after, shown) = (self.campaign.runs, self.path.display());
        if after < before {
            let message = format!("`{shown}` holds a campaign of {before} runs, and {after} are asked for");
            let remedy = format!("write --runs {before} or more, or --out DIR for a folder of {after} runs of its own");
            return Err(FarmError::refused(message, remedy));
        }
        if let Some(reason) = self.campaign.draws_depend_on_runs() {
            let message = format!("`{shown}` cannot go from {before} to {after} runs: {reason}");
            let remedy = "write --out DIR to make all runs anew in a folder of its own, or --fresh to start over here";
            return Err(FarmError::refused(message, remedy));
        }
        Ok(())
    }

    /// Extends the folder's campaign: whole shards are kept, and the last one is completed if it was not full.
    ///
    /// Derived files (summary, page, time histories, contact events, repeated runs) are removed and made again.
    fn extend(&mut self, before: u64, context: Context) -> Result<()> {
        let after = self.campaign.runs;
        let old = Self { campaign: self.campaign.clone().with_sample(before, self.campaign.seed), ..self.unlocked() };
        let (index, last) = (old.shards()?, before / old.plan().shard_runs.max(1));
        let last = index.complete.get(&(last as u32)).map(|file| (last as u32, file));
        if let Some((shard, file)) = last {
            reopen_shard(&self.path, shard, file)?;
        }
        self.remove_derived()?;
        self.extensions.push(Extension { runs_before: before, runs_after: after });
        self.manifest().write(&self.path)?;
        if let Some((_, file)) = last {
            remove(&file.path)?;
        }
        context.note(Note::Extended { campaign: self.campaign.id.clone(), before, after });
        Ok(())
    }

    /// The same folder without its lock.
    fn unlocked(&self) -> Self {
        Self {
            path: self.path.clone(),
            campaign: self.campaign.clone(),
            file: self.file.clone(),
            model: self.model.clone(),
            build: self.build.clone(),
            extensions: self.extensions.clone(),
            judgements: self.judgements.clone(),
            lock: None,
        }
    }

    /// Opens a folder for reading, with its own campaign files.
    ///
    /// # Errors
    /// If it is not a results folder, or its files were changed after the runs.
    pub fn open(path: &Path) -> Result<Self> {
        let manifest = Manifest::require(path)?;
        manifest.refuse_half_judged(path)?;
        let inside = |file: &String| path.join("campaign").join(file);
        let model = manifest.model.as_ref().map(inside);
        let whole = Campaign::load_with(&inside(&manifest.campaign), model.as_deref())?;
        let alone = whole.variant_of_id(&manifest.id).map(|variant| whole.on_variant(variant));
        let campaign = alone.unwrap_or(whole);
        let campaign = campaign.with_sample(manifest.runs, manifest.seed);
        let campaign = match manifest.cases_file(path) {
            Some(cases) => campaign.with_cases(crate::cases::read_cases(&cases)?)?,
            None => campaign,
        };
        let folder = Self {
            path: path.to_owned(),
            campaign,
            file: manifest.campaign.clone(),
            model: manifest.model.clone(),
            build: manifest.made_by.clone(),
            extensions: manifest.extensions.clone(),
            judgements: manifest.judgements.clone(),
            lock: None,
        };
        if folder.manifest() == manifest {
            return Ok(folder);
        }
        let message = format!("the campaign files in `{}` were changed after the runs", path.display());
        Err(FarmError::refused(message, "put the files back, or run the changed campaign into a folder of its own"))
    }

    /// The folders that hold runs: this one, or those of its variants.
    pub(crate) fn with_runs(self) -> Result<Vec<Self>> {
        if self.campaign.variants.is_empty() { Ok(vec![self]) } else { self.variants() }
    }

    /// Returns the folders of the campaign's variants, below this one; a missing folder is not created.
    pub(crate) fn variants(&self) -> Result<Vec<Self>> {
        let of_variant = |variant: &softdock_campaign::Variant| {
            let path = self.path.join(&variant.name);
            let found = Manifest::read(&path)?;
            let (extensions, judgements, build) = match found {
                Some(found) => (found.extensions, found.judgements, found.made_by),
                None => (Vec::new(), Vec::new(), Build::own()),
            };
            Ok(Self {
                path,
                campaign: self.campaign.on_variant(variant),
                build,
                extensions,
                judgements,
                ..self.unlocked()
            })
        };
        self.campaign.variants.iter().map(of_variant).collect()
    }

    /// Takes `path` for the same campaign as this folder.
    pub(crate) fn claim_alike(&self, path: &Path, context: Context) -> Result<Self> {
        let records = (self.extensions.clone(), self.judgements.clone());
        let mut folder = Self::claim_recorded(path, self.campaign.clone(), records, context)?;
        folder.file.clone_from(&self.file);
        folder.model.clone_from(&self.model);
        Ok(folder)
    }

    /// Rejects a folder of another campaign.
    pub(crate) fn same_campaign(&self, other: &Self) -> Result<()> {
        let found = other.manifest().without_records();
        if found == self.manifest().without_records() { Ok(()) } else { Err(self.other(&other.path, &found)) }
    }

    /// Rejects a folder of variants where the runs of one are required.
    pub(crate) fn refuse_variants(&self) -> Result<()> {
        match self.campaign.variants.first() {
            None => Ok(()),
            Some(first) => {
                let message = format!("`{}` holds the runs of several variants", self.path.display());
                let remedy = format!("name one of them: {}", self.path.join(&first.name).display());
                Err(FarmError::refused(message, remedy))
            }
        }
    }

    /// The error of a run that the folder does not hold.
    pub(crate) fn no_run(&self, run: u64) -> FarmError {
        let remedy = match self.campaign.cases() {
            Some(_) => "its table of cases names the runs".to_owned(),
            None => format!("the campaign has the runs 0 to {}", self.campaign.runs - 1),
        };
        FarmError::refused(format!("`{}` holds no run {run}", self.path.display()), remedy)
    }

    /// Returns the runs and their division into shards.
    pub fn plan(&self) -> ShardPlan {
        ShardPlan { runs: self.campaign.runs, shard_runs: self.campaign.execution.shard_runs }
    }

    /// Numbers of the runs of a shard, ascending.
    pub(crate) fn run_numbers(&self, shard: u32) -> Vec<u64> {
        self.plan().range(shard).map(|place| self.campaign.run_at(place)).collect()
    }

    /// Returns the existing shards. Every byte of every shard is verified.
    pub fn shards(&self) -> Result<ShardIndex> {
        Ok(ShardIndex::scan(&self.path, self.plan(), &self.origin())?)
    }

    /// Returns the common origin of the campaign's rows.
    pub(crate) fn origin(&self) -> Origin {
        self.facts().origin()
    }

    /// Returns the campaign data for the analysis.
    pub fn facts(&self) -> CampaignFacts<'_> {
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

    fn manifest(&self) -> Manifest {
        let c = &self.campaign;
        Manifest {
            schema: MANIFEST_SCHEMA.to_owned(),
            id: c.id.clone(),
            campaign: self.file.clone(),
            hash: c.hash.clone(),
            seed: c.seed,
            runs: c.runs,
            made_by: self.build.clone(),
            model: self.model.clone(),
            cases: c.cases().map(|cases| cases.file_name().to_owned()),
            cases_hash: c.cases().map(|cases| cases.hash().to_owned()),
            extensions: self.extensions.clone(),
            judgements: self.judgements.clone(),
            judging: None,
        }
    }

    /// Returns the error with every key in which the campaign of a folder differs from this one.
    fn other(&self, path: &Path, found: &Manifest) -> FarmError {
        let own = self.manifest();
        let state = if own.id == found.id { "another state of this campaign" } else { "another campaign" };
        let text = |text: &str| format!("\"{text}\"");
        let or_none = |value: &Option<String>| value.as_deref().map_or("(none)".to_owned(), text);
        let keys = [
            ("id", text(&found.id), text(&own.id)),
            ("seed", found.seed.to_string(), own.seed.to_string()),
            ("runs", found.runs.to_string(), own.runs.to_string()),
            ("model", or_none(&found.model), or_none(&own.model)),
            ("cases", or_none(&found.cases), or_none(&own.cases)),
        ];
        let keys = keys.into_iter().filter(|(_, found, own)| found != own);
        let mut lines: Vec<String> = keys.map(|(key, found, own)| format!("{key}: {found} -> {own}")).collect();
        if own.cases == found.cases && own.cases_hash != found.cases_hash {
            lines.push(format!("{}: the tables of cases differ", found.cases.as_deref().unwrap_or("cases")));
        }
        let there = Self { path: path.to_owned(), ..self.unlocked() };
        let changes = there.changes_from(found);
        let is_judgement = lines.is_empty() && !changes.is_empty() && self.changes_of_runs(&changes).is_empty();
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
            return FarmError::refused(message, remedy);
        }
        let remedy = format!(
            "put the old values back (`{}` keeps the files), write --out DIR for a folder of its own, or --fresh to \
             start over{extend}",
            path.join("campaign").display()
        );
        FarmError::refused(message, remedy)
    }

    /// Rejects shards without `campaign.json`, which may be results of a user.
    fn refuse_strangers(&self) -> Result<()> {
        let readable = |(path, _): &&(PathBuf, String)| TableReader::open(path).is_ok();
        match self.shards()?.foreign.iter().find(readable) {
            None => Ok(()),
            Some((path, reason)) => {
                let message = format!("`{}` is not of this campaign: {reason}", path.display());
                Err(FarmError::refused(
                    message,
                    "add `--out DIR` with a folder of its own, or move the old results away",
                ))
            }
        }
    }
}

/// State of a folder with respect to a campaign.
enum Held {
    /// No manifest.
    Nothing,
    /// The same campaign.
    Same,
    /// The same campaign with so many runs, which can be extended.
    FewerRuns(u64),
}

/// The folder is in use by another process.
pub(crate) fn busy(path: &Path) -> FarmError {
    let message = format!("another softdock process works in `{}`", path.display());
    FarmError::refused(message, "wait until it has ended, or stop it")
}

/// Removes a folder with its content; a missing folder is not an error.
fn remove_folder(path: &Path) -> Result<()> {
    if path.is_dir() { std::fs::remove_dir_all(path).map_err(writing(path)) } else { Ok(()) }
}

/// Removes a file; a missing file is not an error.
fn remove(path: &Path) -> Result<()> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(writing(path)(error)),
        _ => Ok(()),
    }
}
