//! `softdock schema`, `kernel`, `map`, `bench` and `devices`: file formats, GPU kernel, stability limits, speed.

use crate::gauntlet::{BenchDiagnosisArgs, bench_diagnosis};
use crate::terminal::{Exit, Failure, Format, Outcome, print};
use crate::values::{named, positive};
use clap::{Args, Subcommand};
use softdock_analysis::{MapCurve, map_page, map_text};
use softdock_engine::bench::{Windows, measure_machine};
use softdock_engine::map::{LimitCurve, stability_map};
use softdock_engine::{Choice, open};
use softdock_kernels::frame::Batch;
use softdock_kernels::plant::Plant;
use softdock_tracer::kernel::kernel;
use std::path::PathBuf;

/// Print the JSON Schema of campaign, scenario, rig or robot files, for editors.
#[derive(Args, Debug)]
#[command(after_help = "Example:\n  softdock schema campaign > campaign.schema.json")]
pub(crate) struct SchemaArgs {
    /// Kind of file.
    #[arg(value_parser = named(&SCHEMAS))]
    kind: fn() -> String,
}

/// A file kind: word, content, schema.
type SchemaRow = (&'static str, &'static str, fn() -> String);

const SCHEMAS: [SchemaRow; 4] = [
    ("campaign", "Dispersions, requirements, metrics", softdock_campaign::json_schema),
    ("scenario", "The simulated task and its facility", softdock_campaign::scenario_json_schema),
    ("rig", "A test rig whose recordings are diagnosed", softdock_campaign::rig_json_schema),
    ("robot", "An industrial robot", softdock_campaign::robot_json_schema),
];

pub(crate) fn schema(args: &SchemaArgs) -> Outcome {
    print((args.kind)());
    Ok(Exit::Done)
}

/// Print the GPU kernel of a scenario.
#[derive(Args, Debug)]
#[command(after_help = "Example:\n  softdock kernel campaigns/scenarios/smoke.toml")]
pub(crate) struct KernelArgs {
    /// Scenario file.
    scenario: PathBuf,
}

/// Prints the WGSL module: structs with units and meanings, the frame, the traced stages with their operation counts.
pub(crate) fn kernel_listing(args: &KernelArgs) -> Outcome {
    let scenario = softdock_campaign::load_scenario(&args.scenario)?;
    print(kernel(&Plant::new(scenario.model), Batch::whole()).text);
    Ok(Exit::Done)
}

/// Compute the greatest contact stiffness at which the delayed loop is stable, for every delay compensation.
#[derive(Args, Debug)]
#[command(after_help = "\
Bisects along the stiffness, through the loop itself, for the linear limit (a contact that never opens does not swing up)
and the energy limit (a bounce without adhesion injects no energy). One dimension, ideal robots, pure delay; the
compensators know delay, stiffness and damping.

Example:
  softdock map --mass-kg 200 --delay-ms 16 --out map.html")]
pub(crate) struct MapArgs {
    /// Reduced mass of the two bodies, kg.
    #[arg(long, value_name = "KG", default_value_t = 200.0, value_parser = positive)]
    mass_kg: f64,
    /// Dead time of the loop, ms.
    #[arg(long, value_name = "MS", default_value_t = 16.0, value_parser = positive)]
    delay_ms: f64,
    /// Every third damping only.
    #[arg(long)]
    quick: bool,
    /// Draw the map into this HTML file.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

pub(crate) fn map(args: &MapArgs) -> Outcome {
    let (mass, delay) = (args.mass_kg, 1e-3 * args.delay_ms);
    let curve =
        |LimitCurve { name, linear, energy, closed }| MapCurve { name: String::from(name), linear, energy, closed };
    let limits = stability_map(mass, delay, if args.quick { 3 } else { 1 });
    let curves: Vec<MapCurve> = limits.into_iter().map(curve).collect();
    print(map_text(&curves, mass / (delay * delay)));
    if let Some(path) = &args.out {
        let page = map_page(mass, args.delay_ms, &curves).map_err(Failure::of)?;
        std::fs::write(path, page).map_err(Failure::of)?;
        print(format!("map: {}", path.display()));
    }
    Ok(Exit::Done)
}

/// Measure steps and ticks per second of every backend, and the share of the machine's own peak.
#[derive(Args, Debug)]
#[command(
    args_conflicts_with_subcommands = true,
    after_help = "Examples:\n  softdock bench --quick\n  softdock bench diagnosis"
)]
pub(crate) struct BenchArgs {
    /// Measurement other than speed.
    #[command(subcommand)]
    measurement: Option<Measurement>,
    /// Short windows: seconds instead of a minute, and figures that scatter more.
    #[arg(long)]
    quick: bool,
    #[command(flatten)]
    format: Format,
}

/// Measurements other than speed.
#[derive(Debug, Subcommand)]
enum Measurement {
    Diagnosis(BenchDiagnosisArgs),
}

pub(crate) fn bench(args: &BenchArgs) -> Outcome {
    if let Some(Measurement::Diagnosis(args)) = &args.measurement {
        return bench_diagnosis(args);
    }
    let report = measure_machine(if args.quick { Windows::QUICK } else { Windows::FULL }).map_err(Failure::of)?;
    args.format.print(|| serde_json::json!(report), || report.text());
    Ok(Exit::Done)
}

/// Opens each backend as `run` does, and prints its device.
pub(crate) fn devices() -> Outcome {
    for choice in [Choice::Cpu, Choice::Gpu, Choice::Auto] {
        let device = open(choice, |_| ()).map_or_else(|error| error.to_string(), |engine| engine.device());
        print(format!("--backend {:<4}  {device}", choice.word()));
    }
    Ok(Exit::Done)
}
