//! Makes the missing runs of a results folder: batches, shards, locks, and finished runs of unfinished shards.

use crate::error::{FarmError, Result};
use crate::folder::ResultsFolder;
use crate::lock::ShardLock;
use crate::observer::{Context, Note, Progress, Work};
use crate::outcome::Incomplete;
use crate::part::Part;
use crate::rows::RowBuilder;
use crate::run_engine::RunEngine;
use softdock_engine::{Choice, EngineError};
use softdock_kernels::metrics::flags;
use softdock_kernels::outcome::Finished;
use softdock_results::partial::{PartialShard, partial_path, read_partial, remove_partial, write_partial};
use softdock_results::runs::{RunRow, RunsSchema};
use softdock_results::shards::{Provenance, write_shard};
use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Time between two looks at shards that other processes make.
const WAIT: Duration = Duration::from_millis(200);

/// Options of a run.
#[derive(Clone, Copy, Debug)]
pub struct RunOptions {
    /// Backend of the runs.
    pub choice: Choice,
    /// Part of the campaign.
    pub part: Part,
    /// Whether to delete the files of softdock in the folder first.
    pub is_fresh: bool,
    /// Longest time for which finished runs are in memory only, and are lost if the process is killed.
    pub save_every: Duration,
}

impl Default for RunOptions {
    /// Returns options for the whole campaign on the best device of this machine.
    fn default() -> Self {
        Self { choice: Choice::Auto, part: Part::WHOLE, is_fresh: false, save_every: Duration::from_secs(15) }
    }
}

/// Makes the missing runs of a part of the campaign; returns the reason if the device fails before the end.
pub(crate) fn make_missing(
    folder: &ResultsFolder,
    options: &RunOptions,
    engine: &mut RunEngine,
    context: Context,
) -> Result<Option<Incomplete>> {
    let mut index = folder.shards()?;
    for (path, reason) in &index.foreign {
        context.note(Note::MadeAgain { path: path.clone(), reason: reason.clone(), is_partial: false });
    }
    for path in &index.set_aside {
        context.note(Note::SetAside(path.clone()));
    }
    for shard in index.complete.keys().filter(|shard| partial_path(&folder.path, **shard).is_file()) {
        // Its writer was killed after the whole shard and before this.
        remove_partial(&folder.path, *shard)?;
    }
    let missing: Vec<u32> = index.missing().into_iter().filter(|shard| options.part.holds(*shard)).collect();
    let mut kept = KeptRuns::read(folder, &missing, engine, context);
    context.note(Note::Begin {
        campaign: folder.campaign.id.clone(),
        missing: missing.len(),
        complete: index.complete.len(),
        partial_runs: kept.count(),
        device: engine.device(),
    });
    if missing.is_empty() {
        return Ok(None);
    }
    let progress = Progress::new(context, Work::Runs, kept.runs_to_make(folder, &missing));
    let (mut open, mut done) = (missing, 0);
    while !open.is_empty() && !context.cancel.is_cancelled() {
        // Neighbours only, so that a batch is one range of runs.
        let (mut batch, mut locks, mut busy): (Vec<u32>, Vec<ShardLock>, Vec<u32>) = Default::default();
        let most = engine.batch_shards();
        let mut rest = open.into_iter().peekable();
        let is_next = |batch: &[u32], shard: u32| batch.last().is_none_or(|last| shard == last + 1);
        while let Some(shard) = rest.next_if(|shard| batch.len() < most && is_next(&batch, *shard)) {
            match ShardLock::try_take(&folder.path, shard)? {
                // Another process may have made it since.
                Some(_) if index.look_again(&folder.path, shard) => {}
                Some(lock) => {
                    batch.push(shard);
                    locks.push(lock);
                }
                None => busy.push(shard),
            }
        }
        // Shards of other processes come last.
        open = rest.chain(busy).collect();
        if batch.is_empty() {
            if !open.is_empty() {
                std::thread::sleep(WAIT);
            }
            continue;
        }
        let own = kept.runs_to_make(folder, &batch);
        match make_batch(folder, &batch, engine, &mut kept, (&progress, done), options.save_every)? {
            BatchEnd::Whole => {}
            BatchEnd::Cancelled => return Ok(None),
            BatchEnd::DeviceFailed(error) => {
                context.note(Note::DeviceFailed(error));
                return Ok(Some(Incomplete::DeviceFailed));
            }
        }
        done += own;
        progress.set(done);
    }
    Ok(None)
}

/// Finished runs of unfinished shards from an earlier call.
struct KeptRuns {
    rows: BTreeMap<u32, Vec<RunRow>>,
    /// Their provenance.
    provenance: Provenance,
}

impl KeptRuns {
    /// Reads the rows that are compatible with this engine; for others a note states why they are made again.
    fn read(folder: &ResultsFolder, shards: &[u32], engine: &RunEngine, context: Context) -> Self {
        let provenance = engine.provenance();
        let mut rows = BTreeMap::new();
        for shard in shards {
            match read_kept(folder, *shard, &engine.builder.schema, &provenance) {
                PartialShard::Absent => {}
                PartialShard::Usable(own) => drop(rows.insert(*shard, own)),
                PartialShard::Unusable(reason) => {
                    let path = partial_path(&folder.path, *shard);
                    context.note(Note::MadeAgain { path, reason, is_partial: true });
                }
            }
        }
        Self { rows, provenance }
    }

    fn count(&self) -> usize {
        self.rows.values().map(Vec::len).sum()
    }

    /// Number of runs of these shards that are still to be made.
    fn runs_to_make(&self, folder: &ResultsFolder, shards: &[u32]) -> u64 {
        let missing = |shard: &u32| {
            let range = folder.plan().range(*shard);
            range.end - range.start - self.rows.get(shard).map_or(0, |rows| rows.len() as u64)
        };
        shards.iter().map(missing).sum()
    }

    /// Takes the rows of a shard, unless another engine has taken over: a shard has one backend.
    fn take(&mut self, shard: u32, own: &Provenance) -> Vec<RunRow> {
        let rows = self.rows.remove(&shard).unwrap_or_default();
        let alike =
            own.backend == self.provenance.backend && (own.backend == "cpu" || own.device == self.provenance.device);
        if alike { rows } else { Vec::new() }
    }
}

fn read_kept(folder: &ResultsFolder, shard: u32, schema: &RunsSchema, provenance: &Provenance) -> PartialShard {
    let runs = folder.run_numbers(shard);
    read_partial(&folder.path, shard, |run| runs.binary_search(&run).is_ok(), schema, provenance)
}

/// How a batch ended.
enum BatchEnd {
    /// Every shard is written.
    Whole,
    /// The caller has cancelled it; its finished runs are written.
    Cancelled,
    /// The device failed; what was saved of the batch is on disk.
    DeviceFailed(EngineError),
}

fn make_batch(
    folder: &ResultsFolder,
    shards: &[u32],
    engine: &mut RunEngine,
    kept: &mut KeptRuns,
    (progress, done): (&Progress, u64),
    save_every: Duration,
) -> Result<BatchEnd> {
    let mut rows: Vec<RunRow> = Vec::new();
    for shard in shards {
        rows.append(&mut kept.take(*shard, &engine.provenance()));
    }
    let numbers = shards.iter().flat_map(|shard| folder.run_numbers(*shard));
    let is_kept = |run: &u64| rows.binary_search_by_key(run, |row| row.run).is_ok();
    let (there, missing): (Vec<u64>, Vec<u64>) = numbers.partition(is_kept);
    let device = engine.device();
    let saver = Saver::new(folder, shards, engine, &rows, save_every);
    let made = engine.make_numbered(&missing, &|ended, builder| {
        if saver.follow_failover() {
            progress.set(done);
        }
        saver.add(ended, builder);
        progress.add(ended.len()) && !saver.has_failed()
    });
    saver.result()?;
    let (mut made, mut is_whole) = match made {
        Ok(made) => made,
        Err(FarmError::Engine(error)) if error.is_of_the_device() => return Ok(BatchEnd::DeviceFailed(error)),
        Err(error) => return Err(error),
    };
    if engine.device() != device && !there.is_empty() {
        // The CPU took over in this batch: rows of the GPU are not compatible.
        rows.clear();
        if is_whole {
            let (mut again, ended) = engine.make_numbered(&there, &|_, _| progress.add(0))?;
            made.append(&mut again);
            is_whole = ended;
        }
    }
    rows.append(&mut made);
    rows.sort_by_key(|row| row.run);
    write_batch(folder, shards, &engine.builder.schema, &engine.provenance(), rows)?;
    Ok(if is_whole { BatchEnd::Whole } else { BatchEnd::Cancelled })
}

/// Saves the finished runs of a batch while it is made, so that a killed process loses little.
struct Saver<'a> {
    folder: &'a ResultsFolder,
    shards: &'a [u32],
    save_every: Duration,
    schema: RunsSchema,
    on_cpu: Provenance,
    failed_over: std::sync::Arc<AtomicBool>,
    has_failed: AtomicBool,
    state: Mutex<SaverState>,
}

struct SaverState {
    provenance: Provenance,
    /// Rows of unfinished shards that are on disk.
    rows: Vec<RunRow>,
    /// Runs that have ended since.
    ended: Vec<Finished>,
    saved: Instant,
    result: Result<()>,
}

impl<'a> Saver<'a> {
    fn new(
        folder: &'a ResultsFolder,
        shards: &'a [u32],
        engine: &RunEngine,
        kept: &[RunRow],
        save_every: Duration,
    ) -> Self {
        let state = SaverState {
            provenance: engine.provenance(),
            rows: kept.to_vec(),
            ended: Vec::new(),
            saved: Instant::now(),
            result: Ok(()),
        };
        Self {
            folder,
            shards,
            save_every,
            schema: engine.builder.schema.clone(),
            on_cpu: engine.provenance_on_cpu(),
            failed_over: engine.failed_over(),
            has_failed: AtomicBool::new(false),
            state: Mutex::new(state),
        }
    }

    /// Drops the rows of a GPU in whose place the CPU makes the batch; true when this has just happened.
    fn follow_failover(&self) -> bool {
        if !self.failed_over.load(Ordering::Relaxed) {
            return false;
        }
        let mut state = self.state.lock().expect("no holder panics");
        if state.provenance.backend == "cpu" {
            return false;
        }
        (state.provenance, state.rows, state.ended) = (self.on_cpu.clone(), Vec::new(), Vec::new());
        true
    }

    /// Takes finished runs; makes rows of them and writes them only when it is time to.
    fn add(&self, ended: &[Finished], builder: &RowBuilder) {
        let mut state = self.state.lock().expect("no holder panics");
        let on_gpu = state.provenance.backend != "cpu";
        // What a GPU could not make is repeated at the end of the batch.
        let valid = ended.iter().filter(|run| !on_gpu || run.flags & flags::INVALID == 0);
        state.ended.extend(valid);
        if state.saved.elapsed() < self.save_every || state.ended.is_empty() {
            return;
        }
        let mut rows = std::mem::take(&mut state.rows);
        // One by one: a parallel loop could begin another tile of the engine here, which waits for this lock.
        rows.extend(std::mem::take(&mut state.ended).iter().map(|run| builder.row(run)));
        rows.sort_by_key(|row| row.run);
        match write_batch(self.folder, self.shards, &self.schema, &state.provenance, rows) {
            Ok(unfinished) => state.rows = unfinished,
            Err(error) => {
                state.result = Err(error);
                self.has_failed.store(true, Ordering::Relaxed);
            }
        }
        state.saved = Instant::now();
    }

    fn has_failed(&self) -> bool {
        self.has_failed.load(Ordering::Relaxed)
    }

    /// Whether everything could be written.
    fn result(self) -> Result<()> {
        self.state.into_inner().expect("no holder panics").result
    }
}

/// Writes every complete shard, and the finished runs of the others, which it returns.
fn write_batch(
    folder: &ResultsFolder,
    shards: &[u32],
    schema: &RunsSchema,
    provenance: &Provenance,
    mut rows: Vec<RunRow>,
) -> Result<Vec<RunRow>> {
    let mut unfinished = Vec::new();
    for shard in shards.iter().rev() {
        let numbers = folder.run_numbers(*shard);
        let own = rows.split_off(rows.partition_point(|row| row.run < numbers[0]));
        if own.len() == numbers.len() {
            let mut provenance = provenance.clone();
            if folder.campaign.cases().is_some() {
                let first = folder.plan().range(*shard).start;
                provenance.more.push(("first_case".to_owned(), first.to_string()));
            }
            write_shard(&folder.path, *shard, schema, own, &provenance)?;
            remove_partial(&folder.path, *shard)?;
        } else if !own.is_empty() {
            write_partial(&folder.path, *shard, schema, own.clone(), provenance)?;
            unfinished.extend(own);
        }
    }
    Ok(unfinished)
}
