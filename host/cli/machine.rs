//! `softdock schema`, `kernel`, `map`, `bench` and `devices`: file formats, GPU kernel, stability limits, speed.

use crate::gauntlet::{BenchDiagnosisArgs, bench_diagnosis};
use crate::progress::Terminal;
use crate::terminal::{Exit, Failure, Format, Outcome, print_bytes, write_file};
use crate::values::{named, positive, runs};
use clap::{Args, Subcommand};
use serde_json::json;
use softdock_analysis::{MapCurve, map_page, map_text};
use softdock_campaign::{SCHEMA_KINDS, SchemaKind};
use softdock_diagnosis::report::command_line::CommandLine;
use softdock_engine::bench::{Windows, measure_machine};
use softdock_engine::map::{LimitCurve, count_limits, stability_map};
use softdock_engine::{Choice, open};
use softdock_farm::{CardOptions, Observer, Selection, Work, card_report, load_campaign, page_origin};
use softdock_kernels::frame::Batch;
use softdock_kernels::plant::Plant;
use softdock_tracer::kernel::kernel;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Print the JSON Schema of a kind of files, for editors: keys, words, units, ranges.
#[derive(Args, Debug)]
#[command(after_help = "\
An editor with Taplo (\"Even Better TOML\") reads the schema that the first line of a file names:
  #:schema campaign.schema.json

Example:
  softdock schema campaign > campaign.schema.json")]
pub(crate) struct SchemaArgs {
    /// Kind of file.
    #[arg(value_parser = named(&SCHEMAS))]
    kind: SchemaKind,
}

/// The kinds of files by their words.
const SCHEMAS: [(&str, &str, SchemaKind); SCHEMA_KINDS.len()] = {
    let mut rows = [("", "", SCHEMA_KINDS[0]); SCHEMA_KINDS.len()];
    let mut at = 0;
    while at < rows.len() {
        rows[at] = (SCHEMA_KINDS[at].word, SCHEMA_KINDS[at].content, SCHEMA_KINDS[at]);
        at += 1;
    }
    rows
};

pub(crate) fn schema(args: &SchemaArgs) -> Outcome {
    print_bytes(format!("{}\n", args.kind.text()).as_bytes());
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
pub(crate) fn kernel_listing(args: &KernelArgs, format: &Format) -> Outcome {
    let scenario = softdock_campaign::load_scenario(&args.scenario)?;
    let text = kernel(&Plant::new(scenario.model), Batch::whole()).text;
    format.print(|| json!({ "wgsl": text }), || text.clone());
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

pub(crate) fn map(args: &MapArgs, format: &Format) -> Outcome {
    let (mass, delay) = (args.mass_kg, 1e-3 * args.delay_ms);
    let curve =
        |LimitCurve { name, linear, energy, closed }| MapCurve { name: String::from(name), linear, energy, closed };
    let every = if args.quick { 3 } else { 1 };
    let (terminal, done) = (Terminal::new("map"), AtomicU64::new(0));
    terminal.begin(Work::Map, count_limits(every) as u64);
    let found = || terminal.progress(Work::Map, 1 + done.fetch_add(1, Ordering::Relaxed));
    let limits = stability_map(mass, delay, every, &found);
    terminal.end();
    let curves: Vec<MapCurve> = limits.into_iter().map(curve).collect();
    if let Some(path) = &args.out {
        let command = CommandLine::new("map", &[] as &[&Path]).option("mass-kg", Some(mass));
        let command = command.option("delay-ms", Some(args.delay_ms)).flag("quick", args.quick).file("out", Some(path));
        let page = map_page(mass, args.delay_ms, &curves, &page_origin(&command.text())).map_err(Failure::of)?;
        write_file(path, page.as_bytes())?;
    }
    let stiffness = mass / (delay * delay);
    let points = |curve: &MapCurve| json!({ "compensator": curve.name, "linear": curve.linear, "energy": curve.energy, "closed_form": curve.closed });
    let json = || {
        json!({
            "mass_kg": mass, "delay_s": delay, "stiffness_unit_n_per_m": stiffness, "page": args.out,
            "curves": curves.iter().map(points).collect::<Vec<_>>(),
        })
    };
    let page = args.out.as_ref().map(|path| format!("map: {}", path.display())).unwrap_or_default();
    format.print(json, || map_text(&curves, stiffness) + &page);
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
}

/// Measurements other than speed.
#[derive(Debug, Subcommand)]
enum Measurement {
    Device(BenchDeviceArgs),
    Diagnosis(BenchDiagnosisArgs),
}

pub(crate) fn bench(args: &BenchArgs, format: &Format) -> Outcome {
    match &args.measurement {
        Some(Measurement::Device(args)) => return bench_device(args, format),
        Some(Measurement::Diagnosis(args)) => return bench_diagnosis(args, format),
        None => {}
    }
    let terminal = Terminal::new("bench");
    let report = measure_machine(if args.quick { Windows::QUICK } else { Windows::FULL }).map_err(Failure::of)?;
    terminal.end();
    format.print(|| serde_json::json!(report), || report.text());
    Ok(Exit::Done)
}

/// Measure one graphics card: speed over lanes, loss of the device, a campaign by phases with its parity.
#[derive(Args, Debug)]
#[command(after_help = "\
Writes DIR/card.json, and the campaign's results to DIR/campaign.

Exit codes: 0 no fault, 1 a fault of the card is reported, 2 bad input or no card.

Example:
  softdock bench device campaigns/probe_drogue.toml --out results/card")]
struct BenchDeviceArgs {
    /// Campaign file.
    campaign: PathBuf,
    /// Folder of the report, which must not exist.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Number of runs of the campaign.
    #[arg(long, value_name = "N", default_value = "65536", value_parser = runs())]
    runs: u64,
    /// Numbers of lanes, by commas; 1024 to 65536 in powers of two if not given.
    #[arg(long, value_name = "NUMBERS", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(64..=1 << 20))]
    lanes: Vec<u32>,
    /// Windows of 0.1 s instead of three of 1 s.
    #[arg(long)]
    quick: bool,
    /// Accept a software driver, to try the command.
    #[arg(long)]
    software: bool,
}

/// Measures one card, writes its report and prints it.
fn bench_device(args: &BenchDeviceArgs, format: &Format) -> Outcome {
    let (terminal, full) = (Terminal::new("bench device"), CardOptions::full());
    let context = terminal.context();
    let selection = Selection { runs: Some(args.runs), ..Selection::default() };
    let campaign = load_campaign(&args.campaign, &selection, context)?;
    let given = args.lanes.iter().map(|lanes| *lanes as usize);
    let options = CardOptions {
        lanes: if args.lanes.is_empty() { full.lanes } else { given.collect() },
        windows: if args.quick { Windows::QUICK } else { full.windows },
        accepts_software: args.software,
    };
    let report = card_report(campaign, &args.out.join("campaign"), &options, context)?;
    report.write(&args.out)?;
    terminal.end();
    format.print(|| serde_json::json!(report), || report.text());
    Ok(if report.faults.is_empty() { Exit::Done } else { Exit::NotVerified })
}

/// Opens each backend as `run` does, and prints its device.
pub(crate) fn devices(format: &Format) -> Outcome {
    let terminal = Terminal::new("devices");
    let found = [Choice::Cpu, Choice::Gpu, Choice::Auto].map(|choice| match open(choice, |_| ()) {
        Ok(engine) => (choice.word(), true, engine.device()),
        Err(error) => (choice.word(), false, error.to_string()),
    });
    terminal.end();
    let row = |(backend, is_present, device): &(&str, bool, String)| json!({ "backend": backend, "is_present": is_present, "device": device });
    let line = |(backend, _, device): &(&str, bool, String)| format!("--backend {backend:<4}  {device}\n");
    format.print(|| found.iter().map(row).collect(), || found.iter().map(line).collect());
    Ok(Exit::Done)
}
