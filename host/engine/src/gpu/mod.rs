//! The GPU engine: wgpu on any adapter, within WebGPU's default limits.

mod blocks;
mod compute;
mod farm;

use crate::{Engine, EngineError, Job, RunInput, all_of};
use blocks::Replay;
use farm::{Compiled, Farm};
use softdock_kernels::outcome::Finished;
use std::sync::{Arc, Mutex};
use std::time::Instant;

/// Invocations in a workgroup; the frame's `@workgroup_size`.
pub const WORKGROUP: usize = 64;
/// Lanes at once on a real GPU, as far as bindings hold them: the fastest of 4,096 to 65,536 on an H100.
pub const MOST_LANES: usize = 1 << 15;
/// The same on a software driver, which has no more cores than the host.
const MOST_SOFTWARE_LANES: usize = 1024;
/// A dispatch should take about this long \[s\]: far below every driver's watchdog, far above its overhead.
const SLICE_SECONDS: f64 = 0.15;
/// Ticks of a dispatch at most, independent of the duration of the one before.
const MOST_TICKS: u32 = 1 << 14;
/// Share of the device's memory budget \[%\] beyond which buffers are refused: above it drivers swap or fail.
const MEMORY_SHARE: u8 = 90;

/// Which adapters are welcome.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Adapters {
    /// Real GPUs only.
    Hardware,
    /// Software drivers such as lavapipe too.
    Any,
}

/// The GPU engine.
#[derive(Debug)]
pub struct GpuEngine {
    device: wgpu::Device,
    queue: wgpu::Queue,
    info: wgpu::AdapterInfo,
    /// Most runs that are stepped side by side.
    lanes: usize,
    trouble: Arc<Mutex<Option<EngineError>>>,
    /// Of the last batch: the next shard of a campaign has the same kernel.
    compiled: Mutex<Option<Arc<Compiled>>>,
    /// Of the blocks that were simulated, by their steps.
    replays: Mutex<Vec<(Replay, wgpu::ComputePipeline)>>,
}

impl GpuEngine {
    /// Opens the first suitable adapter, real GPUs first.
    ///
    /// # Errors
    /// [`EngineError::NoAdapter`] if there is none, or none that gives a device.
    pub fn new(adapters: Adapters) -> Result<Self, EngineError> {
        Self::within(adapters, MEMORY_SHARE)
    }

    /// As [`GpuEngine::new`], with buffers in at most this share of the device's memory budget \[%\].
    ///
    /// # Errors
    /// As [`GpuEngine::new`].
    pub fn within(adapters: Adapters, memory_share: u8) -> Result<Self, EngineError> {
        let first = suitable(adapters, memory_share).into_iter().next();
        Self::open(first.ok_or_else(|| EngineError::NoAdapter(String::new()))?)
    }

    /// Opens every suitable adapter, real GPUs first.
    ///
    /// # Errors
    /// [`EngineError::NoAdapter`] if one of them gives no device.
    pub fn every(adapters: Adapters) -> Result<Vec<Self>, EngineError> {
        suitable(adapters, MEMORY_SHARE).into_iter().map(Self::open).collect()
    }

    fn open(adapter: wgpu::Adapter) -> Result<Self, EngineError> {
        let descriptor = wgpu::DeviceDescriptor { required_limits: wgpu::Limits::default(), ..Default::default() };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|error| EngineError::NoAdapter(format!(" that gives a device ({error})")))?;
        let trouble = Arc::new(Mutex::new(None));
        let note = Arc::clone(&trouble);
        device.set_device_lost_callback(move |reason, text| {
            record(&note, EngineError::DeviceLost(format!("{reason:?}: {text}")));
        });
        let note = Arc::clone(&trouble);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            let text = one_line(&error);
            let out_of_memory = matches!(error, wgpu::Error::OutOfMemory { .. });
            record(&note, if out_of_memory { EngineError::OutOfMemory(text) } else { EngineError::DeviceLost(text) });
        }));
        let info = adapter.get_info();
        let lanes = if info.device_type == wgpu::DeviceType::Cpu { MOST_SOFTWARE_LANES } else { MOST_LANES };
        Ok(Self { device, queue, info, lanes, trouble, compiled: Mutex::default(), replays: Mutex::default() })
    }

    /// Whether the adapter is a software driver on this machine's own cores.
    pub fn is_software(&self) -> bool {
        self.info.device_type == wgpu::DeviceType::Cpu
    }

    /// Sets the number of runs that are stepped side by side; bindings may hold fewer. No result depends on it.
    pub fn set_lanes(&mut self, lanes: usize) {
        self.lanes = lanes.max(WORKGROUP);
    }

    /// What has gone wrong, if anything: a device that failed once is not trusted again.
    fn check(&self) -> Result<(), EngineError> {
        self.trouble.lock().expect("no holder panics").clone().map_or(Ok(()), Err)
    }

    /// A switch that destroys the device, as a driver's reset would: to try out what follows.
    #[doc(hidden)]
    pub fn breaker(&self) -> impl Fn() + Send + Sync + 'static {
        let device = self.device.clone();
        move || device.destroy()
    }
}

/// The adapters that are welcome, real GPUs first.
fn suitable(adapters: Adapters, memory_share: u8) -> Vec<wgpu::Adapter> {
    let mut options = wgpu::InstanceDescriptor::new_without_display_handle();
    options.memory_budget_thresholds.for_resource_creation = Some(memory_share);
    let instance = wgpu::Instance::new(options);
    let mut found = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::PRIMARY));
    found.retain(|a| adapters == Adapters::Any || a.get_info().device_type != wgpu::DeviceType::Cpu);
    found.sort_by_key(|a| match a.get_info().device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    });
    found
}

/// Keeps the first cause.
fn record(trouble: &Mutex<Option<EngineError>>, error: EngineError) {
    trouble.lock().expect("no holder panics").get_or_insert(error);
}

/// An error of wgpu with its causes, without line breaks.
fn one_line(error: &dyn std::error::Error) -> String {
    let causes = std::iter::successors(Some(error), |error| error.source());
    let mut words: Vec<String> = causes.map(|cause| cause.to_string()).collect();
    words.dedup();
    words.join(": ").split_whitespace().collect::<Vec<_>>().join(" ")
}

impl Engine for GpuEngine {
    fn device(&self) -> String {
        let i = &self.info;
        format!("{} ({:?}, {} {})", i.name, i.backend, i.driver, i.driver_info)
    }

    fn lanes(&self) -> usize {
        self.lanes
    }

    fn run(
        &mut self,
        job: &Job,
        runs: &[RunInput],
        progress: &(dyn Fn(&[Finished]) -> bool + Sync),
    ) -> Result<Vec<Finished>, EngineError> {
        self.check()?;
        if runs.iter().any(|run| run.plant.is_some()) {
            return Err(EngineError::OwnPlants);
        }
        let mut farm = Farm::new(self, job, runs.len().clamp(1, self.lanes()))?;
        let mut waiting = runs.iter();
        let mut out = Vec::with_capacity(runs.len());
        let mut ticks = 32;
        while farm.fill(&mut waiting) {
            let started = Instant::now();
            let before = out.len();
            farm.slice(ticks, &mut out)?;
            // The slice's length changes no result: state goes through memory unrounded.
            let ratio = (SLICE_SECONDS / started.elapsed().as_secs_f64().max(1e-6)).clamp(0.5, 2.0);
            ticks = ((f64::from(ticks) * ratio) as u32).clamp(1, MOST_TICKS);
            if out.len() > before && !progress(&out[before..]) {
                break;
            }
        }
        all_of(runs, out)
    }
}
