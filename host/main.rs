//! The `softdock` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(softdock::command(std::env::args_os()))
}
