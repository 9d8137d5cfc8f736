//! Failing devices: destroyed in mid-batch, or without memory, and the fallback.

use crate::gpu::{gpu, job_and_runs};
use softdock_engine::cpu::CpuEngine;
use softdock_engine::failover::Failover;
use softdock_engine::gpu::{Adapters, GpuEngine};
use softdock_engine::{Engine, EngineError, Job};
use softdock_kernels::plant::Plant;
use std::sync::atomic::{AtomicUsize, Ordering};

#[test]
fn destroyed_device_is_a_permanent_error() {
    let (job, runs) = job_and_runs("smoke.toml", 48);
    let mut engine = gpu();
    let destroy = engine.breaker();
    let first = engine.run(&job, &runs, &|_| {
        destroy();
        true
    });
    let error = first.expect_err("the device is gone");
    assert!(matches!(error, EngineError::DeviceLost(_)), "{error:?}");
    assert_contains(&error, &["the GPU was lost in mid-batch (", "finished shards are safe", "--backend cpu"]);
    let again = engine.run(&job, &runs, &|_| true).expect_err("a lost device does not come back");
    assert!(matches!(again, EngineError::DeviceLost(_)), "{again:?}");
}

/// Asserts that the message of an error contains these parts.
fn assert_contains(error: &EngineError, parts: &[&str]) {
    let printed = error.to_string();
    for part in parts {
        assert!(printed.contains(part), "`{part}` in {printed}");
    }
}

/// Asserts that an error of memory states its remedies.
fn assert_out_of_memory(error: &EngineError) {
    assert!(matches!(error, EngineError::OutOfMemory(_)), "{error:?}");
    assert_contains(
        error,
        &["the GPU has too little memory for a batch (", "finished shards are safe", "--backend cpu"],
    );
}

/// llvmpipe of Mesa 22 reports no memory budget, so it rejects nothing; a GPU without free memory gives no device.
#[test]
fn a_batch_beyond_the_memory_budget_is_an_error() {
    let (job, runs) = job_and_runs("smoke.toml", 1);
    let mut engine = match GpuEngine::within(Adapters::Any, 0) {
        Ok(engine) => engine,
        Err(error) => {
            assert!(matches!(error, EngineError::NoAdapter(_)), "{error:?}");
            return assert_contains(&error, &["gives a device (Not enough memory", "--backend cpu"]);
        }
    };
    let software = engine.device().contains("llvmpipe");
    match engine.run(&job, &runs, &|_| true) {
        Err(error) => assert_out_of_memory(&error),
        Ok(_) => assert!(software, "a budget of nothing has held a batch on {}", engine.device()),
    }
}

#[test]
fn a_batch_beyond_the_limits_of_the_device_is_an_error() {
    let (job, runs) = job_and_runs("smoke.toml", 1);
    let mut engine = gpu();
    // Delay lines of 20,004 slots of 128 bytes in 64 lanes are 164 MB, where WebGPU's default limits allow 134.
    let mut model = (*job.plant).clone();
    (model.timing.substep, model.timing.substeps) = (1.6e-6, 4);
    let wide = Job::new(Plant::new(model), 1, true);
    assert_out_of_memory(&engine.run(&wide, &runs, &|_| true).expect_err("beyond the limit"));
    assert!(engine.run(&job, &runs, &|_| true).is_ok(), "a batch that fits is made by the same device");
}

#[test]
fn a_buffer_beyond_the_limits_of_the_device_is_an_error() {
    let text = "@group(0) @binding(0) var<storage, read_write> words: array<u32>;\n\
                @compute @workgroup_size(1) fn main() { words[0] = 1u; }";
    let engine = gpu();
    // 160 MiB, where WebGPU's default limits allow 128 in a binding.
    let error = engine.compute(text, "main", 1, &[vec![0; 40 << 20]]).expect_err("beyond the limit");
    assert!(matches!(error, EngineError::OutOfMemory(_)), "{error:?}");
    assert_eq!(engine.compute(text, "main", 1, &[vec![0; 4]]).expect("within it")[0], [1, 0, 0, 0]);
}

#[test]
fn cpu_takes_over_whole_batches_and_reports_it() {
    static REPORTED: AtomicUsize = AtomicUsize::new(0);
    let (job, runs) = job_and_runs("smoke.toml", 48);
    let first = gpu();
    let destroy = first.breaker();
    let mut engine = Failover::new(Box::new(first), |error| {
        assert!(matches!(error, EngineError::DeviceLost(_)), "{error:?}");
        REPORTED.fetch_add(1, Ordering::Relaxed);
    });
    assert!(!engine.device().starts_with("cpu"));
    let ended = AtomicUsize::new(0);
    let rows = engine.run(&job, &runs, &|made| {
        destroy();
        ended.store(made.len(), Ordering::Relaxed);
        true
    });
    let truth = CpuEngine::new().run(&job, &runs, &|_| true).expect("the batch ends");
    assert_eq!(rows.expect("the CPU goes on"), truth, "no row of the lost device is among them");
    assert!(ended.load(Ordering::Relaxed) > 0, "progress is reported");
    assert_eq!(REPORTED.load(Ordering::Relaxed), 1);
    assert!(engine.device().starts_with("cpu f64"), "{}", engine.device());
}

#[test]
fn user_stop_starts_no_cpu_fallback() {
    let (job, runs) = job_and_runs("smoke.toml", 48);
    let mut engine = Failover::new(Box::new(gpu()), |error| panic!("{error}"));
    match engine.run(&job, &runs, &|_| false) {
        // All lanes of a software driver end within one slice: then the batch is whole.
        Ok(rows) => assert_eq!(rows.len(), runs.len()),
        Err(error) => assert!(matches!(error, EngineError::Stopped { .. }), "{error:?}"),
    }
    assert!(!engine.device().starts_with("cpu"), "{}", engine.device());
}
