//! Pipelines, dispatches and read-back: what the farm does slice by slice, and tests and benchmarks once.

use super::{GpuEngine, one_line};
use crate::EngineError;
use std::sync::mpsc;
use std::time::{Duration, Instant};

/// Longest time in which another thread hands over what the device has answered.
const HAND_OVER: Duration = Duration::from_secs(60);

impl GpuEngine {
    /// Runs one entry point of a WGSL module once and gives back its buffers, as words.
    ///
    /// `buffers[i]` is storage binding `i` of group 0, read and written; every one must be used by the entry point.
    ///
    /// # Errors
    /// [`EngineError::Kernel`] if the module does not compile, [`EngineError::OutOfMemory`] if the buffers find no
    /// room, [`EngineError::DeviceLost`] if the device goes away.
    pub fn compute(
        &self,
        text: &str,
        entry: &str,
        workgroups: u32,
        buffers: &[Vec<u32>],
    ) -> Result<Vec<Vec<u32>>, EngineError> {
        Ok(self.compute_timed(text, entry, workgroups, buffers)?.0)
    }

    /// As [`compute`](Self::compute), with the seconds from the dispatch to its end (the driver may compile within them).
    pub(crate) fn compute_timed(
        &self,
        text: &str,
        entry: &str,
        workgroups: u32,
        buffers: &[Vec<u32>],
    ) -> Result<(Vec<Vec<u32>>, f64), EngineError> {
        let [pipeline] = self.compile(text, [entry], None)?;
        let (on_device, seconds) = self.execute(&pipeline, workgroups, buffers)?;
        let read: Result<Vec<_>, _> = on_device.iter().map(|buffer| self.words(buffer)).collect();
        Ok((read?, seconds))
    }

    /// Runs a pipeline once on such buffers, and gives them back with the seconds from the dispatch to its end.
    pub(super) fn execute(
        &self,
        pipeline: &wgpu::ComputePipeline,
        workgroups: u32,
        buffers: &[Vec<u32>],
    ) -> Result<(Vec<wgpu::Buffer>, f64), EngineError> {
        self.check()?;
        let (on_device, bindings) = self.with_room(|| {
            let on_device: Vec<_> =
                buffers.iter().map(|words| self.filled("words", bytemuck::cast_slice(words))).collect();
            let bindings = self.bind(&pipeline.get_bind_group_layout(0), &on_device.iter().collect::<Vec<_>>());
            (on_device, bindings)
        })?;
        self.wait()?;
        let began = Instant::now();
        self.dispatch(pipeline, &bindings, workgroups);
        self.wait()?;
        Ok((on_device, began.elapsed().as_secs_f64()))
    }

    /// What a buffer holds.
    pub(super) fn words(&self, buffer: &wgpu::Buffer) -> Result<Vec<u32>, EngineError> {
        let landing = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: buffer.size(),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        self.read(buffer, &landing, buffer.size() as usize)
    }

    /// Compiles the entry points of a module; a fault in it is a bug, reported with the driver's text.
    ///
    /// Without a layout each pipeline has its own, made of the bindings that its entry point uses.
    pub(super) fn compile<const N: usize>(
        &self,
        text: &str,
        entries: [&str; N],
        layout: Option<&wgpu::PipelineLayout>,
    ) -> Result<[wgpu::ComputePipeline; N], EngineError> {
        let scope = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let module = self.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("softdock"),
            source: wgpu::ShaderSource::Wgsl(text.into()),
        });
        let pipelines = entries.map(|entry| {
            self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(entry),
                layout,
                module: &module,
                entry_point: Some(entry),
                compilation_options: Default::default(),
                cache: None,
            })
        });
        match pollster::block_on(scope.pop()) {
            Some(error) => Err(EngineError::Kernel(error.to_string())),
            None => Ok(pipelines),
        }
    }

    /// Makes buffers and bindings; a lack of memory is an error here, not a fault later.
    pub(super) fn with_room<T>(&self, make: impl FnOnce() -> T) -> Result<T, EngineError> {
        let memory = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let limits = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let made = make();
        let over_limits = pollster::block_on(limits.pop());
        // Without memory a buffer is invalid, and so is what binds it: the first cause is reported.
        match pollster::block_on(memory.pop()).or(over_limits) {
            Some(error) => Err(EngineError::OutOfMemory(one_line(&error))),
            None => self.check().map(|()| made),
        }
    }

    /// A storage buffer with contents; without memory the buffer is invalid, and nothing panics.
    pub(super) fn filled(&self, label: &str, contents: &[u8]) -> wgpu::Buffer {
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC;
        let size = contents.len() as u64;
        let descriptor = wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false };
        let buffer = self.device.create_buffer(&descriptor);
        self.queue.write_buffer(&buffer, 0, contents);
        buffer
    }

    /// Binds buffers to the bindings 0, 1, ... of group 0.
    pub(super) fn bind(&self, layout: &wgpu::BindGroupLayout, buffers: &[&wgpu::Buffer]) -> wgpu::BindGroup {
        let entries: Vec<_> = (0..)
            .zip(buffers)
            .map(|(binding, b)| wgpu::BindGroupEntry { binding, resource: b.as_entire_binding() })
            .collect();
        self.device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
    }

    /// Hands one dispatch to the device.
    pub(super) fn dispatch(&self, pipeline: &wgpu::ComputePipeline, bindings: &wgpu::BindGroup, workgroups: u32) {
        let mut encoder = self.device.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, bindings, &[]);
            pass.dispatch_workgroups(workgroups, 1, 1);
        }
        self.queue.submit([encoder.finish()]);
    }

    /// Waits until the device has done all that it was given.
    fn wait(&self) -> Result<(), EngineError> {
        let lost = |error: wgpu::PollError| EngineError::DeviceLost(error.to_string());
        self.device.poll(wgpu::PollType::wait_indefinitely()).map_err(lost)?;
        self.check()
    }

    /// Copies the beginning of a buffer to the host, through a mappable buffer at least as large.
    pub(super) fn read<T: bytemuck::Pod>(
        &self,
        buffer: &wgpu::Buffer,
        landing: &wgpu::Buffer,
        bytes: usize,
    ) -> Result<Vec<T>, EngineError> {
        let lost = |error: &dyn std::fmt::Display| EngineError::DeviceLost(error.to_string());
        let bytes = bytes as u64;
        let mut encoder = self.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(buffer, 0, landing, 0, bytes);
        self.queue.submit([encoder.finish()]);
        let (sender, receiver) = mpsc::channel();
        // Who waits no more needs no answer.
        landing.map_async(wgpu::MapMode::Read, 0..bytes, move |result| drop(sender.send(result)));
        self.wait()?;
        // Another thread that waits for the device may have fetched the answer, and be about to hand it over.
        match receiver.recv_timeout(HAND_OVER) {
            Ok(Ok(())) => {}
            Ok(Err(error)) => return Err(lost(&error)),
            Err(_) => return Err(EngineError::DeviceLost("the device did not answer".to_owned())),
        }
        let view = landing.get_mapped_range(0..bytes).map_err(|e| lost(&e))?;
        let values = bytemuck::pod_collect_to_vec(&view[..]);
        drop(view);
        landing.unmap();
        Ok(values)
    }
}
