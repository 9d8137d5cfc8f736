//! Parity of the GPU's f32 with the f64 truth, function by function and tick by tick, on every adapter there is.

mod blocks;
mod frame;
mod integers;
mod programs;
mod rounding;
mod samples;
mod stages;
mod table;

pub(crate) use rounding::evaluate;
use softdock_engine::Engine;
use softdock_engine::gpu::{Adapters, GpuEngine};

/// Invocations of a workgroup.
const WORKGROUP: usize = 64;
/// What an output holds before a function runs: a NaN that no arithmetic makes.
const POISON: u32 = 0x7fc0_dead;

/// Every adapter of the machine; `VK_DRIVER_FILES` chooses the drivers.
fn adapters() -> Vec<GpuEngine> {
    let found = GpuEngine::every(Adapters::Any).expect("every adapter gives a device");
    assert!(!found.is_empty(), "tests/run.sh installs lavapipe, a software adapter");
    found.iter().for_each(|gpu| println!("adapter: {}", gpu.device()));
    found
}

/// f32 words, as a storage buffer takes them.
fn words(values: impl IntoIterator<Item = f64>) -> Vec<u32> {
    values.into_iter().map(|value| (value as f32).to_bits()).collect()
}

/// The number in a word that a function must have written.
fn written(word: u32, what: impl FnOnce() -> String) -> f64 {
    assert_ne!(word, POISON, "{} was not written", what());
    f64::from(f32::from_bits(word))
}
