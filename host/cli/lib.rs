//! The `softdock` command: parses arguments, calls the libraries, renders their answers.

mod campaign;
mod cluster;
mod diagnosis;
mod examples;
mod export;
mod gauntlet;
mod listing;
mod machine;
mod progress;
mod results;
mod rig;
mod robots;
mod serve;
mod session_terminal;
mod shell_files;
mod terminal;
mod values;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{CommandFactory, Parser, Subcommand};
use softdock_campaign::suggest::likely;
use std::ffi::OsString;
pub use terminal::report_text;
use terminal::{Failure, Format, Outcome};

/// Monte Carlo verification of contact tasks: thousands of runs, in space and on the HIL facility side by side.
#[derive(Debug, Parser)]
#[command(
    version,
    max_term_width = 110,
    after_help = "\
Exit codes: 0 every requirement verified, 1 some requirement not verified, 2 bad input, 3 campaign incomplete.

Colours: on terminals only; NO_COLOR switches them off, CLICOLOR_FORCE=1 on.

Examples:
  softdock init first
  softdock run smoke.toml"
)]
struct Cli {
    /// Command.
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    format: Format,
    /// Number of threads of the CPU's lanes; one for each core if not given.
    #[arg(long, value_name = "N", global = true, display_order = 901, value_parser = clap::value_parser!(u32).range(1..=1024))]
    threads: Option<u32>,
}

/// The commands; their arguments are documented at each type.
#[derive(Debug, Subcommand)]
enum Command {
    Init(examples::InitArgs),
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
    Serve(serve::ServeArgs),
    Export(export::ExportArgs),
    Examples(examples::ExamplesArgs),
    /// List the parameters of a run: name, unit, legal range, null value, meaning.
    #[command(after_help = "Examples:\n  softdock params\n  softdock params friction")]
    Params(listing::ListArgs),
    /// List the metrics of a run, for requirements: name, unit, when it has a value, meaning.
    #[command(after_help = "Examples:\n  softdock metrics\n  softdock metrics force")]
    Metrics(listing::ListArgs),
    /// List the effects by which the facility may differ from space, with their parameters.
    #[command(after_help = "Examples:\n  softdock effects\n  softdock effects backlash")]
    Effects(listing::ListArgs),
    /// List the signals of the time histories: column, unit, meaning.
    #[command(after_help = "Examples:\n  softdock signals\n  softdock signals latch")]
    Signals(listing::SignalsArgs),
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
    Completions(shell_files::CompletionsArgs),
    Man(shell_files::ManArgs),
}

impl Command {
    fn run(&self, format: &Format) -> Outcome {
        match self {
            Self::Init(args) => examples::init(args, format),
            Self::Check(args) => campaign::check(args, format),
            Self::Plan(args) => campaign::plan(args, format),
            Self::Run(args) => campaign::run(args, format),
            Self::Status(args) => results::status(args, format),
            Self::Verify(args) => results::verify(args, format),
            Self::Worker(args) => cluster::worker(args, format),
            Self::Finish(args) => cluster::finish(args, format),
            Self::Submit(args) => cluster::submit(args, format),
            Self::Merge(args) => results::merge(args, format),
            Self::Compare(args) => results::compare(args, format),
            Self::Judge(args) => results::judge(args, format),
            Self::Report(args) => results::report(args, format),
            Self::Replay(args) => results::replay(args, format),
            Self::Serve(args) => serve::serve(args, format),
            Self::Export(args) => export::export(args, format),
            Self::Examples(args) => examples::examples(args, format),
            Self::Params(args) => listing::params(args, format),
            Self::Metrics(args) => listing::metrics(args, format),
            Self::Effects(args) => listing::effects(args, format),
            Self::Signals(args) => listing::signals(args, format),
            Self::Schema(args) => machine::schema(args),
            Self::Kernel(args) => machine::kernel_listing(args, format),
            Self::Map(args) => machine::map(args, format),
            Self::Bench(args) => machine::bench(args, format),
            Self::Devices => machine::devices(format),
            #[cfg(feature = "s3")]
            Self::Store(args) => cluster::store(args, format),
            Self::Drive(args) => robots::drive(args, format),
            Self::Emulate(args) => robots::emulate(args, format),
            Self::Identify(args) => diagnosis::identify(args, format),
            Self::Diagnose(args) => diagnosis::diagnose(args, format),
            Self::Rig(args) => rig::rig(args, format),
            Self::Completions(args) => shell_files::completions(args, Cli::command()),
            Self::Man(args) => shell_files::man(args, Cli::command(), format),
        }
    }
}

/// Runs the command of an argument list, whose first item is the program's name; prints its answer or its errors,
/// and returns its exit code.
///
/// Help and version are answers; wrong arguments are errors with exit code 2.
pub fn command<I>(arguments: I) -> u8
where
    I: IntoIterator,
    I::Item: Into<OsString> + Clone,
{
    let cli = match Cli::try_parse_from(arguments) {
        Ok(cli) => cli,
        Err(error) => return wrong_arguments(error),
    };
    terminal::end(set_threads(cli.threads).and_then(|()| cli.command.run(&cli.format)))
}

/// Prints help, version or what is wrong with the arguments; returns the exit code.
fn wrong_arguments(mut error: clap::Error) -> u8 {
    if !error.use_stderr() {
        let _ = error.print();
        return terminal::Exit::Done as u8;
    }
    if let (ErrorKind::InvalidSubcommand, Some(ContextValue::String(word))) =
        (error.kind(), error.get(ContextKind::InvalidSubcommand))
    {
        let root = Cli::command();
        let names: Vec<&str> = root.get_subcommands().map(clap::Command::get_name).collect();
        let meant: Vec<String> = likely(word, &names).into_iter().map(str::to_owned).collect();
        if !meant.is_empty() {
            error.insert(ContextKind::SuggestedSubcommand, ContextValue::Strings(meant));
        }
    }
    terminal::warn(error.render());
    terminal::Exit::BadInput as u8
}

/// Sets the number of threads of the process, once.
fn set_threads(threads: Option<u32>) -> Result<(), Failure> {
    let Some(threads) = threads.map(|threads| threads as usize) else { return Ok(()) };
    let is_set = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global().is_ok();
    if is_set || rayon::current_num_threads() == threads {
        return Ok(());
    }
    let message = format!("this process works with {} threads already, not {threads}", rayon::current_num_threads());
    Err(Failure::new(message, "leave --threads out, or start another process"))
}
