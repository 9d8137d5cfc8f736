//! `softdock worker` and `softdock finish`: one of many workers in a results folder, and the end of their work.

use crate::args::{FinishArgs, WorkerArgs};
use crate::farm::{called, end};
use crate::progress::Terminal;
use crate::words::{Exit, warn};
use softdock_farm::{RunOptions, finish_folder, work};

/// Makes a part of the runs.
pub(crate) fn worker(args: &WorkerArgs) -> miette::Result<Exit> {
    let options = RunOptions { choice: args.backend.choice(), part: args.part, ..RunOptions::default() };
    let Some(incomplete) = called(work(&args.results, &options, Terminal::new().context()))? else {
        return Ok(Exit::Done);
    };
    warn(incomplete);
    Ok(Exit::Incomplete)
}

/// Judges a folder whose runs are all made.
pub(crate) fn finish(args: &FinishArgs) -> miette::Result<Exit> {
    end(finish_folder(&args.results, Terminal::new().context()), args.json)
}
