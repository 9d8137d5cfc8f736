//! Runs a batch of HIL loops: on CPU lanes, or on a GPU; the only crate that names wgpu.

pub mod bench;
pub mod blocks;
pub mod contact_events;
pub mod contact_law;
pub mod cpu;
pub mod decimator;
pub mod effective_mass;
pub mod failover;
pub mod gpu;
pub mod instructions;
pub mod map;
pub mod section;
pub mod simulator;

use softdock_kernels::frame::{Batch, Loops, has_noisy_camera};
use softdock_kernels::outcome::Finished;
use softdock_kernels::params::Params;
use softdock_kernels::philox;
use softdock_kernels::plant::Plant;
use std::sync::Arc;

/// What all runs of a campaign have in common.
#[derive(Clone, Debug, PartialEq)]
pub struct Job {
    /// The scenario's prepared constants.
    pub plant: Plant,
    /// Seed and noise.
    pub batch: Batch,
}

impl Job {
    /// Creates a job; `noisy` if any run has noise of the sensor, jitter or drops.
    pub fn new(plant: Plant, seed: u64, noisy: bool) -> Self {
        let noisy = noisy || has_noisy_camera(&plant);
        Self { plant, batch: Batch { key: philox::key(seed), noisy, loops: Loops::Both } }
    }
}

/// Whether a parameter set needs random numbers inside the loop.
pub fn is_noisy(p: &Params<f64>) -> bool {
    p.delay_jitter > 0.0 || p.drop_probability > 0.0 || p.sensor_noise_force > 0.0 || p.sensor_noise_moment > 0.0
}

/// One run to be made.
#[derive(Clone, Debug, PartialEq)]
pub struct RunInput {
    /// The run's number: with the seed, all that its random numbers depend on.
    pub run: u64,
    /// Its parameters.
    pub params: Params<f64>,
    /// Its plant, if it has one of its own; otherwise that of the job.
    pub plant: Option<Arc<Plant>>,
}

impl RunInput {
    /// A run of the job's plant.
    pub fn new(run: u64, params: Params<f64>) -> Self {
        Self { run, params, plant: None }
    }
}

/// Why a batch did not come back.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EngineError {
    /// There is nothing to run on.
    #[error(
        "no GPU adapter found{0}; use `--backend cpu`, or install a Vulkan driver (Mesa's lavapipe runs without a GPU)"
    )]
    NoAdapter(String),
    /// The device went away in mid-batch; nothing of the batch is kept.
    #[error(
        "the GPU was lost in mid-batch ({0}); finished shards are safe: run the same command again, or add `--backend cpu`"
    )]
    DeviceLost(String),
    /// The device has no memory for a batch, or its limits are too small for it.
    #[error(
        "the GPU has too little memory for a batch ({0}); finished shards are safe: free its memory and run the same command again, or add `--backend cpu`"
    )]
    OutOfMemory(String),
    /// A GPU has one plant for all runs of a batch.
    #[error("runs with a plant of their own are made on the CPU: use `--backend cpu`")]
    OwnPlants,
    /// The kernel did not build.
    #[error("the kernel does not compile for this device: {0}")]
    Kernel(String),
    /// The system refuses threads.
    #[error("no threads: {0}")]
    Threads(String),
    /// Stopped by the user.
    #[error("stopped after {} runs of the batch", finished.len())]
    Stopped {
        /// The runs of the batch that had ended, in order of their numbers: each is whole.
        finished: Vec<Finished>,
    },
}

impl EngineError {
    /// Whether the device is at fault, and another one could make the same batch.
    pub fn is_of_the_device(&self) -> bool {
        matches!(self, Self::DeviceLost(_) | Self::OutOfMemory(_))
    }
}

/// Where runs are made.
pub trait Engine {
    /// Backend, device and driver in words, for the result files.
    fn device(&self) -> String;

    /// Most runs that are stepped side by side.
    fn lanes(&self) -> usize {
        1
    }

    /// Makes all runs and gives them back in order of their numbers.
    ///
    /// `progress` receives the runs that have ended since the last call, in any order; it answers `false` to stop the
    /// batch. Calls may come from several threads at a time.
    ///
    /// # Errors
    /// See [`EngineError`]. `Ok` holds every run of the batch. A batch that `progress` stops gives back the runs that
    /// have ended in [`EngineError::Stopped`]; any other error gives back none.
    fn run(
        &mut self,
        job: &Job,
        runs: &[RunInput],
        progress: &(dyn Fn(&[Finished]) -> bool + Sync),
    ) -> Result<Vec<Finished>, EngineError>;
}

/// The finished runs of a batch in order of their numbers; [`EngineError::Stopped`] if they are not all of them.
fn all_of(runs: &[RunInput], mut finished: Vec<Finished>) -> Result<Vec<Finished>, EngineError> {
    finished.sort_by_key(|row| row.run);
    match finished.len() == runs.len() {
        true => Ok(finished),
        false => Err(EngineError::Stopped { finished }),
    }
}

/// Which engine the user asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Choice {
    /// A real GPU if there is one, else the CPU.
    Auto,
    /// A GPU or a software Vulkan driver.
    Gpu,
    /// CPU lanes.
    Cpu,
}

impl Choice {
    /// Every choice: its word on a command line, its meaning, its value.
    pub const NAMED: [(&'static str, &'static str, Self); 3] = [
        ("auto", "A real GPU if there is one, else the CPU", Self::Auto),
        ("gpu", "A GPU, or a software Vulkan driver", Self::Gpu),
        ("cpu", "CPU lanes in f64", Self::Cpu),
    ];

    /// The word on a command line.
    pub fn word(self) -> &'static str {
        Self::NAMED[self as usize].0
    }
}

/// Opens an engine; `report` receives the reason why the CPU takes over, should a GPU of [`Choice::Auto`] fail.
///
/// # Errors
/// [`EngineError::NoAdapter`] if a GPU was asked for and there is none.
pub fn open<'a>(choice: Choice, report: impl Fn(&EngineError) + 'a) -> Result<Box<dyn Engine + 'a>, EngineError> {
    match choice {
        Choice::Cpu => Ok(Box::new(cpu::CpuEngine::new())),
        Choice::Gpu => Ok(Box::new(gpu::GpuEngine::new(gpu::Adapters::Any)?)),
        Choice::Auto => match gpu::GpuEngine::new(gpu::Adapters::Hardware) {
            Ok(engine) => Ok(Box::new(failover::Failover::new(Box::new(engine), report))),
            Err(EngineError::NoAdapter(why)) => {
                // Without any GPU the CPU is no surprise; one that is there and gives no device is.
                if !why.is_empty() {
                    report(&EngineError::NoAdapter(why));
                }
                Ok(Box::new(cpu::CpuEngine::new()))
            }
            Err(error) => Err(error),
        },
    }
}
