//! The GPU farm: wgpu on any adapter, bounded dispatches, finished lanes refilled with the next run.

use crate::{Engine, EngineError, Job, RunInput};
use softdock_kernels::fields::{fields, from_slice, to_vec};
use softdock_kernels::kernel::{Kernel, kernel};
use softdock_kernels::metrics::Metrics;
use softdock_kernels::outcome::{Finished, RunEnd, run_flags};
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use softdock_kernels::vector::vec3;
use std::sync::{Arc, Mutex};
use std::time::Instant;
use wgpu::util::DeviceExt;

/// Invocations in a workgroup; the frame's `@workgroup_size`.
const WORKGROUP: usize = 64;
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

/// Status of a lane, as the frame has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
enum Status {
    Idle,
    Fresh,
    #[expect(dead_code, reason = "only the frame writes it")]
    Running,
    Finished,
}

/// One lane's control block; the frame's `Control`.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct Control {
    run: [u32; 2],
    status: u32,
    tick: u32,
}

/// The uniform block; the frame's `Batch`.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct Batch {
    lanes: u32,
    ticks: u32,
    key: [u32; 2],
    noisy: u32,
    padding: [u32; 3],
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
        let instance = wgpu::Instance::default();
        let mut found = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::PRIMARY));
        found.sort_by_key(|a| match a.get_info().device_type {
            wgpu::DeviceType::DiscreteGpu => 0,
            wgpu::DeviceType::IntegratedGpu => 1,
            wgpu::DeviceType::VirtualGpu => 2,
            wgpu::DeviceType::Other => 3,
            wgpu::DeviceType::Cpu => 4,
        });
        let welcome =
            |a: &wgpu::Adapter| adapters == Adapters::Any || a.get_info().device_type != wgpu::DeviceType::Cpu;
        let adapter = found.into_iter().find(welcome).ok_or_else(|| EngineError::NoAdapter(String::new()))?;
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

/// One batch on the device: buffers, pipeline, and who is in which lane.
struct Farm<'a> {
    engine: &'a GpuEngine,
    plant: &'a Plant,
    kernel: Kernel,
    batch: Batch,
    pipeline: wgpu::ComputePipeline,
    bindings: wgpu::BindGroup,
    uniform: wgpu::Buffer,
    controls: wgpu::Buffer,
    inputs: wgpu::Buffer,
    outcomes: wgpu::Buffer,
    landing: wgpu::Buffer,
    lanes: Vec<Control>,
    parameters: Vec<f32>,
}

impl<'a> Farm<'a> {
    fn new(engine: &'a GpuEngine, job: &'a Job, lanes: usize) -> Result<Self, EngineError> {
        let kernel = kernel(&job.plant);
        let pipeline = compile(engine, &kernel)?;
        let words = |count: usize| (count.max(1) * lanes * 4) as u64;
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC;
        let buffer = |label, size, usage| {
            engine.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage,
                mapped_at_creation: false,
            })
        };
        let parameters = vec![0.0; fields::<f64, Params<f64>>().len() * lanes];
        let points = prepared_points(&job.plant);
        let uniform = buffer("batch", 32, wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST);
        let controls = buffer("controls", words(4), usage);
        let inputs = buffer("inputs", (parameters.len() * 4) as u64, usage);
        let states = buffer("states", words(kernel.state), usage);
        let lines = buffer("delay lines", words(kernel.lines), usage);
        let bristles = buffer("bristles", words(6 * job.plant.contact.points.len()), usage);
        let outcomes = buffer("outcomes", words(kernel.outcome), usage);
        let points = engine.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("points"),
            contents: bytemuck::cast_slice(&points),
            usage: wgpu::BufferUsages::STORAGE,
        });
        let landing = buffer(
            "landing",
            words(kernel.outcome.max(4)),
            wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        );
        let bound = [&uniform, &controls, &inputs, &states, &lines, &bristles, &outcomes, &points];
        let entries: Vec<_> = (0..)
            .zip(bound)
            .map(|(binding, b)| wgpu::BindGroupEntry { binding, resource: b.as_entire_binding() })
            .collect();
        let bindings = engine.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("farm"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        engine.check()?;
        let batch = Batch {
            lanes: lanes as u32,
            ticks: 0,
            key: job.batch.key,
            noisy: u32::from(job.batch.noisy),
            padding: [0; 3],
        };
        let idle = Control { run: [0; 2], status: Status::Idle as u32, tick: 0 };
        Ok(Self {
            engine,
            plant: &job.plant,
            kernel,
            batch,
            pipeline,
            bindings,
            uniform,
            controls,
            inputs,
            outcomes,
            landing,
            lanes: vec![idle; lanes],
            parameters,
        })
    }

    /// Puts waiting runs into idle lanes; `false` when no lane has work.
    fn fill(&mut self, waiting: &mut std::slice::Iter<RunInput>) -> bool {
        let count = self.lanes.len();
        let mut entered = false;
        for lane in 0..count {
            if self.lanes[lane].status != Status::Idle as u32 {
                continue;
            }
            let Some(input) = waiting.next() else { break };
            let run = [input.run as u32, (input.run >> 32) as u32];
            self.lanes[lane] = Control { run, status: Status::Fresh as u32, tick: 0 };
            for (field, value) in to_vec(&input.params).into_iter().enumerate() {
                self.parameters[field * count + lane] = value as f32;
            }
            entered = true;
        }
        if entered {
            self.engine.queue.write_buffer(&self.inputs, 0, bytemuck::cast_slice(&self.parameters));
            self.engine.queue.write_buffer(&self.controls, 0, bytemuck::cast_slice(&self.lanes));
        }
        self.lanes.iter().any(|c| c.status != Status::Idle as u32)
    }

    /// Steps every lane by up to `ticks` ticks and takes out what has finished; gives their number.
    fn slice(&mut self, ticks: u32, out: &mut Vec<Finished>) -> Result<usize, EngineError> {
        self.batch.ticks = ticks;
        self.engine.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&self.batch));
        let mut encoder = self.engine.device.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &self.bindings, &[]);
            pass.dispatch_workgroups((self.lanes.len() / WORKGROUP) as u32, 1, 1);
        }
        self.engine.queue.submit([encoder.finish()]);
        let controls: Vec<Control> = self.read(&self.controls, self.lanes.len() * size_of::<Control>())?;
        self.lanes = controls;
        let ended: Vec<usize> =
            (0..self.lanes.len()).filter(|l| self.lanes[*l].status == Status::Finished as u32).collect();
        if !ended.is_empty() {
            let outcomes: Vec<f32> = self.read(&self.outcomes, self.lanes.len() * self.kernel.outcome * 4)?;
            for lane in &ended {
                out.push(self.finished(&outcomes, *lane));
                self.lanes[*lane].status = Status::Idle as u32;
            }
            self.engine.queue.write_buffer(&self.controls, 0, bytemuck::cast_slice(&self.lanes));
        }
        Ok(ended.len())
    }

    /// One lane's outcome: parameters as applied, metrics of both loops, and what the flags are made of.
    fn finished(&self, outcomes: &[f32], lane: usize) -> Finished {
        let values: Vec<f64> =
            (0..self.kernel.outcome).map(|field| f64::from(outcomes[field * self.lanes.len() + lane])).collect();
        let (params, rest) = values.split_at(fields::<f64, Params<f64>>().len());
        let (space, rest) = rest.split_at(fields::<f64, Metrics<f64>>().len());
        let (hil, extra) = rest.split_at(space.len());
        let (space, hil): (Metrics<f64>, Metrics<f64>) = (from_slice(space), from_slice(hil));
        let end = RunEnd {
            space,
            hil,
            space_watch: (extra[0] > 0.0, extra[1], extra[2]),
            hil_unstable: extra[3] > 0.0,
            saturated: extra[4] > 0.0,
            limited: extra[5] > 0.0,
            dropped: extra[6] > 0.0,
        };
        let [low, high] = self.lanes[lane].run;
        Finished {
            run: u64::from(low) | u64::from(high) << 32,
            params: from_slice(params),
            space,
            hil,
            flags: run_flags(self.plant, end),
            touch: [vec3(extra[7], extra[8], extra[9]), vec3(extra[10], extra[11], extra[12])],
        }
    }

    /// Copies the beginning of a buffer to the host.
    fn read<T: bytemuck::Pod>(&self, buffer: &wgpu::Buffer, bytes: usize) -> Result<Vec<T>, EngineError> {
        let lost = |error: &dyn std::fmt::Display| EngineError::DeviceLost(error.to_string());
        let bytes = bytes as u64;
        let mut encoder = self.engine.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(buffer, 0, &self.landing, 0, bytes);
        self.engine.queue.submit([encoder.finish()]);
        let mapped = Arc::new(Mutex::new(None));
        let answer = Arc::clone(&mapped);
        self.landing.map_async(wgpu::MapMode::Read, 0..bytes, move |result| {
            *answer.lock().expect("no holder panics") = Some(result);
        });
        self.engine.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| lost(&e))?;
        self.engine.check()?;
        match mapped.lock().expect("no holder panics").take() {
            Some(Ok(())) => {}
            Some(Err(error)) => return Err(lost(&error)),
            None => return Err(EngineError::DeviceLost("the device did not answer".to_owned())),
        }
        let view = self.landing.get_mapped_range(0..bytes).map_err(|e| lost(&e))?;
        let values = bytemuck::pod_collect_to_vec(&view[..]);
        drop(view);
        self.landing.unmap();
        Ok(values)
    }
}

/// Part A's points as the frame reads them: centre and radius.
fn prepared_points(plant: &Plant) -> Vec<[f32; 4]> {
    let point = |p: &softdock_kernels::model::ContactPoint| {
        [p.position.x, p.position.y, p.position.z, p.radius].map(|value| value as f32)
    };
    let mut points: Vec<_> = plant.contact.points.iter().map(point).collect();
    if points.is_empty() {
        points.push([0.0; 4]);
    }
    points
}

/// Compiles the kernel; a fault in it is our own, and is said with the driver's words.
fn compile(engine: &GpuEngine, kernel: &Kernel) -> Result<wgpu::ComputePipeline, EngineError> {
    let scope = engine.device.push_error_scope(wgpu::ErrorFilter::Validation);
    let module = engine.device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("softdock"),
        source: wgpu::ShaderSource::Wgsl(kernel.text.as_str().into()),
    });
    let pipeline = engine.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some("slice"),
        layout: None,
        module: &module,
        entry_point: Some("slice"),
        compilation_options: Default::default(),
        cache: None,
    });
    match pollster::block_on(scope.pop()) {
        Some(error) => Err(EngineError::Kernel(error.to_string())),
        None => Ok(pipeline),
    }
}
