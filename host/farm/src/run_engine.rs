//! Engine of a campaign that returns rows, with repetition of invalid GPU runs and failover.

use crate::error::Result;
use crate::manifest::Build;
use crate::observer::{Context, Note, Progress};
use crate::rows::RowBuilder;
use rayon::prelude::*;
use softdock_campaign::Campaign;
use softdock_engine::cpu::CpuEngine;
use softdock_engine::{Choice, Engine, EngineError, RunInput};
use softdock_kernels::frame::Batch;
use softdock_kernels::metrics::flags;
use softdock_kernels::outcome::Finished;
use softdock_results::runs::RunRow;
use softdock_results::shards::{Origin, Provenance};
use softdock_tracer::kernel::kernel;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Runs that a GPU is given at a time, so that all its lanes have work; a CPU takes shard by shard.
const GPU_BATCH: u64 = 1 << 16;

/// Result of an engine alone.
type EngineResult<T> = std::result::Result<T, EngineError>;

/// Function that receives the runs ended since the last call and the row builder; returns `false` to stop.
pub(crate) type Watcher<'a> = &'a (dyn Fn(&[Finished], &RowBuilder) -> bool + Sync);

/// A watcher that only counts.
pub(crate) fn counting<'a>(progress: &'a Progress<'a>) -> impl Fn(&[Finished], &RowBuilder) -> bool + Sync + 'a {
    |ended, _| progress.add(ended.len())
}

/// Notes that the CPU takes over, and why.
fn report_failover<'a>(context: Context<'a>, failed_over: &Arc<AtomicBool>) -> impl Fn(&EngineError) + use<'a> {
    let failed_over = Arc::clone(failed_over);
    move |error| {
        failed_over.store(true, Ordering::Relaxed);
        context.note(Note::Failover(error.clone()));
    }
}

/// Engine that makes the runs of a campaign and returns them as rows.
pub(crate) struct RunEngine<'a> {
    campaign: &'a Campaign,
    /// How runs become rows.
    pub(crate) builder: RowBuilder<'a>,
    engine: Box<dyn Engine + 'a>,
    failed_over: Arc<AtomicBool>,
    scenario_hash: String,
    /// Hash of the scenario's GPU kernel, which identifies the physics on any backend.
    kernel_hash: String,
}

impl<'a> RunEngine<'a> {
    /// Opens the requested engine.
    ///
    /// # Errors
    /// If it does not exist on this machine.
    pub(crate) fn open(campaign: &'a Campaign, choice: Choice, context: Context<'a>) -> EngineResult<Self> {
        let choice = match choice {
            Choice::Gpu if campaign.has_keys() => return Err(EngineError::OwnPlants),
            Choice::Auto if campaign.has_keys() => Choice::Cpu,
            choice => choice,
        };
        let failed_over = Arc::new(AtomicBool::new(false));
        let engine = softdock_engine::open(choice, report_failover(context, &failed_over))?;
        Ok(Self { failed_over, ..Self::with(campaign, engine) })
    }

    /// CPU lanes in f64, the reference for everything else.
    pub(crate) fn reference(campaign: &'a Campaign) -> Self {
        Self::with(campaign, Box::new(CpuEngine::new()))
    }

    /// With a given engine.
    pub(crate) fn with(campaign: &'a Campaign, engine: Box<dyn Engine + 'a>) -> Self {
        let builder = RowBuilder::new(campaign);
        let hash = |text: &str| blake3::hash(text.as_bytes()).to_hex().to_string();
        let kernel_hash = hash(&kernel(&builder.job.plant, Batch::whole()).text);
        let failed_over = Arc::new(AtomicBool::new(false));
        Self { campaign, builder, engine, failed_over, scenario_hash: hash(campaign.scenario.text()), kernel_hash }
    }

    /// Uses a given engine, with failover to the CPU if its device fails.
    #[cfg(test)]
    pub(crate) fn with_failover(campaign: &'a Campaign, first: Box<dyn Engine + 'a>, context: Context<'a>) -> Self {
        let failed_over = Arc::new(AtomicBool::new(false));
        let engine = softdock_engine::failover::Failover::new(first, report_failover(context, &failed_over));
        Self { failed_over, ..Self::with(campaign, Box::new(engine)) }
    }

    /// Becomes true when the CPU takes the place of a GPU that has failed.
    pub(crate) fn failed_over(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.failed_over)
    }

    /// `cpu` or `gpu`.
    pub(crate) fn backend(&self) -> &'static str {
        if self.engine.device().starts_with("cpu") { "cpu" } else { "gpu" }
    }

    /// Returns the name of the device.
    pub(crate) fn device(&self) -> String {
        self.engine.device()
    }

    /// Most runs that the engine steps side by side.
    pub(crate) fn lanes(&self) -> usize {
        self.engine.lanes()
    }

    /// Shards to make in one go.
    pub(crate) fn batch_shards(&self) -> usize {
        let runs = if self.backend() == "gpu" { GPU_BATCH } else { 1 };
        (runs / self.campaign.execution.shard_runs).max(1) as usize
    }

    /// What the files state of their origin.
    pub(crate) fn provenance(&self) -> Provenance {
        self.provenance_on(self.backend(), self.device())
    }

    /// The same for rows that the CPU makes.
    pub(crate) fn provenance_on_cpu(&self) -> Provenance {
        self.provenance_on("cpu", CpuEngine::new().device())
    }

    fn provenance_on(&self, backend: &str, device: String) -> Provenance {
        let build = Build::own();
        let more = [
            ("campaign_id", self.campaign.id.clone()),
            ("runs", self.campaign.runs.to_string()),
            ("scenario_hash", self.scenario_hash.clone()),
            ("kernel_hash", self.kernel_hash.clone()),
        ];
        Provenance {
            origin: Origin {
                campaign_hash: self.campaign.hash.clone(),
                seed: self.campaign.seed,
                version: build.version,
                commit: build.commit,
            },
            backend: backend.to_owned(),
            device,
            more: more.map(|(key, value)| (key.to_owned(), value)).to_vec(),
        }
    }

    /// Makes runs by their numbers; if the user stops, the rows of those that have ended, and `false`.
    pub(crate) fn make_numbered(&mut self, runs: &[u64], watch: Watcher) -> Result<(Vec<RunRow>, bool)> {
        let inputs = self.inputs(runs)?;
        let Self { engine, builder, .. } = &mut *self;
        let (mut finished, is_whole) = match engine.run(&builder.job, &inputs, &|ended| watch(ended, builder)) {
            Ok(finished) => (finished, true),
            Err(EngineError::Stopped { finished }) => (finished, false),
            Err(error) => return Err(error.into()),
        };
        self.repair(&mut finished)?;
        Ok((self.builder.rows(&finished), is_whole))
    }

    /// The inputs of rows' runs, with exactly the parameters that were applied.
    ///
    /// # Errors
    /// See [`RowBuilder::input`].
    pub(crate) fn inputs_of<'r>(&self, rows: impl IntoIterator<Item = &'r RunRow>) -> Result<Vec<RunInput>> {
        let inputs = rows.into_iter().map(|row| Ok(self.builder.input_of(row)?));
        inputs.collect()
    }

    /// Makes given runs; invalid runs of the GPU are repeated in f64.
    pub(crate) fn make_rows(&mut self, inputs: &[RunInput], watch: Watcher) -> EngineResult<Vec<RunRow>> {
        let Self { engine, builder, .. } = &mut *self;
        let mut finished = engine.run(&builder.job, inputs, &|ended| watch(ended, builder))?;
        self.repair(&mut finished)?;
        Ok(self.builder.rows(&finished))
    }

    fn inputs(&self, runs: &[u64]) -> Result<Vec<RunInput>> {
        let builder = &self.builder;
        runs.par_iter().map(|run| Ok(builder.input(*run, None)?)).collect()
    }

    fn repair(&self, finished: &mut [Finished]) -> EngineResult<()> {
        if self.backend() == "gpu" { self.retry(finished) } else { Ok(()) }
    }

    fn retry(&self, finished: &mut [Finished]) -> EngineResult<()> {
        let invalid: Vec<RunInput> = finished
            .iter()
            .filter(|run| run.flags & flags::INVALID != 0)
            .map(|run| RunInput::new(run.run, run.params))
            .collect();
        let repeated = CpuEngine::new().run(&self.builder.job, &invalid, &|_| true)?;
        for mut again in repeated {
            again.flags |= flags::RETRIED;
            if let Ok(place) = finished.binary_search_by_key(&again.run, |run| run.run) {
                finished[place] = again;
            }
        }
        Ok(())
    }
}
