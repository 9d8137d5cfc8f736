//! The `softdock` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    softdock::command(std::env::args_os())
}
