//! What this machine makes of the loops, on every backend at hand, beside its own peak.

use super::{Scene, Speed, cost_of_rules, cpu_peak, device_peak, speed};
use crate::cpu::CpuEngine;
use crate::gpu::{Adapters, GpuEngine, MOST_LANES};
use crate::instructions::InstructionSet;
use crate::{Engine, EngineError};
use serde::Serialize;

/// Runs that fill every lane of a thread several times.
const RUNS_PER_THREAD: u64 = 64;
/// Runs that fill a device.
const RUNS_ON_DEVICE: u64 = MOST_LANES as u64;
/// Runs of a software device, which has no more cores than this machine.
const RUNS_ON_SOFTWARE: u64 = 4096;

/// How long each speed is measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Windows {
    /// Length of a window \[s\].
    pub seconds: f64,
    /// Number of windows, whose median counts.
    pub repeats: usize,
}

impl Windows {
    /// Short windows: figures that scatter more.
    pub const QUICK: Self = Self { seconds: 0.1, repeats: 1 };
    /// Long windows.
    pub const FULL: Self = Self { seconds: 1.0, repeats: 3 };
}

/// Speeds of one backend.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BackendSpeed {
    /// Backend and device.
    pub backend: String,
    /// Threads; 0 for a device of its own.
    pub threads: usize,
    /// Ideal steps per second.
    pub ideal_steps_per_s: f64,
    /// Ticks of the ideal loop per second.
    pub ideal_ticks_per_s: f64,
    /// Ticks of both loops per second.
    pub hil_ticks_per_s: f64,
    /// The same with robots joint by joint.
    pub joint_ticks_per_s: f64,
    /// Time in which a device compiles the kernel of robots with joints \[s\]; none for CPU lanes.
    pub joint_compilation_s: Option<f64>,
    /// Cost of a session's rules, as a share of a HIL tick.
    pub rules_share_of_hil_tick: f64,
    /// Peak of the backend \[flop/s\].
    pub peak_flop_per_s: f64,
    /// Share of the peak that the ideal steps reach.
    pub share_of_peak: f64,
}

/// HIL ticks per second of a backend for a number of runs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RateOfRuns {
    /// Runs side by side.
    pub runs: u64,
    /// Ticks per second over all of them.
    pub hil_ticks_per_s: f64,
}

/// Rate of a backend against the number of runs that it is given at once.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RateGrowth {
    /// Backend and device.
    pub backend: String,
    /// Rates, by growing numbers of runs.
    pub rates: Vec<RateOfRuns>,
}

/// Speeds of this machine.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SpeedReport {
    /// Operations of an ideal step.
    pub flop_per_ideal_step: usize,
    /// Every backend at hand.
    pub backends: Vec<BackendSpeed>,
    /// CPU lanes on all threads, and the device if there is one.
    pub growth: Vec<RateGrowth>,
}

/// Measures every backend at hand.
///
/// # Errors
/// If a device fails, or the system refuses threads.
pub fn measure_machine(windows: Windows) -> Result<SpeedReport, EngineError> {
    let mut device = GpuEngine::new(Adapters::Any).map(Some).or_else(|error| match error {
        EngineError::NoAdapter(_) => Ok(None),
        error => Err(error),
    })?;
    let backends = backends(device.as_mut(), windows)?;
    let growth = growths(device.as_mut(), windows)?;
    Ok(SpeedReport { flop_per_ideal_step: Scene::IdealStep.flops(), backends, growth })
}

fn backends(device: Option<&mut GpuEngine>, windows: Windows) -> Result<Vec<BackendSpeed>, EngineError> {
    let widest = InstructionSet::detect();
    let mut rows = Vec::new();
    for threads in thread_counts() {
        rows.push(on_threads(format!("cpu f64 {widest:?}"), widest, threads, windows)?);
    }
    if widest != InstructionSet::OneLane {
        rows.push(on_threads("cpu f64 one lane".to_owned(), InstructionSet::OneLane, 1, windows)?);
    }
    if let Some(engine) = device {
        rows.push(on_device(engine, windows)?);
    }
    Ok(rows)
}

/// 1, 2, 4, ... and all threads of this machine.
fn thread_counts() -> Vec<usize> {
    let all = rayon::current_num_threads();
    let mut counts: Vec<usize> = (0..).map(|power| 1 << power).take_while(|count| *count < all).collect();
    counts.push(all);
    counts
}

fn on_threads(
    backend: String,
    set: InstructionSet,
    threads: usize,
    windows: Windows,
) -> Result<BackendSpeed, EngineError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.map_err(|error| EngineError::Threads(error.to_string()))?;
    let runs = RUNS_PER_THREAD * threads as u64;
    let row = || row(backend, threads, runs, &mut CpuEngine::with(set), cpu_peak(set, windows.seconds), windows);
    Ok(BackendSpeed { joint_compilation_s: None, ..pool.install(row)? })
}

fn on_device(engine: &mut GpuEngine, windows: Windows) -> Result<BackendSpeed, EngineError> {
    // A software driver shares the cores' multipliers: f32 makes twice the f64 peak in the same registers.
    let cores = if engine.is_software() { 2.0 * cpu_peak(InstructionSet::detect(), windows.seconds) } else { 0.0 };
    let peak = device_peak(engine)?.max(cores);
    let (threads, runs) = match engine.is_software() {
        true => (rayon::current_num_threads(), RUNS_ON_SOFTWARE),
        false => (0, RUNS_ON_DEVICE),
    };
    row(engine.device(), threads, runs, engine, peak, windows)
}

fn row(
    backend: String,
    threads: usize,
    runs: u64,
    engine: &mut dyn Engine,
    peak: f64,
    windows: Windows,
) -> Result<BackendSpeed, EngineError> {
    let mut of = |scene| speed(engine, scene, runs, windows.seconds, windows.repeats);
    let joints = of(Scene::JointLoop)?;
    let [steps, ideal, hil] = [of(Scene::IdealStep)?, of(Scene::IdealLoop)?, of(Scene::HilLoop)?];
    Ok(BackendSpeed {
        ideal_steps_per_s: steps.ticks,
        ideal_ticks_per_s: ideal.ticks,
        hil_ticks_per_s: hil.ticks,
        joint_ticks_per_s: joints.ticks,
        rules_share_of_hil_tick: cost_of_rules(engine, runs, windows.seconds, 2 * windows.repeats + 1)?,
        joint_compilation_s: Some(joints.first),
        backend,
        threads,
        peak_flop_per_s: peak,
        share_of_peak: steps.ticks * Scene::IdealStep.flops() as f64 / peak,
    })
}

fn growths(device: Option<&mut GpuEngine>, windows: Windows) -> Result<Vec<RateGrowth>, EngineError> {
    let mut all = vec![growth(&mut CpuEngine::new(), &[1, 8, 64, 512, 4096], windows)?];
    if let Some(engine) = device.filter(|engine| !engine.is_software()) {
        all.push(growth(engine, &[64, 512, 4096, RUNS_ON_DEVICE], windows)?);
    }
    Ok(all)
}

fn growth(engine: &mut dyn Engine, runs: &[u64], windows: Windows) -> Result<RateGrowth, EngineError> {
    let mut rate = |runs| {
        let Speed { ticks, .. } = speed(engine, Scene::HilLoop, runs, windows.seconds, windows.repeats)?;
        Ok(RateOfRuns { runs, hil_ticks_per_s: ticks })
    };
    let rates = runs.iter().map(|runs| rate(*runs)).collect::<Result<_, EngineError>>()?;
    Ok(RateGrowth { backend: engine.device(), rates })
}

impl SpeedReport {
    /// As tables for a terminal.
    pub fn text(&self) -> String {
        let mut out = format!(
            "Scene: free base, 7 joints, free target, sphere in a cone with friction; {} flop per ideal step of 1 ms.\n\
         Loops: tick 1 ms in 4 substeps; HIL = both loops, delay 8 ms, lagging robots, noisy sensor; joints = the same, robots \
         joint by joint.\n\n\
         {:<44} {:>7} {:>12} {:>12} {:>12} {:>12} {:>10} {:>6}\n",
            self.flop_per_ideal_step,
            "backend",
            "threads",
            "ideal step/s",
            "ideal tick/s",
            "HIL tick/s",
            "joint tick/s",
            "peak Gflop",
            "share"
        );
        for row in &self.backends {
            let name: String = row.backend.chars().take(44).collect();
            let threads = if row.threads == 0 { "-".to_owned() } else { row.threads.to_string() };
            out += &format!(
                "{name:<44} {threads:>7} {:>12.0} {:>12.0} {:>12.0} {:>12.0} {:>10.1} {:>5.1}%\n",
                row.ideal_steps_per_s,
                row.ideal_ticks_per_s,
                row.hil_ticks_per_s,
                row.joint_ticks_per_s,
                row.peak_flop_per_s / 1e9,
                100.0 * row.share_of_peak
            );
        }
        for (row, seconds) in self.backends.iter().filter_map(|row| Some((row, row.joint_compilation_s?))) {
            out += &format!("\n{} compiles the kernel of robots with joints in {seconds:.1} s\n", row.backend);
        }
        for row in &self.backends {
            let name: String = row.backend.chars().take(44).collect();
            let (threads, percent) = (row.threads, 100.0 * row.rules_share_of_hil_tick);
            out += &format!("\nThe rules of a session cost {percent:.1} % of a HIL tick ({name}, {threads} threads)\n");
        }
        for RateGrowth { backend, rates } in &self.growth {
            out += &format!("\nCost against the number of runs (HIL loop, {backend}):\n");
            for RateOfRuns { runs, hil_ticks_per_s: rate } in rates {
                out += &format!("{runs:>6} runs {rate:>12.0} tick/s   {:>9.3} us per tick and run\n", 1e6 / rate);
            }
        }
        out.trim_end().to_owned()
    }
}
