//! Measures the engines in one run: steps and ticks per second, and the share of the machine's own peak.

mod peak;
mod report;
mod scene;

use crate::{Engine, EngineError, Job, RunInput};
pub use peak::{cpu_peak, device_peak};
pub use report::{BackendSpeed, RateGrowth, RateOfRuns, SpeedReport, Windows, measure_machine};
pub use scene::{ideal_step_flops, scene, supervised, with_joints};
use softdock_kernels::effects::EffectSet;
use softdock_kernels::frame::Loops;
use std::time::Instant;

/// What is stepped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scene {
    /// The ideal twin in steps of 1 ms, one per tick: the machine's bare speed.
    IdealStep,
    /// The ideal twin with a tick of 1 ms in four substeps.
    IdealLoop,
    /// Both loops of a run, with delay, lagging robots and a noisy sensor; a tick of 1 ms in four substeps.
    HilLoop,
    /// The same with every rule of a session in force, and none that is ever met.
    SupervisedLoop,
    /// The HIL loop with both robots joint by joint.
    JointLoop,
}

/// How fast an engine steps a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Speed {
    /// Ticks per second over all runs together: the median of some windows.
    pub ticks: f64,
    /// What the first batch of a kernel takes more than the second \[s\]: its compilation, on a device.
    pub first: f64,
}

impl Scene {
    fn job(self, ticks: u32) -> Job {
        let plant = match self {
            Self::IdealStep => scene(1e-3, 1, ticks),
            Self::IdealLoop | Self::HilLoop => scene(2.5e-4, 4, ticks),
            Self::SupervisedLoop => supervised(&scene(2.5e-4, 4, ticks)),
            Self::JointLoop => with_joints(&scene(2.5e-4, 4, ticks)),
        };
        // As a campaign without dispersions would: what its one parameter set has not is not computed.
        let effects = EffectSet::of(&plant.nominal, &plant.timing);
        let plant = plant.with_effects(effects);
        let both = matches!(self, Self::HilLoop | Self::SupervisedLoop | Self::JointLoop);
        let mut job = Job::new(plant, 1, both);
        job.batch.loops = if both { Loops::Both } else { Loops::SpaceOnly };
        job
    }

    /// Flop per tick, where they can be counted (the ideal twin).
    pub fn flops(self) -> usize {
        let plant = self.job(1).plant;
        ideal_step_flops(&plant) * plant.timing.substeps as usize
    }
}

/// Speed over `repeats` windows of about `seconds` each.
///
/// # Errors
/// Those of the engine.
pub fn speed(
    engine: &mut dyn Engine,
    scene: Scene,
    runs: u64,
    seconds: f64,
    repeats: usize,
) -> Result<Speed, EngineError> {
    // A run of a few ticks would measure its start; the length is part of the kernel, so each is run once to compile.
    let mut ticks = 512;
    let batch = runs as f64 * f64::from(ticks);
    let (first, second) = (measure(engine, scene, runs, ticks)?, measure(engine, scene, runs, ticks)?);
    let first_more = (batch / first - batch / second).max(0.0);
    let mut rate = first.max(second);
    while (runs as f64) * f64::from(ticks) / rate < 0.5 * seconds && ticks < 1 << 20 {
        ticks = (seconds * rate / runs as f64).clamp(f64::from(ticks) * 2.0, 1.1e6) as u32;
        rate = measure(engine, scene, runs, ticks)?.max(measure(engine, scene, runs, ticks)?);
    }
    let mut rates = vec![rate];
    for _ in 1..repeats {
        rates.push(measure(engine, scene, runs, ticks)?);
    }
    rates.sort_by(f64::total_cmp);
    Ok(Speed { ticks: rates[rates.len() / 2], first: first_more })
}

/// What the rules of a session cost on an engine, as a share of a tick of both loops without them: the median of `pairs`
/// measurements side by side.
///
/// # Errors
/// Those of the engine.
pub fn cost_of_rules(engine: &mut dyn Engine, runs: u64, seconds: f64, pairs: usize) -> Result<f64, EngineError> {
    let rate = measure(engine, Scene::HilLoop, runs, 512)?;
    let ticks = (seconds * rate / runs as f64).clamp(512.0, 1.1e6) as u32;
    let mut costs = Vec::new();
    for _ in 0..pairs {
        let free = measure(engine, Scene::HilLoop, runs, ticks)?;
        costs.push(free / measure(engine, Scene::SupervisedLoop, runs, ticks)? - 1.0);
    }
    costs.sort_by(f64::total_cmp);
    Ok(costs[costs.len() / 2])
}

fn measure(engine: &mut dyn Engine, scene: Scene, runs: u64, ticks: u32) -> Result<f64, EngineError> {
    let job = scene.job(ticks);
    let inputs: Vec<RunInput> = (0..runs).map(|run| RunInput::new(run, job.plant.nominal)).collect();
    let began = Instant::now();
    let rows = engine.run(&job, &inputs, &|_| true)?;
    let seconds = began.elapsed().as_secs_f64();
    Ok(rows.len() as f64 * f64::from(ticks) / seconds)
}
