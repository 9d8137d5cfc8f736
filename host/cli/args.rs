//! What may be typed.

mod diagnose;
mod drive;
mod repeat;

pub(crate) use diagnose::DiagnoseArgs;
pub(crate) use drive::{DriveArgs, EmulateArgs};

use clap::{Args, Parser, Subcommand, ValueEnum};
use softdock_engine::Choice;
use softdock_farm::Part;
pub(crate) use softdock_farm::default_results;
use std::path::PathBuf;

/// Monte Carlo verification of contact tasks: thousands of runs, in space and on the HIL facility side by side.
#[derive(Debug, Parser)]
#[command(
    version,
    max_term_width = 110,
    after_help = "\
Exit codes: 0 every requirement verified, 1 some requirement not verified, 2 bad input, 3 campaign incomplete.

Example:
  softdock run campaigns/smoke.toml"
)]
pub(crate) struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Read a campaign and everything it names, draw its inputs, step its nominal case, show what its runs can prove.
    Check(CheckArgs),
    /// Say how many runs a requirement needs, and how many failures they allow.
    Plan(PlanArgs),
    /// Run a campaign to its verdict; the same command resumes what was interrupted.
    Run(RunArgs),
    /// Say how far a campaign is, and what it has shown so far.
    Status(StatusArgs),
    /// Compare every file of a results folder with what it states, and summary and page with what the runs give.
    Verify(StatusArgs),
    /// Make one part of the runs of a results folder, as one worker of many; judge nothing.
    Worker(WorkerArgs),
    /// End a results folder whose runs are all made: repeated runs, time histories, summary and page.
    Finish(FinishArgs),
    /// Run a campaign as an array job of a cluster.
    Submit(SubmitArgs),
    /// Join the results folders of several workers into one, and judge them.
    Merge(MergeArgs),
    /// Compare two results folders: failures, rates, runs that changed, metrics, and keys that differ.
    Compare(CompareArgs),
    /// Judge finished runs by other criteria, metrics and requirements, without new runs.
    Judge(JudgeArgs),
    /// Write summary and report page of a results folder again.
    Report(ReportArgs),
    /// Repeat one run of a results folder, or the log of a drive, and compare it bit by bit.
    Replay(ReplayArgs),
    /// Print the JSON Schema of campaign, scenario, rig or robot files, for editors.
    Schema(SchemaArgs),
    /// Print the GPU kernel that a scenario becomes.
    Kernel(KernelArgs),
    /// Find how stiff a contact the delayed loop bears, with every delay compensation.
    Map(MapArgs),
    /// Measure steps and ticks per second of every backend at hand, and the share of the machine's own peak.
    Bench(BenchArgs),
    /// List what runs can be made on.
    Devices,
    /// Copy the runs of a results folder to an S3-compatible object store, or from it.
    #[cfg(feature = "s3")]
    Store(StoreArgs),
    /// Drive one run of a campaign on real or emulated robots, and set it beside what the model expects.
    Drive(DriveArgs),
    /// Be the other side: emulated robots and sensor behind their real protocols.
    Emulate(EmulateArgs),
    /// Identify a robot from recorded motions, or design a motion that shows its parameters.
    Identify(IdentifyArgs),
    /// Say from recordings what a model gets wrong, why, and what knowing it gains.
    Diagnose(DiagnoseArgs),
}

/// Arguments of `store`.
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
    pub(crate) what: StoreCommand,
}

/// Directions of `store`.
#[cfg(feature = "s3")]
#[derive(Debug, Subcommand)]
pub(crate) enum StoreCommand {
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

/// Arguments of `identify`.
#[derive(Args, Debug)]
pub(crate) struct IdentifyArgs {
    /// What is identified.
    #[command(subcommand)]
    pub(crate) what: Identify,
}

/// What can be identified.
#[derive(Debug, Subcommand)]
pub(crate) enum Identify {
    /// Links, rotors and friction of an industrial robot.
    Robot(Box<RobotArgs>),
}

/// Arguments of `identify robot`.
#[derive(Args, Debug)]
#[command(after_help = "\
Recordings are CSV or Parquet; the model file's [log] says which column is what. DIR gets the identified model, the
page and the figures as JSON.

Examples:
  softdock identify robot campaigns/models/kr300_r2500.toml traj_A.csv --validate traj_B.csv --out results/kr300
  softdock identify robot campaigns/models/kr300_r2500.toml --design --out results/kr300_motion")]
pub(crate) struct RobotArgs {
    /// Robot model file: what is known before.
    pub(crate) model: PathBuf,
    /// Recordings that are fitted.
    #[arg(value_name = "LOG", required_unless_present = "design", conflicts_with = "design")]
    pub(crate) logs: Vec<PathBuf>,
    /// Recordings that are only predicted.
    #[arg(long, value_name = "LOG", num_args = 1.., conflicts_with = "design")]
    pub(crate) validate: Vec<PathBuf>,
    /// Known errors to show beside: a CSV with a name and one percentage per joint in each line.
    #[arg(long, value_name = "FILE", conflicts_with = "design")]
    pub(crate) marks: Option<PathBuf>,
    /// Results folder; `results/identify_ID` if not given.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Low-pass of positions and torques, or highest frequency of the Fourier series, in Hz.
    #[arg(long, value_name = "HERTZ", default_value_t = 10.0, value_parser = positive)]
    pub(crate) cutoff: f64,
    /// Period of a periodic motion in seconds: its periods are averaged and differentiated as a Fourier series. With
    /// --design, the period of the motion.
    #[arg(long, value_name = "SECONDS", value_parser = positive)]
    pub(crate) period: Option<f64>,
    /// Weight of the a-priori model, instead of choosing it by cross-validation.
    #[arg(long, value_name = "WEIGHT", value_parser = positive)]
    pub(crate) weight: Option<f64>,
    /// Design a motion that shows the parameters well, inside all limits, instead of identifying.
    #[arg(long)]
    pub(crate) design: bool,
    /// Seed of the design.
    #[arg(long, value_name = "N", default_value_t = 1, requires = "design")]
    pub(crate) seed: u64,
    /// Answer in JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Arguments of `kernel`.
#[derive(Args, Debug)]
#[command(after_help = "Example:\n  softdock kernel campaigns/scenarios/smoke.toml")]
pub(crate) struct KernelArgs {
    /// Scenario file.
    pub(crate) scenario: PathBuf,
}

/// Arguments of `map`.
#[derive(Args, Debug)]
#[command(after_help = "\
Bisects along the stiffness, through the loop itself, for the linear limit (a contact that never opens does not swing up)
and the energy limit (a bounce without adhesion creates no energy). One dimension, ideal robots, pure delay; the
compensators know delay, stiffness and damping.

Example:
  softdock map --mass-kg 200 --delay-ms 16 --out map.html")]
pub(crate) struct MapArgs {
    /// Reduced mass of the two bodies, kg.
    #[arg(long, value_name = "KG", default_value_t = 200.0, value_parser = positive)]
    pub(crate) mass_kg: f64,
    /// Dead time of the loop, ms.
    #[arg(long, value_name = "MS", default_value_t = 16.0, value_parser = positive)]
    pub(crate) delay_ms: f64,
    /// Every third damping only.
    #[arg(long)]
    pub(crate) quick: bool,
    /// Draw the map into this HTML file.
    #[arg(long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
}

/// Arguments of `bench`.
#[derive(Args, Debug)]
#[command(
    args_conflicts_with_subcommands = true,
    after_help = "Examples:\n  softdock bench --quick\n  softdock bench diagnosis"
)]
pub(crate) struct BenchArgs {
    /// Something else than speed.
    #[command(subcommand)]
    pub(crate) what: Option<BenchCommand>,
    /// Short windows: seconds instead of a minute, and figures that scatter more.
    #[arg(long)]
    pub(crate) quick: bool,
    /// Answer in JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// What is measured besides speed.
#[derive(Debug, Subcommand)]
pub(crate) enum BenchCommand {
    /// Measure one graphics card: speed over lanes, loss of the device, a campaign by phases with its parity.
    Device(BenchDeviceArgs),
    /// Judge the diagnosis by recordings whose cause is known: right names, false alarms, intervals, cost.
    Diagnosis(BenchDiagnosisArgs),
}

/// Arguments of `bench device`.
#[derive(Args, Debug)]
#[command(after_help = "\
Writes DIR/card.json, and the campaign's results to DIR/campaign. At most 9 minutes on a card of 2020 or later.

Exit codes: 0 the card may be used, 1 a fault is reported, 2 bad input or no card, 3 stopped.

Example:
  softdock bench device campaigns/probe_drogue.toml --out results/card")]
pub(crate) struct BenchDeviceArgs {
    /// Campaign file.
    pub(crate) campaign: PathBuf,
    /// Folder of the report, which must not exist.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Number of runs of the campaign.
    #[arg(long, value_name = "N", default_value = "65536", value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    pub(crate) runs: u64,
    /// Numbers of lanes, by commas; 1024 to 65536 in powers of two if not given.
    #[arg(long, value_name = "NUMBERS", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(64..=1 << 20))]
    pub(crate) lanes: Vec<u32>,
    /// Windows of 0.1 s instead of three of 1 s.
    #[arg(long)]
    pub(crate) quick: bool,
    /// Accept a software driver, to try the command.
    #[arg(long)]
    pub(crate) software: bool,
    /// Answer in JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Arguments of `bench diagnosis`.
#[derive(Args, Debug)]
#[command(after_help = "\
Effects are hidden in recordings of simulated benches, in multiples of s*, the smallest size that anybody could tell in
the same data. The truth is sealed (BLAKE3) before the diagnosis is given model and recordings, and opened to score it.

What is finished is one line of answers-*.jsonl in the folder, and is not run again, nor is s* (scales-*.jsonl): the
same command resumes. Workers share a folder by --shard; the score counts what all of them have finished. Seconds of
one core that a case takes: command 3, body 5, sensor, drive and contact 7, robot 30, facility 60 to 150. The full
size has 5280 cases of the drive, 2280 of the sensor, 2700 of the contact, 1760 of the command, 1180 of the body, and
324 of the facility.

Exit codes: 0 every demand is met, 1 some demand is not met, 2 bad input, 3 cases are missing.

Examples:
  softdock bench diagnosis
  softdock bench diagnosis --size full --plants drive --shard 2/8 --out /data/score    (the second of eight workers)
  softdock bench diagnosis --size full --only null --out /data/score                   (what is said of nothing hidden)
  softdock bench diagnosis --size full --only effect --multiples 2,4 --out /data/score (what must be named)
  softdock bench diagnosis --size full --out /data/score --score
  softdock bench diagnosis --size full --lay-out drive.pair.J6_warm_up+C6_hold.x4.0 --out case    (to look at one)")]
pub(crate) struct BenchDiagnosisArgs {
    /// How many cases.
    #[arg(long, value_name = "SIZE", default_value = "ci")]
    pub(crate) size: BenchSize,
    /// Plants, by commas; all of the full size, the drive of the small one.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub(crate) plants: Vec<String>,
    /// Draws of every effect and size, instead of the size's own.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=10_000))]
    pub(crate) draws: Option<u64>,
    /// Run only the I-th of N parts of the cases.
    #[arg(long, value_name = "I/N", default_value = "1/1", hide_default_value = true)]
    pub(crate) shard: Part,
    /// Run only cases whose name has this in it: `null`, `drive.pair`, `C1_transport_delay.x2`.
    #[arg(long, value_name = "TEXT")]
    pub(crate) only: Option<String>,
    /// Run only cases of these sizes, in multiples of s*, by commas.
    #[arg(long, value_name = "NUMBERS", value_delimiter = ',')]
    pub(crate) multiples: Vec<f64>,
    /// Run nothing: score what is there.
    #[arg(long)]
    pub(crate) score: bool,
    /// Run nothing: write model and recordings of one case into the results folder, ready for `softdock diagnose`.
    #[arg(long, value_name = "CASE", conflicts_with_all = ["score", "shard", "only", "multiples", "json"])]
    pub(crate) lay_out: Option<String>,
    /// Results folder; `results/bench_diagnosis_SIZE` if not given.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Answer in JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// How many cases, as typed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum BenchSize {
    /// Minutes: enough to notice that something broke.
    Ci,
    /// Hours: enough to state rates with their bounds.
    Full,
}

/// Arguments of `check`.
#[derive(Args, Debug)]
#[command(after_help = "\
Every wrong value is reported at once. A file whose structure is wrong (TOML syntax, an unknown or missing key, text
where a number belongs) stops at its first such mistake: mend it and check again.

The nominal case is stepped in f64: overlap of the parts at the start, first touch, peak forces, outcome and cause in
space and on the facility. A start at which the parts overlap by more than task.max_depth is refused.

Examples:
  softdock check campaigns/probe_drogue.toml --runs 10000
  softdock check campaigns/probe_drogue.toml --step 200 --scene start.svg")]
pub(crate) struct CheckArgs {
    /// Campaign file.
    pub(crate) campaign: PathBuf,
    /// Scenario in the place of the campaign's: the model that a diagnosis has extended.
    #[arg(long, value_name = "FILE")]
    pub(crate) model: Option<PathBuf>,
    /// Number of runs to draw for the histograms.
    #[arg(long, value_name = "N", default_value_t = 2000, value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) runs: u64,
    /// Number of draws to step, spread over the campaign; one round of the CPU's lanes if not given.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    pub(crate) step: Option<u64>,
    /// Where the draws of --step are stepped, instead of what the campaign says.
    #[arg(long, value_enum)]
    pub(crate) backend: Option<BackendArg>,
    /// Draw the nominal start into this SVG file: side view, top view and the two parts.
    #[arg(long, value_name = "FILE")]
    pub(crate) scene: Option<PathBuf>,
    /// Answer in JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Arguments of `plan`.
#[derive(Args, Debug)]
#[command(after_help = "Example:\n  softdock plan --probability 99% --confidence 90% --runs 20000")]
pub(crate) struct PlanArgs {
    /// Share of all cases that must pass: 99% or 0.99.
    #[arg(long, value_name = "SHARE", value_parser = share)]
    pub(crate) probability: f64,
    /// Confidence with which it must be shown: 90% or 0.9.
    #[arg(long, value_name = "SHARE", value_parser = share)]
    pub(crate) confidence: f64,
    /// Runs of your campaign.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1_000_000_000))]
    pub(crate) runs: Option<u64>,
    /// Answer in JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Arguments of `run`.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  softdock run campaigns/probe_drogue.toml
  softdock run campaigns/probe_drogue.toml --out /data/dock --shard 2/8    (the second of eight workers)
  softdock run campaigns/probe_drogue.toml --runs 4000                     (2000 more of a campaign of 2000)
  softdock run campaigns/compensators.toml --variant smith                 (one facility of several)
  softdock run campaigns/probe_drogue.toml --cases corners.csv             (these inputs; no verdict)
  softdock run --only-failed results/probe_drogue                          (into results/probe_drogue_failed)")]
pub(crate) struct RunArgs {
    /// Campaign file.
    #[arg(required_unless_present = "only_failed", conflicts_with = "only_failed")]
    pub(crate) campaign: Option<PathBuf>,
    /// Results folder; `results/ID` if not given, `results/ID_cases` with --cases, `DIR_failed` with --only-failed.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Where the runs are made, instead of what the campaign says.
    #[arg(long, value_enum)]
    pub(crate) backend: Option<BackendArg>,
    /// Number of runs, instead of the campaign's; more than a results folder has extend it, its runs stay.
    #[arg(
        long,
        value_name = "N",
        value_parser = clap::value_parser!(u64).range(1..=1_000_000_000),
        conflicts_with_all = ["cases", "only_failed"]
    )]
    pub(crate) runs: Option<u64>,
    /// Seed, instead of the campaign's.
    #[arg(long, value_name = "N", conflicts_with = "only_failed")]
    pub(crate) seed: Option<u64>,
    /// Start over: delete what softdock has written in the results folder; other files in it are refused.
    #[arg(long, conflicts_with = "shard")]
    pub(crate) fresh: bool,
    /// Run these inputs (CSV or Parquet, a column per parameter, SI) instead of drawing any: no verdict.
    #[arg(long, value_name = "FILE")]
    pub(crate) cases: Option<PathBuf>,
    /// Repeat the runs of a finished results folder that failed in space or on the facility, or are invalid.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["cases", "model", "variant"])]
    pub(crate) only_failed: Option<PathBuf>,
    /// Make only the I-th of N parts of the campaign; `merge` joins them.
    #[arg(long, value_name = "I/N", default_value = "1/1", hide_default_value = true)]
    pub(crate) shard: Part,
    /// Scenario in the place of the campaign's: the model that a diagnosis has extended.
    #[arg(long, value_name = "FILE")]
    pub(crate) model: Option<PathBuf>,
    /// Only this variant of the campaign.
    #[arg(long, value_name = "NAME")]
    pub(crate) variant: Option<String>,
    /// Answer in JSON: the summary, or the comparison of the variants.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Arguments of `status`.
#[derive(Args, Debug)]
#[command(after_help = "Example:\n  softdock status results/probe_drogue")]
pub(crate) struct StatusArgs {
    /// Results folder, or campaign file (then `results/ID`).
    pub(crate) what: PathBuf,
    /// Answer in JSON: the summary.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Arguments of `worker`.
#[derive(Args, Debug)]
#[command(after_help = "\
Exit codes: 0 the part is made, 2 bad input, 3 stopped, the same command goes on.

Example:
  softdock worker /data/dock --part array/16    (a task of an array job with the indices 0 to 15)")]
pub(crate) struct WorkerArgs {
    /// Results folder, which `submit` or `run` has begun.
    pub(crate) results: PathBuf,
    /// The I-th of N parts; `array/N` takes the index of the scheduler's array, from 0 to N-1.
    #[arg(long, value_name = "I/N", value_parser = array_part, default_value = "1/1")]
    pub(crate) part: Part,
    /// Where the runs are made.
    #[arg(long, value_enum, default_value = "auto")]
    pub(crate) backend: BackendArg,
}

/// Arguments of `finish`.
#[derive(Args, Debug)]
#[command(after_help = "\
Exit codes: as `run`.

Example:
  softdock finish /data/dock")]
pub(crate) struct FinishArgs {
    /// Results folder.
    pub(crate) results: PathBuf,
    /// Answer in JSON: the summary, or the comparison of the variants.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Arguments of `submit`.
#[derive(Args, Debug)]
#[command(after_help = "\
DIR must be visible from every node. It gets the campaign's files, the scripts (DIR/slurm) and their logs. A task that
is requeued goes on from what is on disk; near its time limit a task keeps what is finished and requeues itself.
`softdock status DIR` shows how far the array is. Templates for other schedulers: examples/clusters.

Example:
  softdock submit campaigns/probe_drogue.toml --slurm --out /scratch/dock --sbatch=--time=01:00:00")]
pub(crate) struct SubmitArgs {
    /// Campaign file.
    pub(crate) campaign: PathBuf,
    /// Submit to Slurm.
    #[arg(long, required = true)]
    pub(crate) slurm: bool,
    /// Results folder; `results/ID` if not given.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Number of runs, instead of the campaign's.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1_000_000_000))]
    pub(crate) runs: Option<u64>,
    /// Seed, instead of the campaign's.
    #[arg(long, value_name = "N")]
    pub(crate) seed: Option<u64>,
    /// Where the runs are made.
    #[arg(long, value_enum, default_value = "auto")]
    pub(crate) backend: BackendArg,
    /// Tasks of the array; one for each shard, 64 at most, if not given.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub(crate) tasks: Option<u32>,
    /// Seconds before the time limit at which a task ends by itself.
    #[arg(long, value_name = "SECONDS", default_value_t = 120)]
    pub(crate) grace: u32,
    /// Option of sbatch for the array, such as --time=01:00:00; may stand several times.
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true)]
    pub(crate) sbatch: Vec<String>,
    /// Option of sbatch for the job that judges.
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true)]
    pub(crate) finish_sbatch: Vec<String>,
    /// Write the scripts, submit nothing.
    #[arg(long)]
    pub(crate) dry_run: bool,
}

/// Arguments of `merge`.
#[derive(Args, Debug)]
#[command(after_help = "Example:\n  softdock merge results/dock worker1/dock worker2/dock")]
pub(crate) struct MergeArgs {
    /// Folder that gets the whole campaign.
    pub(crate) out: PathBuf,
    /// Results folders of the parts.
    #[arg(required = true, value_name = "DIR")]
    pub(crate) parts: Vec<PathBuf>,
}

/// Arguments of `compare`.
#[derive(Args, Debug)]
#[command(after_help = "\
Runs with the same number are compared in pairs where both folders have the same seed; else the folders are two
independent samples. Differences are those of the second folder less the first.

Exit codes: 0 compared, 2 bad input, 3 compared, but a folder is incomplete.

Example:
  softdock compare results/probe_drogue results/probe_drogue_soft")]
pub(crate) struct CompareArgs {
    /// First results folder.
    #[arg(value_name = "A")]
    pub(crate) first: PathBuf,
    /// Second results folder.
    #[arg(value_name = "B")]
    pub(crate) second: PathBuf,
    /// Answer in JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Arguments of `judge`.
#[derive(Args, Debug)]
#[command(after_help = "\
What may change: [[requirement]], [[metric]], [traces], [compare], titles and sources of a campaign, what an invalid run
counts as, and the criteria of the scenario's [task]. Any other change is refused with its keys: it needs new runs.
The change is recorded in campaign.json and on the page. Only the traces and the repeated runs are stepped.

Exit codes: as `run`.

Example:
  softdock judge results/probe_drogue campaigns/probe_drogue.toml")]
pub(crate) struct JudgeArgs {
    /// Results folder.
    #[arg(value_name = "DIR")]
    pub(crate) results: PathBuf,
    /// Campaign file with the criteria and requirements; that of the folder if not given.
    pub(crate) campaign: Option<PathBuf>,
    /// Scenario in the place of the campaign's, if the runs were made with one.
    #[arg(long, value_name = "FILE", requires = "campaign")]
    pub(crate) model: Option<PathBuf>,
    /// Answer in JSON: the summary.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Arguments of `report`.
#[derive(Args, Debug)]
#[command(after_help = "Example:\n  softdock report results/probe_drogue")]
pub(crate) struct ReportArgs {
    /// Results folder, or campaign file (then `results/ID`).
    pub(crate) what: PathBuf,
    /// Results folder of the campaign file, if it is not `results/ID`.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
}

/// Arguments of `replay`.
#[derive(Args, Debug)]
#[command(after_help = "\
Exit code 0: the row is the same, or was made in f32 and is shown beside f64; 1: the row differs where it must not.

Example:
  softdock replay results/smoke 17 --out run17.parquet")]
pub(crate) struct ReplayArgs {
    /// Results folder.
    #[arg(required_unless_present = "log")]
    pub(crate) results: Option<PathBuf>,
    /// Number of the run.
    #[arg(required_unless_present = "log")]
    pub(crate) run: Option<u64>,
    /// Log of a drive, to be decided again from what its links brought, cycle by cycle.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["results", "run", "out"])]
    pub(crate) log: Option<PathBuf>,
    /// Campaign of the log; where the drive read it if not given.
    #[arg(long, value_name = "FILE", requires = "log")]
    pub(crate) campaign: Option<PathBuf>,
    /// Scenario in the place of the campaign's; the drive's own if not given.
    #[arg(long, value_name = "FILE", requires = "log")]
    pub(crate) model: Option<PathBuf>,
    /// Facility file of the log; where the drive read it if not given.
    #[arg(long, value_name = "FILE", requires = "log")]
    pub(crate) facility: Option<PathBuf>,
    /// File of the time history; `DIR/replays/run=N.parquet` if not given.
    #[arg(long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
}

/// Arguments of `schema`.
#[derive(Args, Debug)]
#[command(after_help = "Example:\n  softdock schema campaign > campaign.schema.json")]
pub(crate) struct SchemaArgs {
    /// Which kind of file.
    pub(crate) kind: SchemaKind,
}

/// Kinds of files that have a schema.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum SchemaKind {
    /// What varies and what must hold.
    Campaign,
    /// What is simulated, and on which facility.
    Scenario,
    /// A bench rig whose recordings are diagnosed.
    Rig,
    /// An industrial robot.
    Robot,
}

/// Backends as typed.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum BackendArg {
    /// A real GPU if there is one, else the CPU.
    Auto,
    /// A GPU, or a software Vulkan driver.
    Gpu,
    /// CPU lanes in f64.
    Cpu,
}

impl BackendArg {
    /// As it is typed.
    pub(crate) fn word(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Gpu => "gpu",
            Self::Cpu => "cpu",
        }
    }

    /// The engine to open.
    pub(crate) fn choice(self) -> Choice {
        match self {
            Self::Auto => Choice::Auto,
            Self::Gpu => Choice::Gpu,
            Self::Cpu => Choice::Cpu,
        }
    }
}

/// A part by its numbers, or by the index of a scheduler's array.
fn array_part(text: &str) -> Result<Part, String> {
    let Some(count) = text.strip_prefix("array/") else { return text.parse() };
    let count: Option<u32> = count.parse().ok().filter(|count| *count > 0);
    Part::of_array(count.ok_or("write array/N with N from 1")?, |name| std::env::var(name).ok())
}

fn share(text: &str) -> Result<f64, String> {
    let (number, scale) = text.strip_suffix('%').map_or((text, 1.0), |percent| (percent, 100.0));
    let value = number.trim().parse::<f64>().map_err(|_| "write a share as 99% or 0.99".to_owned())? / scale;
    let possible = value > 0.0 && value <= 0.999_999;
    possible.then_some(value).ok_or_else(|| "a share lies above 0 and is at most 99.9999%".to_owned())
}

fn positive(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|number| *number > 0.0 && number.is_finite());
    number.ok_or_else(|| "write a number above 0".to_owned())
}
