//! The GPU engine: wgpu on any adapter, within WebGPU's default limits.

mod compute;
mod farm;

use crate::{Engine, EngineError, Job, RunInput};
use farm::Farm;
use softdock_kernels::outcome::Finished;
use std::sync::{Arc, Mutex};
use std::time::Instant;

/// Invocations in a workgroup; the frame's `@workgroup_size`.
pub const WORKGROUP: usize = 64;
/// Lanes at once on a real GPU: what the delay lines leave of WebGPU's 128 MiB binding.
const MOST_LANES: usize = 4096;
/// A dispatch should take about this long \[s\]: far below every driver's watchdog, far above its overhead.
const SLICE_SECONDS: f64 = 0.15;

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
    trouble: Arc<Mutex<Option<String>>>,
}

impl GpuEngine {
    /// Opens the first suitable adapter, real GPUs first.
    ///
    /// # Errors
    /// [`EngineError::NoAdapter`] if there is none, or none that gives a device.
    pub fn new(adapters: Adapters) -> Result<Self, EngineError> {
        let first = suitable(adapters).into_iter().next();
        Self::open(first.ok_or_else(|| EngineError::NoAdapter(String::new()))?)
    }

    /// Opens every suitable adapter, real GPUs first.
    ///
    /// # Errors
    /// [`EngineError::NoAdapter`] if one of them gives no device.
    pub fn every(adapters: Adapters) -> Result<Vec<Self>, EngineError> {
        suitable(adapters).into_iter().map(Self::open).collect()
    }

    fn open(adapter: wgpu::Adapter) -> Result<Self, EngineError> {
        let descriptor = wgpu::DeviceDescriptor { required_limits: wgpu::Limits::default(), ..Default::default() };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|error| EngineError::NoAdapter(format!(" that gives a device ({error})")))?;
        let trouble = Arc::new(Mutex::new(None));
        let note = Arc::clone(&trouble);
        device.set_device_lost_callback(move |reason, text| record(&note, format!("{reason:?}: {text}")));
        let note = Arc::clone(&trouble);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| record(&note, error.to_string())));
        Ok(Self { device, queue, info: adapter.get_info(), trouble })
    }

    /// What went wrong since the last look, if anything.
    fn check(&self) -> Result<(), EngineError> {
        match self.trouble.lock().expect("no holder panics").take() {
            Some(text) => Err(EngineError::DeviceLost(text)),
            None => Ok(()),
        }
    }
}

/// The adapters that are welcome, real GPUs first.
fn suitable(adapters: Adapters) -> Vec<wgpu::Adapter> {
    let instance = wgpu::Instance::default();
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
fn record(trouble: &Mutex<Option<String>>, text: String) {
    trouble.lock().expect("no holder panics").get_or_insert(text);
}

impl Engine for GpuEngine {
    fn device(&self) -> String {
        let i = &self.info;
        format!("{} ({:?}, {} {})", i.name, i.backend, i.driver, i.driver_info)
    }

    fn run(
        &mut self,
        job: &Job,
        runs: &[RunInput],
        progress: &(dyn Fn(usize) -> bool + Sync),
    ) -> Result<Vec<Finished>, EngineError> {
        let most = if self.info.device_type == wgpu::DeviceType::Cpu { 1024 } else { MOST_LANES };
        let lanes = runs.len().clamp(1, most).next_multiple_of(WORKGROUP);
        let mut farm = Farm::new(self, job, lanes)?;
        let mut waiting = runs.iter();
        let mut out = Vec::with_capacity(runs.len());
        let mut ticks = 32;
        while farm.fill(&mut waiting) {
            let started = Instant::now();
            let ended = farm.slice(ticks, &mut out)?;
            // The slice's length changes no result: state goes through memory unrounded.
            let ratio = (SLICE_SECONDS / started.elapsed().as_secs_f64().max(1e-6)).clamp(0.5, 2.0);
            ticks = ((f64::from(ticks) * ratio) as u32).clamp(1, 1024);
            if ended > 0 && !progress(ended) {
                return Err(EngineError::Stopped);
            }
        }
        out.sort_by_key(|row| row.run);
        Ok(out)
    }
}
