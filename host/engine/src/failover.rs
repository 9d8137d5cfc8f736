//! An engine that may fail, and the CPU lanes that take its place for good when it does.

use crate::cpu::CpuEngine;
use crate::{Engine, EngineError, Job, RunInput};
use softdock_kernels::outcome::Finished;

/// A first engine until its device fails, then the CPU.
///
/// A batch comes from one engine as a whole, and [`Engine::device`] names it after the batch: no rows are mixed. Runs
/// that had ended on the first engine are reported as progress once more when the CPU has made them.
pub struct Failover<'a> {
    engine: Box<dyn Engine + 'a>,
    replaced: bool,
    report: Box<dyn Fn(&EngineError) + 'a>,
}

impl<'a> Failover<'a> {
    /// Begins with `first`; `report` receives the reason why it is replaced.
    pub fn new(first: Box<dyn Engine + 'a>, report: impl Fn(&EngineError) + 'a) -> Self {
        Self { engine: first, replaced: false, report: Box::new(report) }
    }
}

impl Engine for Failover<'_> {
    fn device(&self) -> String {
        self.engine.device()
    }

    fn lanes(&self) -> usize {
        self.engine.lanes()
    }

    fn run(
        &mut self,
        job: &Job,
        runs: &[RunInput],
        progress: &(dyn Fn(&[Finished]) -> bool + Sync),
    ) -> Result<Vec<Finished>, EngineError> {
        match self.engine.run(job, runs, progress) {
            Err(error) if error.is_of_the_device() && !self.replaced => (self.report)(&error),
            answer => return answer,
        }
        self.engine = Box::new(CpuEngine::new());
        self.replaced = true;
        self.engine.run(job, runs, progress)
    }
}
