//! Errors and ends of the campaign functions, as the command line reports them.

use crate::words::{Exit, WriteFailure, explain, json, refuse, say, warn};
use softdock_farm::{Ended, FarmError, Shown};

/// The value of a campaign function, or its error with the remedy.
pub(crate) fn called<T>(result: Result<T, FarmError>) -> miette::Result<T> {
    result.map_err(|error| match error {
        FarmError::Campaign(problems) => explain(problems),
        error if error.is_write_failure() => WriteFailure::report(&error, error.remedy().unwrap_or_default()),
        error => match error.remedy() {
            Some(remedy) => refuse(error, remedy),
            None => miette::miette!("{error}"),
        },
    })
}

/// Prints what a call has shown and why it is not complete; gives the exit code.
pub(crate) fn end(result: Result<Ended, FarmError>, as_json: bool) -> miette::Result<Exit> {
    let ended = called(result)?;
    match (as_json, ended.shown.text()) {
        (true, _) => say(json(&ended.shown.json())),
        (false, text) if text.is_empty() => {}
        (false, text) => say(text),
    }
    if let (Some(page), false) = (ended.page(), as_json) {
        let name = if matches!(ended.shown, Shown::Variants(_)) { "comparison" } else { "\nreport" };
        say(format!("{name}  {}", page.display()));
    }
    if let Some(incomplete) = ended.incomplete {
        warn(incomplete);
    }
    Ok(Exit::of_code(ended.exit_code()))
}
