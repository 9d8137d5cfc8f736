//! `softdock worker`, `finish` and `submit`: many workers in one results folder.

use crate::progress::Terminal;
use crate::results::show;
use crate::terminal::{Exit, Failure, Format, Outcome, warn};
use crate::values::{named, runs};
use clap::Args;
use serde_json::json;
use softdock_engine::Choice;
use softdock_farm::{Part, RunOptions, Selection, SlurmOptions, array_part, finish_folder, load_campaign};
use softdock_farm::{submit_slurm_scripts, work, write_slurm_scripts};
use std::path::PathBuf;

/// Make one part of the runs of a results folder, as one worker of many; judge nothing.
#[derive(Args, Debug)]
#[command(after_help = "\
Exit codes: 0 the part is complete, 2 bad input, 3 stopped, the same command resumes.

Example:
  softdock worker /data/dock --part array/16    (a task of an array job with the indices 0 to 15)")]
pub(crate) struct WorkerArgs {
    /// Results folder, which `submit` or `run` has begun.
    results: PathBuf,
    /// The I-th of N parts; `array/N` takes the index of the scheduler's array, from 0 to N-1.
    #[arg(long, value_name = "I/N", value_parser = array_part, default_value = "1/1")]
    part: Part,
    /// Backend that makes the runs.
    #[arg(long, value_name = "BACKEND", value_parser = named(&Choice::NAMED), default_value = "auto")]
    backend: Choice,
}

pub(crate) fn worker(args: &WorkerArgs, format: &Format) -> Outcome {
    let options = RunOptions { choice: args.backend, part: args.part, ..RunOptions::default() };
    let incomplete = work(&args.results, &options, Terminal::new("worker").context())?;
    incomplete.iter().for_each(warn);
    let results = &args.results;
    format.print(|| json!({ "results": results, "is_complete": incomplete.is_none() }), String::new);
    Ok(if incomplete.is_some() { Exit::Incomplete } else { Exit::Done })
}

/// Finish a results folder whose runs are complete: repeated runs, time histories, summary and page.
#[derive(Args, Debug)]
#[command(after_help = "\
--json prints the summary, or the comparison of the variants.

Exit codes: as `run`.

Example:
  softdock finish /data/dock")]
pub(crate) struct FinishArgs {
    /// Results folder.
    results: PathBuf,
}

pub(crate) fn finish(args: &FinishArgs, format: &Format) -> Outcome {
    let ended = finish_folder(&args.results, Terminal::new("finish").context())?;
    show(&ended, format)
}

/// Run a campaign as an array job of a cluster.
#[derive(Args, Debug)]
#[command(after_help = "\
DIR must be visible from every node. It gets the campaign's files, the scripts (DIR/slurm) and their logs. A task that
is requeued resumes from the files on disk; near its time limit a task stores its finished runs and requeues itself.
`softdock status DIR` shows the progress of the array. Templates for other schedulers: examples/clusters.

Example:
  softdock submit campaigns/probe_drogue.toml --slurm --out /scratch/dock --sbatch=--time=01:00:00")]
pub(crate) struct SubmitArgs {
    /// Campaign file.
    campaign: PathBuf,
    /// Submit to Slurm.
    #[arg(long, required = true)]
    slurm: bool,
    /// Results folder; `results/ID` if not given.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Number of runs, in place of the campaign's.
    #[arg(long, value_name = "N", value_parser = runs())]
    runs: Option<u64>,
    /// Seed, in place of the campaign's.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Backend that makes the runs.
    #[arg(long, value_name = "BACKEND", value_parser = named(&Choice::NAMED), default_value = "auto")]
    backend: Choice,
    /// Tasks of the array; one for each shard, 64 at most, if not given.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    tasks: Option<u32>,
    /// Seconds before the time limit at which a task stops by itself.
    #[arg(long, value_name = "SECONDS", default_value_t = 120)]
    grace: u32,
    /// Option of sbatch for the array, such as --time=01:00:00; may be given several times.
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true)]
    sbatch: Vec<String>,
    /// Option of sbatch for the job that judges.
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true)]
    finish_sbatch: Vec<String>,
    /// Write the scripts, submit nothing.
    #[arg(long)]
    dry_run: bool,
}

pub(crate) fn submit(args: &SubmitArgs, format: &Format) -> Outcome {
    let terminal = Terminal::new("submit");
    let selection = Selection { runs: args.runs, seed: args.seed, ..Selection::default() };
    let campaign = load_campaign(&args.campaign, &selection, terminal.context())?;
    let results = selection.results(args.out.as_deref(), &campaign.id);
    let options = SlurmOptions {
        program: std::env::current_exe().map_err(Failure::of)?,
        backend: args.backend.word(),
        tasks: args.tasks,
        grace_s: args.grace,
        sbatch: args.sbatch.clone(),
        finish_sbatch: args.finish_sbatch.clone(),
    };
    let scripts = write_slurm_scripts(campaign, &results, &options, terminal.context())?;
    terminal.end();
    if args.dry_run {
        let lines = || scripts.iter().map(|script| format!("{}\n", script.display())).collect();
        format.print(|| json!({ "scripts": scripts }), lines);
    } else {
        let jobs = submit_slurm_scripts(&results, &scripts)?;
        format.print(|| json!({ "scripts": scripts, "jobs": jobs }), || jobs.text(&results));
    }
    Ok(Exit::Done)
}

/// Copy the runs of a results folder to an S3-compatible object store, or from it.
#[cfg(feature = "s3")]
#[derive(Args, Debug)]
#[command(after_help = "\
Address and credentials: AWS_ENDPOINT_URL, AWS_REGION, AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY; AWS_ALLOW_HTTP=true
for a store without TLS. An object is written once; one that exists with other bytes is an error.

Examples:
  softdock store push results/dock s3://runs/dock
  softdock store pull s3://runs/dock dock && softdock finish dock")]
pub(crate) struct StoreArgs {
    /// Direction.
    #[command(subcommand)]
    direction: Direction,
}

/// Directions of `store`.
#[cfg(feature = "s3")]
#[derive(Debug, clap::Subcommand)]
enum Direction {
    /// Write the campaign and its whole shards to the store.
    Push {
        /// Results folder.
        results: PathBuf,
        /// `s3://BUCKET/PREFIX`.
        url: String,
    },
    /// Read them into a results folder; `finish` judges it.
    Pull {
        /// `s3://BUCKET/PREFIX`.
        url: String,
        /// Results folder.
        results: PathBuf,
    },
}

#[cfg(feature = "s3")]
pub(crate) fn store(args: &StoreArgs, format: &Format) -> Outcome {
    let terminal = Terminal::new("store");
    let done = match &args.direction {
        Direction::Push { results, url } => softdock_farm::store::push(results, url, terminal.context())?,
        Direction::Pull { url, results } => softdock_farm::store::pull(url, results, terminal.context())?,
    };
    let (written, existing) = (done.written, done.existing);
    let text = || format!("{written} files written, {existing} existed with equal bytes");
    format.print(|| json!({ "written": written, "existing": existing }), text);
    Ok(Exit::Done)
}
