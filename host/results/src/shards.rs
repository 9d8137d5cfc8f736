//! The shards of a campaign: written once; complete, missing or foreign by their files alone.

use std::collections::{BTreeMap, HashMap};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use crate::read::{Batches, TableReader};
use crate::runs::columns::RUN;
use crate::runs::{RunRow, RunsSchema};
use crate::table::Table;
use crate::write::{Metadata, content_hash, write_table};
use crate::{Result, ResultsError};

/// Version of the runs contract; a change of the first number breaks readers, columns are only added.
pub const RUNS_SCHEMA: &str = "runs/2";

/// Key of the place of a shard's first case in a table of given cases, whose run numbers may have gaps.
const FIRST_CASE: &str = "softdock.first_case";

/// Key of the hash of the runs that a file was made from.
const ROWS_HASH: &str = "softdock.rows_hash";

/// How a campaign's runs are cut into files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ShardPlan {
    /// Runs of the campaign.
    pub runs: u64,
    /// Runs of a shard; the last one may hold fewer.
    pub shard_runs: u64,
}

impl ShardPlan {
    /// Number of shards.
    pub fn shards(&self) -> u32 {
        self.runs.div_ceil(self.shard_runs.max(1)) as u32
    }

    /// The run numbers of a shard.
    pub fn range(&self, shard: u32) -> Range<u64> {
        let start = u64::from(shard) * self.shard_runs.max(1);
        start.min(self.runs)..(start + self.shard_runs.max(1)).min(self.runs)
    }
}

/// What rows must have in common to go together.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Origin {
    /// Hash of the checked campaign.
    pub campaign_hash: String,
    /// The campaign's seed.
    pub seed: u64,
    /// Version of softdock that made them.
    pub version: String,
    /// The commit that it was built from; `unknown` outside a repository.
    pub commit: String,
}

impl Origin {
    /// Keys and values as files state them, without prefix.
    fn stated(&self) -> [(&'static str, String); 4] {
        [
            ("campaign_hash", self.campaign_hash.clone()),
            ("seed", self.seed.to_string()),
            ("version", self.version.clone()),
            ("commit", self.commit.clone()),
        ]
    }

    /// Why a file with these metadata is of another origin.
    pub(crate) fn differs(&self, metadata: &BTreeMap<String, String>) -> Option<String> {
        self.stated().into_iter().find_map(|(key, expected)| {
            let found = metadata.get(&format!("softdock.{key}")).map_or("", String::as_str);
            (found != expected).then(|| format!("{key} is `{found}`, expected `{expected}`"))
        })
    }
}

/// Provenance that every file of a campaign states.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Provenance {
    /// What its rows have in common with all others of the campaign.
    pub origin: Origin,
    /// `cpu` or `gpu`.
    pub backend: String,
    /// The device, as its driver calls it.
    pub device: String,
    /// More keys, without prefix: `campaign_id`, `scenario_hash`, `kernel_hash` ...
    pub more: Metadata,
}

impl Provenance {
    /// The file metadata of a file with this schema.
    pub fn metadata(&self, schema: &str) -> Metadata {
        let own = [("backend", self.backend.clone()), ("device", self.device.clone())];
        let fixed = std::iter::once(("schema", schema.to_owned())).chain(self.origin.stated()).chain(own);
        let fixed = fixed.map(|(key, value)| (key.to_owned(), value));
        fixed.chain(self.more.iter().cloned()).map(|(key, value)| (format!("softdock.{key}"), value)).collect()
    }
}

/// Path of a shard below a results folder.
pub fn shard_path(results: &Path, shard: u32) -> PathBuf {
    results.join("runs").join(format!("shard={shard:05}.parquet"))
}

/// Ending of the name under which a damaged or foreign file at the place of a shard is kept, with a number behind it.
const SET_ASIDE: &str = ".damaged-";

/// Whether a file name is one that [`write_shard`] gives to a file that was at the place of a shard.
pub fn is_set_aside(name: &str) -> bool {
    let parts = name.split_once(SET_ASIDE).map(|(shard, number)| (shard.strip_prefix("shard="), number));
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    matches!(parts, Some((Some(shard), number))
        if shard.strip_suffix(".parquet").is_some_and(is_number) && is_number(number))
}

/// Keeps what is at the place of a shard under another name, unless it is a whole shard of the same origin.
fn set_aside(path: &Path, shard: u32, origin: &Origin) -> Result<()> {
    if std::fs::symlink_metadata(path).is_err() || is_whole(path, shard, origin) {
        return Ok(());
    }
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut places = (1_u32..).map(|number| path.with_file_name(format!("{name}{SET_ASIDE}{number}")));
    let place = places.find(|place| std::fs::symlink_metadata(place).is_err()).expect("a free number");
    match std::fs::rename(path, place) {
        // Another worker was faster.
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(()),
        renamed => renamed.map_err(ResultsError::write(path)),
    }
}

/// Whether a file is a shard whose bytes, rows and origin are as its writer left them.
fn is_whole(path: &Path, shard: u32, origin: &Origin) -> bool {
    let Ok(reader) = TableReader::open(path) else { return false };
    let metadata = reader.metadata();
    let stated = |key: &str| metadata.get(&format!("softdock.{key}")).map_or("", String::as_str);
    stated("schema") == RUNS_SCHEMA
        && stated("shard") == shard.to_string()
        && stated("rows") == reader.rows().to_string()
        && origin.differs(&metadata).is_none()
}

/// Writes one shard, sorted by run; returns the hash of its rows.
///
/// A file at its place that is no whole shard of this campaign is kept as `shard=NUMBER.parquet.damaged-1` (2, 3, ...).
///
/// # Errors
/// [`ResultsError::Write`] if the file cannot be written; also if a run stands twice.
pub fn write_shard(
    results: &Path,
    shard: u32,
    schema: &RunsSchema,
    mut rows: Vec<RunRow>,
    provenance: &Provenance,
) -> Result<String> {
    rows.sort_by_key(|row| row.run);
    let path = shard_path(results, shard);
    if let Some(pair) = rows.windows(2).find(|pair| pair[0].run == pair[1].run) {
        return Err(ResultsError::contract(&path, format!("run {} stands twice in the shard", pair[0].run)));
    }
    let table = schema.table(&rows);
    let hash = content_hash(&table);
    let mut metadata = provenance.metadata(RUNS_SCHEMA);
    let first_run = rows.first().map_or(0, |row| row.run);
    let own = [
        ("softdock.shard", shard.to_string()),
        ("softdock.first_run", first_run.to_string()),
        ("softdock.rows", rows.len().to_string()),
        ("softdock.content_hash", hash.clone()),
    ];
    metadata.extend(own.map(|(key, value)| (key.to_owned(), value)));
    set_aside(&path, shard, &provenance.origin)?;
    write_table(&path, &table, &metadata)?;
    Ok(hash)
}

/// A shard that is whole and of the campaign, by its bytes, origin and run numbers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShardFile {
    /// Where it lies.
    pub path: PathBuf,
    /// Hash of its rows, as its writer stated it.
    pub content_hash: String,
    /// `cpu` or `gpu`.
    pub backend: String,
    /// The device that computed it.
    pub device: String,
}

/// Which shards of a campaign exist.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShardIndex {
    /// How the campaign is cut.
    pub plan: ShardPlan,
    /// What the campaign's rows have in common.
    pub origin: Origin,
    /// Whole shards by number.
    pub complete: BTreeMap<u32, ShardFile>,
    /// Files under `runs/` that do not belong, with the reason: damaged, of another campaign, seed or cut, or stray. They
    /// count for nothing, and no reader takes their rows.
    pub foreign: Vec<(PathBuf, String)>,
    /// Damaged or foreign files that were at the place of a shard and are kept under another name: ignored.
    pub set_aside: Vec<PathBuf>,
}

/// Length and time of change of a file.
type FileState = (u64, SystemTime);

fn file_state(path: &Path) -> Option<FileState> {
    let found = std::fs::metadata(path).ok()?;
    Some((found.len(), found.modified().ok()?))
}

/// Whole shards that scans of a growing results folder have found.
#[derive(Clone, Debug, Default)]
pub struct KnownShards {
    of: Option<(ShardPlan, Origin)>,
    files: HashMap<PathBuf, (FileState, u32, ShardFile)>,
}

impl ShardIndex {
    /// Looks at all shards of a results folder, every byte of them; an absent folder has none.
    pub fn scan(results: &Path, plan: ShardPlan, origin: &Origin) -> Result<Self> {
        Self::scan_again(results, plan, origin, &mut KnownShards::default())
    }

    /// As [`ShardIndex::scan`], without reading again the files that scans before have found whole and whose length and
    /// time of change are still the same.
    pub fn scan_again(results: &Path, plan: ShardPlan, origin: &Origin, known: &mut KnownShards) -> Result<Self> {
        if known.of.as_ref().is_none_or(|(own_plan, own_origin)| (*own_plan, own_origin) != (plan, origin)) {
            *known = KnownShards { of: Some((plan, origin.clone())), files: HashMap::new() };
        }
        let (complete, foreign) = (BTreeMap::new(), Vec::new());
        let set_aside = files_named(&results.join("runs"), is_set_aside)?;
        let mut index = Self { plan, origin: origin.clone(), complete, foreign, set_aside };
        for path in parquet_files(&results.join("runs"))? {
            let state = file_state(&path);
            if let Some((_, shard, file)) = known.files.get(&path).filter(|own| state.as_ref() == Some(&own.0)) {
                index.complete.insert(*shard, file.clone());
                continue;
            }
            match belongs(&path, plan, origin) {
                Ok((shard, file)) => {
                    known.files.extend(state.map(|state| (path, (state, shard, file.clone()))));
                    index.complete.insert(shard, file);
                }
                Err(reason) => index.foreign.push((path, reason)),
            }
        }
        Ok(index)
    }

    /// Looks at one shard again; true if it is whole now.
    pub fn look_again(&mut self, results: &Path, shard: u32) -> bool {
        let found = belongs(&shard_path(results, shard), self.plan, &self.origin);
        found.map(|(shard, file)| self.complete.insert(shard, file)).is_ok()
    }

    /// Numbers of the shards that are still to be computed.
    pub fn missing(&self) -> Vec<u32> {
        (0..self.plan.shards()).filter(|shard| !self.complete.contains_key(shard)).collect()
    }

    /// Hash of the rows of all whole shards: what is made from them states it.
    pub fn rows_hash(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        for (shard, file) in &self.complete {
            hasher.update(&shard.to_le_bytes()).update(file.content_hash.as_bytes());
        }
        hasher.finalize().to_hex().to_string()
    }

    /// What a file that is made from these shards states of them.
    pub(crate) fn stated_rows(&self) -> [(String, String); 1] {
        [(ROWS_HASH.to_owned(), self.rows_hash())]
    }

    /// Whether a file was made from these shards.
    pub(crate) fn check_origin(&self, path: &Path, metadata: &BTreeMap<String, String>, schema: &str) -> Result<()> {
        let stated = |key: &str| metadata.get(key).map_or("", String::as_str);
        if stated("softdock.schema") != schema {
            return Err(ResultsError::contract(
                path,
                format!("schema is `{}`, expected `{schema}`", stated("softdock.schema")),
            ));
        }
        if let Some(what) = self.origin.differs(metadata) {
            return Err(ResultsError::contract(path, what));
        }
        if stated(ROWS_HASH) != self.rows_hash() {
            return Err(ResultsError::contract(path, "it was made from other runs than those that are there"));
        }
        Ok(())
    }

    /// True if every shard is there.
    pub fn is_complete(&self) -> bool {
        self.complete.len() as u64 == u64::from(self.plan.shards())
    }
}

/// The Parquet files of a folder, by name; unfinished files do not end in `.parquet`.
pub(crate) fn parquet_files(folder: &Path) -> Result<Vec<PathBuf>> {
    files_named(folder, |name| name.ends_with(".parquet"))
}

/// What a folder holds under names of a kind, sorted; an absent folder holds nothing.
fn files_named(folder: &Path, is_wanted: impl Fn(&str) -> bool) -> Result<Vec<PathBuf>> {
    if !folder.is_dir() {
        return Ok(Vec::new());
    }
    let entries = std::fs::read_dir(folder).map_err(ResultsError::io(folder))?;
    let paths = entries.map(|entry| entry.map(|entry| entry.path())).collect::<std::io::Result<Vec<_>>>();
    let mut paths = paths.map_err(ResultsError::io(folder))?;
    paths.retain(|path| path.file_name().is_some_and(|name| is_wanted(&name.to_string_lossy())));
    paths.sort();
    Ok(paths)
}

/// The shard's number if the file is a whole shard of this campaign, or why it is not.
fn belongs(path: &Path, plan: ShardPlan, origin: &Origin) -> std::result::Result<(u32, ShardFile), String> {
    let reader = TableReader::open(path).map_err(|error| error.to_string())?;
    let metadata = reader.metadata();
    let text = |key: &str| metadata.get(&format!("softdock.{key}")).cloned().unwrap_or_default();
    let expect = |key: &str, expected: &str| match text(key) {
        found if found == expected => Ok(()),
        found => Err(format!("{key} is `{found}`, expected `{expected}`")),
    };
    expect("schema", RUNS_SCHEMA)?;
    origin.differs(&metadata).map_or(Ok(()), Err)?;
    let shard: u32 = text("shard").parse().map_err(|_| format!("shard is `{}`, not a number", text("shard")))?;
    let range = plan.range(shard);
    if range.is_empty() {
        return Err(format!("shard {shard} is beyond the campaign's {} runs", plan.runs));
    }
    if path.file_name() != shard_path(Path::new(""), shard).file_name() {
        return Err(format!("the file states that it is shard {shard}"));
    }
    let file = ShardFile {
        path: path.to_owned(),
        content_hash: text("content_hash"),
        backend: text("backend"),
        device: text("device"),
    };
    let rows = range.end - range.start;
    // Given cases may have run numbers of their own; then the file states the place of its first case.
    let first = if metadata.contains_key(FIRST_CASE) { "first_case" } else { "first_run" };
    expect(first, &range.start.to_string())?;
    expect("rows", &rows.to_string())?;
    if reader.rows() != rows {
        return Err(format!("{} rows, expected {rows}", reader.rows()));
    }
    let numbered = first == "first_run";
    check_numbers(reader, numbered.then_some(range)).map_err(|error| error.to_string())?;
    Ok((shard, file))
}

/// Checks that each run stands once, in ascending order; and that they are those of a range, if one is given.
fn check_numbers(reader: TableReader, range: Option<Range<u64>>) -> Result<()> {
    let (mut expected, mut last) = (range, None);
    let path = reader.path().to_owned();
    for batch in reader.select(&[RUN.name()])?.batches()? {
        let batch = batch?;
        for run in batch.get(&RUN).map_err(|error| ResultsError::contract(&path, error.to_string()))? {
            if last.is_some_and(|last| *run <= last) {
                return Err(ResultsError::contract(&path, format!("run {run} stands twice, or out of order")));
            }
            if let Some(expected) = expected.as_mut().and_then(Iterator::next).filter(|expected| expected != run) {
                return Err(ResultsError::contract(&path, format!("run {run} stands in the place of run {expected}")));
            }
            last = Some(*run);
        }
    }
    Ok(())
}

/// Changes the rows of a file of runs, whole or unfinished, and writes it again in one step.
///
/// What the file states of its origin stays, but for `metadata` (keys without the prefix `softdock.`).
///
/// # Errors
/// If the file cannot be read or written, or its rows do not have the hash that it states.
pub fn rewrite_runs(
    path: &Path,
    schema: &RunsSchema,
    metadata: &[(&str, &str)],
    mut change: impl FnMut(&mut RunRow),
) -> Result<()> {
    let reader = TableReader::open(path)?;
    let mut stated: BTreeMap<String, String> = reader.metadata();
    let table = reader.read()?;
    let (found, expected) = (content_hash(&table), stated.get("softdock.content_hash").cloned().unwrap_or_default());
    if found != expected {
        return Err(ResultsError::contract(
            path,
            format!("the rows have the hash {found}, the file states {expected}"),
        ));
    }
    let mut rows = rows_of(path, &table)?;
    rows.iter_mut().for_each(&mut change);
    let table = schema.table(&rows);
    for (key, value) in metadata {
        stated.insert(format!("softdock.{key}"), (*value).to_owned());
    }
    stated.insert("softdock.content_hash".to_owned(), content_hash(&table));
    write_table(path, &table, &stated.into_iter().collect::<Vec<_>>())
}

/// Files of a results folder that hold runs, whole shards first, each with the hash of the campaign that judged them.
///
/// # Errors
/// If a file cannot be read.
pub fn run_files(results: &Path) -> Result<Vec<(PathBuf, String)>> {
    let mut files = parquet_files(&results.join("runs"))?;
    files.append(&mut parquet_files(&results.join("partial"))?);
    let stated = |path: PathBuf| {
        let metadata = TableReader::open(&path)?.metadata();
        Ok((path, metadata.get("softdock.campaign_hash").cloned().unwrap_or_default()))
    };
    files.into_iter().map(stated).collect()
}

/// Reads a shard whole and compares its rows with the hash that its writer stated.
pub fn verify_shard(file: &ShardFile) -> Result<()> {
    let found = content_hash(&TableReader::open(&file.path)?.read()?);
    if found != file.content_hash {
        let what = format!("the rows have the hash {found}, the file states {}", file.content_hash);
        return Err(ResultsError::contract(&file.path, what));
    }
    Ok(())
}

impl ShardIndex {
    /// The columns of the runs, without rows.
    ///
    /// # Errors
    /// If there is no shard, or it cannot be read any more.
    pub fn columns(&self) -> Result<Table> {
        let first =
            self.complete.values().next().ok_or_else(|| ResultsError::contract(Path::new("runs"), "no shard"))?;
        TableReader::open(&first.path)?.columns()
    }

    /// Streams selected columns of all runs, in the order of the shards, a few thousand rows at a time.
    pub fn read_columns(&self, names: &[String]) -> impl Iterator<Item = Result<Table>> + use<> {
        let names = names.to_vec();
        let open = move |path: PathBuf| TableReader::open(&path)?.select(&names)?.batches();
        self.paths().into_iter().flat_map(move |path| either(open(path)))
    }

    /// Streams all runs as rows, in the order of the shards.
    pub fn read_runs(&self) -> impl Iterator<Item = Result<RunRow>> + use<> {
        self.paths().into_iter().flat_map(|path| {
            let batches = either(TableReader::open(&path).and_then(TableReader::batches));
            batches.flat_map(move |batch| match batch.and_then(|table| rows_of(&path, &table)) {
                Ok(rows) => rows.into_iter().map(Ok).collect::<Vec<_>>(),
                Err(error) => vec![Err(error)],
            })
        })
    }

    /// One run; only the shards that can hold it are read.
    ///
    /// # Errors
    /// If a shard cannot be read any more.
    pub fn read_run(&self, run: u64) -> Result<Option<RunRow>> {
        for (shard, file) in &self.complete {
            let reader = TableReader::open(&file.path)?;
            if !reader.metadata().contains_key(FIRST_CASE) && !self.plan.range(*shard).contains(&run) {
                continue;
            }
            for batch in reader.batches()? {
                if let Some(row) = rows_of(&file.path, &batch?)?.into_iter().find(|row| row.run == run) {
                    return Ok(Some(row));
                }
            }
        }
        Ok(None)
    }

    pub(crate) fn paths(&self) -> Vec<PathBuf> {
        self.complete.values().map(|file| file.path.clone()).collect()
    }
}

/// The batches of a file, or the one error that stands in their place.
fn either(batches: Result<Batches>) -> impl Iterator<Item = Result<Table>> {
    let (batches, error) = match batches {
        Ok(batches) => (Some(batches), None),
        Err(error) => (None, Some(Err(error))),
    };
    batches.into_iter().flatten().chain(error)
}

fn rows_of(path: &Path, table: &Table) -> Result<Vec<RunRow>> {
    RunsSchema::of_table(table).rows(table).map_err(|what| ResultsError::contract(path, what))
}
