//! `softdock completions` and `man`: files for shells and manuals, from the argument parser.

use crate::terminal::{Exit, Failure, Format, Outcome, print_bytes};
use clap::{Args, Command};
use clap_complete::Shell;
use serde_json::json;
use std::path::PathBuf;

/// Print the completions of a shell.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  softdock completions bash > ~/.local/share/bash-completion/completions/softdock
  softdock completions zsh > ~/.zfunc/_softdock
  softdock completions fish > ~/.config/fish/completions/softdock.fish
  softdock completions powershell >> $PROFILE")]
pub(crate) struct CompletionsArgs {
    /// Shell.
    shell: Shell,
}

pub(crate) fn completions(args: &CompletionsArgs, mut command: Command) -> Outcome {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command, "softdock", &mut script);
    print_bytes(&script);
    Ok(Exit::Done)
}

/// Write the manual pages of all commands into a folder.
#[derive(Args, Debug)]
#[command(after_help = "Example:\n  softdock man ~/.local/share/man/man1 && man softdock-run")]
pub(crate) struct ManArgs {
    /// Folder that receives the pages.
    #[arg(value_name = "DIR", default_value = "man")]
    folder: PathBuf,
}

pub(crate) fn man(args: &ManArgs, command: Command, format: &Format) -> Outcome {
    let shown = args.folder.display();
    let refuse = |error: std::io::Error| {
        Failure::new(format!("`{shown}` cannot be written: {error}"), "name a folder that can be written")
    };
    std::fs::create_dir_all(&args.folder).map_err(refuse)?;
    clap_mangen::generate_to(command, &args.folder).map_err(refuse)?;
    let text = || format!("pages  {shown}\nnext   man {}", args.folder.join("softdock.1").display());
    format.print(|| json!({ "folder": args.folder }), text);
    Ok(Exit::Done)
}
