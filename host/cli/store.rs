//! `softdock store`: results folders to and from object stores.

use crate::args::{StoreArgs, StoreCommand};
use crate::farm::called;
use crate::progress::Terminal;
use crate::words::{Exit, say};
use softdock_farm::store::{pull, push};

/// Pushes or pulls a results folder.
pub(crate) fn store(args: &StoreArgs) -> miette::Result<Exit> {
    let terminal = Terminal::new();
    let done = match &args.what {
        StoreCommand::Push { results, url } => called(push(results, url, terminal.context()))?,
        StoreCommand::Pull { url, results } => called(pull(url, results, terminal.context()))?,
    };
    say(format!("{} files written, {} existed with equal bytes", done.written, done.existing));
    Ok(Exit::Done)
}
