//! `softdock bench`: what this machine makes of the loops, in one run, beside its own peak.

use crate::args::BenchArgs;
use crate::words::{Exit, json, say};
use miette::IntoDiagnostic;
use serde_json::{Value, json};
use softdock_engine::bench::{Scene, Speed, cost_of_rules, cpu_peak, device_peak, speed};
use softdock_engine::cpu::CpuEngine;
use softdock_engine::gpu::{Adapters, GpuEngine, MOST_LANES};
use softdock_engine::instructions::InstructionSet;
use softdock_engine::{Engine, EngineError};

/// Runs that fill every lane of a thread several times.
const RUNS_PER_THREAD: u64 = 64;
/// Runs that fill a device.
const RUNS_ON_DEVICE: u64 = MOST_LANES as u64;
/// Runs of a software device, which has no more cores than this machine.
const RUNS_ON_SOFTWARE: u64 = 4096;

/// One line of the table.
struct Row {
    backend: String,
    threads: usize,
    ideal_steps: f64,
    ideal_ticks: f64,
    hil_ticks: f64,
    joint_ticks: f64,
    /// What the rules of a session cost, as a share of a HIL tick.
    rules: f64,
    /// What a device takes to compile the kernel of robots with joints \[s\].
    compilation: Option<f64>,
    peak: f64,
}

/// Measures every backend at hand and prints the tables.
pub(crate) fn bench(args: &BenchArgs) -> miette::Result<Exit> {
    let length = if args.quick { Length { seconds: 0.1, repeats: 1 } } else { Length { seconds: 1.0, repeats: 3 } };
    let mut device = GpuEngine::new(Adapters::Any).map(Some).or_else(|error| match error {
        EngineError::NoAdapter(_) => Ok(None),
        error => Err(error).into_diagnostic(),
    })?;
    let rows = backends(device.as_mut(), length)?;
    let growths = growths(device.as_mut(), length).into_diagnostic()?;
    let flops = Scene::IdealStep.flops();
    say(if args.json { json(&in_json(flops, &rows, &growths)) } else { in_words(flops, &rows, &growths) });
    Ok(Exit::Done)
}

/// How long is measured.
#[derive(Clone, Copy)]
struct Length {
    seconds: f64,
    repeats: usize,
}

fn backends(device: Option<&mut GpuEngine>, length: Length) -> miette::Result<Vec<Row>> {
    let widest = InstructionSet::detect();
    let mut rows = Vec::new();
    for threads in thread_counts() {
        let name = format!("cpu f64 {widest:?}");
        rows.push(on_threads(name, widest, threads, length)?);
    }
    if widest != InstructionSet::OneLane {
        rows.push(on_threads("cpu f64 one lane".to_owned(), InstructionSet::OneLane, 1, length)?);
    }
    if let Some(engine) = device {
        rows.push(on_device(engine, length).into_diagnostic()?);
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

fn on_threads(backend: String, set: InstructionSet, threads: usize, length: Length) -> miette::Result<Row> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().into_diagnostic()?;
    let runs = RUNS_PER_THREAD * threads as u64;
    let row = || row(backend, threads, runs, &mut CpuEngine::with(set), cpu_peak(set, length.seconds), length);
    Ok(Row { compilation: None, ..pool.install(row).into_diagnostic()? })
}

fn on_device(engine: &mut GpuEngine, length: Length) -> Result<Row, EngineError> {
    // A software driver shares the cores' multipliers: f32 makes twice the f64 peak in the same registers.
    let cores = if engine.is_software() { 2.0 * cpu_peak(InstructionSet::detect(), length.seconds) } else { 0.0 };
    let peak = device_peak(engine)?.max(cores);
    let (threads, runs) = match engine.is_software() {
        true => (rayon::current_num_threads(), RUNS_ON_SOFTWARE),
        false => (0, RUNS_ON_DEVICE),
    };
    row(engine.device(), threads, runs, engine, peak, length)
}

fn row(
    backend: String,
    threads: usize,
    runs: u64,
    engine: &mut dyn Engine,
    peak: f64,
    length: Length,
) -> Result<Row, EngineError> {
    let mut of = |scene| speed(engine, scene, runs, length.seconds, length.repeats);
    let joints = of(Scene::JointLoop)?;
    let [steps, ideal, hil] = [of(Scene::IdealStep)?, of(Scene::IdealLoop)?, of(Scene::HilLoop)?];
    Ok(Row {
        ideal_steps: steps.ticks,
        ideal_ticks: ideal.ticks,
        hil_ticks: hil.ticks,
        joint_ticks: joints.ticks,
        rules: cost_of_rules(engine, runs, length.seconds, 2 * length.repeats + 1)?,
        compilation: Some(joints.first),
        backend,
        threads,
        peak,
    })
}

/// HIL ticks per second of a backend against the number of runs that it is given at once.
struct Growth {
    backend: String,
    /// Runs, and ticks per second over all of them.
    rates: Vec<(u64, f64)>,
}

/// Of the CPU's lanes on all threads, and of the device if there is one.
fn growths(device: Option<&mut GpuEngine>, length: Length) -> Result<Vec<Growth>, EngineError> {
    let mut all = vec![growth(&mut CpuEngine::new(), &[1, 8, 64, 512, 4096], length)?];
    if let Some(engine) = device.filter(|engine| !engine.is_software()) {
        all.push(growth(engine, &[64, 512, 4096, RUNS_ON_DEVICE], length)?);
    }
    Ok(all)
}

fn growth(engine: &mut dyn Engine, runs: &[u64], length: Length) -> Result<Growth, EngineError> {
    let mut rate = |runs| {
        let Speed { ticks, .. } = speed(engine, Scene::HilLoop, runs, length.seconds, length.repeats)?;
        Ok((runs, ticks))
    };
    let rates = runs.iter().map(|runs| rate(*runs)).collect::<Result<_, EngineError>>()?;
    Ok(Growth { backend: engine.device(), rates })
}

impl Row {
    /// Share of the peak that the ideal steps reach.
    fn share(&self, flops: usize) -> f64 {
        self.ideal_steps * flops as f64 / self.peak
    }
}

fn in_words(flops: usize, rows: &[Row], growths: &[Growth]) -> String {
    let mut out = format!(
        "Scene: free base, 7 joints, free target, sphere in a cone with friction; {flops} flop per ideal step of 1 ms.\n\
         Loops: tick 1 ms in 4 substeps; HIL = both loops, delay 8 ms, lagging robots, noisy sensor; joints = the same, robots \
         joint by joint.\n\n\
         {:<44} {:>7} {:>12} {:>12} {:>12} {:>12} {:>10} {:>6}\n",
        "backend", "threads", "ideal step/s", "ideal tick/s", "HIL tick/s", "joint tick/s", "peak Gflop", "share"
    );
    for row in rows {
        let name: String = row.backend.chars().take(44).collect();
        let threads = if row.threads == 0 { "-".to_owned() } else { row.threads.to_string() };
        out += &format!(
            "{name:<44} {threads:>7} {:>12.0} {:>12.0} {:>12.0} {:>12.0} {:>10.1} {:>5.1}%\n",
            row.ideal_steps,
            row.ideal_ticks,
            row.hil_ticks,
            row.joint_ticks,
            row.peak / 1e9,
            100.0 * row.share(flops)
        );
    }
    for (row, seconds) in rows.iter().filter_map(|row| Some((row, row.compilation?))) {
        out += &format!("\n{} compiles the kernel of robots with joints in {seconds:.1} s\n", row.backend);
    }
    for row in rows {
        let name: String = row.backend.chars().take(44).collect();
        let (threads, percent) = (row.threads, 100.0 * row.rules);
        out += &format!("\nThe rules of a session cost {percent:.1} % of a HIL tick ({name}, {threads} threads)\n");
    }
    for Growth { backend, rates } in growths {
        out += &format!("\nCost against the number of runs (HIL loop, {backend}):\n");
        for (runs, rate) in rates {
            out += &format!("{runs:>6} runs {rate:>12.0} tick/s   {:>9.3} us per tick and run\n", 1e6 / rate);
        }
    }
    out.trim_end().to_owned()
}

fn in_json(flops: usize, rows: &[Row], growths: &[Growth]) -> Value {
    let rows: Vec<Value> = rows
        .iter()
        .map(|row| {
            json!({
                "backend": row.backend, "threads": row.threads, "ideal_steps_per_s": row.ideal_steps,
                "ideal_ticks_per_s": row.ideal_ticks, "hil_ticks_per_s": row.hil_ticks, "joint_ticks_per_s": row.joint_ticks,
                "joint_compilation_s": row.compilation, "rules_share_of_hil_tick": row.rules,
                "peak_flop_per_s": row.peak, "share_of_peak": row.share(flops),
            })
        })
        .collect();
    let rates = |rates: &[(u64, f64)]| -> Vec<Value> {
        rates.iter().map(|(runs, rate)| json!({ "runs": runs, "hil_ticks_per_s": rate })).collect()
    };
    let growth: Vec<Value> =
        growths.iter().map(|g| json!({ "backend": g.backend, "rates": rates(&g.rates) })).collect();
    json!({ "flop_per_ideal_step": flops, "backends": rows, "growth": growth })
}
