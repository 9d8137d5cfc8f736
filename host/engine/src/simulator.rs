//! Who simulates sections of the loop: CPU lanes, or a GPU for the blocks, which have kernels of their own.

use crate::blocks::Outputs;
use crate::decimator::Decimator;
use crate::gpu::{Adapters, GpuEngine};
use crate::section::Section;
use crate::{Choice, EngineError};
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use softdock_kernels::block::Recorded;
use std::sync::{Arc, Once};

/// Who simulates.
#[derive(Clone, Debug, Default)]
pub enum Simulator {
    /// CPU lanes, in f64.
    #[default]
    Lanes,
    /// A GPU, in f32; CPU lanes for whole facilities, and for all once the device has failed.
    Gpu(Arc<Device>),
}

/// A GPU, and who hears of its failure.
#[derive(Debug)]
pub struct Device {
    engine: GpuEngine,
    report: fn(&EngineError),
    reported: Once,
}

impl Simulator {
    /// Opens what was chosen; `report` receives the reason why the CPU takes over, should a GPU fail.
    ///
    /// # Errors
    /// [`EngineError::NoAdapter`] if a GPU was asked for and there is none.
    pub fn open(choice: Choice, report: fn(&EngineError)) -> Result<Self, EngineError> {
        let adapters = match choice {
            Choice::Cpu => return Ok(Self::Lanes),
            Choice::Gpu => Adapters::Any,
            Choice::Auto => Adapters::Hardware,
        };
        match GpuEngine::new(adapters) {
            Ok(engine) => Ok(Self::Gpu(Arc::new(Device { engine, report, reported: Once::new() }))),
            Err(EngineError::NoAdapter(_)) if choice == Choice::Auto => Ok(Self::Lanes),
            Err(error) => Err(error),
        }
    }

    /// Whether it simulates a section in single precision.
    pub fn is_single(&self, section: &Section) -> bool {
        matches!((self, section), (Self::Gpu(_), Section::Block(_)))
    }

    /// Simulates a section for every recording and every parameter set, and gives what a decimator keeps of it; the
    /// result as of [`crate::blocks::simulate`].
    pub fn simulate(
        &self,
        section: &Section,
        recordings: &[&Recorded],
        sets: &[Vec<f64>],
        decimator: &Decimator,
    ) -> Outputs {
        let (Self::Gpu(device), Section::Block(kind)) = (self, section) else {
            return section.simulate(recordings, sets, decimator);
        };
        let channels = kind.outputs().len();
        let passed = |sets: Vec<Vec<f64>>| sets.into_par_iter().map(|own| decimator.pass(own, channels)).collect();
        match device.engine.simulate(*kind, recordings, sets) {
            Ok(outputs) => outputs.into_iter().map(passed).collect(),
            Err(error) => {
                device.reported.call_once(|| (device.report)(&error));
                section.simulate(recordings, sets, decimator)
            }
        }
    }
}
