//! The `softdock` command: from a campaign file to a verdict.

mod args;
mod bench;
mod bench_diagnosis;
mod check;
mod compare;
mod devices;
mod diagnose;
mod drive;
mod emulate;
mod farm;
mod identify;
mod judge;
mod kernel;
mod map;
mod merge;
mod plan;
mod progress;
mod replay;
mod replay_log;
mod report;
mod reports;
mod run;
mod scene;
mod schema;
mod status;
#[cfg(feature = "s3")]
mod store;
mod submit;
mod verify;
mod words;
mod worker;

use args::{BenchCommand, Command};
use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    let answer = match args::Cli::parse().command {
        Command::Check(args) => check::check(&args),
        Command::Plan(args) => plan::plan(&args),
        Command::Run(args) => run::run(&args),
        Command::Status(args) => status::status(&args),
        Command::Verify(args) => verify::verify(&args),
        Command::Worker(args) => worker::worker(&args),
        Command::Finish(args) => worker::finish(&args),
        Command::Submit(args) => submit::submit(&args),
        Command::Merge(args) => merge::merge(&args),
        Command::Compare(args) => compare::compare(&args),
        Command::Judge(args) => judge::judge(&args),
        Command::Report(args) => report::report(&args),
        Command::Replay(args) => replay::replay(&args),
        Command::Schema(args) => schema::schema(&args),
        Command::Kernel(args) => kernel::kernel_listing(&args),
        Command::Map(args) => map::map(&args),
        Command::Bench(args) => match &args.what {
            None => bench::bench(&args),
            Some(BenchCommand::Device(args)) => bench::bench_device(args),
            Some(BenchCommand::Diagnosis(args)) => bench_diagnosis::bench_diagnosis(args),
        },
        Command::Identify(args) => identify::identify(&args),
        Command::Diagnose(args) => diagnose::diagnose(&args),
        Command::Drive(args) => drive::drive(&args),
        Command::Emulate(args) => emulate::emulate(&args),
        Command::Devices => devices::devices(),
        #[cfg(feature = "s3")]
        Command::Store(args) => store::store(&args),
    };
    words::leave(answer)
}
