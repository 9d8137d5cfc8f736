//! Runs made into rows: an engine at work on one campaign, with its repairs.

use crate::folder::Build;
use crate::rows::Ledger;
use crate::words::warn;
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
use std::ops::Range;

/// Runs that a GPU is given at a time, so that all its lanes have work; a CPU takes shard by shard.
const GPU_BATCH: u64 = 1 << 16;

/// Told how many runs have ended since the last call; answers `false` to stop.
pub(crate) type Watcher<'a> = &'a (dyn Fn(usize) -> bool + Sync);

/// What became of a GPU.
pub(crate) fn failed(error: &EngineError) -> String {
    match error {
        EngineError::OutOfMemory(why) => format!("the GPU has no room for a batch ({why})"),
        EngineError::DeviceLost(why) => format!("the GPU was lost in mid-batch ({why})"),
        other => other.to_string(),
    }
}

/// Says that the CPU makes the shards that are left, and why.
pub(crate) fn tell_failover(error: &EngineError) {
    let why = failed(error);
    warn(format!("{why}; finished shards stay, the CPU makes the rest: each shard states its backend"));
}

/// A campaign's runs, on whatever makes them.
pub(crate) struct Farm<'a> {
    campaign: &'a Campaign,
    /// How runs become rows.
    pub(crate) ledger: Ledger<'a>,
    engine: Box<dyn Engine>,
    scenario_hash: String,
    /// Hash of the GPU kernel that the scenario becomes: the physics, whatever makes the runs.
    kernel_hash: String,
}

impl<'a> Farm<'a> {
    /// Opens the engine that was asked for.
    pub(crate) fn open(campaign: &'a Campaign, choice: Choice) -> Result<Self, EngineError> {
        Ok(Self::with(campaign, softdock_engine::open(choice, tell_failover)?))
    }

    /// With a given engine.
    pub(crate) fn with(campaign: &'a Campaign, engine: Box<dyn Engine>) -> Self {
        let ledger = Ledger::new(campaign);
        let hash = |text: &str| blake3::hash(text.as_bytes()).to_hex().to_string();
        let kernel_hash = hash(&kernel(&ledger.job.plant, Batch::whole()).text);
        Self { campaign, ledger, engine, scenario_hash: hash(campaign.scenario.text()), kernel_hash }
    }

    /// `cpu` or `gpu`.
    pub(crate) fn backend(&self) -> &'static str {
        if self.engine.device().starts_with("cpu") { "cpu" } else { "gpu" }
    }

    /// The device in words.
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

    /// What the files say about where they come from.
    pub(crate) fn provenance(&self) -> Provenance {
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
            backend: self.backend().to_owned(),
            device: self.device(),
            more: more.map(|(key, value)| (key.to_owned(), value)).to_vec(),
        }
    }

    /// Makes the runs of a range.
    pub(crate) fn make(&mut self, runs: Range<u64>, watch: Watcher) -> Result<Vec<RunRow>, EngineError> {
        self.make_rows(&self.inputs(&runs.collect::<Vec<_>>()), watch)
    }

    /// Makes runs by their numbers; if the user stops, the rows of those that have ended, and `false`.
    pub(crate) fn make_numbered(&mut self, runs: &[u64], watch: Watcher) -> Result<(Vec<RunRow>, bool), EngineError> {
        let inputs = self.inputs(runs);
        let (mut finished, is_whole) = match self.engine.run(&self.ledger.job, &inputs, watch) {
            Ok(finished) => (finished, true),
            Err(EngineError::Stopped { finished }) => (finished, false),
            Err(error) => return Err(error),
        };
        self.repair(&mut finished)?;
        Ok((self.ledger.rows(&finished), is_whole))
    }

    /// Makes given runs; what the GPU could not make is repeated in f64.
    pub(crate) fn make_rows(&mut self, inputs: &[RunInput], watch: Watcher) -> Result<Vec<RunRow>, EngineError> {
        let mut finished = self.engine.run(&self.ledger.job, inputs, watch)?;
        self.repair(&mut finished)?;
        Ok(self.ledger.rows(&finished))
    }

    fn inputs(&self, runs: &[u64]) -> Vec<RunInput> {
        runs.par_iter().map(|run| RunInput { run: *run, params: self.campaign.draw(*run).params }).collect()
    }

    fn repair(&self, finished: &mut [Finished]) -> Result<(), EngineError> {
        if self.backend() == "gpu" { self.retry(finished) } else { Ok(()) }
    }

    fn retry(&self, finished: &mut [Finished]) -> Result<(), EngineError> {
        let invalid: Vec<RunInput> = finished
            .iter()
            .filter(|run| run.flags & flags::INVALID != 0)
            .map(|run| RunInput { run: run.run, params: run.params })
            .collect();
        let repeated = CpuEngine::new().run(&self.ledger.job, &invalid, &|_| true)?;
        for mut again in repeated {
            again.flags |= flags::RETRIED;
            if let Ok(place) = finished.binary_search_by_key(&again.run, |run| run.run) {
                finished[place] = again;
            }
        }
        Ok(())
    }
}
