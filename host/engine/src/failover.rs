//! An engine that may fail, and the CPU lanes that take its place for good when it does.

use crate::cpu::CpuEngine;
use crate::{Engine, EngineError, Job, RunInput};
use softdock_kernels::outcome::Finished;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A first engine until its device fails, then the CPU.
///
/// A batch comes from one engine as a whole, and [`Engine::device`] names it after the batch: no rows are mixed.
pub struct Failover {
    engine: Box<dyn Engine>,
    replaced: bool,
    tell: fn(&EngineError),
}

impl Failover {
    /// Begins with `first`; `tell` hears why it is replaced.
    pub fn new(first: Box<dyn Engine>, tell: fn(&EngineError)) -> Self {
        Self { engine: first, replaced: false, tell }
    }
}

impl Engine for Failover {
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
        progress: &(dyn Fn(usize) -> bool + Sync),
    ) -> Result<Vec<Finished>, EngineError> {
        let counted = AtomicUsize::new(0);
        let counting = |ended: usize| {
            counted.fetch_add(ended, Ordering::Relaxed);
            progress(ended)
        };
        match self.engine.run(job, runs, &counting) {
            Err(error) if error.is_of_the_device() && !self.replaced => (self.tell)(&error),
            answer => return answer,
        }
        self.engine = Box::new(CpuEngine::new());
        self.replaced = true;
        // Runs that were counted and then lost with the batch are not counted again.
        let again = |ended: usize| {
            let owed = counted.load(Ordering::Relaxed).min(ended);
            counted.fetch_sub(owed, Ordering::Relaxed);
            progress(ended - owed)
        };
        self.engine.run(job, runs, &again)
    }
}
