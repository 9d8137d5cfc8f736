//! The GPU farm against f64 lanes, on whatever adapter there is (lavapipe in the tests).

use softdock_campaign::criteria::succeeds;
use softdock_engine::cpu::CpuEngine;
use softdock_engine::gpu::{Adapters, GpuEngine};
use softdock_engine::{Engine, EngineError, Job, RunInput};
use softdock_kernels::fields::{fields, to_vec};
use softdock_kernels::metrics::Metrics;
use softdock_kernels::outcome::Finished;
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use std::path::Path;

pub(crate) fn job_and_runs(campaign: &str, count: u64) -> (Job, Vec<RunInput>) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("campaigns").join(campaign);
    let campaign = softdock_campaign::load(&path).expect("a shipped campaign loads");
    let runs = (0..count).map(|run| RunInput::new(run, campaign.draw(run).expect("a draw").params)).collect();
    (Job::new(Plant::new(campaign.scenario.model), campaign.seed, true), runs)
}

pub(crate) fn gpu() -> GpuEngine {
    GpuEngine::new(Adapters::Any).expect("tests/run.sh installs lavapipe, a software adapter")
}

/// The same runs with their parameters as the GPU has applied them.
fn as_applied(rows: &[Finished]) -> Vec<RunInput> {
    rows.iter().map(|row| RunInput::new(row.run, row.params)).collect()
}

#[test]
fn f32_and_f64_give_the_same_verdicts_and_forces() {
    let (job, runs) = job_and_runs("smoke.toml", 48);
    let rows = gpu().run(&job, &runs, &|_| true).expect("the batch ends");
    let truth = CpuEngine::new().run(&job, &as_applied(&rows), &|_| true).expect("the batch ends");
    let passes = |run: &Finished| [&run.space, &run.hil].map(|side| succeeds(&job.plant.task, side));
    let flips = rows.iter().zip(&truth).filter(|(a, b)| passes(a) != passes(b)).count();
    assert_eq!(flips, 0, "48 runs far from their limits");
    let stops = |run: &Finished| run.stop.map(|stop| stop.rule);
    let other_stops = rows.iter().zip(&truth).filter(|(a, b)| stops(a) != stops(b)).count();
    assert_eq!(other_stops, 0, "the same rules stop the same sessions");
    for (a, b) in rows.iter().zip(&truth) {
        assert_eq!(a.flags, b.flags, "run {}", a.run);
        // A contact of 0.1 s sampled in f32 at 1 m lever arms: 1e-7 m on 5e5 N/m is 0.05 N; ten times that is a fault.
        let scale = b.space.peak_contact_force.max(10.0);
        assert!(
            (a.space.peak_contact_force - b.space.peak_contact_force).abs() < 0.02 * scale,
            "run {}: {a:?} {b:?}",
            a.run
        );
    }
}

#[test]
fn a_run_does_not_depend_on_its_lane_or_its_batch() {
    let (job, runs) = job_and_runs("smoke.toml", 24);
    let mut engine = gpu();
    let whole = engine.run(&job, &runs, &|_| true).expect("the batch ends");
    let mut reversed = runs.clone();
    reversed.reverse();
    assert_eq!(engine.run(&job, &reversed, &|_| true).expect("the batch ends"), whole);
    let parts: Vec<Finished> =
        runs.chunks(7).flat_map(|part| engine.run(&job, part, &|_| true).expect("the batch ends")).collect();
    assert_eq!(parts, whole);
}

#[test]
fn applied_parameters_are_the_drawn_ones_rounded_once() {
    let (job, runs) = job_and_runs("smoke.toml", 8);
    let rows = gpu().run(&job, &runs, &|_| true).expect("the batch ends");
    let names = fields::<f64, Params<f64>>();
    for (row, run) in rows.iter().zip(&runs) {
        for ((applied, drawn), field) in to_vec(&row.params).iter().zip(to_vec(&run.params)).zip(&names) {
            assert_eq!(*applied, f64::from(drawn as f32), "{} of run {}", field.name, run.run);
        }
    }
}

#[test]
fn stopped_gpu_batch_returns_finished_runs() {
    let (job, runs) = job_and_runs("smoke.toml", 48);
    let mut engine = gpu();
    match engine.run(&job, &runs, &|_| false) {
        Err(EngineError::Stopped { finished }) => {
            assert!(!finished.is_empty() && finished.len() < runs.len(), "{} runs", finished.len());
            let first: Vec<RunInput> = runs.iter().filter(|run| run.run == finished[0].run).cloned().collect();
            assert_eq!(engine.run(&job, &first, &|_| true).expect("one run")[0], finished[0], "the run is whole");
        }
        other => panic!("{} runs instead of a stopped batch", other.map_or(0, |rows| rows.len())),
    }
}

#[test]
fn stopped_cpu_batch_returns_finished_runs() {
    let (job, runs) = job_and_runs("smoke.toml", 64);
    let whole = CpuEngine::new().run(&job, &runs, &|_| true).expect("the batch ends");
    match CpuEngine::new().run(&job, &runs, &|_| false) {
        Err(EngineError::Stopped { finished }) => {
            assert!(!finished.is_empty() && finished.len() < runs.len(), "{} runs", finished.len());
            assert!(finished.iter().all(|run| *run == whole[run.run as usize]), "as in the whole batch");
        }
        other => panic!("{} runs instead of a stopped batch", other.map_or(0, |rows| rows.len())),
    }
}

#[test]
fn every_metric_of_a_docking_with_an_arm_is_close_in_the_median() {
    let (job, runs) = job_and_runs("probe_drogue.toml", 16);
    let rows = gpu().run(&job, &runs, &|_| true).expect("the batch ends");
    let truth = CpuEngine::new().run(&job, &as_applied(&rows), &|_| true).expect("the batch ends");
    for (index, field) in fields::<f64, Metrics<f64>>().iter().enumerate() {
        if field.name.ends_with("momentum_error") {
            continue; // f32 rounding is all that this metric shows there
        }
        // Speeds are compared with the closing speed: what is left after capture is a rattle about zero.
        let floor = if field.unit == "m/s" { 0.05 } else { 1e-3 };
        let value = |row: &Finished| to_vec(&row.space)[index];
        let mut differences: Vec<f64> =
            rows.iter().zip(&truth).map(|(a, b)| (value(a) - value(b)).abs() / value(b).abs().max(floor)).collect();
        differences.sort_by(f64::total_cmp);
        // Contact with friction is chaotic: single runs may part, the median may not.
        assert!(differences[differences.len() / 2] < 0.01, "{}: {differences:?}", field.name);
    }
}
