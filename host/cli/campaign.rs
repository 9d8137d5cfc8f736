//! `softdock check`, `plan` and `run`: a campaign from its file to its verdict.

use crate::progress::Terminal;
use crate::results::show;
use crate::terminal::{Exit, Format, Outcome, warn};
use crate::values::{named, runs};
use clap::Args;
use softdock_analysis::plan::{parse_share, plan_json, plan_text};
use softdock_campaign::{Campaign, Setting, Settings};
use softdock_engine::Choice;
use softdock_farm::check::{check_json, check_text};
use softdock_farm::step::step;
use softdock_farm::{Part, RunOptions, Selection, choice_of, draw_nominal_start};
use softdock_farm::{failed_results, failed_runs, load_campaign};
use std::path::PathBuf;

/// Check a campaign: read its files, draw its inputs, step its nominal case, report what its runs can prove.
#[derive(Args, Debug)]
#[command(after_help = "\
Every wrong value is reported at once. A file whose structure is wrong (TOML syntax, an unknown or missing key, text
where a number belongs) stops at its first such mistake: correct it and check again.

The nominal case is stepped in f64: overlap of the parts at the start, first touch, peak forces, outcome and cause in
space and on the facility. A start at which the parts overlap by more than task.max_depth is refused.

Examples:
  softdock check campaigns/probe_drogue.toml --runs 10000
  softdock check campaigns/probe_drogue.toml --step 200 --scene start.svg
  softdock check campaigns/probe_drogue.toml --set 'scenario.contact.friction=0.3'")]
pub(crate) struct CheckArgs {
    /// Campaign file.
    campaign: PathBuf,
    /// Scenario file in place of the campaign's: a model that a diagnosis has extended.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Number of runs to draw for the histograms.
    #[arg(long, value_name = "N", default_value_t = 2000, value_parser = clap::value_parser!(u64).range(1..))]
    runs: u64,
    /// Number of draws to step, spread over the campaign; one round of the CPU's lanes if not given.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    step: Option<u64>,
    /// Backend that steps the draws of --step, in place of the campaign's.
    #[arg(long, value_name = "BACKEND", value_parser = named(&Choice::NAMED))]
    backend: Option<Choice>,
    /// Draw the nominal start into this SVG file: side view, top view and the two parts.
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    /// Value in the place of the written one, several times: a key of the campaign, of its scenario (scenario.KEY) or of its
    /// facility file (station.KEY).
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<Setting>,
}

pub(crate) fn check(args: &CheckArgs, format: &Format) -> Outcome {
    let campaign = Campaign::load_set(&args.campaign, args.model.as_deref(), &Settings::new(args.set.clone())?)?;
    if let Some(path) = &args.scene {
        draw_nominal_start(&campaign, path)?;
        warn(format!("scene  {}", path.display()));
    }
    let choice = args.backend.unwrap_or_else(|| choice_of(&campaign));
    let terminal = Terminal::new("check");
    let stepped = step(&campaign, args.step, choice, terminal.context())?;
    let (mut answer, text) = (check_json(&campaign, args.runs)?, check_text(&campaign, args.runs)?);
    answer["stepped"] = stepped.json();
    terminal.end();
    format.print(|| answer, || text + &stepped.text());
    Ok(Exit::Done)
}

/// Compute how many runs a requirement needs, and how many failures they allow.
#[derive(Args, Debug)]
#[command(after_help = "Example:\n  softdock plan --probability 99% --confidence 90% --runs 20000")]
pub(crate) struct PlanArgs {
    /// Share of all cases that must pass: 99% or 0.99.
    #[arg(long, value_name = "SHARE", value_parser = parse_share)]
    probability: f64,
    /// Confidence with which it must be shown: 90% or 0.9.
    #[arg(long, value_name = "SHARE", value_parser = parse_share)]
    confidence: f64,
    /// Runs of your campaign.
    #[arg(long, value_name = "N", value_parser = runs())]
    runs: Option<u64>,
}

pub(crate) fn plan(args: &PlanArgs, format: &Format) -> Outcome {
    let (probability, confidence) = (args.probability, args.confidence);
    let json = || plan_json(probability, confidence, args.runs);
    format.print(json, || plan_text(probability, confidence, args.runs));
    Ok(Exit::Done)
}

/// Run a campaign to its verdict; the same command resumes an interrupted campaign.
#[derive(Args, Debug)]
#[command(after_help = "\
--json prints the summary, or the comparison of the variants.

Examples:
  softdock run campaigns/probe_drogue.toml
  softdock run campaigns/probe_drogue.toml --out /data/dock --shard 2/8    (the second of eight workers)
  softdock run campaigns/probe_drogue.toml --runs 4000                     (2000 more of a campaign of 2000)
  softdock run campaigns/compensators.toml --variant smith                 (one facility of several)
  softdock run campaigns/probe_drogue.toml --cases corners.csv             (these inputs; no verdict)
  softdock run campaigns/probe_drogue.toml --set 'scenario.contact.friction=0.3' --out results/slippery
  softdock run --only-failed results/probe_drogue                          (into results/probe_drogue_failed)")]
pub(crate) struct RunArgs {
    /// Campaign file.
    #[arg(required_unless_present = "only_failed", conflicts_with = "only_failed")]
    campaign: Option<PathBuf>,
    /// Results folder; `results/ID` if not given, `results/ID_cases` with --cases, `DIR_failed` with --only-failed.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Backend that makes the runs, in place of the campaign's.
    #[arg(long, value_name = "BACKEND", value_parser = named(&Choice::NAMED))]
    backend: Option<Choice>,
    /// Number of runs, in place of the campaign's; a larger number extends an existing results folder.
    #[arg(long, value_name = "N", value_parser = runs(), conflicts_with_all = ["cases", "only_failed"])]
    runs: Option<u64>,
    /// Seed, in place of the campaign's.
    #[arg(long, value_name = "N", conflicts_with = "only_failed")]
    seed: Option<u64>,
    /// Start over: delete what softdock has written in the results folder; refuse if it holds other files.
    #[arg(long, conflicts_with = "shard")]
    fresh: bool,
    /// Run these inputs (CSV or Parquet, a column per parameter, SI) instead of drawing any: no verdict.
    #[arg(long, value_name = "FILE")]
    cases: Option<PathBuf>,
    /// Repeat the runs of a finished results folder that failed in space or on the facility, or are invalid.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["cases", "model", "variant"])]
    only_failed: Option<PathBuf>,
    /// Make only the I-th of N parts of the campaign; `merge` joins them.
    #[arg(long, value_name = "I/N", default_value = "1/1", hide_default_value = true)]
    shard: Part,
    /// Scenario file in place of the campaign's: a model that a diagnosis has extended.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Only this variant of the campaign.
    #[arg(long, value_name = "NAME")]
    variant: Option<String>,
    /// Value in the place of the written one, several times: a key of the campaign, of its scenario (scenario.KEY) or of its
    /// facility file (station.KEY).
    #[arg(long, value_name = "KEY=VALUE", conflicts_with = "only_failed")]
    set: Vec<Setting>,
}

pub(crate) fn run(args: &RunArgs, format: &Format) -> Outcome {
    let terminal = Terminal::new("run");
    let context = terminal.context();
    let (campaign, out) = if let Some(results) = &args.only_failed {
        let out = failed_results(results, args.out.as_deref())?;
        let Some(campaign) = failed_runs(results, context)? else { return Ok(Exit::Done) };
        (campaign, out)
    } else {
        let selection = Selection {
            model: args.model.clone(),
            runs: args.runs,
            seed: args.seed,
            variant: args.variant.clone(),
            cases: args.cases.clone(),
            settings: Settings::new(args.set.clone())?,
        };
        let file = args.campaign.as_ref().expect("clap requires it without --only-failed");
        let campaign = load_campaign(file, &selection, context)?;
        let out = selection.results(args.out.as_deref(), &campaign.id);
        (campaign, out)
    };
    let choice = args.backend.unwrap_or_else(|| choice_of(&campaign));
    let options = RunOptions { choice, part: args.shard, is_fresh: args.fresh, ..RunOptions::default() };
    let ended = softdock_farm::run(campaign, &out, &options, context)?;
    terminal.end();
    show(&ended, format)
}
