//! The `softdock` command: parses arguments, calls the libraries, renders their answers.

mod campaign;
mod cluster;
mod diagnosis;
mod gauntlet;
mod machine;
mod progress;
mod results;
mod rig;
mod robots;
mod session_terminal;
mod terminal;
mod values;

use clap::{Parser, Subcommand};
use std::ffi::OsString;
use terminal::Outcome;

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
struct Cli {
    /// Command.
    #[command(subcommand)]
    command: Command,
}

/// The commands; their arguments are documented at each type.
#[derive(Debug, Subcommand)]
enum Command {
    Check(campaign::CheckArgs),
    Plan(campaign::PlanArgs),
    Run(campaign::RunArgs),
    Status(results::StatusArgs),
    Verify(results::VerifyArgs),
    Worker(cluster::WorkerArgs),
    Finish(cluster::FinishArgs),
    Submit(cluster::SubmitArgs),
    Merge(results::MergeArgs),
    Compare(results::CompareArgs),
    Judge(results::JudgeArgs),
    Report(results::ReportArgs),
    Replay(results::ReplayArgs),
    Schema(machine::SchemaArgs),
    Kernel(machine::KernelArgs),
    Map(machine::MapArgs),
    Bench(machine::BenchArgs),
    /// List the devices that can make runs.
    Devices,
    #[cfg(feature = "s3")]
    Store(cluster::StoreArgs),
    Drive(robots::DriveArgs),
    Emulate(robots::EmulateArgs),
    Identify(diagnosis::IdentifyArgs),
    Diagnose(diagnosis::DiagnoseArgs),
    Rig(rig::RigArgs),
}

impl Command {
    fn run(&self) -> Outcome {
        match self {
            Self::Check(args) => campaign::check(args),
            Self::Plan(args) => campaign::plan(args),
            Self::Run(args) => campaign::run(args),
            Self::Status(args) => results::status(args),
            Self::Verify(args) => results::verify(args),
            Self::Worker(args) => cluster::worker(args),
            Self::Finish(args) => cluster::finish(args),
            Self::Submit(args) => cluster::submit(args),
            Self::Merge(args) => results::merge(args),
            Self::Compare(args) => results::compare(args),
            Self::Judge(args) => results::judge(args),
            Self::Report(args) => results::report(args),
            Self::Replay(args) => results::replay(args),
            Self::Schema(args) => machine::schema(args),
            Self::Kernel(args) => machine::kernel_listing(args),
            Self::Map(args) => machine::map(args),
            Self::Bench(args) => machine::bench(args),
            Self::Devices => machine::devices(),
            #[cfg(feature = "s3")]
            Self::Store(args) => cluster::store(args),
            Self::Drive(args) => robots::drive(args),
            Self::Emulate(args) => robots::emulate(args),
            Self::Identify(args) => diagnosis::identify(args),
            Self::Diagnose(args) => diagnosis::diagnose(args),
            Self::Rig(args) => rig::rig(args),
        }
    }
}

/// Runs the command of an argument list, whose first item is the program's name; prints its answer or its errors,
/// and returns its exit code.
///
/// Help, version and wrong arguments end the process, as clap does.
pub fn command<I>(arguments: I) -> u8
where
    I: IntoIterator,
    I::Item: Into<OsString> + Clone,
{
    terminal::end(Cli::parse_from(arguments).command.run())
}
