//! One batch on the device: bounded slices, finished lanes refilled with the next run.

use super::{GpuEngine, WORKGROUP};
use crate::{EngineError, Job, RunInput};
use softdock_kernels::fields::{fields, from_slice, to_vec};
use softdock_kernels::metrics::Metrics;
use softdock_kernels::outcome::Finished;
use softdock_kernels::quads::{self, word};
use softdock_tracer::kernel::{Kernel, kernel};
use std::sync::Arc;

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
}

/// A job's kernel, its entry points compiled over one layout of bindings.
#[derive(Debug)]
pub(super) struct Compiled {
    job: Job,
    kernel: Kernel,
    bindings: wgpu::BindGroupLayout,
    begin: wgpu::ComputePipeline,
    slice: wgpu::ComputePipeline,
    end: wgpu::ComputePipeline,
}

impl Compiled {
    /// Of the engine's last batch if its job was the same, else newly traced and compiled.
    fn of(engine: &GpuEngine, job: &Job) -> Result<Arc<Self>, EngineError> {
        let mut last = engine.compiled.lock().expect("no holder panics");
        if let Some(known) = last.as_ref().filter(|known| known.job == *job) {
            return Ok(Arc::clone(known));
        }
        let compiled = Arc::new(Self::new(engine, job)?);
        *last = Some(Arc::clone(&compiled));
        Ok(compiled)
    }

    fn new(engine: &GpuEngine, job: &Job) -> Result<Self, EngineError> {
        use wgpu::BufferBindingType::{Storage, Uniform};
        let read = Storage { read_only: true };
        let write = Storage { read_only: false };
        let kernel = kernel(&job.plant, job.batch);
        // The frame's bindings: batch, controls, inputs, states, lines, outcomes; with meshes their tables.
        let tables = (!kernel.tables.is_empty()).then_some(read);
        let entries: Vec<_> = (0..)
            .zip([Uniform, write, read, write, write, write].into_iter().chain(tables))
            .map(|(binding, ty)| wgpu::BindGroupLayoutEntry {
                binding,
                visibility: wgpu::ShaderStages::COMPUTE,
                ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
                count: None,
            })
            .collect();
        let descriptor = wgpu::BindGroupLayoutDescriptor { label: Some("farm"), entries: &entries };
        let bindings = engine.device.create_bind_group_layout(&descriptor);
        let layout = engine.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("farm"),
            bind_group_layouts: &[Some(&bindings)],
            ..Default::default()
        });
        let [begin, slice, end] = engine.compile(&kernel.text, ["begin", "slice", "end"], Some(&layout))?;
        Ok(Self { job: job.clone(), kernel, bindings, begin, slice, end })
    }

    /// Lanes for up to `most` runs at once: whole workgroups, as many as each buffer's binding holds (at least one).
    fn lanes(&self, engine: &GpuEngine, most: usize) -> usize {
        let (inputs, outcome) = (self.kernel.inputs.len(), self.kernel.outcome);
        let vectors = [inputs, self.kernel.state, self.kernel.lines].map(quads::words);
        let words = vectors.into_iter().fold(outcome, usize::max);
        let room = engine.device.limits().max_storage_buffer_binding_size as usize / (words * size_of::<f32>());
        most.next_multiple_of(WORKGROUP).min(room / WORKGROUP * WORKGROUP).max(WORKGROUP)
    }
}

/// One batch on the device: kernel, buffers, and who is in which lane.
pub(super) struct Farm<'a> {
    engine: &'a GpuEngine,
    compiled: Arc<Compiled>,
    batch: Batch,
    fresh: bool,
    buffers: Buffers,
    lanes: Vec<Control>,
    /// Of every lane all parameters, and those that the kernel reads as its buffer has them.
    parameters: Vec<Vec<f32>>,
    inputs: Vec<f32>,
}

/// What a batch has on the device and the host reads or writes; the bindings keep the rest alive.
struct Buffers {
    bindings: wgpu::BindGroup,
    uniform: wgpu::Buffer,
    controls: wgpu::Buffer,
    inputs: wgpu::Buffer,
    outcomes: wgpu::Buffer,
    landing: wgpu::Buffer,
}

impl Buffers {
    fn new(engine: &GpuEngine, compiled: &Compiled, lanes: usize) -> Self {
        let kernel = &compiled.kernel;
        let words = |count: usize| (count.max(1) * lanes * size_of::<f32>()) as u64;
        let vectors = |numbers: usize| words(quads::words(numbers));
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC;
        let buffer = |label, size, usage| {
            let descriptor = wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false };
            engine.device.create_buffer(&descriptor)
        };
        let uniform =
            buffer("batch", size_of::<Batch>() as u64, wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST);
        let controls = buffer("controls", words(4), usage);
        let inputs = buffer("inputs", vectors(kernel.inputs.len()), usage);
        let states = buffer("states", vectors(kernel.state), usage);
        let lines = buffer("delay lines", vectors(kernel.lines), usage);
        let outcomes = buffer("outcomes", words(kernel.outcome), usage);
        let landing_usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        let landing = buffer("landing", words(kernel.outcome.max(4)), landing_usage);
        let tables = match kernel.tables.is_empty() {
            true => None,
            false => Some(engine.filled("tables of the meshes", bytemuck::cast_slice(&kernel.tables))),
        };
        let mut bound = vec![&uniform, &controls, &inputs, &states, &lines, &outcomes];
        bound.extend(&tables);
        Self { bindings: engine.bind(&compiled.bindings, &bound), uniform, controls, inputs, outcomes, landing }
    }
}

impl<'a> Farm<'a> {
    /// With a lane for each of `most` runs, as far as the device's bindings hold them.
    pub(super) fn new(engine: &'a GpuEngine, job: &Job, most: usize) -> Result<Self, EngineError> {
        let compiled = Compiled::of(engine, job)?;
        let lanes = compiled.lanes(engine, most);
        let inputs = vec![0.0; quads::words(compiled.kernel.inputs.len()) * lanes];
        let parameters = vec![Vec::new(); lanes];
        let buffers = engine.with_room(|| Buffers::new(engine, &compiled, lanes))?;
        let batch = Batch { lanes: lanes as u32, ticks: 0, key: job.batch.key };
        let idle = Control { run: [0; 2], status: Status::Idle as u32, tick: 0 };
        let lanes = vec![idle; lanes];
        Ok(Self { engine, compiled, batch, fresh: false, buffers, lanes, parameters, inputs })
    }

    /// Puts waiting runs into idle lanes; `false` when no lane has work.
    pub(super) fn fill(&mut self, waiting: &mut std::slice::Iter<RunInput>) -> bool {
        let count = self.lanes.len();
        let mut entered = false;
        for lane in 0..count {
            if self.lanes[lane].status != Status::Idle as u32 {
                continue;
            }
            let Some(input) = waiting.next() else { break };
            let run = [input.run as u32, (input.run >> 32) as u32];
            self.lanes[lane] = Control { run, status: Status::Fresh as u32, tick: 0 };
            self.parameters[lane] = to_vec(&input.params).into_iter().map(|value| value as f32).collect();
            for (index, field) in self.compiled.kernel.inputs.iter().enumerate() {
                self.inputs[word(index, count, lane)] = self.parameters[lane][*field];
            }
            entered = true;
        }
        self.fresh |= entered;
        if entered {
            self.engine.queue.write_buffer(&self.buffers.inputs, 0, bytemuck::cast_slice(&self.inputs));
            self.engine.queue.write_buffer(&self.buffers.controls, 0, bytemuck::cast_slice(&self.lanes));
        }
        self.lanes.iter().any(|c| c.status != Status::Idle as u32)
    }

    fn dispatch(&self, pipeline: &wgpu::ComputePipeline) {
        self.engine.dispatch(pipeline, &self.buffers.bindings, (self.lanes.len() / WORKGROUP) as u32);
    }

    /// Steps every lane by up to `ticks` ticks and appends the runs that have finished to `out`.
    pub(super) fn slice(&mut self, ticks: u32, out: &mut Vec<Finished>) -> Result<(), EngineError> {
        self.batch.ticks = ticks;
        self.engine.queue.write_buffer(&self.buffers.uniform, 0, bytemuck::bytes_of(&self.batch));
        if std::mem::take(&mut self.fresh) {
            self.dispatch(&self.compiled.begin);
        }
        self.dispatch(&self.compiled.slice);
        let controls: Vec<Control> =
            self.engine.read(&self.buffers.controls, &self.buffers.landing, self.lanes.len() * size_of::<Control>())?;
        self.lanes = controls;
        let ended: Vec<usize> =
            (0..self.lanes.len()).filter(|l| self.lanes[*l].status == Status::Finished as u32).collect();
        if !ended.is_empty() {
            self.dispatch(&self.compiled.end);
            let outcomes: Vec<f32> = self.engine.read(
                &self.buffers.outcomes,
                &self.buffers.landing,
                self.lanes.len() * self.compiled.kernel.outcome * 4,
            )?;
            for lane in &ended {
                out.push(self.finished(&outcomes, *lane));
                self.lanes[*lane].status = Status::Idle as u32;
            }
            self.engine.queue.write_buffer(&self.buffers.controls, 0, bytemuck::cast_slice(&self.lanes));
        }
        Ok(())
    }

    /// The finished run of one lane; its outcome holds the metrics of both loops and the state at the end.
    fn finished(&self, outcomes: &[f32], lane: usize) -> Finished {
        let values: Vec<f64> = (0..self.compiled.kernel.outcome)
            .map(|field| f64::from(outcomes[field * self.lanes.len() + lane]))
            .collect();
        let params: Vec<f64> = self.parameters[lane].iter().map(|value| f64::from(*value)).collect();
        let (space, rest) = values.split_at(fields::<f64, Metrics<f64>>().len());
        let (hil, end) = rest.split_at(space.len());
        let [low, high] = self.lanes[lane].run;
        let run = u64::from(low) | u64::from(high) << 32;
        let metrics = [from_slice(space), from_slice(hil)];
        Finished::new(&self.compiled.job.plant, run, from_slice(&params), metrics, &from_slice(end))
    }
}
