//! `softdock verify`: a results folder compared with what it states of itself.

use crate::args::StatusArgs;
use crate::farm::called;
use crate::words::{Exit, json, say};
use serde_json::json;
use softdock_farm::Verification;

/// Verifies a folder, or every variant below it.
pub(crate) fn verify(args: &StatusArgs) -> miette::Result<Exit> {
    let found = called(softdock_farm::verify(&args.what))?;
    match args.json {
        true => say(json(&found.iter().map(as_json).collect())),
        false => found.iter().for_each(print),
    }
    // What differs weighs more than what is missing.
    let codes = found.iter().map(Verification::exit_code);
    let worst = if codes.clone().any(|code| code == 1) { 1 } else { codes.max().unwrap_or(0) };
    Ok(Exit::of_code(worst))
}

fn as_json(found: &Verification) -> serde_json::Value {
    json!({
        "campaign": found.campaign, "verified": found.exit_code() == 0, "results_hash": found.results_hash,
        "differs": found.differs, "missing": found.missing, "unknown": found.notes,
    })
}

fn print(found: &Verification) {
    let word = match found.exit_code() {
        0 => "every file is as it was written, and gives the summary and the page that are there",
        1 => "DIFFERS from what it states",
        _ => "what is there is as it was written; not complete",
    };
    say(format!("{}  {word}", found.campaign));
    for (kind, lines) in [("differs", &found.differs), ("missing", &found.missing), ("note", &found.notes)] {
        lines.iter().for_each(|line| say(format!("  {kind}  {line}")));
    }
    found.results_hash.iter().for_each(|hash| say(format!("  results_hash  {hash}")));
}
