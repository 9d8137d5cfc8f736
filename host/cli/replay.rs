//! `softdock replay`: one row made again in f64, from exactly the inputs that stand in it.

use crate::args::ReplayArgs;
use crate::farm::called;
use crate::words::{Exit, say};

/// Repeats a run.
pub(crate) fn replay(args: &ReplayArgs) -> miette::Result<Exit> {
    let (Some(results), Some(run)) = (&args.results, args.run) else {
        return crate::replay_log::replay_log(args);
    };
    let replayed = called(softdock_farm::replay_run(results, run, args.out.as_deref()))?;
    match (replayed.differences.is_empty(), replayed.is_f64) {
        (true, _) => say(format!("run {run}: equal, bit for bit")),
        (false, true) => say(format!("run {run}: DIFFERENT from what the same f64 code gave before")),
        (false, false) => say(format!("run {run}: made in f32, here beside f64")),
    }
    replayed.differences.iter().for_each(|line| say(format!("  {line}")));
    say(format!("time history  {}", replayed.history.display()));
    Ok(if replayed.is_wrong() { Exit::NotVerified } else { Exit::Done })
}
