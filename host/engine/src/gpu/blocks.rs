//! Simulates blocks of the loop from their recordings on a GPU, in f32: one lane for every parameter set.

use super::{GpuEngine, WORKGROUP};
use crate::EngineError;
use crate::blocks::{BlockKind, Outputs};
use softdock_kernels::block::Recorded;

/// Outputs of all lanes of one dispatch: well within WebGPU's binding of 128 MiB.
const MOST_OUTPUTS: usize = 24 << 20;

/// What the kernel of a block depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Replay {
    kind: BlockKind,
    /// Bits of the step \[s\].
    step: u64,
}

impl GpuEngine {
    /// Simulates a block for every recording and every parameter set; the result as of [`crate::blocks::simulate`].
    ///
    /// # Errors
    /// Those of the device, see [`EngineError`].
    pub fn simulate(
        &self,
        kind: BlockKind,
        recordings: &[&Recorded],
        sets: &[Vec<f64>],
    ) -> Result<Outputs, EngineError> {
        recordings.iter().map(|recorded| self.simulate_one(kind, recorded, sets)).collect()
    }

    fn simulate_one(
        &self,
        kind: BlockKind,
        recorded: &Recorded,
        sets: &[Vec<f64>],
    ) -> Result<Vec<Vec<f64>>, EngineError> {
        let pipeline = self.replay(kind, recorded.step)?;
        let (inputs, late) = (words(recorded.inputs.iter().copied()), words(recorded.late.iter().copied()));
        let numbers = recorded.samples() * kind.outputs().len();
        let mut out = Vec::with_capacity(sets.len());
        for chunk in sets.chunks((MOST_OUTPUTS / numbers).max(1)) {
            let lanes = chunk.len();
            let offset = |field: usize| recorded.offsets.get(field).copied().unwrap_or(0.0);
            let of_field = |field: usize| chunk.iter().map(move |set| set[field] + offset(field));
            let parameters = (0..chunk[0].len()).flat_map(of_field);
            let buffers = [
                vec![lanes as u32, recorded.instants as u32, recorded.stride as u32],
                inputs.clone(),
                late.clone(),
                words(parameters),
                vec![0; numbers * lanes],
            ];
            let groups = lanes.div_ceil(WORKGROUP) as u32;
            let (on_device, _) = self.execute(&pipeline, groups, &buffers)?;
            let outputs = self.words(on_device.last().expect("the last buffer"))?;
            let number = |lane: usize, i: usize| f64::from(f32::from_bits(outputs[i * lanes + lane]));
            out.extend((0..lanes).map(|lane| (0..numbers).map(|i| number(lane, i)).collect()));
        }
        Ok(out)
    }

    /// The pipeline of a block with a step, compiled once.
    fn replay(&self, kind: BlockKind, step: f64) -> Result<wgpu::ComputePipeline, EngineError> {
        let key = Replay { kind, step: step.to_bits() };
        let mut known = self.replays.lock().expect("no holder panics");
        if let Some((_, pipeline)) = known.iter().find(|(own, _)| *own == key) {
            return Ok(pipeline.clone());
        }
        let [pipeline] = self.compile(&kind.kernel(step), ["replay"], None)?;
        known.push((key, pipeline.clone()));
        Ok(pipeline)
    }
}

fn words(values: impl Iterator<Item = f64>) -> Vec<u32> {
    values.map(|value| (value as f32).to_bits()).collect()
}
